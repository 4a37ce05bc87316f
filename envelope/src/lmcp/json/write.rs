//! Objects as JSON.

use serde_json::{Map, Value as Json};

use super::member;
use crate::lmcp::object::{Object, elements};
use crate::lmcp::value::View;

/// An object in JSON form, its fields in wire order.
pub fn to_json(object: &dyn Object) -> Json {
    let info = object.type_info();
    let fields: Map<_, _> =
        object.fields().map(|(field, value)| (field.name.to_owned(), value_to_json(value))).collect();
    Json::Object(Map::from_iter([
        (member::TYPE.to_owned(), info.full_name.into()),
        (member::SERIES.to_owned(), info.series.text.into()),
        (member::SERIES_ID.to_owned(), info.series.name.0.into()),
        (member::TYPE_ID.to_owned(), info.id.into()),
        (member::VERSION.to_owned(), info.series.version.into()),
        (member::FIELDS.to_owned(), Json::Object(fields)),
    ]))
}

fn value_to_json(value: View<'_>) -> Json {
    match value {
        View::Bool(value) => value.into(),
        View::Byte(value) => value.into(),
        View::Int32(value) | View::Enum(value, _) => value.into(),
        View::UInt32(value) => value.into(),
        View::Int64(value) => value.into(),
        View::Real32(value) => real_to_json(value.into()),
        View::Real64(value) => real_to_json(value),
        View::Text(value) => value.into(),
        View::Object(value) => value.map_or(Json::Null, to_json),
        View::List(list) => elements(list).map(value_to_json).collect(),
    }
}

fn real_to_json(value: f64) -> Json {
    if value.is_finite() { value.into() } else { value.to_string().into() }
}
