//! Every node has a reader of everything: what it reads comes in order and once, and after all faults have ended it holds what
//! every other one holds.

use super::wrote::Wrote;
use crate::service::{Input, Outbox, Service};
use crate::sim::observe::{Checker, Fact, Facts, Observation, Seen};
use aldis_envelope::{
    BootId, Change, EntityId, Envelope, KeyHash, Monotonic, Now, Prefix, ServiceId, Source, Wall,
};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// What was written so short before the end may not have come everywhere.
const ON_ITS_WAY: Duration = Duration::from_secs(8);

/// A reader has read something that was not to come, or not then.
#[derive(Debug, Clone, PartialEq, Eq)]
struct OutOfOrder(String);

impl Fact for OutOfOrder {}

/// An instance by its topic, its key and its writer.
type InstanceId = (String, KeyHash, Source);

/// What was last heard of an instance: whether it is there, and with what content.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Last {
    is_there: bool,
    content: u32,
}

impl Last {
    fn of(envelope: &Envelope) -> Self {
        let message = &envelope.message;
        let is_there = message.change == Change::Put;
        Self { is_there, content: if is_there { crc32fast::hash(&message.content) } else { 0 } }
    }
}

fn id_of(envelope: &Envelope) -> Option<InstanceId> {
    let (label, instance) = (&envelope.message.label, envelope.message.instance.as_ref()?);
    Some((label.descriptor().to_owned(), instance.hash, label.source()))
}

/// What the readers of all nodes hold, by node.
#[derive(Debug, Clone, Default)]
pub(super) struct Board(Arc<Mutex<BTreeMap<EntityId, BTreeMap<InstanceId, Last>>>>);

impl Board {
    fn with<T>(&self, act: impl FnOnce(&mut BTreeMap<EntityId, BTreeMap<InstanceId, Last>>) -> T) -> T {
        act(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// What has been told of the writers of a node, over its lives.
#[derive(Debug, Clone, Default)]
pub(super) struct Told(Arc<Mutex<BTreeMap<InstanceId, InstanceTold>>>);

#[derive(Debug, Default)]
struct InstanceTold {
    /// Each sample with the life that said it last.
    samples: BTreeMap<Sample, BootId>,
    last: Option<Sample>,
}

/// A sample of an instance: when its source sent it, and a hash of what it says and does.
type Sample = (Wall, u32);

impl Told {
    /// Whether a sample is to be told: a new one, or the last one again, which a new life retains. What one life says twice is
    /// new each time: statuses of one moment are alike.
    fn is_to_be_told(&self, id: &InstanceId, envelope: &Envelope) -> bool {
        let Envelope { message, stamp } = envelope;
        let what = (message.change == Change::Put).then(|| crc32fast::hash(&message.content));
        let sample = (stamp.source_time, what.unwrap_or(message.change as u32));
        let mut told = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let told = told.entry(id.clone()).or_default();
        let is_new = told.samples.insert(sample, stamp.boot).is_none_or(|life| life == stamp.boot);
        if is_new {
            told.last = Some(sample);
        }
        is_new || told.last == Some(sample)
    }
}

/// The reader of a node. What services of the node itself write it hears as soon as that is on disk, and tells.
pub(super) struct Mirror {
    node: EntityId,
    board: Board,
    facts: Facts,
    told: Told,
    /// The last boot and sequence of each stream.
    streams: BTreeMap<(Source, String), (u64, u64)>,
    /// The last boot of each writer.
    boots: BTreeMap<Source, u64>,
}

impl Mirror {
    pub(super) fn new(node: EntityId, board: Board, facts: Facts, told: Told) -> Self {
        Self { node, board, facts, told, streams: BTreeMap::new(), boots: BTreeMap::new() }
    }

    fn read(&mut self, envelope: &Envelope) {
        let Some(id) = id_of(envelope) else { return };
        let is_kept = id.2.service >= ServiceId::ALLOCATION;
        if id.2.entity == self.node && is_kept && self.told.is_to_be_told(&id, envelope) {
            self.facts.tell(Wrote(envelope.clone()));
        }
        let now = (envelope.stamp.boot.0, envelope.stamp.sequence);
        if let Some(before) = self.streams.insert((id.2, id.0.clone()), now)
            && before >= now
        {
            let text = format!("node {} reads {now:?} of {} by {} after {before:?}", self.node, id.0, id.2);
            self.facts.tell(OutOfOrder(text));
        }
        let before = self.boots.insert(id.2, now.0);
        self.board.with(|board| {
            let held = board.entry(self.node).or_default();
            if before.is_some_and(|before| before < now.0) {
                // A writer that has started again tells anew what it retains: the rest has gone with its former life.
                held.retain(|(_, _, writer), _| *writer != id.2);
            }
            held.insert(id, Last::of(envelope));
        });
    }
}

impl Service for Mirror {
    fn subscriptions(&self) -> Vec<Prefix> {
        Prefix::new("UMAA::").into_iter().collect()
    }

    fn handle(&mut self, _: Now, input: Input<'_>, _: &mut Outbox) {
        match input {
            Input::Started => self.board.with(|board| drop(board.insert(self.node, BTreeMap::new()))),
            Input::Message(envelope) if envelope.message.call.is_none() => self.read(envelope),
            _ => {}
        }
    }
}

/// Compares what readers hold with what was written.
pub(super) struct Mirrors {
    board: Board,
    written: BTreeMap<InstanceId, (Monotonic, Last)>,
    now: Monotonic,
}

impl Mirrors {
    pub(super) fn new(board: Board) -> Self {
        Self { board, written: BTreeMap::new(), now: Monotonic::START }
    }
}

impl Checker for Mirrors {
    fn name(&self) -> &'static str {
        "retained"
    }

    fn observe(&mut self, observation: &Observation<'_>) -> Result<(), String> {
        self.now = observation.at;
        let Seen::Fact(fact) = &observation.seen else { return Ok(()) };
        if let Some(OutOfOrder(what)) = fact.downcast() {
            return Err(what.clone());
        }
        if let Some(Wrote(envelope)) = fact.downcast()
            && let Some(id) = id_of(envelope)
        {
            self.written.insert(id, (observation.at, Last::of(envelope)));
        }
        Ok(())
    }

    fn finish(&mut self) -> Vec<String> {
        let mut wrong = Vec::new();
        let gone = Last { is_there: false, content: 0 };
        let settled = self.written.iter().filter(|(_, (at, _))| *at + ON_ITS_WAY < self.now);
        let settled: Vec<_> = settled.collect();
        self.board.with(|board| {
            for (node, held) in board {
                for (id, (_, last)) in &settled {
                    let held = held.get(*id).copied().unwrap_or(gone);
                    if held != *last {
                        let (topic, instance, writer) = id;
                        wrong.push(format!(
                            "node {node} holds {held:?} of {instance} of {topic} by {writer}, which wrote {last:?}"
                        ));
                    }
                }
            }
        });
        wrong
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aldis_envelope::{ContentType, Instance, Label, Message, Name, Priority, Stamp};
    use bytes::Bytes;

    fn said(boot: u64, sequence: u64, content: &'static str) -> Envelope {
        let writer = Source::new(EntityId::new(1).unwrap(), ServiceId::ALLOCATION);
        let label = Label::broadcast(ContentType::Umaa, Name::new("UMAA::SO::X::X").unwrap(), writer);
        let message = Message::new(Arc::new(label), Bytes::from_static(content.as_bytes()));
        let stamp = Stamp {
            node: writer.entity,
            boot: BootId(boot),
            sequence,
            source_time: Wall(5),
            lifespan_left_ms: None,
            priority: Priority::Data,
            skipped: 0,
            via: Default::default(),
        };
        Envelope { message: message.of_instance(Instance::of_number(1)), stamp }
    }

    #[test]
    fn what_a_life_says_is_told_each_time_and_what_it_retains_of_another_once() {
        let told = Told::default();
        let hears = |envelope: &Envelope| told.is_to_be_told(&id_of(envelope).unwrap(), envelope);
        let moment = ["COMMANDED", "ISSUED", "COMMANDED"];
        for (number, state) in moment.into_iter().enumerate() {
            assert!(hears(&said(1, number as u64, state)), "{number}: {state}");
        }
        assert!(!hears(&said(2, 1, "ISSUED")), "an older word of the former life");
        assert!(hears(&said(2, 2, "COMMANDED")), "its last word, which stands");
        assert!(hears(&said(2, 3, "EXECUTING")));
    }
}
