//! Bytes that are wrong: errors, no panics, no memory beyond what a message is allowed.

use proptest::prelude::*;

use super::golden_messages;
use crate::lmcp::cmasi::{AirVehicleState, KeyValuePair, Location3D, LoiterAction, VehicleAction, Waypoint};
use crate::lmcp::cmasi::{MissionCommand, RemoveTasks};
use crate::lmcp::{
    DecodeFault, EncodeFault, Header, Kind, Object, Ref, Slot, TypeInfo, checksum, decode, decode_as,
    descendants, encode, natural_key, position, split, types,
};

/// Everything that reads bytes.
fn read_by_all(message: &[u8]) {
    let header = Header::peek(message).map(|it| it.type_info().map(|info| info.full_name));
    let descriptor = header.ok().and_then(Result::ok).unwrap_or("none");
    let _ = (position(message), natural_key(descriptor, message));
    if let Ok(object) = decode(message) {
        let again = encode(object.as_ref()).unwrap();
        assert_eq!(again[..again.len() - 4], message[..message.len() - 4], "what is read is written back");
    }
}

/// The container's size and checksum made right, so that what is inside is reached.
fn mend(message: &mut [u8]) {
    let length = message.len();
    if length >= 12 {
        message[4..8].copy_from_slice(&(length as u32 - 12).to_be_bytes());
        message[length - 4..].fill(0);
    }
}

#[test]
fn a_message_cut_anywhere_is_an_error() {
    for message in golden_messages() {
        for length in 0..message.len() {
            let mut cut = message[..length].to_vec();
            assert!(decode(&cut).is_err());
            read_by_all(&cut);
            mend(&mut cut);
            assert!(decode(&cut).is_err());
            read_by_all(&cut);
        }
    }
}

#[test]
fn a_message_wrong_in_any_byte_does_no_harm() {
    for message in golden_messages() {
        for position in 8..message.len() - 4 {
            for change in [0x01, 0xff] {
                let mut wrong = message.clone();
                wrong[position] ^= change;
                mend(&mut wrong);
                read_by_all(&wrong);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn random_bytes_do_no_harm(mut bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        read_by_all(&bytes);
        if bytes.len() >= 12 {
            bytes[..4].copy_from_slice(b"LMCP");
            mend(&mut bytes);
            read_by_all(&bytes);
        }
    }

    #[test]
    fn several_wrong_bytes_do_no_harm(
        pick in any::<prop::sample::Index>(),
        wrongs in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let messages = golden_messages();
        if !messages.is_empty() {
            let mut message = pick.get(messages).clone();
            for (place, value) in wrongs {
                let place = place.index(message.len());
                message[place] = value;
            }
            mend(&mut message);
            read_by_all(&message);
        }
    }
}

fn fault(message: &[u8]) -> (DecodeFault, usize, String) {
    let error = decode(message).unwrap_err();
    (error.fault, error.offset, error.path.to_string())
}

#[test]
fn the_container_is_checked() {
    let mut message = encode(&Location3D::default()).unwrap();
    let length = message.len();
    assert_eq!(fault(b"LMCX0000000000000").0, DecodeFault::NotLmcp);
    assert_eq!(fault(b"LMCP").0, DecodeFault::Truncated { needed: 8, left: 4 });
    message.push(0);
    assert_eq!(fault(&message).0, DecodeFault::Length { declared: length as u64, found: length + 1 });
    message.pop();
    message[length - 1] ^= 1;
    assert!(matches!(fault(&message), (DecodeFault::Checksum { .. }, at, _) if at == length - 4));
    message[length - 4..].fill(0);
    assert!(decode(&message).is_ok(), "a checksum of 0 was not computed");
    assert_eq!(
        fault(&[76, 77, 67, 80, 0, 0, 0, 1, 0, 0, 0, 0, 0]),
        (DecodeFault::NullRoot, 8, String::new())
    );
}

#[test]
fn messages_that_follow_one_another_are_split() {
    let (place, pair) = (encode(&Location3D::default()).unwrap(), encode(&KeyValuePair::default()).unwrap());
    let both = [&place[..], &pair].concat();
    assert_eq!(split(&both).collect::<Result<Vec<_>, _>>().unwrap(), [&place[..], &pair]);
    assert_eq!(split(b"").count(), 0);
    let end = place.len();
    for (length, offset) in [(end + 3, end), (end + 9, end + 4), (both.len() - 1, end + 4)] {
        let parts: Vec<_> = split(&both[..length]).collect();
        assert_eq!((parts.len(), parts[0].as_ref().unwrap()), (2, &&place[..]));
        assert_eq!(parts[1].as_ref().unwrap_err().offset, offset);
    }
    let junk = [&place[..], b"junk and more"].concat();
    assert_eq!(
        split(&junk).last().unwrap().unwrap_err().to_string(),
        format!("not an LMCP message, at byte {end}")
    );
}

#[test]
fn a_checksum_is_the_sum_of_all_bytes() {
    let bytes: Vec<u8> = (0..1000_u32).map(|i| (i * 7) as u8 | 0x80).collect();
    assert_eq!(checksum(&bytes), bytes.iter().map(|&byte| u32::from(byte)).sum::<u32>());
    assert_eq!(checksum(&[0xff; 129]), 129 * 255);
}

#[test]
fn unknown_types_are_told_from_damage() {
    let sound = encode(&Location3D::default()).unwrap();
    let with = |place: usize, value: u8| {
        let mut message = sound.clone();
        message[place] = value;
        mend(&mut message);
        decode(&message).unwrap_err()
    };
    assert_eq!(with(9, b'X').to_string(), "series XMASI is not known, at byte 8");
    assert_eq!(with(20, 99).to_string(), "type 99 of series CMASI is not known, at byte 8");
    assert_eq!(with(20, 0).to_string(), "type 0 of series CMASI is not known, at byte 8");
    assert_eq!(with(22, 4).to_string(), "version 4 of series CMASI where 3 is known, at byte 8");
    assert!([with(9, b'X'), with(20, 99), with(22, 4)].iter().all(|error| error.is_unknown_type()));
    assert!(!with(8, 2).is_unknown_type());
    assert_eq!(with(8, 2).fault, DecodeFault::Presence(2));
}

#[test]
fn an_error_names_the_field_and_the_byte() {
    let action = LoiterAction { location: Waypoint::default().into(), ..LoiterAction::default() };
    let waypoint = Waypoint { vehicle_action_list: vec![action.into()], ..Waypoint::default() };
    let mission = MissionCommand { waypoint_list: vec![Ref::NULL, waypoint.into()], ..Default::default() };
    let mut message = encode(&mission).unwrap();
    let inner = message.windows(15).rposition(|it| it == b"\x01CMASI\0\0\0\0\0\0\x23\0\x03").unwrap();
    message[inner + 12] = 2;
    mend(&mut message);
    let path = "WaypointList[1].VehicleActionList[0].Location";
    let (expected, found) = ("afrl.cmasi.Location3D", "afrl.cmasi.KeyValuePair");
    assert_eq!(fault(&message), (DecodeFault::Kind { expected, found }, inner, path.to_owned()));
}

#[test]
fn an_array_count_is_not_trusted() {
    let mut message = encode(&RemoveTasks::default()).unwrap();
    message[23..25].fill(0xff);
    mend(&mut message);
    let expected = DecodeFault::Count { count: 65535, left: 0 };
    assert_eq!(fault(&message), (expected, 25, "TaskList".to_owned()));
}

/// An object of the type without texts and elements, which takes little on the wire.
fn blank(info: &'static TypeInfo) -> Box<dyn Object> {
    let mut object = (info.default)();
    for field in info.fields() {
        match object.slot(field.name) {
            Some(Slot::List(list)) => list.truncate(0),
            Some(Slot::Text(text)) => text.clear(),
            _ => {}
        }
    }
    object
}

/// A vehicle action without a place is smaller than any other object on the wire: of these, a short message has room.
const WITH_FLOOR: &str = "afrl.cmasi.StopMovementAction";

#[test]
fn no_object_in_an_array_is_refused_for_its_memory() {
    let mut refused = Vec::new();
    for info in types() {
        for field in info.own_fields {
            let Kind::List(Kind::Object(element), _) = field.kind else { continue };
            for held in descendants(element) {
                let mut object = blank(info);
                let Some(Slot::List(list)) = object.slot(field.name) else { panic!("{info} {}", field.name) };
                let count = if held.full_name == WITH_FLOOR { 16 } else { 100 };
                for index in 0..count {
                    let Some(Slot::Object(place)) = list.place(index) else {
                        panic!("{info} {}", field.name)
                    };
                    assert!(place.put(blank(held)).is_ok());
                }
                let message = encode(object.as_ref()).unwrap();
                if decode(&message).is_err() {
                    refused.push(format!("{info}.{}: {held} {} B", field.name, message.len() / count));
                }
            }
        }
    }
    assert!(refused.is_empty(), "{refused:#?}");
}

#[test]
fn nulls_do_not_multiply_memory() {
    let with_nulls = |count| {
        let waypoint_list = vec![Ref::NULL; count];
        encode(&MissionCommand { waypoint_list, ..MissionCommand::default() }).unwrap()
    };
    assert!(decode(&with_nulls(5)).is_ok());
    assert_eq!(fault(&with_nulls(60_000)).0, DecodeFault::Memory);
}

/// Actions in waypoints in actions, which the model allows without end.
fn nested(levels: usize) -> Waypoint {
    (0..levels).fold(Waypoint::default(), |inner, _| {
        let action = LoiterAction { location: inner.into(), ..LoiterAction::default() };
        Waypoint { vehicle_action_list: vec![action.into()], ..Waypoint::default() }
    })
}

#[test]
fn nesting_ends() {
    let deepest = encode(&nested(7)).unwrap();
    assert!(decode(&deepest).is_ok());
    assert_eq!(encode(&nested(8)).unwrap_err().fault, EncodeFault::Depth);
}

#[test]
fn what_does_not_fit_the_wire_is_an_error_that_names_the_field() {
    let long = RemoveTasks { task_list: vec![1; 65_536] };
    assert_eq!(
        encode(&long).unwrap_err().to_string(),
        "an array of 65536 elements, 65535 at most in TaskList"
    );
    assert!(encode(&RemoveTasks { task_list: vec![1; 65_535] }).is_ok());
    let pair = KeyValuePair { key: "k".into(), value: "v".repeat(65_536).into() };
    let state = AirVehicleState::default();
    let mut base = state.base.clone();
    base.info = vec![KeyValuePair::default().into(), pair.into()];
    let error = encode(&AirVehicleState { base, ..state }).unwrap_err();
    assert_eq!(error.to_string(), "a text of 65536 bytes, 65535 at most in Info[1].Value");
}

#[test]
fn another_type_than_asked_for_is_an_error() {
    let message = encode(&Location3D::default()).unwrap();
    let error = decode_as::<VehicleAction>(&message).unwrap_err();
    assert_eq!(
        error.to_string(),
        "afrl.cmasi.Location3D where afrl.cmasi.VehicleAction is declared, at byte 8"
    );
}
