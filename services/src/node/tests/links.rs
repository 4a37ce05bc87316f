//! Whole nodes on two sides of bad links.

use super::*;
use crate::event::LinkId;
use crate::journal::JournalConfig;
use crate::link::export::{Export, Rule};
use crate::link::{CarrierConfig, CarrierId, Class, LinkConfig, LinkSpec};
use crate::sim::link::Profile;
use aldis_envelope::aldis::link as told;
use aldis_envelope::umaa::{CommandKey, Key};
use aldis_envelope::{Change, Instance};

const CARRIER: CarrierId = CarrierId(0);

fn spec(own: u64, peer: u64, behind: &[u64], rules: Vec<Rule>) -> LinkSpec {
    let Profile { rate, mtu, .. } = Profile::L1;
    let carrier = CarrierConfig { id: CARRIER, rate, mtu, round_trip: Profile::L1.round_trip(), loss: 0.1 };
    LinkSpec {
        name: format!("link-{peer}"),
        link: LinkConfig::new(id(own), id(peer), vec![carrier]),
        export: Export { behind: behind.iter().map(|&entity| id(entity)).collect(), rules },
    }
}

fn rules() -> Vec<Rule> {
    let addressed = |entity: &str| Rule {
        address: Prefix::new(entity).ok(),
        lifespan: Some(Duration::from_secs(600)),
        ..Rule::new("", Class::Command)
    };
    vec![
        Rule {
            lifespan: Some(Duration::from_secs(600)),
            ..Rule::new("UMAA::SO::X::XCommand", Class::Command)
        },
        Rule::new("UMAA::SO::T::", Class::State),
        addressed("eid1"),
        addressed("eid9000"),
        addressed("eid400"),
        addressed("eid401"),
    ]
}

fn linked(entities: &[u64], services: Vec<ServiceSpec>, links: Vec<LinkSpec>) -> NodeConfig {
    NodeConfig { links, ..config(entities, services) }
}

/// Shore and vehicle 400, each on a bus of its own.
fn pair(shore: Vec<ServiceSpec>, vehicle: Vec<ServiceSpec>) -> (World, NodeHandle, NodeHandle) {
    let mut world = world();
    let mut shore = linked(&[1], shore, vec![spec(1, 400, &[400], rules())]);
    shore.bridges.push(bridge(1));
    let shore = world.add(shore).unwrap();
    let mut vehicle = linked(&[400], vehicle, vec![spec(400, 1, &[1, 9000], rules())]);
    vehicle.bridges.push(bridge(400));
    let vehicle = world.add(vehicle).unwrap();
    world.partition(&[0, 1], Duration::ZERO);
    world.join((shore, LinkId(0)), (vehicle, LinkId(0)), CARRIER, &Profile::L1);
    world.run_for(Duration::from_secs(20));
    (world, shore, vehicle)
}

fn guids() -> Guids {
    Guids::new(&Fleet::new("blue").unwrap(), GuidForm::Readable)
}

/// Sends, at a word of its node's bridge: `400 7 put` is a command with session 7 for vehicle 400; `- 7 put` a report of instance 7.
fn sender(of: Source) -> (ServiceSpec, Seen) {
    let act: Act = Arc::new(move |input, out| {
        let Input::Message(envelope) = input else { return };
        let Ok(text) = std::str::from_utf8(&envelope.message.content) else { return };
        let mut words = text.split(' ');
        let (Some(to), Some(number), Some(change)) = (words.next(), words.next(), words.next()) else {
            return;
        };
        let number: i64 = number.parse().unwrap();
        let (topic, instance) = match to {
            "-" => ("UMAA::SO::T::TReport", Instance::of_number(number)),
            to => {
                let destination = guids().of_service(source(to.parse().unwrap(), 100));
                let session_id = guids().of_session(destination, aldis_envelope::Wall(0), number as u64);
                let key = CommandKey { source: guids().of_service(of), session_id, destination };
                ("UMAA::SO::X::XCommand", key.instance())
            }
        };
        let label = Label::broadcast(ContentType::Umaa, Name::new(topic).unwrap(), out.source());
        let content = Bytes::from(format!("{number}"));
        let message = Message::new(Arc::new(label), content).of_instance(instance);
        out.send(match change {
            "dispose" => Message { change: Change::Dispose, content: Bytes::new(), ..message },
            _ => message,
        });
    });
    probe(of, &["go"], act)
}

fn say(world: &mut World, node: NodeHandle, words: &str) {
    let message = Bytes::from(format!("go$lmcp|go||0|0${words}"));
    world.give(node, Event::Peer(BridgeId(0), PeerId(1), PeerEvent::Message(message)));
    world.run_for(Duration::from_millis(20));
}

fn of(seen: &Seen, from: &str) -> Vec<String> {
    seen.lock().unwrap().iter().filter_map(|line| line.strip_prefix(from)).map(str::to_owned).collect()
}

#[test]
fn commands_cross_once_in_order_and_towards_their_destination_alone() {
    let (sender, _) = sender(source(1, 100));
    let (receiver, seen) = probe(source(400, 100), &["UMAA::SO::X"], idle());
    let (mut world, shore, _) = pair(vec![sender], vec![receiver]);
    let before = world.link_bytes(shore, LinkId(0));
    for session in 1..=5 {
        say(&mut world, shore, &format!("401 {session} put"));
    }
    world.run_for(Duration::from_secs(1));
    assert!(world.link_bytes(shore, LinkId(0)) - before < 60, "nothing but keeping alive");
    for session in 1..=20 {
        say(&mut world, shore, &format!("400 {session} put"));
    }
    say(&mut world, shore, "400 7 dispose");
    world.run_for(Duration::from_secs(120));
    let all: Vec<_> = (1..=20).map(|session| format!("{session}")).chain([String::new()]).collect();
    let got: Vec<_> = of(&seen, "eid1sid100 UMAA::SO::X::XCommand b");
    assert_eq!(got.iter().map(|line| line.trim_matches('"').to_owned()).collect::<Vec<_>>(), all);
}

#[test]
fn states_cross_and_a_late_joiner_on_the_far_side_has_them() {
    let (sender, _) = sender(source(400, 100));
    let (mut world, _, vehicle) = pair(Vec::new(), vec![sender]);
    for instance in 1..=3 {
        say(&mut world, vehicle, &format!("- {instance} put"));
    }
    say(&mut world, vehicle, "- 2 dispose");
    world.run_for(Duration::from_secs(30));
    let (joiner, seen) = probe(source(5, 100), &["UMAA::SO::T"], idle());
    let joiner = world.add(config(&[5], vec![joiner])).unwrap();
    world.partition(&[0, 1, 0], Duration::ZERO);
    world.run_for(Duration::from_secs(10));
    let mut got = of(&seen, "eid400sid100 UMAA::SO::T::TReport ");
    got.sort();
    assert_eq!(got, ["b\"\"", "b\"1\"", "b\"3\""], "the dispose, and two that are alive");
    assert!(world.is_running(joiner));
}

#[test]
fn calls_cross_and_who_is_not_heard_is_still_waited_for() {
    let (caller, seen) = probe(source(1, 101), &[], idle());
    let (mut world, _, vehicle) = pair(vec![caller], Vec::new());
    assert_eq!(of(&seen, "call"), Vec::<String>::new());
    // A caller on shore's bus, which has seen the tokens that shore shows for the vehicle.
    let act: Act = Arc::new(|input, out| {
        if matches!(input, Input::HistoryComplete(_)) {
            let (to, ping) = (Address::new("eid400sid1").unwrap(), Descriptor::new(aldis::PING).unwrap());
            out.call(to, ContentType::Aldis, ping, Bytes::from_static(b"?"), Duration::from_secs(60));
        }
    });
    let (caller, seen) = probe(source(9000, 300), &[], act);
    world.add(config(&[9000], vec![caller])).unwrap();
    world.partition(&[0, 1, 0], Duration::ZERO);
    world.run_for(Duration::from_secs(70));
    let lines = seen.lock().unwrap().clone();
    assert!(lines.contains(&"call 1 ended Ok(())".to_owned()), "{lines:?}");
    let tickets = lines.iter().filter(|line| line.contains(told::TICKET)).count();
    assert!(tickets >= 3, "accepted, on the air, delivered: {lines:?}");
    world.cut(vehicle, true);
    world.run_for(Duration::from_secs(30));
}

#[test]
fn a_relay_passes_on_and_what_is_not_from_behind_is_refused() {
    let (sender, _) = sender(source(400, 100));
    let (receiver, seen) = probe(source(401, 100), &["UMAA::SO::X"], idle());
    let mut world = world();
    let links = vec![spec(1, 400, &[400], rules()), spec(1, 401, &[401], rules())];
    let shore = world.add(linked(&[1], Vec::new(), links)).unwrap();
    let mut first = linked(&[400], vec![sender], vec![spec(400, 1, &[1, 401], rules())]);
    first.bridges.push(bridge(400));
    let first = world.add(first).unwrap();
    // The second vehicle's configuration names shore alone: what 400 says is not shore's to say.
    let strict = linked(&[401], vec![receiver], vec![spec(401, 1, &[1], rules())]);
    let second = world.add(strict).unwrap();
    world.partition(&[0, 1, 2], Duration::ZERO);
    world.join((shore, LinkId(0)), (first, LinkId(0)), CARRIER, &Profile::L1);
    world.join((shore, LinkId(1)), (second, LinkId(0)), CARRIER, &Profile::L1);
    world.run_for(Duration::from_secs(20));
    say(&mut world, first, "401 1 put");
    world.run_for(Duration::from_secs(30));
    assert_eq!(of(&seen, "eid400sid100"), Vec::<String>::new());
    assert_eq!(world.node(second).counters().refused_links, 1);
    assert_eq!(world.node(shore).counters().imported_by_links, 1);
}

#[test]
fn what_is_accepted_survives_both_ends() {
    let (sender, _) = sender(source(1, 100));
    let (receiver, seen) = probe(source(400, 100), &["UMAA::SO::X"], idle());
    let mut world = world();
    let mut shore = linked(&[1], vec![sender], vec![spec(1, 400, &[400], rules())]);
    shore.bridges.push(bridge(1));
    let journal = || JournalConfig { segment_bytes: 1 << 14, ..JournalConfig::new(7) };
    let latency = (MILLISECOND, 3 * MILLISECOND);
    let shore = world.add_with_journal(shore, journal(), latency).unwrap();
    let vehicle = linked(&[400], vec![receiver], vec![spec(400, 1, &[1], rules())]);
    let vehicle = world.add_with_journal(vehicle, journal(), latency).unwrap();
    world.restart(shore);
    world.restart(vehicle);
    world.partition(&[0, 1], Duration::ZERO);
    world.join((shore, LinkId(0)), (vehicle, LinkId(0)), CARRIER, &Profile::L1);
    world.run_for(Duration::from_secs(20));
    world.cut(vehicle, true);
    for session in 1..=5 {
        say(&mut world, shore, &format!("400 {session} put"));
    }
    world.run_for(Duration::from_secs(1));
    world.crash(shore, true, Duration::ZERO);
    world.crash(vehicle, true, Duration::ZERO);
    world.restart(shore);
    world.restart(vehicle);
    world.cut(vehicle, false);
    world.run_for(Duration::from_secs(60));
    let got = of(&seen, "eid1sid100 UMAA::SO::X::XCommand ");
    assert_eq!(got, ["b\"1\"", "b\"2\"", "b\"3\"", "b\"4\"", "b\"5\""]);
}

#[test]
fn who_waits_for_all_readers_waits_for_those_beyond_a_link() {
    let (waiting, told) = super::sharing::writer(source(1, 100), "UMAA::SO::T::TReport", &["go"]);
    let (mut world, shore, _) = pair(vec![waiting], Vec::new());
    let (reader, seen) = probe(source(5, 100), &["UMAA::SO::T"], idle());
    world.add(config(&[5], vec![reader])).unwrap();
    world.partition(&[0, 1, 1], Duration::ZERO);
    world.run_for(Duration::from_secs(10));
    let confirmed = || of(&told, "confirmed ");
    let has =
        |number: &str| of(&seen, "eid1sid100 UMAA::SO::T::TReport b").contains(&format!("\"{number}\""));
    say(&mut world, shore, "?7");
    // Nobody reads on this side, and the word is on its way: half a round trip there, and half of one back.
    world.run_for(Duration::from_millis(400));
    assert!(confirmed().is_empty(), "{:?}", confirmed());
    world.run_for(Duration::from_millis(4_500));
    assert_eq!((confirmed(), has("7")), (vec!["7 Ok(())".to_owned()], true));
    // The reader loses its gateway: the sample crosses, and it is not confirmed.
    world.partition(&[0, 1, 2], Duration::ZERO);
    say(&mut world, shore, "?8");
    world.run_for(Duration::from_secs(6));
    let missing = "8 Err(Missing { missing: [400] })".to_owned();
    assert_eq!((confirmed()[1..].to_vec(), has("8")), (vec![missing], false));
    // Whoever reads here is waited for as well as who reads there.
    world.partition(&[0, 1, 1], Duration::ZERO);
    world.run_for(Duration::from_secs(15));
    assert!(has("8"));
    let (near, _) = probe(source(6, 100), &["UMAA::SO::T"], idle());
    world.add(config(&[6], vec![near])).unwrap();
    world.partition(&[0, 1, 1, 0], Duration::ZERO);
    world.run_for(Duration::from_secs(5));
    say(&mut world, shore, "?9");
    world.run_for(Duration::from_secs(6));
    assert_eq!((confirmed()[2..].to_vec(), has("9")), (vec!["9 Ok(())".to_owned()], true));
}

#[test]
fn a_peer_that_refuses_what_a_source_says_is_no_reader_of_it() {
    let (waiting, told) = super::sharing::writer(source(400, 100), "UMAA::SO::T::TReport", &["go"]);
    let mut world = world();
    let links = vec![spec(1, 400, &[400], rules()), spec(1, 401, &[401], rules())];
    let shore = world.add(linked(&[1], Vec::new(), links)).unwrap();
    let mut first = linked(&[400], vec![waiting], vec![spec(400, 1, &[1, 401], rules())]);
    first.bridges.push(bridge(400));
    let first = world.add(first).unwrap();
    // What 400 says is not shore's to say here.
    let second = world.add(linked(&[401], Vec::new(), vec![spec(401, 1, &[1], rules())])).unwrap();
    world.partition(&[0, 1, 2], Duration::ZERO);
    world.join((shore, LinkId(0)), (first, LinkId(0)), CARRIER, &Profile::L1);
    world.join((shore, LinkId(1)), (second, LinkId(0)), CARRIER, &Profile::L1);
    world.run_for(Duration::from_secs(30));
    say(&mut world, first, "?7");
    world.run_for(Duration::from_secs(6));
    assert_eq!(of(&told, "confirmed "), ["7 Ok(())"]);
    assert!(world.node(second).counters().refused_links > 0, "shore offered it to the second vehicle");
}
