//! What holds for every topic: names, keys, the bytes of a sample, hostile bytes, JSON.

mod samples;

use super::*;
use crate::KeyHash;
use proptest::prelude::*;
use samples::{Track, Tracks, Waypoint, Waypoints};

/// Topic, type and key members as umaa-so gives them for version 5.2.1.
const NAMES: [(&str, &str, &[&str]); 11] = [
    (
        "UMAA::SO::HealthReport::HealthReport",
        "UMAA::SO::HealthReport::HealthReportType",
        &["source", "resourceID"],
    ),
    ("UMAA::SO::LogReport::LogReport", "UMAA::SO::LogReport::LogReportType", &["source"]),
    (
        "UMAA::SO::ResourceAllocation::ResourceAllocationCommand",
        "UMAA::SO::ResourceAllocation::ResourceAllocationCommandType",
        &["source", "sessionID", "destination"],
    ),
    (
        "UMAA::SO::ResourceAllocation::ResourceAllocationCommandStatus",
        "UMAA::SO::ResourceAllocation::ResourceAllocationCommandStatusType",
        &["source", "sessionID"],
    ),
    (
        "UMAA::SO::ResourceAllocation::ResourceAllocationCommandAckReport",
        "UMAA::SO::ResourceAllocation::ResourceAllocationCommandAckReportType",
        &["source", "sessionID"],
    ),
    (
        "UMAA::SO::ResourceAllocation::ResourceAllocationReport",
        "UMAA::SO::ResourceAllocation::ResourceAllocationReportType",
        &["source"],
    ),
    (
        "UMAA::SO::ResourceAllocation::ResourceAllocationConfigReport",
        "UMAA::SO::ResourceAllocation::ResourceAllocationConfigReportType",
        &["source"],
    ),
    (
        "UMAA::SO::ResourceAllocation::ResourceAllocationPriorityCommand",
        "UMAA::SO::ResourceAllocation::ResourceAllocationPriorityCommandType",
        &["source", "sessionID", "destination"],
    ),
    (
        "UMAA::SO::ResourceAllocation::ResourceAllocationPriorityCommandStatus",
        "UMAA::SO::ResourceAllocation::ResourceAllocationPriorityCommandStatusType",
        &["source", "sessionID"],
    ),
    (
        "UMAA::SO::ResourceAllocation::ResourceAllocationPriorityCommandAckReport",
        "UMAA::SO::ResourceAllocation::ResourceAllocationPriorityCommandAckReportType",
        &["source", "sessionID"],
    ),
    (
        "UMAA::SO::ResourceAllocation::ResourceAllocationPriorityReport",
        "UMAA::SO::ResourceAllocation::ResourceAllocationPriorityReportType",
        &["source"],
    ),
];

#[test]
fn topics_types_and_keys_have_the_names_of_the_specification() {
    let found: Vec<_> = topics().map(|topic| (topic.name, topic.type_name, topic.key_members)).collect();
    assert_eq!(found, NAMES);
    for (name, ..) in NAMES {
        assert_eq!(topic(name).map(|topic| topic.name), Some(name));
        assert!(Name::new(name).is_ok(), "{name}");
    }
    assert!(topic("UMAA::SO::HealthReport::HealthReportType").is_none());
    assert_eq!(SetElement::<Tracks>::NAME, "UMAA::SA::TrackReport::TrackReportTypeTracksSetElement");
}

fn guid(byte: u8) -> Guid {
    Guid([byte; 16])
}

/// Bytes counted out by hand: length, elements, option tags, zigzag integers, GUIDs as they are.
#[test]
fn the_content_is_the_members_in_the_order_of_the_wire() {
    let command = ResourceAllocationCommand {
        duration: DurationSeconds::new(30.0).ok(),
        resource_id: guid(1),
        time_stamp: DateTime::new(1, 2).unwrap(),
        source: guid(2),
        session_id: guid(3),
        destination: guid(4),
    };
    let thirty = [0, 0, 0, 0, 0, 0, 0x3e, 0x40];
    let members: &[&[u8]] = &[&[1], &thirty, &[1; 16], &[2, 4], &[2; 16], &[3; 16], &[4; 16]];
    assert_eq!(encode(&command), members.concat());
    assert_eq!(command.instance().hash, KeyHash::md5(&[&[2; 16], &[3; 16], &[4; 16]]));

    let key = SessionKey { source: guid(5), session_id: guid(3) };
    let ack = ResourceAllocationCommandAckReport {
        command: command.clone(),
        time_stamp: DateTime::new(3, 4).unwrap(),
        source: guid(5),
        session_id: guid(3),
    };
    assert_eq!(encode(&ack), [&encode(&command)[..], &[6, 8], &[5; 16], &[3; 16]].concat());
    assert_eq!(ack.key(), key);

    let status = ResourceAllocationCommandStatus::new(
        DateTime::new(3, 4).unwrap(),
        key,
        CommandState::Failed,
        CommandStatusReason::ResourceRejected,
        LongDescription::new("no").unwrap(),
    );
    assert_eq!(encode(&status), [&[6, 8][..], &[5; 16], &[3; 16], &[4, 4, 2], b"no"].concat());

    let session = ResourceAllocationControlSession {
        controlling_consumer: guid(2),
        end_time: DateTime::new(5, 0).ok(),
    };
    let info =
        |control_session, byte| ResourceAllocationControlInfo { control_session, resource_id: guid(byte) };
    let report = ResourceAllocationReport {
        control_info: Sequence::new(vec![info(Some(session), 1), info(None, 7)]).unwrap(),
        time_stamp: DateTime::new(3, 4).unwrap(),
        source: guid(5),
    };
    let infos: &[&[u8]] = &[&[2, 1], &[2; 16], &[1, 10, 0], &[1; 16], &[0], &[7; 16]];
    assert_eq!(encode(&report), [&infos.concat()[..], &[6, 8], &[5; 16]].concat());

    let element = ListElement::<Waypoints> {
        element: Waypoint { depth: 9 },
        list_id: guid(1),
        element_id: guid(2),
        element_timestamp: DateTime::new(3, 4).unwrap(),
        next_element_id: Some(guid(3)),
    };
    assert_eq!(encode(&element), [&[9][..], &[1; 16], &[2; 16], &[6, 8], &[1], &[3; 16]].concat());
    assert_eq!(element.instance().hash, KeyHash([2; 16]));
}

#[test]
fn json_has_the_names_of_the_idl() {
    let status = ResourceAllocationCommandStatus::new(
        DateTime::new(3, 4).unwrap(),
        SessionKey { source: guid(5), session_id: guid(3) },
        CommandState::Failed,
        CommandStatusReason::ResourceRejected,
        LongDescription::new("no").unwrap(),
    );
    let topic = topic(ResourceAllocationCommandStatus::NAME).unwrap();
    let expected = serde_json::json!({
        "timeStamp": { "seconds": 3, "nanoseconds": 4 },
        "source": "05050505-0505-0505-0505-050505050505", "sessionID": "03030303-0303-0303-0303-030303030303",
        "commandStatus": "FAILED", "commandStatusReason": "RESOURCE_REJECTED", "logMessage": "no",
    });
    assert_eq!(topic.json(&encode(&status)).unwrap(), expected);
    let key = topic.key_json(&status.instance()).unwrap();
    assert_eq!(key["source"], expected["source"]);
    assert_eq!(key["sessionID"], expected["sessionID"]);
    assert_eq!(topic.key_json(&Instance { key: None, ..status.instance() }), None);
}

#[test]
fn json_that_is_no_sample_is_refused_with_its_place() {
    let topic = topic(ResourceAllocationCommand::NAME).unwrap();
    let command = |duration: &str, more: &str| {
        let guid = guid(1);
        format!(
            r#"{{"duration": {duration}, "resourceID": "{guid}", "timeStamp": {{"seconds": 1, "nanoseconds": 0}},
               "source": "{guid}", "sessionID": "{guid}", "destination": "{guid}"{more}}}"#
        )
    };
    assert!(topic.sample(&command("null", "")).is_ok());
    for (wrong, why) in [
        (command("-1", ""), "0 to 37817280 seconds are allowed at line 1"),
        (command("1", r#", "more": 1"#), "unknown field `more`"),
        (command("1", "").replace("sessionID", "session"), "unknown field `session`"),
        (r#"{"duration": 1}"#.to_owned(), "missing field `resourceID`"),
    ] {
        let told = topic.sample(&wrong).unwrap_err().to_string();
        assert!(told.contains(why) && told.contains(topic.name), "{told}");
    }
}

/// What holds for a sample of any topic.
fn holds<T: Topic>(sample: &T, cut: usize, flip: (usize, u8)) -> Result<(), TestCaseError> {
    let content = encode(sample);
    prop_assert_eq!(decode::<T>(&content), Ok(sample.clone()));
    prop_assert_eq!(T::Key::from_bytes(&sample.key().to_bytes()), Some(sample.key()));
    prop_assert_eq!(T::Key::of_instance(&sample.instance()), Some(sample.key()));

    let info = TopicInfo::of::<T>();
    let json = info.json(&content).unwrap().to_string();
    prop_assert_eq!(info.sample(&json).unwrap(), (content.clone(), sample.instance()));

    prop_assert!(decode::<T>(&content[..cut % content.len()]).is_err(), "cut short");
    let longer = [&content[..], &[0]].concat();
    let trailing = matches!(decode::<T>(&longer), Err(ContentError::Trailing { left: 1, .. }));
    prop_assert!(trailing, "one byte too many");

    // Hostile: what can still be read is a good value.
    let mut flipped = content.to_vec();
    flipped[flip.0 % content.len()] ^= flip.1;
    if let Ok(other) = decode::<T>(&flipped) {
        prop_assert_eq!(decode::<T>(&encode(&other)), Ok(other));
    }
    Ok(())
}

macro_rules! every_topic {
    ($($test:ident: $topic:ty = $samples:expr;)+) => {
        proptest! {
            #![proptest_config(ProptestConfig::with_cases(64))]
            $(#[test]
            fn $test(sample in $samples, cut in any::<usize>(), at in any::<usize>(), bits in 1u8..) {
                holds::<$topic>(&sample, cut, (at, bits))?;
            })+
        }
    };
}

every_topic! {
    health_reports: HealthReport = samples::health_report();
    log_reports: LogReport = samples::log_report();
    allocation_commands: ResourceAllocationCommand = samples::command();
    allocation_statuses: ResourceAllocationCommandStatus = samples::status();
    allocation_acks: ResourceAllocationCommandAckReport = samples::ack(samples::command());
    allocation_reports: ResourceAllocationReport = samples::report();
    allocation_config_reports: ResourceAllocationConfigReport = samples::config_report();
    priority_commands: ResourceAllocationPriorityCommand = samples::priority_command();
    priority_statuses: ResourceAllocationPriorityCommandStatus = samples::status();
    priority_acks: ResourceAllocationPriorityCommandAckReport = samples::ack(samples::priority_command());
    priority_reports: ResourceAllocationPriorityReport = samples::priority_report();
    set_elements: SetElement<Tracks> = samples::set_element();
    list_elements: ListElement<Waypoints> = samples::list_element();
}

proptest! {
    #[test]
    fn no_bytes_make_a_decoder_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        for topic in topics() {
            if let Ok(json) = topic.json(&bytes) {
                prop_assert!(topic.sample(&json.to_string()).is_ok(), "{json}");
            }
        }
    }

    #[test]
    fn metadata_comes_back(set in samples::set_metadata(), list in samples::list_metadata()) {
        let (set_bytes, list_bytes) = (postcard::to_allocvec(&set).unwrap(), postcard::to_allocvec(&list).unwrap());
        prop_assert_eq!(postcard::from_bytes::<LargeSetMetadata>(&set_bytes), Ok(set));
        prop_assert_eq!(postcard::from_bytes::<LargeListMetadata>(&list_bytes), Ok(list));
        let text = serde_json::to_string(&list).unwrap();
        prop_assert_eq!(serde_json::from_str::<LargeListMetadata>(&text).unwrap(), list);
    }

    #[test]
    fn a_header_is_set_and_read(command in samples::command(), other in samples::priority_command()) {
        let mut changed = command.clone();
        changed.set_header(other.header());
        prop_assert_eq!(changed.header(), other.header());
        prop_assert_eq!((changed.duration, changed.resource_id), (command.duration, command.resource_id));
        prop_assert_eq!((changed.source(), changed.time_stamp()), (other.source, other.time_stamp));
    }
}

/// The bounds of tables 13, 16, 17, 21, 31 and 32, at the bound and one beyond it.
#[test]
fn sequences_and_texts_end_at_their_bounds() {
    fn bound<T: Clone + Serialize + DeserializeOwned, const MAX: usize>(
        element: T,
        _: &Sequence<T, MAX>,
        max: usize,
    ) {
        let full = postcard::to_allocvec(&vec![element.clone(); max]).unwrap();
        let over = postcard::to_allocvec(&vec![element; max + 1]).unwrap();
        assert_eq!(postcard::from_bytes::<Sequence<T, MAX>>(&full).map(|read| read.len()).ok(), Some(max));
        assert!(postcard::from_bytes::<Sequence<T, MAX>>(&over).is_err(), "{max}");
    }
    let (time_stamp, source, resource_id) = (DateTime::default(), guid(1), guid(2));
    let report = ResourceAllocationReport { control_info: Sequence::default(), time_stamp, source };
    bound(ResourceAllocationControlInfo { control_session: None, resource_id }, &report.control_info, 256);
    let definition = ResourceAllocationDefinition { related_sources: Sequence::default(), resource_id };
    bound(source, &definition.related_sources, 100);
    let config = ResourceAllocationConfigReport { resources: Sequence::default(), time_stamp, source };
    bound(definition, &config.resources, 256);
    let info = ResourceAllocationPriorityInfo { priorities: Sequence::default(), resource_id };
    bound(source, &info.priorities, 100);
    let priorities = ResourceAllocationPriorityReport { priorities: Sequence::default(), time_stamp, source };
    bound(info, &priorities.priorities, 32);

    let entry = LongDescription::new("x".repeat(4095)).unwrap();
    let mut content = encode(&LogReport { entry, level: LogLevel::Error, time_stamp, source }).to_vec();
    assert!(decode::<LogReport>(&content).is_ok());
    // One more character, and its length: 4096 instead of 4095 in two bytes of seven bits.
    content.insert(2, b'x');
    content[..2].copy_from_slice(&[0x80, 0x20]);
    assert!(decode::<LogReport>(&content).is_err());
}

#[test]
fn an_element_has_a_topic_of_its_own() {
    let element = SetElement::<Tracks> {
        element: Track { course: 1 },
        set_id: guid(1),
        element_id: guid(2),
        element_timestamp: DateTime::default(),
    };
    let source = Source::new(crate::EntityId::new(1).unwrap(), crate::ServiceId::NODE);
    let label = label::<SetElement<Tracks>>(source).unwrap();
    let message = dispose(label, &element);
    assert_eq!((message.change, message.content.len()), (Change::Dispose, 0));
    assert_eq!(message.instance.unwrap().key.as_deref(), Some(&[2; 16][..]));
}

#[test]
fn descriptions_of_both_versions_are_sound_and_agree_with_the_types() {
    let library = v5_2_1::library().unwrap();
    for info in topics() {
        let keys: Vec<_> = library.key_members(info.type_name).into_iter().map(|key| key.path).collect();
        assert_eq!(keys, info.key_members, "{}", info.name);
        assert_eq!(info.type_name, format!("{}Type", info.name));
    }
    let newer = v6_0::library().unwrap();
    let keys = |name: &str| newer.key_members(name).into_iter().map(|key| key.path).collect::<Vec<_>>();
    let health = keys("UMAA::SO::HealthReport::HealthReportType");
    assert_eq!(health, ["source.id", "source.parentID", "code", "resourceID.id", "resourceID.parentID"]);
    assert_eq!(keys(v6_0::RESOURCES_ELEMENT), ["setID", "elementID"]);
    let status = newer.structure("UMAA::SO::HealthReport::HealthReportType").unwrap().members[2].clone();
    assert_eq!((status.name.as_str(), status.optional, status.id), ("status", true, 2));
    assert_eq!(v6_0::topics().len(), topics().count() + 1);
    assert!(v6_0::topics().iter().all(|topic| newer.structure(&topic.type_name).is_some()));
}
