//! Two participants in one process on a domain of their own.
#![allow(clippy::unwrap_used, reason = "tests")]

use super::*;
use aldis_envelope::description::{
    Definition, Draft, Enumeration, Extensibility, Library, Member, Structure, Type,
};
use bytes::Bytes;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

const WITHIN: Duration = Duration::from_secs(20);
static NEXT_DOMAIN: AtomicU32 = AtomicU32::new(0);

/// A domain of this test run's own.
fn domain() -> u32 {
    let next = NEXT_DOMAIN.fetch_add(1, Ordering::Relaxed);
    // The ports of two domains are 250 apart; process ids keep test runs apart.
    60 + (std::process::id() % 12) * 10 + next % 10
}

fn pair() -> (Participant, Participant) {
    let config = ParticipantConfig::loopback(domain());
    (Participant::open(&config).unwrap(), Participant::open(&config).unwrap())
}

/// A type with every kind of part: nested, optional, enumeration, array, sequence, text, key.
fn library() -> Library {
    let mut draft = Draft::default();
    draft.add("T::Guid", Definition::Alias(Type::array(Type::Octet, 16))).unwrap();
    draft.add("T::Colour", Definition::Enumeration(Enumeration::counted(["RED", "GREEN"]))).unwrap();
    let time = Structure {
        extensibility: Extensibility::Appendable,
        base: None,
        members: vec![Member::new(0, "seconds", Type::Int64), Member::new(1, "nanoseconds", Type::Int32)],
    };
    draft.add("T::Time", Definition::Structure(time)).unwrap();
    let sample = Structure {
        extensibility: Extensibility::Appendable,
        base: None,
        members: vec![
            Member::new(0, "at", Type::named("T::Time")),
            Member::new(1, "colour", Type::named("T::Colour")),
            Member::new(2, "again", Type::named("T::Time")).optional(),
            Member::new(3, "text", Type::String { bound: Some(100) }),
            Member::new(4, "numbers", Type::sequence(Type::Int32, Some(8))),
            Member::new(5, "id", Type::named("T::Guid")).key(),
        ],
    };
    draft.add("T::Sample", Definition::Structure(sample)).unwrap();
    let plain = Structure {
        extensibility: Extensibility::Final,
        base: None,
        members: vec![Member::new(0, "value", Type::Int32), Member::new(1, "key", Type::Int32).key()],
    };
    draft.add("T::Plain", Definition::Structure(plain)).unwrap();
    draft.finish().unwrap()
}

fn described<'a>(library: &'a Library, type_name: &'a str) -> TypeSource<'a> {
    TypeSource::Described { library, type_name, extensibility: None, told: true }
}

/// `T::Plain` in XCDR2, little-endian, or its key alone.
fn plain(value: i32, key: i32) -> Vec<u8> {
    [[0, 7, 0, 0], value.to_le_bytes(), key.to_le_bytes()].concat()
}

fn plain_key(key: i32) -> Vec<u8> {
    [[0, 7, 0, 0], key.to_le_bytes()].concat()
}

fn kept() -> Qos {
    Qos {
        reliable: true,
        durability: Durability::TransientLocal,
        history: History::KeepAll,
        durability_service: (History::KeepLast(1), Limits::default()),
        autodispose: false,
        representations: vec![Representation::Xcdr2],
        ..Qos::default()
    }
}

fn no_mismatch() -> Box<dyn Fn(Mismatch) + Send + Sync> {
    Box::new(|mismatch| panic!("{mismatch:?}"))
}

fn to(sender: Sender<Incoming>) -> Box<dyn Receive> {
    Box::new(move |incoming| sender.send(incoming).is_ok())
}

fn change(receiver: &Receiver<Incoming>) -> Arrival {
    match receiver.recv_timeout(WITHIN).unwrap() {
        Incoming::Change(arrival) => arrival,
        gone => panic!("{gone:?}"),
    }
}

#[test]
fn each_change_comes_by_itself_in_order_with_its_own_time() {
    let library = library();
    let (one, two) = pair();
    let topic = |participant| Topic::new(participant, "Plain", described(&library, "T::Plain")).unwrap();
    let (sender, receiver) = channel();
    let reader = Reader::new(&topic(&two), &kept(), to(sender), no_mismatch()).unwrap();
    let writer = Writer::new(&topic(&one), &kept(), no_mismatch()).unwrap();
    let at = 1_700_000_000_000_000_000;
    assert!(writer.write(Sending::Sample, &plain(1, 7), at).unwrap());
    assert!(writer.write(Sending::Sample, &plain(2, 8), at + 10).unwrap());
    assert!(writer.write(Sending::Dispose, &plain_key(7), at + 20).unwrap());
    assert!(writer.write(Sending::Sample, &plain(3, 7), at + 30).unwrap());
    assert!(writer.write(Sending::Unregister, &plain_key(8), at + 40).unwrap());
    assert!(writer.wait_for_acknowledgments(WITHIN).unwrap());
    let first = change(&receiver);
    assert_eq!(first.writer, writer.guid());
    assert_eq!((first.source_timestamp, &first.cdr), (at, &Bytes::from(plain(1, 7))));
    assert!(first.is_sample && !first.disposes && !first.unregisters && !first.autodispose);
    assert_eq!(change(&receiver).cdr, plain(2, 8));
    let dispose = change(&receiver);
    assert!(!dispose.is_sample && dispose.disposes && !dispose.unregisters);
    assert_eq!((dispose.source_timestamp, &dispose.cdr[..8]), (at + 20, &plain_key(7)[..]));
    assert_eq!(change(&receiver).cdr, plain(3, 7));
    let unregister = change(&receiver);
    assert!(!unregister.is_sample && !unregister.disposes && unregister.unregisters);
    assert_eq!((reader.matched(), writer.matched()), (1, 1));
    let guid = writer.guid();
    drop(writer);
    let gone = receiver.recv_timeout(WITHIN).unwrap();
    assert_eq!(gone, Incoming::WriterGone { writer: guid, autodispose: false });
}

#[test]
fn who_comes_late_gets_what_is_kept_and_nothing_disposed() {
    let library = library();
    let (one, two) = pair();
    let topic = |participant| Topic::new(participant, "Plain", described(&library, "T::Plain")).unwrap();
    let writer = Writer::new(&topic(&one), &kept(), no_mismatch()).unwrap();
    for (at, value) in [(1, 10), (2, 11), (3, 12)] {
        assert!(writer.write(Sending::Sample, &plain(value, 1), at).unwrap());
        assert!(writer.write(Sending::Sample, &plain(value, 0), at).unwrap());
    }
    assert!(writer.write(Sending::DisposeAndUnregister, &plain_key(0), 4).unwrap());
    let (sender, receiver) = channel();
    let _reader = Reader::new(&topic(&two), &kept(), to(sender), no_mismatch()).unwrap();
    let kept = change(&receiver);
    assert_eq!((kept.source_timestamp, kept.cdr), (3, plain(12, 1).into()));
    assert!(writer.write(Sending::Sample, &plain(99, 5), 9).unwrap());
    let mut after = change(&receiver);
    if !after.is_sample {
        assert!(after.disposes, "{after:?}");
        after = change(&receiver);
    }
    assert_eq!(after.cdr, plain(99, 5));
}

#[test]
fn discovery_tells_types_that_others_can_use() {
    let library = library();
    let (one, two) = pair();
    let (tell, told) = channel();
    let discovery = Discovery::new(&two, Box::new(move || tell.send(()).unwrap_or_default())).unwrap();
    let topic = Topic::new(&one, "T::Samples", described(&library, "T::Sample")).unwrap();
    assert_eq!((topic.extensibility(), topic.type_name()), (Extensibility::Appendable, "T::Sample"));
    let qos = Qos { partitions: vec!["here".into()], ..kept() };
    let writer = Writer::new(&topic, &qos, no_mismatch()).unwrap();
    let found = loop {
        told.recv_timeout(WITHIN).unwrap();
        let changes = discovery.changes().unwrap();
        let endpoint = changes.into_iter().find_map(|change| match change {
            Change::Endpoint(endpoint) => Some(endpoint),
            _ => None,
        });
        if let Some(endpoint) = endpoint {
            break endpoint;
        }
    };
    assert_eq!((found.guid, found.participant, found.side), (writer.guid(), one.guid(), Side::Writer));
    assert_eq!((found.topic.as_str(), found.type_name.as_str()), ("T::Samples", "T::Sample"));
    assert_eq!(found.qos.partitions, ["here"]);
    assert_eq!(found.qos.representations, [Representation::Xcdr2]);
    assert!(found.qos.reliable && !found.qos.autodispose);
    assert_eq!(found.qos.durability, Durability::TransientLocal);
    let information = found.type_information.unwrap();
    let same = Topic::new(&two, "T::Samples", TypeSource::Discovered(&information)).unwrap();
    assert_eq!(same.extensibility(), Extensibility::Appendable);
    let (sender, receiver) = channel();
    let _reader = Reader::new(&same, &qos, to(sender), no_mismatch()).unwrap();
    let body = [&1i64.to_le_bytes()[..], &2i32.to_le_bytes()].concat();
    let mut sample = vec![0, 9, 0, 0];
    let mut inside = Vec::new();
    inside.extend((body.len() as u32).to_le_bytes());
    inside.extend(&body);
    inside.extend(1i32.to_le_bytes());
    inside.extend([0, 0, 0, 0]);
    inside.extend(3u32.to_le_bytes());
    inside.extend(b"hi\0\0");
    inside.extend(1u32.to_le_bytes());
    inside.extend(5i32.to_le_bytes());
    inside.extend([9; 16]);
    sample.extend((inside.len() as u32).to_le_bytes());
    sample.extend(inside);
    assert!(writer.write(Sending::Sample, &sample, 1).unwrap());
    assert_eq!(change(&receiver).cdr, sample);
    let wrong = writer.write(Sending::Sample, &sample[..20], 1).unwrap_err();
    assert!(wrong.to_string().contains("no Sample of T::Sample"), "{wrong}");
    let guid = writer.guid();
    drop(writer);
    loop {
        told.recv_timeout(WITHIN).unwrap();
        let is_gone = |change: &Change| matches!(change, Change::EndpointGone(gone) if *gone == guid);
        if discovery.changes().unwrap().iter().any(is_gone) {
            break;
        }
    }
}

#[test]
fn a_mismatch_names_the_policy_on_both_sides() {
    let library = library();
    let (one, two) = pair();
    let topic = |participant| Topic::new(participant, "Plain", described(&library, "T::Plain")).unwrap();
    let (tell, told) = channel();
    let telling = || {
        let tell = tell.clone();
        Box::new(move |mismatch: Mismatch| tell.send(mismatch.policy.to_string()).unwrap_or_default())
    };
    let weak = Qos { reliable: false, ..kept() };
    let _writer = Writer::new(&topic(&one), &weak, telling()).unwrap();
    let _reader = Reader::new(&topic(&two), &kept(), Box::new(|_| true), telling()).unwrap();
    assert_eq!(told.recv_timeout(WITHIN).unwrap(), "RELIABILITY");
    assert_eq!(told.recv_timeout(WITHIN).unwrap(), "RELIABILITY");
}

#[test]
fn a_receiver_without_room_holds_the_writer_up_and_loses_nothing() {
    const COUNT: i32 = 3_000;
    let library = library();
    let (one, two) = pair();
    let topic = |participant| Topic::new(participant, "Plain", described(&library, "T::Plain")).unwrap();
    let (sender, receiver) = std::sync::mpsc::sync_channel(64);
    let full = Box::new(move |incoming| sender.try_send(incoming).is_ok());
    let _reader = Reader::new(&topic(&two), &kept(), full, no_mismatch()).unwrap();
    let qos = Qos { durability_service: (History::KeepAll, Limits::default()), ..kept() };
    let writer = Writer::new(&topic(&one), &qos, no_mismatch()).unwrap();
    let writing = std::thread::spawn(move || {
        for value in 0..COUNT {
            while !writer.write(Sending::Sample, &plain(value, value % 7), i64::from(value)).unwrap() {
                writer.wait_for_acknowledgments(Duration::from_millis(20)).unwrap();
            }
        }
        writer.wait_for_acknowledgments(WITHIN).unwrap()
    });
    for value in 0..COUNT {
        let arrival = match receiver.recv_timeout(WITHIN).unwrap() {
            Incoming::Change(arrival) => arrival,
            gone => panic!("{gone:?}"),
        };
        assert_eq!(arrival.cdr, plain(value, value % 7));
    }
    assert!(writing.join().unwrap());
}

#[test]
fn own_endpoints_do_not_hear_each_other() {
    let library = library();
    let (one, two) = pair();
    let topic = |participant| Topic::new(participant, "Plain", described(&library, "T::Plain")).unwrap();
    let (sender, receiver) = channel();
    let _reader = Reader::new(&topic(&one), &kept(), to(sender), no_mismatch()).unwrap();
    let own = Writer::new(&topic(&one), &kept(), no_mismatch()).unwrap();
    assert!(own.write(Sending::Sample, &plain(1, 1), 1).unwrap());
    let other = Writer::new(&topic(&two), &kept(), no_mismatch()).unwrap();
    assert!(other.write(Sending::Sample, &plain(2, 1), 2).unwrap());
    assert_eq!(change(&receiver).writer, other.guid());
    assert_eq!(own.matched(), 0);
}

#[test]
fn errors_name_the_call_and_the_cause() {
    let library = library();
    let participant = Participant::open(&ParticipantConfig::loopback(domain())).unwrap();
    let unknown = Topic::new(&participant, "X", described(&library, "T::Nothing")).unwrap_err();
    assert_eq!(unknown.to_string(), "dds_dynamic_type_create of T::Nothing: it is not described");
    let zero = Topic::new(&participant, "a\0b", described(&library, "T::Plain")).unwrap_err();
    assert!(zero.to_string().contains("it holds a zero byte"), "{zero}");
    let other = ParticipantConfig {
        xml: Some("<CycloneDDS/>".into()),
        ..ParticipantConfig::new(participant.domain())
    };
    let taken = Participant::open(&other).unwrap_err();
    assert!(taken.to_string().contains("another configuration"), "{taken}");
    let topic = Topic::new(&participant, "Plain", described(&library, "T::Plain")).unwrap();
    let both = Topic::new(&participant, "Plain", described(&library, "T::Sample"));
    assert!(both.is_err(), "one name, two types");
    drop(topic);
}
