use super::*;
use crate::link::body::Origin;
use crate::link::held::Held;
use crate::link::names::{Definition, Names};
use aldis_envelope::{BootId, EntityId};
use proptest::prelude::*;

/// Under a rule without a limit.
const SHARE: (u32, u8) = (0, 100);
const FREE: (Duration, (u32, u8)) = (Duration::ZERO, SHARE);

fn at(seconds: u64) -> Monotonic {
    Monotonic::since_start(Duration::from_secs(seconds))
}

fn sample(sequence: u64, time: i64, since: u64) -> Sample {
    let content = Bytes::from_static(&[5; 24]);
    let (change, expires, since) = (Change::Put, None, at(since));
    Sample { origin: 0, sequence, time, change, content, expires, since }
}

fn entry() -> InstanceEntry {
    InstanceEntry { label: 1, instance: None, usual: 24 }
}

fn drain(states: &mut States, now: u64) -> Vec<(u32, u64)> {
    let mut sent = Vec::new();
    while let Some((number, sample)) = states.next(at(now)) {
        states.sent(number, at(now), Duration::ZERO);
        sent.push((number, sample.sequence));
    }
    sent
}

#[test]
fn only_the_newest_is_sent_and_what_is_lost_is_sent_again() {
    let mut states = States::default();
    assert!(states.offer(3, sample(1, 0, 0), FREE, true));
    assert!(states.offer(3, sample(2, 0, 0), FREE, true));
    assert!(!states.offer(3, sample(1, 0, 0), FREE, true));
    states.offer(1, sample(7, 0, 0), FREE, true);
    assert_eq!(drain(&mut states, 0), [(1, 7), (3, 2)]);
    states.lost(3, 0, 2);
    assert_eq!(drain(&mut states, 0), [(3, 2)]);
    states.offer(3, sample(3, 0, 0), FREE, true);
    assert_eq!(drain(&mut states, 0), [(3, 3)]);
    states.lost(3, 0, 2);
    states.arrived(3, 0, 3);
    states.arrived(1, 0, 7);
    assert!(states.is_settled());
}

#[test]
fn a_share_holds_back_what_is_under_its_rule_alone() {
    let mut states = States::default();
    let tenth = (Duration::ZERO, (1, 10));
    for number in 0..3 {
        states.offer(number, sample(1, 0, 0), tenth, true);
    }
    states.offer(3, sample(1, 0, 0), FREE, true);
    let mut sent = Vec::new();
    while let Some((number, _)) = states.next(at(0)) {
        states.sent(number, at(0), Duration::from_secs(1));
        sent.push(number);
    }
    assert_eq!(sent, [0, 3], "the first has taken a tenth of ten seconds");
    assert_eq!(states.deadline(), Some(at(10)));
    states.tick(at(10));
    assert_eq!(states.next(at(10)).map(|(number, _)| number), Some(1));
}

#[test]
fn of_a_stream_the_newest_sample_alone_waits() {
    let mut states = States::default();
    for number in 0..4 {
        states.offer(number, sample(1, 0, 0), FREE, true);
        states.supersede(number, |other| other < 3);
    }
    assert_eq!(
        drain(&mut states, 0),
        [(3, 1)],
        "three belongs to another stream, and supersedes those before it"
    );
    states.offer(2, sample(2, 0, 0), FREE, true);
    assert_eq!(drain(&mut states, 0), [(2, 2)]);
}

#[test]
fn what_is_on_the_air_alone_goes_once_more_and_not_twice() {
    let mut states = States::default();
    states.offer(0, sample(1, 0, 0), FREE, true);
    assert_eq!(drain(&mut states, 0), [(0, 1)]);
    assert_eq!(states.lonely_since(), Some(at(0)));
    states.again(at(1));
    assert_eq!(drain(&mut states, 1), [(0, 1)]);
    assert_eq!(states.lonely_since(), None);
    states.arrived(0, 0, 1);
    assert!(states.is_settled());
}

#[test]
fn an_interval_and_missing_names_hold_samples_back() {
    let mut states = States::default();
    let interval = Duration::from_secs(2);
    states.offer(0, sample(1, 0, 0), (interval, SHARE), false);
    assert!(drain(&mut states, 0).is_empty());
    states.name(|_, _| true);
    assert_eq!(drain(&mut states, 0), [(0, 1)]);
    states.offer(0, sample(2, 0, 1), (interval, SHARE), true);
    states.offer(0, sample(3, 0, 1), (interval, SHARE), true);
    assert!(drain(&mut states, 1).is_empty());
    assert_eq!(states.deadline(), Some(at(2)));
    states.tick(at(2));
    assert_eq!(drain(&mut states, 2), [(0, 3)]);
}

#[test]
fn digests_tell_what_differs() {
    let mut states = States::default();
    let (mut held, names) = (Held::default(), Names::default());
    for number in 0..40 {
        states.offer(number, sample(9, 0, 0), FREE, true);
        held.take(&names, number, 0, 9, 0);
    }
    for (number, sequence) in drain(&mut states, 0) {
        states.arrived(number, 0, sequence);
    }
    let digests = |states: &States, held: &Held| (states.digest().1.whole(), held.digest().1.whole());
    let (ours, theirs) = digests(&states, &held);
    assert_eq!(ours, theirs);
    held.take(&names, 17, 0, 10, 0);
    let (ours, theirs) = digests(&states, &held);
    assert_ne!(ours, theirs);
    states.doubt(&held.digest().1.encode());
    let again = drain(&mut states, 0);
    assert!(again.contains(&(17, 9)) && again.len() == 8, "{again:?}");
}

proptest! {
    #[test]
    fn the_short_form_says_what_the_long_one_does(
        steps in prop::collection::btree_map(0u32..900, (1u64..127, 0i64..16_000 * SHORT_TIME_US), 1..30),
        held_sequence in 1u64..100_000,
        held_time in -1_000_000_000_000i64..2_000_000_000_000_000,
    ) {
        let (mut states, mut held, mut names) = (States::default(), Held::default(), Names::default());
        let origin = Origin { node: EntityId::new(1).unwrap(), boot: BootId(1), via: Default::default() };
        names.insert(0, Definition::Origin(origin)).ok();
        for (&number, &(sequence, time)) in &steps {
            names.insert(number, Definition::Instance(entry())).ok();
            states.offer(number, sample(held_sequence, held_time, 0), FREE, true);
            states.sent(number, at(0), Duration::ZERO);
            states.arrived(number, 0, held_sequence);
            held.take(&names, number, 0, held_sequence, held_time);
            states.offer(number, sample(held_sequence + sequence, held_time + time, 0), FREE, true);
        }
        let (mut block, mut before) = (Vec::new(), None);
        for &number in steps.keys() {
            block.extend(states.short(number, &entry(), before, at(20)).unwrap());
            before = Some(number);
        }
        let read = held.read_short(&names, &block).unwrap();
        let told: Vec<_> = read.iter().map(|s| (s.number, s.sequence, s.time)).collect();
        let units = |time: i64| time.div_euclid(SHORT_TIME_US) * SHORT_TIME_US;
        let meant: Vec<_> = steps.iter().map(|(&n, &(s, t))| (n, held_sequence + s, units(held_time + t))).collect();
        prop_assert_eq!(told, meant);
    }

    #[test]
    fn strange_blocks_are_refused(block: Vec<u8>) {
        let (mut held, mut names) = (Held::default(), Names::default());
        names.insert(0, Definition::Instance(entry())).ok();
        held.take(&names, 0, 0, 1, 0);
        let _ = held.read_short(&names, &block);
    }
}
