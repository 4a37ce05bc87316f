//! Which entities may call which services.

use super::cure::cured;
use super::schema;
use super::text::RequestPrefix;
use aldis_envelope::{EntityId, ServiceId};
use aldis_services::allow::AllowRule;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::fmt;

/// One `[[allow]]`: these entities may send these requests to this service. What no rule allows is left to the
/// defaults: ping and reading for everybody, administration for the own entity and the operators.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Allow {
    /// Who may call: "any" or a list of entities.
    pub(crate) from: Callers,
    /// Which service may be called: its id, or "any".
    pub(crate) service: Called,
    /// Which requests: beginnings of their descriptors. Default: all.
    #[serde(default = "every_request")]
    pub(crate) requests: Vec<RequestPrefix>,
}

impl Allow {
    /// The rule as the node reads it; it alone decides.
    pub(crate) fn rule(&self) -> AllowRule {
        AllowRule {
            from: match &self.from {
                Callers::Any => None,
                Callers::Only(entities) => Some(entities.clone()),
            },
            service: match self.service {
                Called::Any => None,
                Called::Only(service) => Some(service),
            },
            requests: self.requests.iter().map(|prefix| prefix.as_str().to_owned()).collect(),
        }
    }
}

fn every_request() -> Vec<RequestPrefix> {
    vec![RequestPrefix::all()]
}

/// Who may call.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Callers {
    /// Every entity.
    Any,
    /// These entities alone.
    Only(Vec<EntityId>),
}

/// Which service may be called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Called {
    /// Every service of the node.
    Any,
    /// This one alone.
    Only(ServiceId),
}

const CALLERS_CURE: &str = "write from = \"any\", or a list of entities such as from = [1, 9000]";
const CALLED_CURE: &str = "write service = \"any\", or one service id such as service = 37";

// Read by hand: serde's untagged enums forget where in the file a mistake stands.
impl<'de> Deserialize<'de> for Callers {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;

        impl<'de> Visitor<'de> for Reader {
            type Value = Callers;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&cured("\"any\" or a list of entities", CALLERS_CURE))
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Callers, E> {
                match text {
                    "any" => Ok(Callers::Any),
                    _ => Err(E::custom(cured(format_args!("`{text}` names no callers"), CALLERS_CURE))),
                }
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Callers, A::Error> {
                let mut entities = Vec::new();
                while let Some(entity) = list.next_element()? {
                    entities.push(entity);
                }
                if entities.is_empty() {
                    return Err(de::Error::custom(cured("`from` names nobody", CALLERS_CURE)));
                }
                Ok(Callers::Only(entities))
            }
        }
        deserializer.deserialize_any(Reader)
    }
}

impl<'de> Deserialize<'de> for Called {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;

        impl Visitor<'_> for Reader {
            type Value = Called;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&cured("\"any\" or a service id", CALLED_CURE))
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Called, E> {
                match text {
                    "any" => Ok(Called::Any),
                    _ => Err(E::custom(cured(format_args!("`{text}` names no service"), CALLED_CURE))),
                }
            }

            fn visit_u64<E: de::Error>(self, number: u64) -> Result<Called, E> {
                ServiceId::new(number).map(Called::Only).map_err(E::custom)
            }

            fn visit_i64<E: de::Error>(self, number: i64) -> Result<Called, E> {
                match u64::try_from(number) {
                    Ok(number) => self.visit_u64(number),
                    Err(_) => Err(E::custom(cured(format_args!("`{number}` is no service id"), CALLED_CURE))),
                }
            }
        }
        deserializer.deserialize_any(Reader)
    }
}

impl Serialize for Callers {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Any => serializer.serialize_str("any"),
            Self::Only(entities) => entities.serialize(serializer),
        }
    }
}

impl Serialize for Called {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Any => serializer.serialize_str("any"),
            Self::Only(service) => service.serialize(serializer),
        }
    }
}

impl JsonSchema for Callers {
    fn schema_name() -> Cow<'static, str> {
        "Callers".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let entity = generator.subschema_for::<schema::EntityId>();
        json_schema!({ "oneOf": [{ "const": "any" }, { "type": "array", "minItems": 1, "items": entity }] })
    }
}

impl JsonSchema for Called {
    fn schema_name() -> Cow<'static, str> {
        "Called".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let service = generator.subschema_for::<schema::ServiceId>();
        json_schema!({ "oneOf": [{ "const": "any" }, service] })
    }
}
