//! A writer's and a reader's node over a channel that loses, doubles and reorders, from a seed.

use super::*;
use aldis_envelope::aldis::dds::{Ask, Confirm, History as Told, Readers, Streams};
use aldis_envelope::{
    Address, Change, ContentType, Envelope, Instance, Label, Message, Monotonic, Name, Prefix, Priority,
    ServiceId, Source, Stamp, Wall,
};
use bytes::Bytes;
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

enum Word {
    Sample(Envelope),
    Readers(Readers),
    Streams(Streams),
    Ask(Ask),
    Told(Told),
    Confirm(Confirm),
}

const TOPIC: &str = "UMAA::SO::T::TReport";

/// A writer's node and a reader's, with the channel between them.
struct Pair {
    now: Monotonic,
    random: fastrand::Rng,
    /// Of a hundred words, how many are lost and how many come twice.
    faults: (u32, u32),
    writers: Writers,
    reading: Reading,
    qos: Qos,
    under_way: BTreeMap<(Monotonic, u64), (bool, Word)>,
    words: u64,
    written: u64,
    /// What the reader's services have got: sequence, instance, change.
    got: Vec<(u64, i64, Change)>,
    lost: u64,
}

fn participant(entity: u64) -> Participant {
    Participant { node: EntityId::new(entity).unwrap(), boot: BootId(1) }
}

impl Pair {
    fn new(seed: u64, qos: Qos, faults: (u32, u32)) -> Self {
        Self {
            now: Monotonic::START,
            random: fastrand::Rng::with_seed(seed),
            faults,
            writers: Writers::default(),
            reading: Reading::default(),
            qos,
            under_way: BTreeMap::new(),
            words: 0,
            written: 0,
            got: Vec::new(),
            lost: 0,
        }
    }

    fn send(&mut self, to_writer: bool, word: impl Fn() -> Word) {
        let times = match self.random.u32(0..100) {
            drawn if drawn < self.faults.0 => 0,
            drawn if drawn < self.faults.0 + self.faults.1 => 2,
            _ => 1,
        };
        for _ in 0..times {
            let delay = Duration::from_millis(self.random.u64(1..50));
            self.words += 1;
            self.under_way.insert((self.now + delay, self.words), (to_writer, word()));
        }
    }

    fn write(&mut self, id: i64, change: Change) -> Envelope {
        self.written += 1;
        let writer = participant(4);
        let source = Source::new(writer.node, ServiceId::HEALTH);
        let label = Label::broadcast(ContentType::Umaa, Name::new(TOPIC).unwrap(), source);
        let content = Bytes::copy_from_slice(&self.written.to_be_bytes());
        let message = Message::new(Arc::new(label), content).of_instance(Instance::of_number(id));
        let stamp = Stamp {
            node: writer.node,
            boot: writer.boot,
            sequence: self.written,
            source_time: Wall(0),
            lifespan_left_ms: None,
            priority: Priority::Data,
            skipped: 0,
            via: Default::default(),
        };
        let envelope = Envelope { message: Message { change, ..message }, stamp };
        self.writers.wrote(self.now, self.qos, true, &envelope);
        let sent = envelope.clone();
        self.send(false, || Word::Sample(sent.clone()));
        envelope
    }

    fn announce(&mut self) {
        let prefixes = vec![Prefix::new("UMAA::").unwrap()];
        let readers = Readers { number: 1, reliable: true, lease_ms: 10_000, prefixes };
        self.send(true, || Word::Readers(readers.clone()));
    }

    fn run_for(&mut self, time: Duration) {
        let end = self.now + time;
        while let Some(next) = self.next().filter(|next| *next <= end) {
            self.now = next.max(self.now);
            while let Some(first) = self.under_way.first_entry()
                && first.key().0 <= self.now
            {
                let (_, word) = first.remove();
                self.take(word);
            }
            let (reminders, _) = self.writers.due(self.now);
            for (_, streams) in reminders {
                self.send(false, || Word::Streams(streams.clone()));
            }
            let mut step = Step::default();
            self.reading.due(self.now, true, &mut step);
            self.finish(step);
        }
        self.now = end;
    }

    fn next(&self) -> Option<Monotonic> {
        let word = self.under_way.first_key_value().map(|((at, _), _)| *at);
        [word, self.writers.next_deadline(), self.reading.next_deadline()].into_iter().flatten().min()
    }

    fn take(&mut self, word: Word) {
        let (writer, reader) = (participant(4), participant(5));
        let mut step = Step::default();
        let (now, qos) = (self.now, self.qos);
        match word {
            Word::Sample(envelope) => self.reading.sample(now, qos, &envelope, &mut step),
            Word::Streams(streams) => {
                self.reading.ends(now, writer, &streams.ends, |_: &Address| Some(qos), &mut step)
            }
            Word::Told(told) => self.reading.told(now, writer, told, &mut step),
            Word::Readers(readers) => {
                for streams in self.writers.announced(now, reader, readers).0 {
                    self.send(false, || Word::Streams(streams.clone()));
                }
            }
            Word::Ask(ask) => {
                if let Some(told) = self.writers.asked(now, reader, &ask) {
                    self.send(false, || Word::Told(told.clone()));
                }
            }
            Word::Confirm(confirm) => drop(self.writers.confirmed(now, reader, &confirm)),
        }
        self.finish(step);
    }

    fn finish(&mut self, step: Step) {
        self.lost += step.lost;
        for envelope in step.deliver {
            let key: [u8; 8] = envelope.message.instance.as_ref().unwrap().hash.0[..8].try_into().unwrap();
            self.got.push((envelope.stamp.sequence, i64::from_be_bytes(key), envelope.message.change));
        }
        for (_, ask) in step.ask {
            self.send(true, || Word::Ask(ask.clone()));
        }
        for (_, confirm) in self.reading.confirmations(self.now, true) {
            self.send(true, || Word::Confirm(confirm.clone()));
        }
    }

    /// Lets everything arrive: the channel is good now, and readers announce themselves again.
    fn heal(&mut self) {
        self.faults = (0, 0);
        self.announce();
        self.run_for(Duration::from_secs(30));
    }
}

fn qos(keep: Keep) -> Qos {
    Qos { durability: Durability::TransientLocal, keep, samples_max: 100_000 }
}

fn changes() -> impl Strategy<Value = Vec<(i64, Change)>> {
    let change =
        prop_oneof![6 => Just(Change::Put), 1 => Just(Change::Dispose), 1 => Just(Change::Unregister)];
    proptest::collection::vec((0_i64..6, change), 1..80)
}

proptest! {
    #[test]
    fn every_sample_arrives_once_and_in_order(
        seed: u64, loss in 0_u32..40, doubled in 0_u32..20, changes in changes(),
    ) {
        let mut pair = Pair::new(seed, qos(Keep::All), (loss, doubled));
        pair.faults = (0, 0);
        pair.announce();
        pair.run_for(Duration::from_millis(100));
        pair.faults = (loss, doubled);
        let mut expected = Vec::new();
        for (id, change) in changes {
            let envelope = pair.write(id, change);
            expected.push((envelope.stamp.sequence, id, change));
            let pause = pair.random.u64(0..30);
            pair.run_for(Duration::from_millis(pause));
        }
        pair.heal();
        prop_assert_eq!(&pair.got, &expected);
        prop_assert_eq!(pair.lost, 0);
    }

    #[test]
    fn a_late_joiner_ends_with_the_same_instances(
        seed: u64, loss in 0_u32..40, join in 0_usize..80, changes in changes(),
    ) {
        let mut pair = Pair::new(seed, qos(Keep::Last(1)), (loss, 5));
        let mut state: BTreeMap<i64, Change> = BTreeMap::new();
        for (place, (id, change)) in changes.into_iter().enumerate() {
            if place == join {
                pair.announce();
            }
            if place < join {
                pair.faults.0 = 100;
            } else {
                pair.faults.0 = loss;
            }
            pair.write(id, change);
            state.insert(id, change);
            pair.run_for(Duration::from_millis(10));
        }
        pair.heal();
        prop_assert!(pair.got.windows(2).all(|pair| pair[0].0 < pair[1].0), "in order, once: {:?}", pair.got);
        let seen: BTreeMap<i64, Change> = pair.got.iter().map(|&(_, id, change)| (id, change)).collect();
        prop_assert_eq!(seen, state);
        prop_assert_eq!(pair.lost, 0);
    }
}

#[test]
fn a_confirmation_waits_for_every_reliable_reader_and_for_no_longer_than_it_may() {
    let mut pair = Pair::new(1, qos(Keep::Last(1)), (0, 0));
    pair.announce();
    pair.run_for(Duration::from_millis(100));
    let sample = pair.write(1, Change::Put);
    let source = sample.message.label.source();
    assert_eq!(pair.writers.confirm((source, 7), &sample, &[], pair.now + Duration::from_secs(5)), None);
    let confirm = Confirm { to: BootId(1), upto: vec![(writers::name_of(&sample).unwrap(), 1)] };
    let confirmed = pair.writers.confirmed(pair.now, participant(5), &confirm);
    assert_eq!(confirmed, [Confirmed { source, number: 7, outcome: Ok(()) }]);
    // Who has it already does not hold it up; who has it not is named.
    assert!(pair.writers.confirm((source, 8), &sample, &[], pair.now).is_some());
    let sample = pair.write(1, Change::Put);
    assert_eq!(pair.writers.confirm((source, 9), &sample, &[], pair.now + Duration::from_secs(5)), None);
    let (_, confirmed) = pair.writers.due(pair.now + Duration::from_secs(5));
    let missing = vec![EntityId::new(5).unwrap()];
    let outcome = Err(crate::service::Unconfirmed::Missing { missing });
    assert_eq!(confirmed, [Confirmed { source, number: 9, outcome }]);
    // A reader that is not heard for its lease is waited for no longer.
    let sample = pair.write(1, Change::Put);
    assert_eq!(pair.writers.confirm((source, 10), &sample, &[], pair.now + Duration::from_secs(60)), None);
    let (_, confirmed) = pair.writers.due(pair.now + Duration::from_secs(11));
    assert_eq!(confirmed, [Confirmed { source, number: 10, outcome: Ok(()) }]);
}

#[test]
fn what_claims_to_come_from_far_ahead_is_given_up_within_a_bound() {
    let mut pair = Pair::new(1, qos(Keep::All), (100, 0));
    let mut sample = pair.write(1, Change::Put);
    sample.stamp.sequence = 1 << 40;
    let mut step = Step::default();
    pair.reading.sample(pair.now, pair.qos, &sample, &mut step);
    assert!(step.deliver.is_empty());
    pair.finish(step);
    pair.run_for(Duration::from_secs(80));
    assert_eq!(pair.got.len(), 1);
    assert_eq!(pair.lost, (1 << 40) - 1);
    let mut beyond = sample.clone();
    beyond.stamp.sequence = u64::MAX;
    let mut step = Step::default();
    pair.reading.sample(pair.now, pair.qos, &beyond, &mut step);
    assert_eq!(step.deliver.len(), 1, "handed on, not followed");
}

/// What a reader makes of samples, as the numbers in their contents.
fn hear(reading: &mut Reading, now: Monotonic, samples: &[Envelope]) -> Vec<u64> {
    let mut step = Step::default();
    samples.iter().for_each(|sample| reading.sample(now, qos(Keep::All), sample, &mut step));
    let number = |envelope: &Envelope| u64::from_be_bytes(envelope.message.content[..].try_into().unwrap());
    step.deliver.iter().map(number).collect()
}

#[test]
fn one_confirmation_speaks_for_many_samples_unless_their_writer_asks() {
    let mut pair = Pair::new(1, qos(Keep::All), (0, 0));
    let samples: Vec<_> = (0..4).map(|id| pair.write(id, Change::Put)).collect();
    let (mut reading, now) = (Reading::default(), pair.now);
    let upto = |confirms: Vec<(Participant, Confirm)>| {
        confirms.into_iter().flat_map(|(_, confirm)| confirm.upto).map(|(_, upto)| upto).collect::<Vec<_>>()
    };
    hear(&mut reading, now, &samples[..3]);
    assert!(reading.confirmations(now, true).is_empty());
    let due = reading.next_deadline().unwrap();
    assert_eq!(upto(reading.confirmations(due, true)), [3]);
    let ends = [(writers::name_of(&samples[3]).unwrap(), 4)];
    let mut step = Step::default();
    reading.ends(due, participant(4), &ends, |_: &Address| Some(qos(Keep::All)), &mut step);
    assert_eq!(upto(reading.confirmations(due, true)), [3], "it says what it has");
    hear(&mut reading, due, &samples[3..]);
    assert_eq!(upto(reading.confirmations(due, true)), [4], "what is waited for is said at once");
    assert_eq!(reading.next_deadline(), None);
}

#[test]
fn who_stayed_hears_of_each_instance_that_is_there_the_last_sample_once_more() {
    let mut pair = Pair::new(1, qos(Keep::All), (0, 0));
    let changes =
        [(1, Change::Put), (1, Change::Put), (2, Change::Put), (2, Change::Dispose), (1, Change::Put)];
    let written: Vec<_> = changes.into_iter().map(|(id, change)| pair.write(id, change)).collect();
    let mut reading = Reading::default();
    assert_eq!(hear(&mut reading, pair.now, &written[..4]), [1, 2, 3, 4]);
    // The next life has both samples of the first instance and the end of the second, and says something new then.
    let again = [&written[0], &written[1], &written[3], &written[4]].into_iter().zip(1..);
    let again: Vec<_> = again
        .map(|(sample, sequence)| {
            let mut sample = sample.clone();
            (sample.stamp.boot, sample.stamp.sequence) = (BootId(2), sequence);
            sample
        })
        .collect();
    let (later, ends) =
        (Participant { boot: BootId(2), ..participant(4) }, [(writers::name_of(&again[0]).unwrap(), 4)]);
    let mut step = Step::default();
    reading.ends(pair.now, later, &ends, |_: &Address| Some(qos(Keep::All)), &mut step);
    assert_eq!(hear(&mut reading, pair.now, &again), [2, 5]);
}
