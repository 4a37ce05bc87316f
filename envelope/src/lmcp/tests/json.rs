//! The JSON form: what it looks like, and what is refused.

use serde_json::{Value as Json, json};

use crate::lmcp::cmasi::{AltitudeType, Location3D};
use crate::lmcp::{JsonFault, from_json, read_json, to_json, types, verify};

/// An object of that type with one field.
fn object(name: &str, field: &str, value: &Json) -> Json {
    json!({ "_type": name, "fields": { field: value } })
}

fn error(json: &Json) -> String {
    from_json(json.to_string().as_bytes()).unwrap_err().to_string()
}

#[test]
fn an_object_tells_its_type_and_fields() {
    let place = Location3D { latitude: 45.5, altitude: f32::NAN, ..Location3D::default() };
    let expected = json!({
        "_type": "afrl.cmasi.Location3D",
        "_series": "CMASI",
        "_series_id": 4_849_604_199_710_720_000_u64,
        "_lmcp_type": 3,
        "_version": 3,
        "fields": { "Latitude": 45.5, "Longitude": 0.0, "Altitude": "NaN", "AltitudeType": 1 }
    });
    assert_eq!(to_json(&place), expected);
    assert!(
        from_json(expected.to_string().as_bytes()).unwrap().get::<Location3D>().unwrap().altitude.is_nan()
    );
}

#[test]
fn an_enumeration_is_a_number_or_a_name() {
    for (value, expected) in [(json!("AGL"), 0), (json!(0), 0), (json!(7), 7)] {
        let place = from_json(object("afrl.cmasi.Location3D", "AltitudeType", &value).to_string().as_bytes())
            .unwrap();
        assert_eq!(place.get::<Location3D>().unwrap().altitude_type, AltitudeType(expected));
    }
}

#[test]
fn what_is_wrong_is_named() {
    assert_eq!(error(&json!(1)), "an object expected");
    assert_eq!(error(&json!({})), "a map with _type expected");
    assert_eq!(error(&json!({ "_type": "a.B" })), "type a.B is not known");
    assert_eq!(error(&json!({ "_type": "afrl.cmasi.Task" })), "a map with fields expected");
    let mut task = object("afrl.cmasi.Task", "TaskID", &json!(1.5));
    assert_eq!(error(&task), "a 64-bit integer expected in TaskID");
    task["_version"] = json!(2);
    assert_eq!(error(&task), "version 2 where 3 is known");
    let priority = object("afrl.cmasi.Task", "Priority", &json!(256));
    assert_eq!(error(&priority), "an integer from 0 to 255 expected in Priority");
    assert_eq!(error(&object("afrl.cmasi.Task", "Id", &json!(1))), "afrl.cmasi.Task has no field Id");
    let inner = object("afrl.cmasi.KeyValuePair", "Key", &json!(1));
    let outer = object("afrl.cmasi.Task", "Parameters", &json!([null, inner]));
    assert_eq!(error(&outer), "a text expected in Parameters[1].Key");
    let other =
        object("afrl.cmasi.Task", "Parameters", &json!([object("afrl.cmasi.Task", "Label", &json!(""))]));
    assert_eq!(error(&other), "the field does not hold afrl.cmasi.Task in Parameters[0]");
    for wrong in [json!([1, 2]), json!([1, 2, 3, 4])] {
        let perception = object("afrl.cmasi.perceive.EntityPerception", "Velocity", &wrong);
        assert!(error(&perception).ends_with("found in Velocity"), "{}", error(&perception));
    }
    let huge = object("afrl.cmasi.Location3D", "Altitude", &json!(1e300));
    assert_eq!(error(&huge), "a 32-bit number expected in Altitude");
}

#[test]
fn verification_tells_what_differs() {
    let mut message = crate::lmcp::encode(&Location3D::default()).unwrap();
    let length = message.len();
    let expected = json!({ "object": to_json(&Location3D::default()) });
    let sound = verify(&message, &expected).unwrap();
    assert!(sound.identical && sound.fields_equal);
    message[length - 4..].fill(0);
    assert!(!verify(&message, &expected).unwrap().identical, "the checksum is computed when encoding");
    assert!(!verify(&message, &json!({})).unwrap().fields_equal);
}

#[test]
fn members_come_in_any_order_and_texts_with_escapes() {
    let text = br#"{ "fields": {"Value": "a\n\u00e9", "Key" : "k"}, "more": [{"x": [1e5, "]"]}, null],
        "_version": 3, "_type": "afrl.cmasi.KeyValuePair" }"#;
    let pair = from_json(text).unwrap();
    assert_eq!(to_json(pair.as_ref())["fields"], json!({ "Key": "k", "Value": "a\né" }));
}

#[test]
fn text_that_is_no_json_tells_the_line() {
    let wrong = |text: &str| from_json(text.as_bytes()).unwrap_err().to_string();
    assert_eq!(wrong("{\n \"_type\" 1}"), "line 2: `:` expected");
    assert_eq!(wrong("{\n\n1: 2}"), "line 3: a key expected");
    assert_eq!(wrong("{\"_type\": \"afrl\n"), "line 1: a value expected");
    assert_eq!(wrong("{\"a\": 1 \"b\": 2}"), "line 1: `,` or `}` expected");
    assert_eq!(wrong(r#"{"_type":"afrl.cmasi.Task","fields":{}} 1"#), "line 1: the end expected");
    assert_eq!(wrong(&format!("{{\"a\":{}", "[".repeat(100))), "objects and arrays nested too deep");
    assert_eq!(from_json(b"{\n\xff").unwrap_err().to_string(), "line 2: UTF-8 expected");
}

#[test]
fn several_objects_are_read_plain_and_described() {
    let place = to_json(&Location3D::default());
    let text = format!("{place}\n[{place}, {{\"line\": 1, \"object\": {place}}}]");
    assert_eq!(read_json(text.as_bytes()).unwrap().len(), 3);
    let (number, error) = read_json(format!("{place} {{}}").as_bytes()).unwrap_err();
    assert_eq!((number, error.to_string().as_str()), (2, "a map with _type expected"));
}

#[test]
fn an_object_of_each_type_with_nothing_said_of_it_is_read() {
    for info in types() {
        let text = json!({ "_type": info.full_name, "fields": {} }).to_string();
        assert_eq!(from_json(text.as_bytes()).unwrap().type_info(), info);
    }
}

#[test]
fn nulls_do_not_multiply_memory() {
    let nulls = |count| {
        let list = Json::Array(vec![Json::Null; count]);
        from_json(object("afrl.cmasi.MissionCommand", "WaypointList", &list).to_string().as_bytes())
    };
    assert!(nulls(4).is_ok());
    assert_eq!(nulls(10_000).unwrap_err().fault, JsonFault::Memory);
}
