//! The samples of one stream that are still worth telling.

use super::qos::{Durability, Keep, Qos};
use aldis_envelope::{Change, Envelope, KeyHash};
use std::collections::{BTreeMap, VecDeque};

/// How many instances that have ended are remembered in a stream. Who was away while more of them ended may hold some of
/// them for alive.
const ENDED_MAX: usize = 10_000;

/// What is kept of one stream, by sequence.
#[derive(Debug)]
pub struct History {
    qos: Qos,
    samples: BTreeMap<u64, Envelope>,
    instances: BTreeMap<Option<KeyHash>, Vec<u64>>,
    /// Disposes and unregisters whose readers may still want what came before.
    ending: VecDeque<(u64, Option<KeyHash>)>,
    /// Those of which only the end itself is kept.
    ended: VecDeque<(u64, Option<KeyHash>)>,
    broken_upto: u64,
    shed: u64,
    records: Records,
}

/// The journal's records of the samples of one stream. Empty where its topic is not persistent.
#[derive(Debug, Default)]
struct Records {
    /// By sequence.
    held: BTreeMap<u64, u64>,
    /// Those of samples that are kept no longer.
    forgotten: Vec<u64>,
}

impl Records {
    fn sample_goes(&mut self, sequence: u64) {
        if !self.held.is_empty() {
            self.forgotten.extend(self.held.remove(&sequence));
        }
    }
}

/// A part of a history.
#[derive(Debug)]
pub(super) struct Page<'a> {
    /// The samples, by sequence.
    pub(super) samples: Vec<&'a Envelope>,
    /// The last sequence that the page speaks of.
    pub(super) upto: u64,
    /// Whether samples in it are gone that the topic promised to keep.
    pub(super) broken: bool,
}

impl History {
    pub(super) fn new(qos: Qos) -> Self {
        Self {
            qos,
            samples: BTreeMap::new(),
            instances: BTreeMap::new(),
            ending: VecDeque::new(),
            ended: VecDeque::new(),
            broken_upto: 0,
            shed: 0,
            records: Records::default(),
        }
    }

    /// Keeps a sample; what it supersedes goes.
    pub(super) fn add(&mut self, envelope: Envelope) {
        let sequence = envelope.stamp.sequence;
        let instance = instance_of(&envelope);
        let ends = envelope.message.change != Change::Put;
        self.samples.insert(sequence, envelope);
        let of_instance = self.instances.entry(instance).or_default();
        of_instance.push(sequence);
        if let Keep::Last(count) = self.qos.keep {
            let over = of_instance.len().saturating_sub(count.max(1) as usize);
            for superseded in of_instance.drain(..over) {
                self.samples.remove(&superseded);
                self.records.sample_goes(superseded);
            }
        }
        if ends {
            self.ending.push_back((sequence, instance));
        }
        while self.samples.len() > self.qos.samples_max {
            self.shed_oldest();
        }
    }

    /// Every reader that is there has all up to a sequence: what only they waited for goes.
    pub(super) fn settle(&mut self, floor: u64) {
        while let Some(&(sequence, instance)) = self.ending.front()
            && sequence <= floor
        {
            self.ending.pop_front();
            if let Some(of_instance) = self.instances.get_mut(&instance)
                && of_instance.contains(&sequence)
            {
                let keep_from = of_instance.partition_point(|&s| s < sequence);
                for superseded in of_instance.drain(..keep_from) {
                    self.samples.remove(&superseded);
                    self.records.sample_goes(superseded);
                }
                self.ended.push_back((sequence, instance));
            }
        }
        while self.ended.len() > ENDED_MAX {
            if let Some((sequence, instance)) = self.ended.pop_front() {
                self.remove(sequence, instance);
            }
        }
        if self.qos.durability == Durability::Volatile {
            while let Some((&sequence, _)) = self.samples.first_key_value()
                && sequence <= floor
            {
                self.remove_first();
            }
        }
    }

    fn shed_oldest(&mut self) {
        if let Some(sequence) = self.remove_first() {
            self.broken_upto = sequence;
            self.shed += 1;
        }
    }

    fn remove_first(&mut self) -> Option<u64> {
        let (&sequence, envelope) = self.samples.first_key_value()?;
        let instance = instance_of(envelope);
        self.remove(sequence, instance);
        Some(sequence)
    }

    /// The journal holds a sample under a number.
    pub(super) fn recorded(&mut self, sequence: u64, record: u64) {
        match self.samples.contains_key(&sequence) {
            true => drop(self.records.held.insert(sequence, record)),
            false => self.records.forgotten.push(record),
        }
    }

    /// Moves the records of samples that are kept no longer, in the order in which they went.
    pub(super) fn take_forgotten(&mut self, into: &mut Vec<u64>) {
        into.append(&mut self.records.forgotten);
    }

    fn remove(&mut self, sequence: u64, instance: Option<KeyHash>) {
        self.samples.remove(&sequence);
        self.records.sample_goes(sequence);
        if let Some(of_instance) = self.instances.get_mut(&instance) {
            of_instance.retain(|&s| s != sequence);
            if of_instance.is_empty() {
                self.instances.remove(&instance);
            }
        }
    }

    /// What is kept between two sequences, as much as fits a page.
    pub(super) fn page(&self, from: u64, upto: u64, samples_max: usize, bytes_max: usize) -> Page<'_> {
        let mut page = Page { samples: Vec::new(), upto, broken: from <= self.broken_upto };
        let mut bytes = 0;
        for (&sequence, envelope) in self.samples.range(from..=upto.max(from)) {
            bytes += envelope.message.content.len() + 64;
            if page.samples.len() >= samples_max || (bytes > bytes_max && !page.samples.is_empty()) {
                page.upto = sequence - 1;
                break;
            }
            page.samples.push(envelope);
        }
        page
    }

    /// All samples, by sequence.
    pub fn samples(&self) -> impl Iterator<Item = &Envelope> {
        self.samples.values()
    }

    /// The samples of instances that have not ended, by sequence; none where they are kept for the readers of the moment alone.
    pub fn living(&self) -> impl Iterator<Item = &Envelope> {
        let is_volatile = self.qos.durability == Durability::Volatile;
        let ends = self.samples.iter().filter(|(_, sample)| sample.message.change != Change::Put);
        let ends: BTreeMap<_, _> = ends.map(|(&sequence, sample)| (instance_of(sample), sequence)).collect();
        let is_living = move |sequence: &u64, sample: &Envelope| {
            !is_volatile && ends.get(&instance_of(sample)).is_none_or(|end| end < sequence)
        };
        self.samples.iter().filter(move |(sequence, sample)| is_living(sequence, sample)).map(|(_, s)| s)
    }

    /// How many were dropped against the topic's promise since this was last asked.
    pub(super) fn take_shed(&mut self) -> u64 {
        std::mem::take(&mut self.shed)
    }

    /// How many samples are kept.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether nothing is kept.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }
}

fn instance_of(sample: &Envelope) -> Option<KeyHash> {
    sample.message.instance.as_ref().map(|instance| instance.hash)
}

#[cfg(test)]
mod tests {
    use super::*;
    use aldis_envelope::{
        BootId, ContentType, EntityId, Instance, Label, Message, Name, Priority, ServiceId, Source, Stamp,
        Wall,
    };
    use bytes::Bytes;
    use std::sync::Arc;

    fn sample(sequence: u64, id: i64, change: Change) -> Envelope {
        let entity = EntityId::new(4).unwrap();
        let source = Source::new(entity, ServiceId::NODE);
        let label = Label::broadcast(ContentType::Umaa, Name::new("T").unwrap(), source);
        let message = Message::new(Arc::new(label), Bytes::new()).of_instance(Instance::of_number(id));
        let stamp = Stamp {
            node: entity,
            boot: BootId(1),
            sequence,
            source_time: Wall(0),
            lifespan_left_ms: None,
            priority: Priority::Data,
            skipped: 0,
            via: Default::default(),
        };
        Envelope { message: Message { change, ..message }, stamp }
    }

    fn history(durability: Durability, keep: Keep, samples_max: usize) -> History {
        History::new(Qos { durability, keep, samples_max })
    }

    fn kept(history: &History) -> Vec<u64> {
        history.samples.keys().copied().collect()
    }

    #[test]
    fn the_last_of_each_instance_are_kept() {
        let mut history = history(Durability::TransientLocal, Keep::Last(2), 100);
        for sequence in 1..=6 {
            history.add(sample(sequence, (sequence % 2) as i64, Change::Put));
        }
        assert_eq!(kept(&history), [3, 4, 5, 6]);
        let page = history.page(1, 6, 3, 1 << 20);
        assert_eq!((page.samples.len(), page.upto, page.broken), (3, 5, false));
    }

    #[test]
    fn an_end_supersedes_what_came_before_once_all_have_it() {
        let mut history = history(Durability::TransientLocal, Keep::All, 100);
        for sequence in 1..=3 {
            history.add(sample(sequence, 7, Change::Put));
        }
        history.add(sample(4, 7, Change::Dispose));
        history.settle(3);
        assert_eq!(kept(&history), [1, 2, 3, 4], "somebody still waits for the end");
        history.settle(4);
        assert_eq!(kept(&history), [4]);
        history.add(sample(5, 7, Change::Put));
        assert_eq!(kept(&history), [4, 5], "alive again");
    }

    #[test]
    fn the_records_of_what_goes_are_told_in_the_order_in_which_it_went() {
        let mut history = history(Durability::Persistent, Keep::Last(1), 3);
        let mut forgotten = Vec::new();
        for (sequence, id) in [(1, 7), (2, 8), (3, 7), (4, 9), (5, 10)] {
            history.add(sample(sequence, id, Change::Put));
            history.recorded(sequence, 100 + sequence);
        }
        history.take_forgotten(&mut forgotten);
        assert_eq!(forgotten, [101, 102], "superseded, then shed by the limit");
        history.add(sample(6, 7, Change::Dispose));
        history.recorded(6, 106);
        history.recorded(5000, 200);
        history.take_forgotten(&mut forgotten);
        assert_eq!(forgotten[2..], [103, 200], "what was never kept is forgotten at once");
        assert_eq!(history.living().map(|s| s.stamp.sequence).collect::<Vec<_>>(), [4, 5]);
    }

    #[test]
    fn what_ended_and_came_again_lives() {
        let mut history = history(Durability::TransientLocal, Keep::All, 100);
        for (sequence, change) in [(1, Change::Put), (2, Change::Unregister), (3, Change::Put)] {
            history.add(sample(sequence, 7, change));
        }
        assert_eq!(history.living().map(|s| s.stamp.sequence).collect::<Vec<_>>(), [3]);
    }

    #[test]
    fn volatile_samples_go_when_all_have_them() {
        let mut history = history(Durability::Volatile, Keep::All, 100);
        (1..=5).for_each(|sequence| history.add(sample(sequence, 1, Change::Put)));
        history.settle(3);
        assert_eq!(kept(&history), [4, 5]);
        history.settle(5);
        assert!(history.is_empty() && history.instances.is_empty());
    }

    #[test]
    fn over_the_limit_the_oldest_go_and_the_page_says_so() {
        let mut history = history(Durability::TransientLocal, Keep::All, 3);
        (1..=5).for_each(|sequence| history.add(sample(sequence, sequence as i64, Change::Put)));
        assert_eq!(kept(&history), [3, 4, 5]);
        assert_eq!((history.take_shed(), history.take_shed()), (2, 0));
        assert!(history.page(2, 5, 10, 1 << 20).broken);
        assert!(!history.page(3, 5, 10, 1 << 20).broken);
    }

    #[test]
    fn ends_are_remembered_within_a_limit() {
        let mut history = history(Durability::TransientLocal, Keep::Last(1), 1 << 20);
        let count = ENDED_MAX as u64 + 10;
        for sequence in 1..=count {
            history.add(sample(sequence, sequence as i64, Change::Dispose));
        }
        history.settle(count);
        assert_eq!(history.len(), ENDED_MAX);
        assert_eq!(history.samples().next().unwrap().stamp.sequence, 11);
    }
}
