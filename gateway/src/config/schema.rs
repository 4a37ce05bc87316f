//! The JSON Schema of a configuration, from the very types that read it. The types of the envelope are described
//! here, because the envelope does not know about schemas.

use super::Config;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde_json::Value;
use std::borrow::Cow;

/// The JSON Schema of a configuration file.
pub(crate) fn schema() -> Value {
    schemars::schema_for!(Config).to_value()
}

macro_rules! described {
    ($($marker:ident as $name:literal = $schema:tt;)*) => {$(
        #[doc = concat!("Describes ", $name, " of the envelope.")]
        pub(crate) struct $marker;

        impl JsonSchema for $marker {
            fn schema_name() -> Cow<'static, str> {
                $name.into()
            }
            fn schema_id() -> Cow<'static, str> {
                concat!("aldis_envelope::", $name).into()
            }
            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                json_schema!($schema)
            }
        }
    )*};
}

described! {
    EntityId as "EntityId" = {
        "description": "An entity: a vehicle, a station, an operator.",
        "type": "integer", "minimum": 1, "maximum": 281_474_976_710_655_u64
    };
    ServiceId as "ServiceId" = {
        "description": "A service of an entity.",
        "type": "integer", "minimum": 1, "maximum": 4_294_967_295_u32
    };
    BridgeServiceId as "BridgeServiceId" = {
        "description": "The service id of a bridge.",
        "type": "integer", "minimum": 20, "maximum": 99
    };
    NamedServiceId as "NamedServiceId" = {
        "description": "The id of a service that a configuration names.",
        "type": "integer", "minimum": 100, "maximum": 4_294_967_295_u32
    };
    EntityIds as "EntityIds" = {
        "description": "The entities that the node speaks for, its own first.",
        "type": "array", "minItems": 1, "uniqueItems": true,
        "items": { "type": "integer", "minimum": 1, "maximum": 281_474_976_710_655_u64 }
    };
    OperatorIds as "OperatorIds" = {
        "description": "Entities that may administer the node.",
        "type": "array", "uniqueItems": true,
        "items": { "type": "integer", "minimum": 1, "maximum": 281_474_976_710_655_u64 }
    };
    Fleet as "Fleet" = {
        "description": "The name of a fleet, one chunk of every key on the bus.",
        "type": "string", "pattern": "^[A-Za-z0-9_-]{1,64}$"
    };
    Prefix as "Prefix" = {
        "description": "The beginning of addresses, or an id matched whole; the empty text is every address.",
        "type": "string", "maxLength": 512, "pattern": "^[^$|]*$"
    };
    Dialect as "Dialect" = {
        "description": "How ids are written: `eid400.sid37` (openuxas) or `eid400sid37` (slides).",
        "type": "string", "enum": ["openuxas", "slides"]
    };
    GuidForm as "GuidForm" = {
        "description": "How the GUIDs of own services are made: with the ids inside (readable), or from names (v5).",
        "type": "string", "enum": ["readable", "v5"]
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_schema_names_every_table_and_refuses_unknown_keys() {
        let schema = schema();
        let properties = schema["properties"].as_object().unwrap();
        for key in [
            "fleet",
            "name",
            "entities",
            "operators",
            "bus",
            "routing",
            "bridge",
            "allow",
            "journal",
            "log",
            "health",
            "service",
        ] {
            assert!(properties.contains_key(key), "{key}");
        }
        assert_eq!(schema["additionalProperties"], false);
        assert_eq!(schema["required"], serde_json::json!(["name", "entities"]));
        assert_eq!(schema["properties"]["fleet"]["default"], "fleet");
        assert_eq!(schema["$defs"]["EntityId"]["maximum"], aldis_envelope::EntityId::MAX);
    }

    #[test]
    fn the_kinds_of_bridges_and_services_are_described_with_their_keys() {
        let schema = schema().to_string();
        for word in ["uxas-tcp", "stall_timeout_ms", "message_bytes_max", "track", "turn_rate_deg_per_s"] {
            assert!(schema.contains(word), "{word}");
        }
    }
}
