//! What outlives the process, in whole nodes with disks.

use super::sharing::{contents, reading, say, writer};
use super::*;
use crate::dds::{Durability, Keep, Qos, TopicRule};
use crate::journal::{
    Batch, Damage, DamageKind, JournalConfig, JournalEvent, Operation, Recovered, Unusable,
};
use crate::sim::DiskFaults;
use aldis_envelope::Change;

const REPORT: &str = "UMAA::SO::T::TReport";

fn persistent(prefix: &str, keep: Keep) -> TopicRule {
    let qos = Qos { durability: Durability::Persistent, keep, samples_max: 1_000 };
    TopicRule { prefix: Prefix::new(prefix).unwrap(), qos: Some(qos) }
}

fn with_bridge(entity: u64, services: Vec<ServiceSpec>) -> NodeConfig {
    let mut config = config(&[entity], services);
    config.bridges.push(bridge(entity));
    config.topics.push(persistent("UMAA::SO::T", Keep::ByPattern));
    config
}

/// A node whose writer keeps what it says on disk.
fn keeping(world: &mut World, services: Vec<ServiceSpec>) -> NodeHandle {
    let journal = JournalConfig { segment_bytes: 1 << 14, ..JournalConfig::new(7) };
    let latency = (MILLISECOND, 3 * MILLISECOND);
    let node = world.add_with_journal(with_bridge(1, services), journal, latency).unwrap();
    world.restart(node);
    world.run_for(Duration::from_millis(100));
    node
}

fn crash(world: &mut World, node: NodeHandle, power_loss: bool) {
    world.crash(node, power_loss, MILLISECOND);
    world.run_for(Duration::from_millis(10));
    world.restart(node);
    world.run_for(Duration::from_secs(1));
}

#[test]
fn what_is_retained_comes_back_after_a_crash_and_what_was_disposed_does_not() {
    let mut world = world();
    let (spec, told) = writer(source(1, 5), REPORT, &["go"]);
    let node = keeping(&mut world, vec![spec]);
    let (_, stays) = reading(&mut world, 400, &["UMAA::SO::T"]);
    say(&mut world, node, "1 2 3 1 -2");
    world.run_for(Duration::from_secs(1));
    let boot = world.node(node).boot();
    crash(&mut world, node, true);
    assert!(world.node(node).boot() > boot);
    let recovered = |told: &Seen| {
        let lines = told.lock().unwrap();
        lines.iter().filter_map(|line| line.strip_prefix("recovered ").map(str::to_owned)).collect::<Vec<_>>()
    };
    let its = |id| format!("eid1sid5 {REPORT} b\"{id}\"");
    assert_eq!(recovered(&told), [its(3), its(1)], "in the order of their writing");
    let (_, joins) = reading(&mut world, 401, &["UMAA::SO::T"]);
    world.run_for(Duration::from_millis(300));
    assert_eq!(contents(&joins), ["3", "1", "", "history true"]);
    let mut heard = contents(&stays);
    heard.retain(|line| line != "history true");
    let once_more = "who stayed hears what is there once more, and of no end";
    assert_eq!(heard, ["1", "2", "3", "1", "", "3", "1"], "{once_more}");
    say(&mut world, node, "4");
    assert_eq!(contents(&joins).last().unwrap(), "4");
    assert_eq!(world.node(node).counters().recovered, 3);
}

#[test]
fn a_service_that_crashes_alone_gets_what_it_said_whatever_the_topic() {
    let mut world = world();
    let (spec, told) = writer(source(1, 5), "UMAA::SO::Other", &["go"]);
    let node = keeping(&mut world, vec![spec]);
    say(&mut world, node, "7 8 -8");
    say(&mut world, node, "x");
    assert_eq!(world.node(node).counters().crashes, 1, "`x` is no number");
    world.run_for(Duration::from_secs(5));
    let lines = told.lock().unwrap().clone();
    let recovered: Vec<_> = lines.iter().filter(|line| line.starts_with("recovered")).collect();
    assert_eq!(recovered, ["recovered eid1sid5 UMAA::SO::Other b\"7\""]);
}

#[test]
fn nobody_has_what_is_not_on_disk_and_the_order_of_a_source_is_kept() {
    let mut world = world();
    let (kept, told) = writer(source(1, 5), REPORT, &["go"]);
    let both: Act = Arc::new(|input, out| {
        let Input::Message(_) = input else { return };
        for (topic, content) in
            [("UMAA::SO::T::A", "first"), ("plain", "second"), ("UMAA::SO::T::A", "third")]
        {
            let label = Label::broadcast(ContentType::Umaa, Name::new(topic).unwrap(), out.source());
            out.send(Message::new(Arc::new(label), Bytes::from_static(content.as_bytes())));
        }
    });
    let (both, _) = probe(source(1, 6), &["both"], both);
    let node = keeping(&mut world, vec![kept, both]);
    let (_, heard) = reading(&mut world, 400, &["UMAA::SO::T", "plain"]);
    let (_, other) = probe(source(1, 7), &[], idle());
    world.run_for(Duration::from_secs(1));
    let words = |heard: &Seen| {
        seen(heard).iter().filter_map(|l| l.split('"').nth(1).map(str::to_owned)).collect::<Vec<_>>()
    };
    world.give_message(node, 1, b"both$lmcp|both||0|0$!");
    assert_eq!(words(&heard), Vec::<String>::new());
    world.run_for(Duration::from_millis(50));
    assert_eq!(words(&heard), ["first", "second", "third"]);
    say(&mut world, node, "?5");
    assert_eq!(seen(&told).last().unwrap(), "confirmed 5 Ok(())");
    assert!(seen(&other).is_empty());
    assert_eq!(world.node(node).counters().kept, 3);
}

#[test]
fn a_full_disk_refuses_what_needs_it_and_nothing_else() {
    let mut world = world();
    let (kept, told) = writer(source(1, 5), REPORT, &["go"]);
    let (plain, _) = writer(source(1, 6), "plain.Topic", &["plain"]);
    let node = keeping(&mut world, vec![kept, plain]);
    let (_, heard) = reading(&mut world, 400, &["UMAA::SO::T", "plain.Topic"]);
    world.run_for(Duration::from_secs(1));
    say(&mut world, node, "1");
    world.set_disk(node, DiskFaults::default(), Some(0));
    say(&mut world, node, "?2");
    world.give_message(node, 1, b"plain$lmcp|plain||0|0$3");
    world.run_for(Duration::from_millis(50));
    let refused = seen(&told).last().unwrap().clone();
    assert!(refused.starts_with("confirmed 2 Err(NotKept(\"the disk refuses: no space left"), "{refused}");
    let words =
        || seen(&heard).iter().filter_map(|l| l.split('"').nth(1).map(str::to_owned)).collect::<Vec<_>>();
    assert_eq!(words(), ["1", "3"]);
    assert_eq!(world.node(node).counters().not_kept, 1);
    world.set_disk(node, DiskFaults::default(), None);
    world.run_for(Duration::from_secs(5));
    say(&mut world, node, "4");
    assert_eq!(words(), ["1", "3", "4"]);
}

#[test]
fn last_words_are_on_disk_before_the_node_ends() {
    let mut world = world();
    let (spec, told) = writer(source(1, 5), REPORT, &["go"]);
    let last: Act = Arc::new(|input, out| {
        let label =
            Label::broadcast(ContentType::Umaa, Name::new("UMAA::SO::T::Last").unwrap(), out.source());
        let message = Message::new(Arc::new(label), Bytes::from_static(b"here"));
        let message = message.of_instance(aldis_envelope::Instance::of_number(1));
        match input {
            Input::Message(_) => out.send(message),
            Input::Shutdown => {
                out.send(Message { change: Change::Dispose, content: Bytes::new(), ..message });
            }
            _ => {}
        }
    });
    let (last, _) = probe(source(1, 6), &["go"], last);
    let node = keeping(&mut world, vec![spec, last]);
    say(&mut world, node, "1");
    world.give(node, Event::Shutdown);
    assert!(!world.has_exited(node), "the dispose is not on disk yet");
    world.run_for(Duration::from_millis(50));
    assert!(world.has_exited(node));
    crash(&mut world, node, true);
    assert!(told.lock().unwrap().iter().any(|line| line.starts_with("recovered")));
    let (_, joins) = reading(&mut world, 401, &["UMAA::SO::T::Last"]);
    world.run_for(Duration::from_millis(200));
    assert_eq!(contents(&joins)[0], "eid1sid6 UMAA::SO::T::Last b\"\"", "the end, told again");
}

/// What may be retained of an instance: none where it was disposed.
type Said = Option<u64>;

/// One seed: a writer says at random what it likes on some instances, while the machine crashes at random.
fn crashes(seed: u64, faults: DiskFaults) {
    let mut world = World::new(seed, (MILLISECOND, 5 * MILLISECOND));
    let mut random = fastrand::Rng::with_seed(seed);
    let (spec, _) = counting_writer();
    let node = keeping(&mut world, vec![spec]);
    let (_, heard) = reading(&mut world, 400, &["UMAA::SO::T"]);
    world.run_for(Duration::from_secs(1));
    world.set_disk(node, faults, None);
    let mut said: BTreeMap<u64, Vec<Said>> = BTreeMap::new();
    let mut counter = 0;
    for _ in 0..12 {
        for _ in 0..random.usize(1..12) {
            let (id, disposes) = (random.u64(1..5), random.u8(..4) == 0);
            counter += 1;
            said.entry(id).or_default().push((!disposes).then_some(counter));
            let sign = if disposes { "-" } else { "" };
            let message = Bytes::from(format!("go$lmcp|go||0|0${sign}{id}:{counter}"));
            world.give(node, Event::Peer(BridgeId(0), PeerId(1), PeerEvent::Message(message)));
            world.run_for(Duration::from_micros(random.u64(0..3_000)));
        }
        if random.bool() {
            crash(&mut world, node, random.bool());
        }
    }
    world.heal();
    world.run_for(Duration::from_secs(60));
    let (_, joins) = reading(&mut world, 401, &["UMAA::SO::T"]);
    world.run_for(Duration::from_secs(1));
    let (heard, retained) = (last_of_each(&heard), last_of_each(&joins));
    for (id, said) in said {
        let from = heard.get(&id).and_then(|last| said.iter().rposition(|s| s == last)).unwrap_or(0);
        let nothing = !heard.contains_key(&id) && !retained.contains_key(&id);
        let now = retained.get(&id).copied().unwrap_or(None);
        assert!(
            nothing || said[from..].contains(&now),
            "seed {seed}: {id} is {now:?}, said {said:?} from {from}"
        );
    }
}

/// A writer of reports that are numbered, `7:1` and `-7:2`: the number is the content, of a dispose too.
fn counting_writer() -> (ServiceSpec, Seen) {
    let act: Act = Arc::new(move |input, out| {
        let Input::Message(envelope) = input else { return };
        let text = String::from_utf8(envelope.message.content.to_vec()).unwrap();
        let (id, _) = text.trim_start_matches('-').split_once(':').unwrap();
        let label = Label::broadcast(ContentType::Umaa, Name::new(REPORT).unwrap(), out.source());
        let instance = aldis_envelope::Instance::of_number(id.parse().unwrap());
        let message = Message::new(Arc::new(label), Bytes::from(text.clone())).of_instance(instance);
        let change = if text.starts_with('-') { Change::Dispose } else { Change::Put };
        out.send(Message { change, ..message });
    });
    probe(source(1, 5), &["go"], act)
}

/// The last that a probe has heard of each instance.
fn last_of_each(heard: &Seen) -> BTreeMap<u64, Said> {
    let lines = seen(heard);
    let words = lines.iter().filter_map(|line| line.split('"').nth(1));
    let said = words.filter_map(|word| {
        let (id, number) = word.trim_start_matches('-').split_once(':')?;
        Some((id.parse().ok()?, (!word.starts_with('-')).then_some(number.parse().ok()?)))
    });
    said.collect()
}

#[test]
fn whatever_was_heard_outlives_every_crash() {
    for seed in 0..25 {
        crashes(seed, DiskFaults::default());
        crashes(seed, DiskFaults { sync_fails: 0.1, write_fails: 0.1, ..DiskFaults::default() });
    }
}

fn now(seconds: u64) -> Now {
    let monotonic = Monotonic::since_start(Duration::from_secs(seconds));
    Now { monotonic, wall: aldis_envelope::Wall(1_000_000_000_000 + seconds as i64) }
}

fn turn(node: &mut Node, seconds: u64, mut events: Vec<Event>) -> Vec<Effect> {
    let mut effects = Vec::new();
    node.handle(now(seconds), &mut events, &mut effects);
    effects
}

fn batches(effects: &[Effect]) -> Vec<(u64, Batch)> {
    let batch = |effect: &Effect| match effect {
        Effect::Append(number, batch) => Some((*number, batch.clone())),
        _ => None,
    };
    effects.iter().filter_map(batch).collect()
}

fn journal(event: JournalEvent) -> Event {
    Event::Journal(event)
}

fn all(start: u64) -> Event {
    journal(JournalEvent::RecoveredAll(Recovered { start, is_kept: true, ..Recovered::default() }))
}

fn words(words: &str) -> Event {
    let message = Bytes::from(format!("go$lmcp|go||0|0${words}"));
    Event::Peer(BridgeId(0), PeerId(1), PeerEvent::Message(message))
}

#[test]
fn a_node_starts_when_its_journal_is_begun_and_its_boot_rises_by_the_starts() {
    let (spec, told) = writer(source(1, 5), REPORT, &["go"]);
    let node = || Node::new(with_bridge(1, vec![spec.clone()])).unwrap().with_journal();
    let mut first = node();
    let effects = turn(&mut first, 0, vec![Event::BusOpened, words("1")]);
    assert!(matches!(effects[..], [Effect::PauseInput(true)]));
    let effects = turn(&mut first, 1, vec![all(1)]);
    let begun = batches(&effects);
    assert_eq!((begun.len(), begun[0].0), (1, 1));
    assert_eq!(told.lock().unwrap().len(), 0, "not started");
    let effects = turn(&mut first, 1, vec![journal(JournalEvent::Written { up_to: 1 })]);
    assert!(effects.iter().any(|effect| matches!(effect, Effect::Subscribe(_))), "the bus opened before");
    assert!(effects.iter().any(|effect| matches!(effect, Effect::PauseInput(false))));
    assert_eq!(first.boot(), BootId(1_000_000_000_001 + 1));
    assert_eq!(batches(&effects).len(), 1, "the message that came before the start");
    let Operation::Put { space, key, value } = begun[0].1.operations()[0].clone() else { panic!("a put") };
    let mut second = node();
    // The clock has stepped back: the boot rises all the same.
    turn(&mut second, 0, vec![journal(JournalEvent::Recovered { space, key, value }), all(2)]);
    assert_eq!(second.boot(), BootId(1_000_000_000_001 + 2));
}

#[test]
fn one_turn_is_one_batch_and_forgets_what_it_supersedes_with_the_next() {
    let (spec, _) = writer(source(1, 5), REPORT, &["go"]);
    let mut node = Node::new(with_bridge(1, vec![spec])).unwrap().with_journal();
    turn(&mut node, 0, vec![all(1)]);
    turn(&mut node, 0, vec![journal(JournalEvent::Written { up_to: 1 })]);
    let first = batches(&turn(&mut node, 1, vec![words("1 2"), words("1"), words("-2")]));
    assert_eq!((first.len(), first[0].0, first[0].1.operations().len()), (1, 2, 4));
    let written = turn(&mut node, 1, vec![journal(JournalEvent::Written { up_to: 2 })]);
    assert_eq!(batches(&written).len(), 0, "forgetting alone is worth no sync");
    let second = batches(&turn(&mut node, 2, vec![words("3")]));
    let forgets =
        |batch: &Batch| batch.operations().iter().filter(|op| matches!(op, Operation::Forget { .. })).count();
    assert_eq!((second[0].1.operations().len(), forgets(&second[0].1)), (3, 2), "1 and 2 are superseded");
}

#[test]
fn a_journal_that_cannot_be_used_refuses_what_is_persistent_alone() {
    let (spec, told) = writer(source(1, 5), REPORT, &["go"]);
    let (plain, _) = writer(source(1, 6), "plain.Topic", &["plain"]);
    let mut node = Node::new(with_bridge(1, vec![spec, plain])).unwrap().with_journal();
    let newer = Unusable::Newer { file: "00000001.journal".into(), version: 9 };
    turn(&mut node, 0, vec![Event::BusOpened, journal(JournalEvent::Unusable(newer))]);
    assert_eq!(node.boot(), BootId(1), "as the shell said");
    let plain = Bytes::from_static(b"plain$lmcp|plain||0|0$3");
    let plain = Event::Peer(BridgeId(0), PeerId(1), PeerEvent::Message(plain));
    let effects = turn(&mut node, 1, vec![words("?7"), plain]);
    let line = told.lock().unwrap().last().unwrap().clone();
    assert!(line.starts_with("confirmed 7 Err(NotKept(\"00000001.journal has format 9"), "{line}");
    let published =
        |effect: &&Effect| matches!(effect, Effect::PublishOn(key, _) if key.contains("plain/Topic"));
    assert_eq!(effects.iter().filter(published).count(), 1);
    assert_eq!(batches(&effects).len(), 0);
}

#[test]
fn of_a_damaged_journal_what_is_whole_is_kept_and_the_rest_named() {
    let (spec, told) = writer(source(1, 5), REPORT, &["go"]);
    let mut node = Node::new(with_bridge(1, vec![spec])).unwrap().with_journal();
    let label = Label::broadcast(ContentType::Umaa, Name::new(REPORT).unwrap(), source(1, 5));
    let message = Message::new(Arc::new(label), Bytes::from_static(b"whole"));
    let whole = crate::dds::Record::encode(&message, aldis_envelope::Wall(5)).unwrap();
    let record = |number: u64, value: Bytes| {
        let key = Bytes::from(number.to_be_bytes().to_vec());
        journal(JournalEvent::Recovered { space: 1, key, value })
    };
    let begun = JournalEvent::Recovered {
        space: 2,
        key: Bytes::from_static(b"begun"),
        value: Bytes::from(7_u64.to_be_bytes().to_vec()),
    };
    let damage = Damage {
        file: "00000001.journal".into(),
        offset: 64,
        bytes: 80,
        kind: DamageKind::Lost { batches: Some(2) },
    };
    let recovered = Recovered { start: 3, is_kept: true, damage: vec![damage], ..Recovered::default() };
    let newer = Bytes::from_static(&[200, 1, 2]);
    let events = vec![
        journal(begun),
        record(4, newer),
        record(9, whole),
        journal(JournalEvent::RecoveredAll(recovered)),
    ];
    let effects = turn(&mut node, 0, events);
    assert_eq!(node.boot(), BootId(10));
    assert_eq!(seen(&told), [format!("recovered eid1sid5 {REPORT} b\"whole\"")]);
    let says = |part: &str| {
        let is = |effect: &Effect| matches!(effect, Effect::Say(note) if note.text.contains(part));
        assert!(effects.iter().any(is), "{part}");
    };
    says("00000001.journal: 80 bytes from 64 on are damaged: 2 batches are lost");
    says("record 4 of the journal is not read: it has version 200");
    let next = batches(&turn(&mut node, 1, vec![words("1")]));
    assert!(
        matches!(&next[0].1.operations()[0], Operation::Put { key, .. } if key[..] == 10_u64.to_be_bytes()),
        "after all numbers that there are"
    );
}
