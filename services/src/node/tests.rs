//! Whole nodes in the simulator: what a fleet must see.

mod bridges;
mod journal;
mod life;
mod links;
mod sharing;

use super::*;
use crate::event::{PeerEvent, PublisherId};
use crate::registry;
use crate::service::{Input, Outbox, Service};
use crate::sim::{NodeHandle, World};
use crate::track::TrackConfig;
use aldis_envelope::{
    BootId, CallId, ContentType, Descriptor, Dialect, Envelope, GuidForm, Guids, Name, Refusal, Source, aldis,
};
use bytes::Bytes;
use std::sync::Mutex;
use std::time::Duration;

const MILLISECOND: Duration = Duration::from_millis(1);

fn id(entity: u64) -> EntityId {
    EntityId::new(entity).unwrap()
}

fn source(entity: u64, service: u64) -> Source {
    Source::new(id(entity), ServiceId::new(service).unwrap())
}

/// What a probe has seen, shared with the test.
type Seen = Arc<Mutex<Vec<String>>>;
/// What a probe does with an input, beside writing down what it sees.
type Act = Arc<dyn Fn(&Input<'_>, &mut Outbox) + Send + Sync>;

/// A service that writes down what it gets.
struct Probe {
    subscribe: &'static [&'static str],
    seen: Seen,
    act: Act,
}

impl Service for Probe {
    fn subscriptions(&self) -> Vec<Prefix> {
        self.subscribe.iter().map(|prefix| Prefix::new(prefix).unwrap()).collect()
    }

    fn handle(&mut self, _: Now, input: Input<'_>, out: &mut Outbox) {
        let line = match &input {
            Input::Message(envelope) => message_line(envelope),
            Input::CallEnded(CallId(call), outcome) => format!("call {call} ended {outcome:?}"),
            Input::Job(number, result) => format!("job {number} {}", result.is_ok()),
            Input::HistoryComplete(complete) => format!("history {complete}"),
            Input::Confirmed(number, outcome) => format!("confirmed {number} {outcome:?}"),
            Input::Recovered(envelope) => format!("recovered {}", message_line(envelope)),
            Input::Shutdown => "shutdown".into(),
            _ => String::new(),
        };
        if !line.is_empty() {
            self.seen.lock().unwrap().push(line);
        }
        (self.act)(&input, out);
    }
}

fn message_line(envelope: &Envelope) -> String {
    let label = &envelope.message.label;
    format!("{} {} {:?}", label.source(), label.descriptor(), envelope.message.content)
}

fn probe(source: Source, subscribe: &'static [&'static str], act: Act) -> (ServiceSpec, Seen) {
    let seen = Seen::default();
    let for_factory = seen.clone();
    let factory = Arc::new(move || -> Box<dyn Service> {
        Box::new(Probe { subscribe, seen: for_factory.clone(), act: act.clone() })
    });
    (ServiceSpec { source, name: "probe".into(), factory }, seen)
}

fn idle() -> Act {
    Arc::new(|_, _| {})
}

fn config(entities: &[u64], services: Vec<ServiceSpec>) -> NodeConfig {
    let fleet = Fleet::new("blue").unwrap();
    let own = id(entities[0]);
    let mut all = registry::built_in(own, &Guids::new(&fleet, GuidForm::Readable), Duration::from_secs(5));
    all.extend(services);
    NodeConfig {
        fleet,
        entities: entities.iter().map(|&entity| id(entity)).collect(),
        boot: BootId(1),
        topics: Vec::new(),
        reliable: true,
        operators: vec![id(9000)],
        allow: Vec::new(),
        import: vec![Prefix::all()],
        export: vec![Prefix::all()],
        services: all,
        bridges: Vec::new(),
        links: Vec::new(),
    }
}

fn bridge(entity: u64) -> BridgeSpec {
    BridgeSpec {
        peer: None,
        self_generated: false,
        source: source(entity, 20),
        name: "uxas".into(),
        dialect: Dialect::OpenUxas,
        import: vec![Prefix::all()],
        export: vec![Prefix::all()],
        queue_messages_max: 8,
        stall_timeout: Duration::from_secs(2),
    }
}

fn world() -> World {
    World::new(7, (MILLISECOND, 5 * MILLISECOND))
}

fn calling(to: &'static str, descriptor: &'static str) -> Act {
    Arc::new(move |input, out| {
        if matches!(input, Input::Started) {
            let descriptor = Descriptor::new(descriptor).unwrap();
            let content = Bytes::from_static(b"?");
            out.call(
                Address::new(to).unwrap(),
                ContentType::Aldis,
                descriptor,
                content,
                Duration::from_secs(2),
            );
        }
    })
}

/// What a probe has seen of messages and calls.
fn seen(seen: &Seen) -> Vec<String> {
    let seen = seen.lock().unwrap();
    seen.iter().filter(|line| !line.starts_with("history")).cloned().collect()
}

/// Runs a call from entity 9000 to a fleet of one node and says what the caller saw.
fn call(from: u64, to: &'static str, descriptor: &'static str, called: Vec<ServiceSpec>) -> Vec<String> {
    let mut world = world();
    world.add(config(&[400], called)).unwrap();
    let (spec, caller) = probe(source(from, 555), &[], calling(to, descriptor));
    world.add(config(&[from], vec![spec])).unwrap();
    world.run_for(Duration::from_secs(3));
    seen(&caller)
}

#[test]
fn every_service_answers_a_ping() {
    for service in ["eid400sid1", "eid400sid2", "eid400sid100"] {
        let lines = call(77, service, aldis::PING, vec![probe(source(400, 100), &[], idle()).0]);
        assert_eq!(lines, [format!("{service} aldis.Pong b\"?\""), "call 1 ended Ok(())".into()]);
    }
    let all = call(77, "eid400sidall", aldis::PING, vec![probe(source(400, 100), &[], idle()).0]);
    assert_eq!(all.len(), 5, "four services and the end: {all:?}");
}

#[test]
fn nobody_there_is_known_at_once_and_silence_at_the_deadline() {
    assert_eq!(call(77, "eid400sid99", aldis::PING, vec![]), ["call 1 ended Err(NobodyThere)"]);
    assert_eq!(call(77, "eid8sidall", aldis::PING, vec![]), ["call 1 ended Err(NobodyThere)"]);
    let silent = probe(source(400, 100), &[], idle()).0;
    assert_eq!(call(9000, "eid400sid100", "do", vec![silent]), ["call 1 ended Err(NoAnswer)"]);
}

#[test]
fn a_call_that_is_not_allowed_is_answered_with_the_reason() {
    let (silent, called) = probe(source(400, 100), &[], idle());
    let lines = call(77, "eid400sid100", "do", vec![silent]);
    assert!(lines[0].contains("NotAllowed") && lines[0].contains("entity 77"), "{lines:?}");
    assert_eq!(seen(&called), Vec::<String>::new());
}

#[test]
fn a_mailbox_collects_the_answers_of_many() {
    let answering: Act = Arc::new(|input, out| {
        if let Input::Message(request) = input {
            let name = Name::new("answer").unwrap();
            out.reply(request, ContentType::Aldis, name, Bytes::from_static(b"!"), true);
        }
    });
    let planners = [100, 101].map(|s| probe(source(400, s), &["Planner"], answering.clone()).0);
    let lines = call(9000, "Planner", "plan", planners.to_vec());
    let answers = ["eid400sid100 answer b\"!\"", "eid400sid101 answer b\"!\"", "call 1 ended Ok(())"];
    assert_eq!(lines, answers);
}

#[test]
fn the_node_tells_its_status() {
    let lines = call(77, "eid400sid1", aldis::NODE_QUERY, vec![]);
    assert!(lines[0].starts_with("eid400sid1 aldis.NodeStatus"), "{lines:?}");
    let unknown = call(9000, "eid400sid1", "aldis.Nonsense", vec![]);
    assert!(unknown[0].contains("NotUnderstood"), "{unknown:?}");
}

#[test]
fn the_crash_of_one_service_is_its_own() {
    let crashing: Act = Arc::new(|input, _| assert!(!matches!(input, Input::Message(_)), "as planned"));
    let (bad, _) = probe(source(400, 100), &["a"], crashing);
    let (good, received) = probe(source(400, 101), &["a"], idle());
    let mut world = world();
    let node = world.add(config(&[400], vec![bad, good])).unwrap();
    let sender = sender(&mut world, 1);
    world.run_for(Duration::from_secs(1));
    assert_eq!(seen(&received), ["eid1sid5 a b\"x\""]);
    assert_eq!(world.node(node).counters().crashes, 1);
    // It starts again after its delay, and crashes again; the other goes on.
    world.run_for(Duration::from_secs(3));
    send(&mut world, sender);
    assert_eq!(world.node(node).counters().crashes, 2);
    assert_eq!(seen(&received).len(), 2);
}

/// A node whose service 5 broadcasts `a` when it is told to by a message from its bridge's peer.
fn sender(world: &mut World, entity: u64) -> NodeHandle {
    let act: Act = Arc::new(move |input, out| {
        if matches!(input, Input::Started | Input::Message(_)) {
            let label = Label::broadcast(ContentType::Lmcp, Name::new("a").unwrap(), out.source());
            out.send(Message::new(Arc::new(label), Bytes::from_static(b"x")));
        }
    });
    let mut config = config(&[entity], vec![probe(source(entity, 5), &["go"], act).0]);
    config.bridges.push(bridge(entity));
    let node = world.add(config).unwrap();
    world.run_for(Duration::from_millis(20));
    send(world, node);
    node
}

fn send(world: &mut World, node: NodeHandle) {
    world.give_message(node, 1, b"go$lmcp|go||0|0$.");
    world.run_for(Duration::from_millis(20));
}

#[test]
fn what_is_held_back_while_the_session_is_down_is_told_and_not_lost() {
    let mut world = world();
    let (hearing, received) = probe(source(400, 100), &["a"], idle());
    let hearer = world.add(config(&[400], vec![hearing])).unwrap();
    let sender = sender(&mut world, 1);
    world.close_bus(sender);
    send(&mut world, sender);
    send(&mut world, sender);
    world.open_bus(sender);
    send(&mut world, sender);
    assert_eq!(seen(&received).len(), 2);
    let counters = world.node(hearer).counters();
    // Two of `a`; the health report that said that the session was down is retained, and was asked for.
    assert_eq!((counters.lost, counters.skipped_told), (0, 2));
    world.close_bus(hearer);
    send(&mut world, sender);
    world.open_bus(hearer);
    send(&mut world, sender);
    assert_eq!(world.node(hearer).counters().missed_offline, 1);
    assert_eq!(world.node(hearer).counters().lost, 0);
}

fn relay() -> (World, NodeHandle, NodeHandle) {
    let mut world = world();
    let [shore, vehicle] = [&[1][..], &[400, 100]].map(|entities| {
        let mut config = config(entities, vec![]);
        config.bridges.push(bridge(entities[0]));
        world.add(config).unwrap()
    });
    for node in [shore, vehicle] {
        for peer in [1, 2] {
            world.give(node, up(peer, 1_000));
        }
    }
    world.run_for(Duration::from_secs(1));
    (world, shore, vehicle)
}

fn up(peer: u64, credit: usize) -> Event {
    Event::Peer(BridgeId(0), PeerId(peer), PeerEvent::Up(format!("peer {peer}"), credit))
}

fn sent_lines(world: &mut World, node: NodeHandle) -> Vec<String> {
    let line = |(_, peer, label, content): (BridgeId, PeerId, Arc<Label>, Bytes)| {
        format!("{} {} {} {content:?}", peer.0, label.source(), label.address)
    };
    world.sent(node).into_iter().map(line).collect()
}

#[test]
fn a_message_crosses_with_its_ids_and_never_returns_to_its_peer() {
    let (mut world, shore, vehicle) = relay();
    world.give_message(vehicle, 1, b"a.B$lmcp|a.B||100|61$x");
    world.give_message(vehicle, 1, b"eid1.sid7$lmcp|a.B||400|37$y");
    world.run_for(Duration::from_secs(1));
    assert_eq!(
        sent_lines(&mut world, vehicle),
        ["2 eid100sid61 a.B b\"x\"", "2 eid400sid37 eid1sid7 b\"y\""]
    );
    let far = [
        "1 eid100sid61 a.B b\"x\"",
        "2 eid100sid61 a.B b\"x\"",
        "1 eid400sid37 eid1sid7 b\"y\"",
        "2 eid400sid37 eid1sid7 b\"y\"",
    ];
    assert_eq!(sent_lines(&mut world, shore), far);
}

#[test]
fn foreign_sources_are_refused_and_missing_ones_assigned() {
    let (mut world, shore, vehicle) = relay();
    world.give_message(vehicle, 1, b"a.B$lmcp|a.B||300|61$x");
    world.give_message(vehicle, 1, b"no message");
    world.give_message(vehicle, 1, b"a.B$lmcp|a.B||0|0$x");
    world.run_for(Duration::from_secs(1));
    assert_eq!(sent_lines(&mut world, shore)[0], "1 eid400sid20 a.B b\"x\"");
    let counters: BTreeMap<_, _> = world.node(vehicle).all_counters().into_iter().collect();
    let of = |name: &str| counters[name];
    assert_eq!(of("uxas.refused_foreign_entity"), 1);
    assert_eq!(of("uxas.refused_malformed"), 1);
    assert_eq!(of("uxas.sources_assigned"), 1);
    assert_eq!(of("uxas.imported"), 1);
}

#[test]
fn a_slow_peer_gets_all_in_order_and_a_stalled_one_holds_nobody_for_long() {
    let (mut world, _, vehicle) = relay();
    let tell = |world: &mut World, n: usize| {
        (0..n).for_each(|_| world.give_message(vehicle, 1, b"a$lmcp|a||100|1$x"))
    };
    world.give(vehicle, up(2, 3));
    tell(&mut world, 6);
    assert_eq!(world.sent(vehicle).len(), 3, "the credit of three bytes");
    let ready = |bytes| Event::Peer(BridgeId(0), PeerId(2), PeerEvent::Ready(bytes));
    world.give(vehicle, ready(10));
    assert_eq!(world.sent(vehicle).len(), 3);
    tell(&mut world, 7 + 4 + 8);
    world.run_for(Duration::from_secs(1));
    assert_eq!(world.sent(vehicle).len(), 7);
    world.run_for(Duration::from_secs(2));
    let counters: BTreeMap<_, _> = world.node(vehicle).all_counters().into_iter().collect();
    assert_eq!((counters["uxas.shed_full"], counters["uxas.shed_stalled"]), (4, 8));
    world.give(vehicle, ready(10));
    tell(&mut world, 1);
    assert_eq!(world.sent(vehicle).len(), 1);
}

#[test]
fn health_is_reported_held_and_disposed_at_the_end() {
    let mut world = world();
    let (hearing, received) = probe(source(1, 100), &["UMAA::SO::HealthReport"], idle());
    let shore = world.add(config(&[1], vec![hearing])).unwrap();
    let track = registry::Kind::Track(TrackConfig {
        entity: id(400),
        latitude_deg: 0.0,
        longitude_deg: 0.0,
        heading_deg: 0.0,
        speed_m_per_s: 1.0,
        turn_rate_deg_per_s: 0.0,
        rate_hz: 1.0,
    });
    let fleet = Fleet::new("blue").unwrap();
    let guids = Guids::new(&fleet, GuidForm::Readable);
    let vehicle =
        world.add(config(&[400], vec![registry::service(source(400, 100), "track", track, &guids)])).unwrap();
    world.run_for(Duration::from_secs(6));
    let before = seen(&received);
    assert!(before.iter().any(|line| line.starts_with("eid400sid2")), "{before:?}");
    world.give(vehicle, Event::Shutdown);
    world.run_for(Duration::from_secs(1));
    let disposed = seen(&received).iter().filter(|line| line.ends_with("b\"\"")).count();
    assert_eq!(disposed, 5, "health, log, node, track and the bus");
    assert!(world.has_exited(vehicle) && !world.has_exited(shore));
}

#[test]
fn a_job_leaves_the_loop_and_comes_back() {
    let act: Act = Arc::new(|input, out| {
        if matches!(input, Input::Started) {
            out.job(3, Box::new(|| Box::new(42)));
        }
    });
    let (spec, done) = probe(source(1, 100), &[], act);
    let mut world = world();
    world.add(config(&[1], vec![spec])).unwrap();
    world.run_for(Duration::from_secs(1));
    assert_eq!(seen(&done), ["job 3 true"]);
}

#[test]
fn publishers_are_declared_once_and_within_their_limit() {
    let many: Act = Arc::new(|input, out| {
        if matches!(input, Input::Started | Input::Message(_)) {
            for i in 0..publishing::PUBLISHERS_MAX + 5 {
                let label =
                    Label::broadcast(ContentType::Lmcp, Name::new(&format!("t{i}")).unwrap(), out.source());
                out.send(Message::new(Arc::new(label), Bytes::new()));
            }
        }
    });
    let mut node = Node::new(config(&[1], vec![probe(source(1, 100), &["go"], many).0])).unwrap();
    let mut effects = Vec::new();
    node.handle(Now::default(), &mut vec![Event::BusOpened], &mut effects);
    let label = Arc::new(Label::broadcast(ContentType::Lmcp, Name::new("go").unwrap(), source(2, 2)));
    let stamp = aldis_envelope::Stamp {
        node: id(2),
        boot: BootId(1),
        sequence: 1,
        source_time: Default::default(),
        lifespan_left_ms: None,
        priority: Default::default(),
        skipped: 0,
        via: Default::default(),
    };
    let go = Envelope { message: Message::new(label, Bytes::new()), stamp };
    node.handle(Now::default(), &mut vec![Event::Sample(go)], &mut effects);
    let declared = |effects: &[Effect]| {
        effects.iter().filter(|e| matches!(e, Effect::Declare { publisher: PublisherId(_), .. })).count()
    };
    let undeclared = effects.iter().filter(|e| matches!(e, Effect::PublishOn(..))).count();
    assert_eq!(declared(&effects), publishing::PUBLISHERS_MAX);
    assert!(undeclared >= 5, "{undeclared}");
}

#[test]
fn refusals_are_values() {
    let mut twice = config(&[1], vec![]);
    twice.services.push(twice.services[0].clone());
    assert!(Node::new(twice).err().unwrap().contains("eid1sid2"));
    let foreign = config(&[1], vec![probe(source(2, 100), &[], idle()).0]);
    assert!(Node::new(foreign).err().unwrap().contains("does not speak for"));
    let text = Refusal::NobodyThere.to_string();
    assert_eq!(text, "nobody is there: no service at this address is alive");
}
