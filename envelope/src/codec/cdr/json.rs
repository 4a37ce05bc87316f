//! Values for people: members by their names, enumerations by the names of their values.

use super::schema::{Node, NodeId, Schema};
use super::value::Value;
use crate::guid::Guid;
use serde_json::{Map, Value as Json};

impl Schema {
    /// A sample in JSON. Sixteen octets are shown as a GUID, others as hexadecimal digits; numbers that are none are texts.
    pub fn json(&self, value: &Value) -> Json {
        self.node_json(self.root, value)
    }

    fn node_json(&self, node: NodeId, value: &Value) -> Json {
        match (&self.nodes[node], value) {
            (Node::Structure(structure), Value::Structure(members)) => {
                let named = structure.members.iter().zip(members).map(|(field, member)| {
                    let shown =
                        member.as_ref().map_or(Json::Null, |member| self.node_json(field.node, member));
                    (field.name.clone(), shown)
                });
                Json::Object(named.collect())
            }
            (Node::Union { union, cases, discriminator, .. }, Value::Union(chosen, held)) => {
                let mut shown = Map::new();
                let name = match &self.nodes[*discriminator] {
                    Node::Enumeration(known) => known.name_of(*chosen as i32).map(Json::from),
                    _ => None,
                };
                shown.insert("discriminator".to_owned(), name.unwrap_or_else(|| Json::from(*chosen)));
                let case = union.cases.iter().position(|case| union.case_of(*chosen) == Some(case));
                if let (Some(place), Some(held)) = (case, held) {
                    let name = union.cases[place].member.name.clone();
                    shown.insert(name, self.node_json(cases[place], held));
                }
                Json::Object(shown)
            }
            (Node::List(list), Value::List(elements)) => {
                elements.iter().map(|element| self.node_json(list.element, element)).collect()
            }
            (Node::Enumeration(known), Value::Enumeration(value)) => {
                known.name_of(*value).map_or_else(|| Json::from(*value), Json::from)
            }
            (_, plain) => plain_json(plain),
        }
    }
}

fn plain_json(value: &Value) -> Json {
    match value {
        Value::Boolean(value) => Json::from(*value),
        Value::Unsigned(value) | Value::Bits(value) => Json::from(*value),
        Value::Signed(value) => Json::from(*value),
        Value::Enumeration(value) => Json::from(*value),
        Value::Float32(value) if !value.is_finite() => Json::from(value.to_string()),
        // The shortest digits that are this float, not those of the double of the same value.
        Value::Float32(value) => value.to_string().parse::<f64>().map_or(Json::Null, Json::from),
        Value::Float64(value) if !value.is_finite() => Json::from(value.to_string()),
        Value::Float64(value) => Json::from(*value),
        Value::Character(unit) => {
            Json::from(char::from_u32((*unit).into()).unwrap_or(char::REPLACEMENT_CHARACTER).to_string())
        }
        Value::Text(text) => Json::from(text.as_str()),
        Value::Octets(octets) => match octets.as_slice().try_into() {
            Ok(guid) => Json::from(Guid(guid).to_string()),
            Err(_) => Json::from(octets.iter().map(|octet| format!("{octet:02x}")).collect::<String>()),
        },
        Value::List(elements) => elements.iter().map(plain_json).collect(),
        Value::Structure(members) => {
            members.iter().map(|member| member.as_ref().map_or(Json::Null, plain_json)).collect()
        }
        Value::Union(_, held) => held.as_deref().map_or(Json::Null, plain_json),
    }
}
