//! Objects from JSON.

use serde_json::{Map, Value as Json};
use thiserror::Error;

use super::member;
use crate::lmcp::error::{FieldPath, Within};
use crate::lmcp::object::Object;
use crate::lmcp::registry::type_of;
use crate::lmcp::schema::EnumInfo;
use crate::lmcp::value::{List, Reference, Slot, Text};

/// Why JSON is not the form of an object.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{fault}{}", Within(path))]
pub struct JsonError {
    /// What is wrong.
    pub fault: JsonFault,
    /// In which field; empty for the root object itself.
    pub path: FieldPath,
}

/// What is wrong with the JSON form of an object.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum JsonFault {
    /// A value of another kind, or a number beyond the field's range.
    #[error("{0} expected")]
    Expected(&'static str),
    /// A type that is not declared here.
    #[error("type {0} is not known")]
    UnknownType(String),
    /// Another version of the type's series than the one declared here.
    #[error("version {found} where {known} is known")]
    Version {
        /// The version that the JSON tells.
        found: Json,
        /// The version declared here.
        known: u16,
    },
    /// A field that the type does not have.
    #[error("{info} has no field {field}")]
    UnknownField {
        /// The type.
        info: &'static str,
        /// The field.
        field: String,
    },
    /// An object of a type that the field does not hold.
    #[error("the field does not hold {0}")]
    Kind(&'static str),
    /// An array of a fixed length with another one.
    #[error("{expected} elements expected and {found} found")]
    Count {
        /// The length that the model fixes.
        expected: usize,
        /// The length of the JSON array.
        found: usize,
    },
}

type Read<T> = Result<T, Box<JsonError>>;

fn fail<T>(fault: JsonFault) -> Read<T> {
    Err(Box::new(JsonError { fault, path: FieldPath::default() }))
}

/// The object whose JSON form this is. Fields that are not there keep their default; only `_type` and
/// `fields` are needed of the rest.
///
/// # Errors
/// Names the field and what was expected there.
pub fn from_json(json: &Json) -> Result<Box<dyn Object>, JsonError> {
    read_object(json).map_err(|error| *error)
}

fn read_object(json: &Json) -> Read<Box<dyn Object>> {
    let Some(map) = json.as_object() else { return fail(JsonFault::Expected("an object")) };
    let Some(name) = map.get(member::TYPE).and_then(Json::as_str) else {
        return fail(JsonFault::Expected("a map with _type"));
    };
    let Some(info) = type_of(name) else { return fail(JsonFault::UnknownType(name.to_owned())) };
    let known = info.series.version;
    match map.get(member::VERSION) {
        Some(found) if *found != known => return fail(JsonFault::Version { found: found.clone(), known }),
        _ => {}
    }
    let Some(fields) = map.get(member::FIELDS).and_then(Json::as_object) else {
        return fail(JsonFault::Expected("a map with fields"));
    };
    let mut object = (info.default)();
    read_fields(fields, object.as_mut())?;
    Ok(object)
}

fn read_fields(fields: &Map<String, Json>, object: &mut dyn Object) -> Read<()> {
    let info = object.type_info();
    for (name, json) in fields {
        let (Some(field), Some(slot)) = (info.field(name), object.slot(name)) else {
            return fail(JsonFault::UnknownField { info: info.full_name, field: name.clone() });
        };
        if let Err(mut error) = read_value(json, slot) {
            error.path.push_field(field.name);
            return Err(error);
        }
    }
    Ok(())
}

fn read_value(json: &Json, slot: Slot<'_>) -> Read<()> {
    match slot {
        Slot::Bool(value) => set(value, json.as_bool(), "a truth value"),
        Slot::Byte(value) => set(value, integer(json), "an integer from 0 to 255"),
        Slot::Int32(value) => set(value, integer(json), "a 32-bit integer"),
        Slot::UInt32(value) => set(value, integer(json), "an unsigned 32-bit integer"),
        Slot::Int64(value) => set(value, json.as_i64(), "a 64-bit integer"),
        Slot::Real32(value) => set(value, real(json).and_then(narrow), "a 32-bit number"),
        Slot::Real64(value) => set(value, real(json), "a number"),
        Slot::Enum(value, info) => set(value, enumeration(json, info), "a number or name of the enumeration"),
        Slot::Text(value) => set(value, json.as_str().map(Text::new), "a text"),
        Slot::Object(reference) => read_reference(json, reference),
        Slot::List(list) => read_list(json, list),
    }
}

fn set<T>(place: &mut T, value: Option<T>, expected: &'static str) -> Read<()> {
    match value {
        Some(value) => {
            *place = value;
            Ok(())
        }
        None => fail(JsonFault::Expected(expected)),
    }
}

fn integer<T: TryFrom<i64>>(json: &Json) -> Option<T> {
    json.as_i64()?.try_into().ok()
}

fn enumeration(json: &Json, info: &EnumInfo) -> Option<i32> {
    json.as_str().map_or_else(|| integer(json), |name| info.value_of(name))
}

fn real(json: &Json) -> Option<f64> {
    match json.as_str() {
        Some("NaN") => Some(f64::NAN),
        Some("inf") => Some(f64::INFINITY),
        Some("-inf") => Some(f64::NEG_INFINITY),
        Some(_) => None,
        None => json.as_f64(),
    }
}

/// The nearest 32-bit number; none when that is infinite for a finite one.
fn narrow(value: f64) -> Option<f32> {
    let narrow = value as f32;
    (narrow.is_finite() || !value.is_finite()).then_some(narrow)
}

fn read_reference(json: &Json, reference: &mut dyn Reference) -> Read<()> {
    if json.is_null() {
        reference.clear();
        return Ok(());
    }
    let object = read_object(json)?;
    reference.put(object).or_else(|object| fail(JsonFault::Kind(object.type_info().full_name)))
}

fn read_list(json: &Json, list: &mut dyn List) -> Read<()> {
    let Some(items) = json.as_array() else { return fail(JsonFault::Expected("an array")) };
    list.truncate(0);
    for (index, item) in items.iter().enumerate() {
        let Some(place) = list.place(index) else { break };
        if let Err(mut error) = read_value(item, place) {
            error.path.push_index(index);
            return Err(error);
        }
    }
    match (list.length(), items.len()) {
        (expected, found) if expected != found => fail(JsonFault::Count { expected, found }),
        _ => Ok(()),
    }
}
