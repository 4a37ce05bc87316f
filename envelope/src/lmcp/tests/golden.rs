//! The reference's own messages.

use super::{files, golden_messages, read, shared};
use crate::lmcp::cmasi::{AirVehicleState, AltitudeType};
use crate::lmcp::{
    Header, decode, decode_as, encode, from_json, key_of, natural_key, position, type_of, types, verify,
};

#[test]
fn every_message_comes_back_as_the_same_bytes() {
    let Some(folder) = shared("lmcp") else { return };
    let files = files(&folder, "lmcp");
    assert_eq!(files.len(), 164);
    for path in files {
        let bytes = read(&path);
        let object = decode(&bytes).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let name = path.file_stem().unwrap().to_str().unwrap();
        assert_eq!(object.type_info().full_name, name);
        assert_eq!(encode(object.as_ref()).unwrap(), bytes, "{name}");
        assert_eq!(*object, *object.clone(), "{name}");
    }
}

#[test]
fn a_header_tells_the_type() {
    for message in golden_messages() {
        let object = decode(message).unwrap();
        let info = Header::peek(message).unwrap().type_info().unwrap();
        assert_eq!(info, object.type_info());
        assert_eq!(type_of(info.full_name), Some(info));
    }
}

#[test]
fn a_natural_key_is_the_field_that_the_table_names() {
    let mut keyed = 0;
    for message in golden_messages() {
        let object = decode(message).unwrap();
        let info = object.type_info();
        let Some(crate::lmcp::View::Int64(key)) = key_of(info).and_then(|key| object.view(key.field)) else {
            assert_eq!(natural_key(info.full_name, message), None, "{info}");
            continue;
        };
        keyed += 1;
        assert_eq!(natural_key(info.full_name, message), Some(key), "{info}");
        assert_eq!(natural_key("afrl.cmasi.Other", message), None);
    }
    let declared = types().filter(|info| key_of(info).is_some()).count();
    assert!(keyed == declared || golden_messages().is_empty(), "{keyed} of {declared}");
}

#[test]
fn a_position_is_read_from_states_alone() {
    for message in golden_messages() {
        let object = decode(message).unwrap();
        let state = object.get::<crate::lmcp::cmasi::EntityState>();
        let expected = state.and_then(|state| state.location.get()).map(|place| place.latitude);
        assert_eq!(position(message).map(|position| position.latitude), expected);
    }
}

#[test]
fn a_state_is_read_by_field() {
    let Some(folder) = shared("lmcp") else { return };
    let state: AirVehicleState = decode_as(&read(&folder.join("afrl.cmasi.AirVehicleState.lmcp"))).unwrap();
    assert_eq!(state.id, 8_589_935_593);
    assert_eq!(state.location.get().unwrap().altitude_type, AltitudeType::AGL);
    assert_eq!(state.payload_state_list.len(), 2);
    assert_eq!(state.wind_direction, -73.1);
}

#[test]
fn every_message_equals_the_json_beside_it_both_ways() {
    let Some(folder) = shared("lmcp") else { return };
    for path in files(&folder, "lmcp") {
        let message = read(&path);
        let json: serde_json::Value = serde_json::from_slice(&read(&path.with_extension("json"))).unwrap();
        let verification = verify(&message, &json).unwrap();
        assert!(verification.identical && verification.fields_equal, "{verification:?}");
        let object = from_json(json["object"].to_string().as_bytes())
            .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert_eq!(encode(object.as_ref()).unwrap(), message, "{}", path.display());
    }
}

/// Payloads of frames `address$attributes$payload`, each after 8 bytes of time and 4 of length.
fn captured_payloads(capture: &[u8]) -> Vec<&[u8]> {
    let mut payloads = Vec::new();
    let mut rest = capture;
    while let Some((head, tail)) = rest.split_first_chunk::<12>() {
        let length = u32::from_le_bytes([head[8], head[9], head[10], head[11]]) as usize;
        let (frame, tail) = tail.split_at(length);
        payloads.extend(frame.splitn(3, |&byte| byte == b'$').nth(2));
        rest = tail;
    }
    payloads
}

#[test]
fn what_a_running_planner_sent_comes_back_as_the_same_bytes() {
    let Some(folder) = shared("captures/waterway") else { return };
    let capture = read(&folder.join("pub_capture.bin"));
    let payloads = captured_payloads(&capture);
    assert_eq!(payloads.len(), 28);
    for payload in payloads {
        let object = decode(payload).unwrap();
        assert_eq!(encode(object.as_ref()).unwrap(), payload, "{}", object.type_info());
    }
}
