//! Retained topics between whole nodes.

use super::*;
use aldis_envelope::{Change, Instance};

const REPORT: &str = "UMAA::SO::T::TReport";

/// Sends a sample of an instance for each word of a message: `7` puts it, `-7` disposes it, `?7` wants its confirmation.
pub(super) fn writer(
    of: Source,
    topic: &'static str,
    trigger: &'static [&'static str],
) -> (ServiceSpec, Seen) {
    let act: Act = Arc::new(move |input, out| {
        let Input::Message(envelope) = input else { return };
        let text = String::from_utf8(envelope.message.content.to_vec()).unwrap();
        for word in text.split(' ') {
            let id: i64 = word.trim_start_matches(['-', '?']).parse().unwrap();
            let label = Label::broadcast(ContentType::Umaa, Name::new(topic).unwrap(), out.source());
            let content = Bytes::from(format!("{id}"));
            let message = Message::new(Arc::new(label), content).of_instance(Instance::of_number(id));
            match word.as_bytes()[0] {
                b'-' => out.send(Message { change: Change::Dispose, content: Bytes::new(), ..message }),
                b'?' => out.send_confirmed(message, id as u64, Duration::from_secs(5)),
                _ => out.send(message),
            }
        }
    });
    probe(of, trigger, act)
}

fn writing(world: &mut World, entity: u64, topic: &'static str) -> (NodeHandle, Seen) {
    let (spec, told) = writer(source(entity, 5), topic, &["go"]);
    let mut config = config(&[entity], vec![spec]);
    config.bridges.push(bridge(entity));
    let node = world.add(config).unwrap();
    world.run_for(Duration::from_millis(20));
    (node, told)
}

pub(super) fn say(world: &mut World, node: NodeHandle, words: &str) {
    let message = Bytes::from(format!("go$lmcp|go||0|0${words}"));
    world.give(node, Event::Peer(BridgeId(0), PeerId(1), PeerEvent::Message(message)));
    world.run_for(Duration::from_millis(20));
}

pub(super) fn reading(world: &mut World, entity: u64, topic: &'static [&'static str]) -> (NodeHandle, Seen) {
    let (spec, seen) = probe(source(entity, 100), topic, idle());
    (world.add(config(&[entity], vec![spec])).unwrap(), seen)
}

/// The contents that a probe got, and whatever else it was told.
pub(super) fn contents(probe: &Seen) -> Vec<String> {
    let short = |line: &String| match line.strip_prefix("eid1sid5 UMAA::SO::T::TReport b") {
        Some(content) => content.trim_matches('"').to_owned(),
        None => line.clone(),
    };
    probe.lock().unwrap().iter().map(short).collect()
}

#[test]
fn a_late_joiner_gets_the_last_of_each_instance_and_is_told_when_it_has_all() {
    let mut world = world();
    let (node, _) = writing(&mut world, 1, REPORT);
    say(&mut world, node, "1 2 3 1 -2");
    let (reader, got) = reading(&mut world, 400, &["UMAA::SO::T"]);
    world.run_for(Duration::from_millis(300));
    assert_eq!(contents(&got), ["3", "1", "", "history true"], "an empty content is the dispose");
    say(&mut world, node, "4");
    assert_eq!(contents(&got)[4..], ["4"]);
    assert_eq!(world.node(reader).counters().lost, 0);
    // Everything is confirmed: nobody is reminded of anything.
    let published = world.node(node).counters().retold;
    world.run_for(Duration::from_secs(60));
    assert_eq!(world.node(node).counters().retold, published);
}

#[test]
fn what_is_missed_during_an_outage_comes_afterwards_in_order() {
    let mut world = world();
    let (node, _) = writing(&mut world, 1, "UMAA::SO::T::TCommandStatus");
    let (reader, got) = reading(&mut world, 400, &["UMAA::SO::T"]);
    world.run_for(Duration::from_secs(1));
    say(&mut world, node, "1");
    world.close_bus(reader);
    say(&mut world, node, "1 2 1 2");
    world.open_bus(reader);
    world.run_for(Duration::from_secs(2));
    say(&mut world, node, "3");
    let ids: Vec<_> =
        seen(&got).iter().filter_map(|line| line.split("b\"").nth(1).map(str::to_owned)).collect();
    assert_eq!(ids, ["1\"", "1\"", "2\"", "1\"", "2\"", "3\""], "every transition, once");
    assert_eq!(world.node(reader).counters().lost, 0);
}

#[test]
fn a_lost_last_sample_is_found_without_another() {
    let mut world = world();
    let (node, _) = writing(&mut world, 1, REPORT);
    let (reader, got) = reading(&mut world, 400, &["UMAA::SO::T"]);
    world.run_for(Duration::from_secs(1));
    // Only the writer's session is down: its sample goes nowhere.
    world.close_bus(node);
    say(&mut world, node, "1");
    world.open_bus(node);
    world.run_for(Duration::from_secs(1));
    assert_eq!(contents(&got), ["history true", "1"]);
    assert_eq!(world.node(reader).counters().missed_offline, 0);
}

#[test]
fn a_delivery_is_confirmed_by_every_reader_or_the_missing_ones_are_named() {
    let mut world = world();
    let (node, told) = writing(&mut world, 1, REPORT);
    let readers = [400, 401].map(|entity| reading(&mut world, entity, &["UMAA::"]).0);
    world.run_for(Duration::from_secs(1));
    say(&mut world, node, "?1");
    let of = |told: &Seen| seen(told).into_iter().filter(|l| l.starts_with("confirmed")).collect::<Vec<_>>();
    assert_eq!(of(&told), ["confirmed 1 Ok(())"]);
    world.close_bus(readers[1]);
    say(&mut world, node, "?2");
    world.run_for(Duration::from_secs(6));
    assert_eq!(of(&told)[1..], ["confirmed 2 Err(Missing { missing: [401] })"]);
    // Its lease has run out: nobody waits for it.
    world.run_for(Duration::from_secs(6));
    say(&mut world, node, "?3");
    assert_eq!(of(&told)[2..], ["confirmed 3 Ok(())"]);
}

#[test]
fn an_orderly_end_is_waited_for_by_nobody() {
    let mut world = world();
    let (node, told) = writing(&mut world, 1, REPORT);
    let (reader, _) = reading(&mut world, 400, &["UMAA::"]);
    world.run_for(Duration::from_secs(1));
    world.give(reader, Event::Shutdown);
    world.run_for(Duration::from_millis(50));
    world.close_bus(reader);
    say(&mut world, node, "?1");
    assert_eq!(seen(&told).last().unwrap(), "confirmed 1 Ok(())");
}

#[test]
fn a_service_that_starts_again_gets_what_is_kept_from_near_and_far() {
    let mut world = world();
    let (far, _) = writing(&mut world, 1, REPORT);
    let crash: Act = Arc::new(|input, _| {
        if let Input::Message(envelope) = input {
            assert!(!envelope.message.content.starts_with(b"13"), "as planned");
        }
    });
    let (reader, got) = probe(source(400, 100), &["UMAA::SO::T"], crash);
    let (near, _) = writer(source(400, 5), "UMAA::SO::T::Near", &["near"]);
    let mut config = config(&[400], vec![near, reader]);
    config.bridges.push(bridge(400));
    let node = world.add(config).unwrap();
    world.run_for(Duration::from_secs(1));
    say(&mut world, far, "1 2");
    world.give_message(node, 1, b"near$lmcp|near||0|0$7");
    say(&mut world, far, "13");
    assert_eq!(world.node(node).counters().crashes, 1);
    say(&mut world, far, "-13");
    got.lock().unwrap().clear();
    world.run_for(Duration::from_secs(5));
    let lines = contents(&got);
    assert_eq!(lines.len(), 5, "{lines:?}");
    assert!(lines[0].contains("Near"), "{lines:?}");
    assert_eq!(lines[1..], ["1", "2", "", "history true"]);
}

#[test]
fn without_a_bus_history_is_waited_for_in_vain_but_not_for_ever() {
    let mut world = world();
    let (node, got) = reading(&mut world, 400, &["UMAA::SO::T"]);
    world.close_bus(node);
    got.lock().unwrap().clear();
    world.run_for(Duration::from_secs(6));
    assert_eq!(contents(&got), ["history false"]);
}

#[test]
fn history_is_complete_when_programs_that_are_no_node_have_told_theirs_too() {
    for seed in 0..20 {
        let mut world = World::new(seed, (MILLISECOND, 40 * MILLISECOND));
        world.add(config(&[1], Vec::new())).unwrap();
        let say: Act = Arc::new(|input, out| {
            if matches!(input, Input::Started) {
                let label = Label::broadcast(ContentType::Umaa, Name::new(REPORT).unwrap(), out.source());
                out.send(Message::new(Arc::new(label), Bytes::from_static(b"7")));
            }
        });
        let (program, _) = probe(source(9000, 100), &[], say);
        world.add(NodeConfig { services: vec![program], ..config(&[9000], Vec::new()) }).unwrap();
        world.run_for(Duration::from_secs(1));
        let (_, got) = reading(&mut world, 400, &["UMAA::SO::T"]);
        world.run_for(Duration::from_millis(800));
        let expected = [format!("eid9000sid100 {REPORT} b\"7\""), "history true".into()];
        assert_eq!(contents(&got), expected, "seed {seed}");
    }
}

#[test]
fn a_volatile_topic_has_no_late_joiners() {
    let mut world = world();
    let (node, _) = writing(&mut world, 1, "UMAA::SO::T::LogReport");
    say(&mut world, node, "1 2");
    let (_, got) = reading(&mut world, 400, &["UMAA::SO::T"]);
    world.run_for(Duration::from_millis(300));
    say(&mut world, node, "3");
    assert_eq!(contents(&got), ["history true", "eid1sid5 UMAA::SO::T::LogReport b\"3\""]);
}

#[test]
fn what_nodes_tell_one_another_is_believed_of_their_own_source_alone() {
    let mut world = world();
    let (node, _) = reading(&mut world, 400, &["UMAA::SO::T"]);
    let label = Label::limitedcast(
        Address::Service(source(400, 1)),
        ContentType::Aldis,
        Name::new("aldis.dds.History").unwrap().into(),
        source(7, 1),
    );
    let stamp = aldis_envelope::Stamp {
        node: id(8),
        boot: BootId(1),
        sequence: 1,
        source_time: aldis_envelope::Wall(0),
        lifespan_left_ms: None,
        priority: Priority::Data,
        skipped: 0,
        via: Default::default(),
    };
    let message = Message::new(Arc::new(label), Bytes::from_static(b"\xff\xff\xff"));
    world.give(node, Event::Sample(Envelope { message: message.clone(), stamp: stamp.clone() }));
    world.give(
        node,
        Event::Sample(Envelope { message, stamp: aldis_envelope::Stamp { node: id(7), ..stamp } }),
    );
    assert_eq!(world.node(node).counters().refused_among_nodes, 2);
}
