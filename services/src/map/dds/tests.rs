use super::*;
use aldis_envelope::codec::cdr::{Form, Representation, Schema, Value};
use aldis_envelope::description::{Definition, Draft, Extensibility, Library, Member, Structure, Type};
use aldis_envelope::umaa::{self, ErrorCode, ErrorCondition, HealthReport, LongDescription, v5_2_1};
use aldis_envelope::{Change, ContentType, DateTime, EntityId, Guid, KeyHash, ServiceId, Source, Wall};
use bytes::Bytes;

const HEALTH: &str = "UMAA::SO::HealthReport::HealthReport";

fn source() -> Source {
    Source::new(EntityId::new(400).unwrap(), ServiceId::new(20).unwrap())
}

fn health() -> (TopicMap, Schema, HealthReport) {
    let library = v5_2_1::library().unwrap();
    let map = TopicMap::new(HEALTH, "UMAA::SO::HealthReport::HealthReportType", &library, &source().into())
        .unwrap();
    let report = HealthReport {
        code: ErrorCode::Sensor,
        log_time: DateTime::new(1, 2).unwrap(),
        severity: ErrorCondition::Fail,
        status: LongDescription::new("gone").unwrap(),
        time_stamp: DateTime::new(3, 4).unwrap(),
        source: Guid([1; 16]),
        resource_id: Guid([2; 16]),
    };
    (map, Schema::new(&library, "UMAA::SO::HealthReport::HealthReportType").unwrap(), report)
}

fn taken(change: Change, body: Body) -> Taken {
    Taken { writer: [1; 16], source_time: Wall(77), change, body }
}

const DELIMITED: Representation = Representation { form: Form::DelimitedXcdr2, ..Representation::XCDR1 };
const PLAIN: Representation = Representation { form: Form::PlainXcdr2, ..Representation::XCDR1 };

#[test]
fn a_sample_of_ours_crosses_both_ways_in_every_form() {
    let (mut map, schema, report) = health();
    let label = umaa::label::<HealthReport>(source()).unwrap();
    let sent = umaa::put(label.clone(), &report);
    for representation in [DELIMITED, PLAIN, Representation::XCDR1] {
        let given = map.export(&sent, representation).unwrap();
        let shape = if representation == PLAIN { schema.as_final() } else { schema.clone() };
        assert_eq!(given.bytes, shape.of_postcard(&sent.content, representation).unwrap());
        let came = map.import(&taken(Change::Put, Body::Sample(given.bytes))).unwrap();
        assert_eq!((&came.message, came.source_time), (&sent, Wall(77)));
        for change in [Change::Dispose, Change::Unregister] {
            let ends = umaa::about_instance(label.clone(), change, umaa::Topic::key(&report));
            let given = map.export(&ends, representation).unwrap();
            let came = map.import(&taken(change, Body::Key(given.bytes))).unwrap();
            assert_eq!(came.message, ends, "a key alone is enough");
        }
    }
}

#[test]
fn a_hash_alone_is_enough_once_the_key_was_told() {
    let (mut map, _, report) = health();
    let hash = umaa::Topic::instance(&report).hash;
    let ends = taken(Change::Dispose, Body::Hash(hash));
    let why = map.import(&ends).unwrap_err().to_string();
    assert!(
        why.contains(HEALTH) && why.contains(&hash.to_string()) && why.contains("serialized keys"),
        "{why}"
    );
    let sent = umaa::put(umaa::label::<HealthReport>(source()).unwrap(), &report);
    let given = map.export(&sent, DELIMITED).unwrap();
    map.import(&taken(Change::Put, Body::Sample(given.bytes))).unwrap();
    let came = map.import(&ends).unwrap().message.instance.unwrap();
    assert_eq!(came.key, umaa::Topic::instance(&report).key);
    // Its writer unregisters after it has disposed; then nothing more is due.
    map.import(&taken(Change::Unregister, Body::Hash(hash))).unwrap();
    assert_eq!(map.instances(), 0);
    assert!(map.import(&ends).is_err());
    // A single GUID is its own hash and need not be remembered.
    let library = v5_2_1::library().unwrap();
    let log = "UMAA::SO::LogReport::LogReport";
    let mut map =
        TopicMap::new(log, "UMAA::SO::LogReport::LogReportType", &library, &source().into()).unwrap();
    let came = map.import(&taken(Change::Dispose, Body::Hash(KeyHash([5; 16])))).unwrap();
    assert_eq!(came.message.instance.unwrap().key.as_deref(), Some(&[5; 16][..]));
}

#[test]
fn what_is_not_exactly_ours_stays_as_it_came() {
    let (mut map, schema, report) = health();
    let sent = umaa::put(umaa::label::<HealthReport>(source()).unwrap(), &report);
    let bytes = map.export(&sent, DELIMITED).unwrap().bytes;
    // Nanoseconds outside their range: behind both headers, the code, the header of the time and its seconds.
    let mut late = bytes.to_vec();
    late[4 + 4 + 4 + 4 + 8..][..4].copy_from_slice(&(-1_i32).to_le_bytes());
    let came = map.import(&taken(Change::Put, Body::Sample(late.clone().into()))).unwrap().message;
    assert_eq!((&came.label.attributes.content_type, &came.content[..]), (&ContentType::Cdr, &late[..]));
    assert_eq!(came.instance, sent.instance, "its key is read all the same");
    assert_eq!(map.export(&came, DELIMITED).unwrap().bytes, late);
    let anew = map.export(&came, PLAIN).unwrap().bytes;
    assert_eq!(schema.as_final().read(&anew).unwrap().value, schema.read(&late).unwrap().value);
    // A member more than we know: it leaves as it came or not at all.
    let mut longer = bytes.to_vec();
    let length = u32::from_le_bytes(longer[4..8].try_into().unwrap()) + 4;
    longer[4..8].copy_from_slice(&length.to_le_bytes());
    longer.extend([9; 4]);
    let came = map.import(&taken(Change::Put, Body::Sample(longer.clone().into()))).unwrap().message;
    assert_eq!((&came.label.attributes.content_type, &came.instance), (&ContentType::Cdr, &sent.instance));
    assert_eq!(map.export(&came, DELIMITED).unwrap().bytes, longer);
    assert!(matches!(map.export(&came, PLAIN), Err(ExportError::OtherVersion { .. })));
    let malformed = map.import(&taken(Change::Put, Body::Sample(Bytes::from_static(&[0, 9, 0, 0, 255]))));
    assert!(matches!(malformed, Err(ImportError::Malformed { .. })));
}

#[test]
fn a_topic_of_another_type_is_carried_with_its_instances_and_one_of_no_known_type_as_bytes() {
    let members =
        vec![Member::new(0, "n", Type::Int32).key(), Member::new(1, "t", Type::String { bound: None })];
    let structure = Structure { extensibility: Extensibility::Final, base: None, members };
    let mut draft = Draft::default();
    draft.add("T", Definition::Structure(structure)).unwrap();
    let library = draft.finish().unwrap();
    let schema = Schema::new(&library, "T").unwrap();
    let value = Value::Structure(vec![Some(Value::Signed(7)), Some(Value::Text("a".to_owned()))]);
    let bytes = Bytes::from(schema.write(&value, PLAIN).unwrap());
    let put = taken(Change::Put, Body::Sample(bytes.clone()));
    let mut known = TopicMap::new("topic", "T", &library, &source().into()).unwrap();
    let came = known.import(&put).unwrap().message;
    assert_eq!(came.instance.as_ref().unwrap().hash.to_string(), "00000007000000000000000000000000");
    assert_eq!((&came.content, came.label.is_broadcast()), (&bytes, true));
    let mut unknown = TopicMap::new("topic", "T", &Library::default(), &source().into()).unwrap();
    let came = unknown.import(&put).unwrap().message;
    assert_eq!((&came.content, &came.instance), (&bytes, &None));
    assert_eq!(unknown.export(&came, PLAIN).unwrap().bytes, bytes);
    assert!(matches!(unknown.export(&came, DELIMITED), Err(ExportError::UnknownType { .. })));
    let ends = taken(Change::Dispose, Body::Key(bytes));
    assert!(matches!(unknown.import(&ends), Err(ImportError::UnknownType { .. })));
}
