//! The bridge as the node sees it: inputs in, messages and commands out.

use super::*;
use crate::map::dds::Rules;
use crate::service::domain::{DomainCommand, Durable, Opening, Quality, Sending, Xcdr};
use crate::service::{Action, Outbox, Service};
use aldis_envelope::description::{Definition, Draft, Extensibility, Member, Structure, Type};
use aldis_envelope::{
    BootId, Change, ContentType, Envelope, Fleet, Message, Monotonic, Now, Priority, Source, Stamp, Wall,
};
use bytes::Bytes;
use std::sync::Arc;

mod version;

fn source(entity: u64, service: u32) -> Source {
    format!("eid{entity}sid{service}")
        .parse::<aldis_envelope::Address>()
        .ok()
        .and_then(|address| match address {
            aldis_envelope::Address::Service(source) => Some(source),
            _ => None,
        })
        .unwrap()
}

fn guid(participant: u8, entity: u8) -> DomainGuid {
    let mut bytes = [participant; 16];
    bytes[15] = entity;
    DomainGuid(bytes)
}

fn config() -> DomainConfig {
    let mut draft = Draft::default();
    let members = vec![Member::new(0, "value", Type::Int32), Member::new(1, "key", Type::Int32).key()];
    let plain = Structure { extensibility: Extensibility::Final, base: None, members };
    draft.add("T::Plain", Definition::Structure(plain)).unwrap();
    DomainConfig {
        fleet: Fleet::new("test").unwrap(),
        source: source(5, 30),
        partition: String::new(),
        topics: Rules { allow: Vec::new(), deny: vec!["secret*".parse().unwrap()] },
        rules: Vec::new(),
        types: Arc::new(draft.finish().unwrap()),
        exact: Arc::default(),
        translates: false,
        queue_max: 100,
    }
}

fn quality() -> Quality {
    Quality {
        reliable: true,
        durable: Durable::TransientLocal,
        keep_last: Some(1),
        samples_max: None,
        exclusive: false,
        access: 0,
        ordered: false,
        by_source_time: false,
        coherent: false,
        deadline_ns: None,
        latency_budget_ns: 0,
        liveliness: 0,
        lease_ns: None,
        partitions: Vec::new(),
        autodispose: true,
        xcdr: vec![Xcdr::V2],
    }
}

fn endpoint(guid: DomainGuid, writes: bool, topic: &str) -> DomainEvent {
    DomainEvent::Endpoint(Box::new(Endpoint {
        guid,
        participant: guid,
        writes,
        topic: topic.into(),
        type_name: "T::Plain".into(),
        quality: quality(),
        extensibility: Some(Extensibility::Final),
    }))
}

fn sample(value: i32, key: i32) -> Bytes {
    [[0, 7, 0, 0], value.to_le_bytes(), key.to_le_bytes()].concat().into()
}

fn key(key: i32) -> Bytes {
    [[0, 7, 0, 0], key.to_le_bytes()].concat().into()
}

fn written(writer: DomainGuid, at: i64, cdr: Bytes) -> Arrival {
    let (disposes, unregisters, autodispose) = (false, false, false);
    Arrival { writer, source_time: Wall(at), is_sample: true, disposes, unregisters, autodispose, cdr }
}

struct Stage {
    domain: Domain,
    out: Outbox,
}

impl Stage {
    fn new() -> Self {
        Self::with(config())
    }

    fn with(config: DomainConfig) -> Self {
        Self { domain: Domain::new(config), out: Outbox::new(source(5, 30)) }
    }

    fn give(&mut self, event: DomainEvent) -> Vec<Action> {
        self.domain.handle(Default::default(), Input::Domain(event), &mut self.out);
        self.out.drain().collect()
    }

    fn opens(&mut self, event: DomainEvent) -> Vec<Opening> {
        let open = |action| match action {
            Action::Domain(DomainCommand::Open(opening)) => Some(*opening),
            _ => None,
        };
        self.give(event).into_iter().filter_map(open).collect()
    }

    fn says(&mut self, event: DomainEvent) -> Vec<(Change, String, i64)> {
        let said = |action| match action {
            Action::SendAt(message, at) => Some((message.change, message.label.address.to_string(), at.0)),
            _ => None,
        };
        self.give(event).into_iter().filter_map(said).collect()
    }

    fn writes(&mut self, envelope: &Envelope) -> Vec<(Sending, Bytes, i64)> {
        self.domain.handle(Default::default(), Input::Message(envelope), &mut self.out);
        self.written()
    }

    fn written(&mut self) -> Vec<(Sending, Bytes, i64)> {
        let write = |action| match action {
            Action::Domain(DomainCommand::Write(_, sending, cdr, at)) => Some((sending, cdr, at.0)),
            _ => None,
        };
        self.out.drain().filter_map(write).collect()
    }
}

fn from_fleet(of: Source, change: Change, key: i32, content: Bytes, at: i64) -> Envelope {
    let name = aldis_envelope::Name::new("dds::Plain").unwrap();
    let label = Arc::new(aldis_envelope::Label::broadcast(ContentType::Cdr, name, of));
    let key = Bytes::copy_from_slice(&key.to_be_bytes());
    let instance = aldis_envelope::Instance::of_key(key, aldis_envelope::KeyWidth::Fits16);
    let message = Message { label, change, instance: Some(Arc::new(instance)), call: None, content };
    let stamp = Stamp {
        node: of.entity,
        boot: BootId(1),
        sequence: 1,
        source_time: Wall(at),
        lifespan_left_ms: None,
        priority: Priority::Data,
        skipped: 0,
        via: Default::default(),
    };
    Envelope { message, stamp }
}

#[test]
fn routes_open_for_those_who_are_there_and_close_after_them() {
    let mut stage = Stage::new();
    let opened = stage.opens(endpoint(guid(1, 1), true, "Plain"));
    assert_eq!(opened.len(), 1);
    assert!(!opened[0].writes && opened[0].like == Some(guid(1, 1)));
    assert!(stage.opens(endpoint(guid(2, 1), true, "Plain")).is_empty(), "one reader hears both");
    let writer = stage.opens(endpoint(guid(3, 1), false, "Plain"));
    assert!(writer[0].writes && !writer[0].quality.autodispose);
    assert!(stage.opens(endpoint(guid(1, 2), true, "secret")).is_empty());
    let closed = stage.give(DomainEvent::EndpointGone(guid(3, 1)));
    assert!(
        closed
            .iter()
            .any(|a| matches!(a, Action::Domain(DomainCommand::Close(id)) if *id == writer[0].route))
    );
    assert_eq!(
        stage.domain.status().left_out,
        [("secret".to_owned(), "its topic is not allowed".to_owned())]
    );
}

#[test]
fn an_instance_is_left_when_its_last_writer_leaves() {
    let mut stage = Stage::new();
    let route = stage.opens(endpoint(guid(1, 1), true, "Plain"))[0].route;
    stage.opens(endpoint(guid(2, 1), true, "Plain"));
    let put = (Change::Put, "dds::Plain".to_owned(), 10);
    assert_eq!(stage.says(DomainEvent::Arrived(route, written(guid(1, 1), 10, sample(1, 7)))), [put]);
    stage.says(DomainEvent::Arrived(route, written(guid(2, 1), 20, sample(2, 7))));
    assert!(stage.says(DomainEvent::WriterGone(route, guid(1, 1), false)).is_empty());
    let left = stage.says(DomainEvent::WriterGone(route, guid(2, 1), false));
    assert_eq!(left, [(Change::Unregister, "dds::Plain".to_owned(), 20)]);
    stage.says(DomainEvent::Arrived(route, written(guid(2, 1), 30, sample(2, 8))));
    let disposed = stage.says(DomainEvent::WriterGone(route, guid(2, 1), true));
    assert_eq!(disposed[0].0, Change::Dispose);
}

#[test]
fn what_another_gateway_writes_is_not_taken() {
    let mut stage = Stage::new();
    let route = stage.opens(endpoint(guid(1, 1), true, "Plain"))[0].route;
    let other = DomainConfig { source: source(9, 1), ..config() };
    let early = DomainEvent::Arrived(route, written(guid(4, 1), 1, sample(1, 1)));
    assert!(stage.says(early).is_empty(), "nobody has told of this writer yet");
    stage.give(DomainEvent::Participant(guid(4, 0), mark(&other).into_bytes()));
    assert!(stage.says(endpoint(guid(4, 1), true, "Plain")).is_empty());
    assert_eq!(stage.domain.counters.echoes_stopped, 1);
    let early = DomainEvent::Arrived(route, written(guid(6, 1), 1, sample(1, 1)));
    assert!(stage.says(early).is_empty());
    assert_eq!(stage.says(endpoint(guid(6, 1), true, "Plain")).len(), 1, "its endpoint is known now");
}

#[test]
fn of_two_gateways_in_one_partition_the_smaller_bridges() {
    let mut stage = Stage::new();
    stage.opens(endpoint(guid(1, 1), true, "Plain"));
    let smaller = DomainConfig { source: source(3, 1), ..config() };
    let closed = stage.give(DomainEvent::Participant(guid(4, 0), mark(&smaller).into_bytes()));
    assert!(closed.iter().any(|action| matches!(action, Action::Domain(DomainCommand::Close(_)))));
    assert_eq!(stage.domain.status().stands_by_for, Some(3));
    assert_eq!(stage.opens(DomainEvent::ParticipantGone(guid(4, 0))).len(), 1);
}

#[test]
fn ends_are_written_with_the_key_and_lost_contact_is_no_cancel() {
    let mut stage = Stage::new();
    stage.opens(endpoint(guid(1, 1), false, "Plain"));
    let far = source(400, 30);
    let put = stage.writes(&from_fleet(far, Change::Put, 7, sample(1, 7), 5));
    assert_eq!(put, [(Sending::Sample, sample(1, 7), 5)]);
    stage.writes(&from_fleet(far, Change::Put, 8, sample(1, 8), 6));
    let disposed = stage.writes(&from_fleet(far, Change::Dispose, 7, Bytes::new(), 7));
    assert_eq!(disposed, [(Sending::Dispose, key(7), 7)]);
    let unknown = stage.writes(&from_fleet(far, Change::Dispose, 9, Bytes::new(), 8));
    assert_eq!(unknown, [(Sending::Dispose, key(9), 8)]);
    stage.domain.handle(Default::default(), Input::Token(far, false), &mut stage.out);
    let left: Vec<_> = stage.written().into_iter().map(|(sending, _, _)| sending).collect();
    assert_eq!(left, [Sending::Unregister; 3]);
}

#[test]
fn who_differs_in_what_it_requests_is_told_and_who_has_a_route_of_its_own_is_not() {
    let mut stage = Stage::new();
    let route = stage.opens(endpoint(guid(1, 1), false, "Plain"))[0].route;
    let DomainEvent::Endpoint(mut other) = endpoint(guid(2, 1), false, "Plain") else { unreachable!() };
    other.extensibility = Some(Extensibility::Appendable);
    stage.give(DomainEvent::Endpoint(other.clone()));
    let notes = |actions: Vec<Action>| {
        let text = |action| if let Action::Note(note) = action { Some(note.text) } else { None };
        actions.into_iter().filter_map(text).collect::<Vec<_>>()
    };
    let mismatch = |policy: &str| DomainEvent::Mismatch(route, policy.to_owned());
    let later = |stage: &mut Stage, seconds| {
        let now = Now {
            monotonic: Monotonic::START + std::time::Duration::from_secs(seconds),
            ..Default::default()
        };
        stage.domain.handle(now, Input::Deadline, &mut stage.out);
        stage.out.drain().collect::<Vec<_>>()
    };
    assert_eq!(notes(stage.give(mismatch("TYPE_CONSISTENCY_ENFORCEMENT"))), [""; 0]);
    assert_eq!(notes(later(&mut stage, 3)), [""; 0], "another route is there for it");
    assert_eq!(notes(stage.give(mismatch("DURABILITY"))), [""; 0], "discovery has not told of it yet");
    let DomainEvent::Endpoint(mut strict) = endpoint(guid(3, 1), false, "Plain") else { unreachable!() };
    strict.quality.durable = Durable::Persistent;
    stage.give(DomainEvent::Endpoint(strict));
    let told = ["Plain: DURABILITY: TRANSIENT_LOCAL is offered, PERSISTENT requested"];
    assert_eq!(notes(later(&mut stage, 6)), told);
    assert_eq!(notes(stage.give(mismatch("DURABILITY"))), [""; 0], "it is told once");
    assert_eq!((stage.domain.counters.mismatches, stage.domain.next_deadline()), (2, None));
}
