//! Follows the streams of other nodes: each sample once, in the order of its writer, with what is missing asked for.

mod again;
mod told;

use super::Participant;
use super::history::History;
use super::qos::{Durability, Qos};
use super::writers::name_of;
use again::Former;
use aldis_envelope::aldis::dds::{Ask, Confirm, History as Told, StreamName};
use aldis_envelope::{Address, EntityId, Envelope, Label, Monotonic, Prefix};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;
use told::envelope;

/// How many streams are followed. What is beyond is handed on as it comes.
const STREAMS_MAX: usize = 65_536;
/// How many samples of a stream wait for one that is missing. Those beyond are dropped and asked for later.
const HELD_MAX: usize = 4_096;
/// No stream gets so far; what claims to is not followed.
const SEQUENCE_MAX: u64 = 1 << 62;
/// How long an answer is waited for before it is asked for again.
const ASK_FIRST: Duration = Duration::from_millis(250);
/// The longest wait for an answer: it is twice as long each time.
const ASK_LAST: Duration = Duration::from_secs(4);
/// How often is asked in vain before what is missing is given up: 64 s in all. A machine that stands still for half a minute
/// loses nothing.
const ASKS_MAX: u32 = 20;
/// How long what was handed over waits to be confirmed together with what follows, where its writer has not asked for it.
const CONFIRM_WITHIN: Duration = Duration::from_millis(10);

/// What comes of an input.
#[derive(Debug, Default)]
pub struct Step {
    /// Samples to hand over now, in this order.
    pub deliver: Vec<Envelope>,
    /// What to ask for.
    pub ask: Vec<(Participant, Ask)>,
    /// Samples that will never come: dropped by their writer's node, or gone with it.
    pub lost: u64,
    /// Samples that were known already.
    pub duplicates: u64,
}

type Key = (EntityId, StreamName);

#[derive(Debug)]
struct Asked {
    upto: u64,
    again: Monotonic,
    times: u32,
}

#[derive(Debug)]
struct Stream {
    participant: Participant,
    label: Option<Arc<Label>>,
    /// The first sequence that has not been handed over or found to be gone.
    next: u64,
    /// The last sequence that is known to exist.
    end: u64,
    held: BTreeMap<u64, Envelope>,
    asked: Option<Asked>,
    history: History,
    /// What was handed over of it in the former life of its writer's node.
    former: Former,
    confirmed: u64,
    /// Up to here its writer has asked for.
    asked_for: u64,
}

/// The streams that a node reads.
#[derive(Debug, Default)]
pub struct Reading {
    streams: BTreeMap<Key, Stream>,
    unconfirmed: BTreeSet<Key>,
    /// When they are confirmed.
    confirm_at: Option<Monotonic>,
    /// Streams that wait for an answer.
    asking: BTreeSet<Key>,
}

impl Reading {
    /// A sample from the bus.
    pub fn sample(&mut self, now: Monotonic, qos: Qos, envelope: &Envelope, step: &mut Step) {
        let Some(name) = name_of(envelope).filter(|_| envelope.stamp.sequence <= SEQUENCE_MAX) else {
            step.deliver.push(envelope.clone());
            return;
        };
        let stamp = &envelope.stamp;
        let participant = Participant { node: stamp.node, boot: stamp.boot };
        let Some((key, stream)) = self.stream(participant, name, qos, stamp.sequence, step) else {
            if self.streams.len() >= STREAMS_MAX {
                step.deliver.push(envelope.clone());
            }
            return;
        };
        stream.label = Some(envelope.message.label.clone());
        let sequence = stamp.sequence;
        if sequence < stream.next || stream.held.contains_key(&sequence) {
            step.duplicates += 1;
            // Its confirmation may have been lost.
            self.confirm(key, now);
            return;
        }
        stream.end = stream.end.max(sequence);
        if sequence.saturating_sub(u64::from(stamp.skipped)) <= stream.next {
            // Nothing, or only what a rule left out, is missing before it.
            stream.next = sequence;
            stream.hand_over(envelope.clone(), step);
        } else if stream.held.len() < HELD_MAX {
            stream.held.insert(sequence, envelope.clone());
        }
        self.go_on(now, &key, step);
    }

    /// A writer's node tells where a stream stands.
    pub fn ends(
        &mut self,
        now: Monotonic,
        from: Participant,
        ends: &[(StreamName, u64)],
        qos: impl Fn(&Address) -> Option<Qos>,
        step: &mut Step,
    ) {
        for (name, end) in ends.iter().filter(|(_, end)| *end <= SEQUENCE_MAX) {
            let Some(qos) = qos(&Address::Name(name.topic.clone())) else { continue };
            let Some((key, stream)) = self.stream(from, name.clone(), qos, end + 1, step) else {
                continue;
            };
            stream.end = stream.end.max(*end);
            stream.asked_for = stream.asked_for.max(*end);
            self.confirm(key.clone(), now);
            self.go_on(now, &key, step);
        }
    }

    /// A writer's node tells what it keeps of a part of a stream.
    pub fn told(&mut self, now: Monotonic, from: Participant, told: Told, step: &mut Step) {
        let key = (from.node, told.stream.clone());
        let Some(stream) = self.streams.get_mut(&key).filter(|stream| stream.participant == from) else {
            return;
        };
        if told.from > stream.next || told.upto < stream.next || told.upto > stream.end {
            return;
        }
        let label = stream.label_of(&told);
        for sample in told.samples {
            let sequence = sample.sequence;
            if sequence >= stream.next && sequence <= told.upto {
                stream.held.entry(sequence).or_insert_with(|| envelope(from, &label, sample));
            }
        }
        while stream.next <= told.upto {
            let first = stream.held.first_key_value().map_or(u64::MAX, |(&sequence, _)| sequence);
            let until = first.min(told.upto + 1);
            if until > stream.next {
                step.lost += if told.broken { until - stream.next } else { 0 };
                stream.next = until;
            } else if let Some((_, envelope)) = stream.held.pop_first() {
                stream.hand_over(envelope, step);
            }
        }
        stream.asked = None;
        self.go_on(now, &key, step);
    }

    /// A stream of a participant; a later life of its node begins it anew.
    fn stream(
        &mut self,
        participant: Participant,
        name: StreamName,
        qos: Qos,
        heard: u64,
        step: &mut Step,
    ) -> Option<(Key, &mut Stream)> {
        let key = (participant.node, name);
        let full = self.streams.len() >= STREAMS_MAX;
        match self.streams.get_mut(&key) {
            Some(stream) if stream.participant.boot == participant.boot => {}
            Some(stream) if stream.participant.boot > participant.boot => {
                step.duplicates += 1;
                return None;
            }
            Some(stream) => {
                stream.give_up(step);
                let former = Former::of(&stream.history);
                *stream = Stream { former, ..Stream::new(participant, qos, heard) };
                self.asking.remove(&key);
            }
            None if full => return None,
            None => drop(self.streams.insert(key.clone(), Stream::new(participant, qos, heard))),
        }
        let stream = self.streams.get_mut(&key)?;
        Some((key, stream))
    }

    /// Hands over what follows, and asks for what is missing.
    fn go_on(&mut self, now: Monotonic, key: &Key, step: &mut Step) {
        let Some(stream) = self.streams.get_mut(key) else { return };
        stream.hand_over_held(step);
        let is_asked_for = stream.asked_for > stream.confirmed;
        let is_news = stream.next - 1 > stream.confirmed;
        match stream.missing() {
            None => {
                stream.asked = None;
                stream.former.forget();
                self.asking.remove(key);
            }
            Some(upto) if stream.asked.as_ref().is_none_or(|asked| asked.upto < stream.next) => {
                stream.asked = Some(Asked { upto, again: now + ASK_FIRST, times: 0 });
                self.asking.insert(key.clone());
                step.ask.push(stream.ask(&key.1, upto));
            }
            Some(_) => {}
        }
        if is_news {
            self.confirm(key.clone(), if is_asked_for { now } else { now + CONFIRM_WITHIN });
        }
    }

    /// A stream is to be confirmed by then.
    fn confirm(&mut self, key: Key, by: Monotonic) {
        self.unconfirmed.insert(key);
        self.confirm_at = Some(self.confirm_at.map_or(by, |at| at.min(by)));
    }

    /// Asks again where no answer came, and gives up what has been asked for too often. While the own session is down
    /// nothing is given up.
    pub fn due(&mut self, now: Monotonic, bus_is_open: bool, step: &mut Step) {
        let due: Vec<_> = self.asking.iter().filter(|key| self.is_due(key, now)).cloned().collect();
        for key in due {
            let Some(stream) = self.streams.get_mut(&key) else { continue };
            let Some(upto) = stream.missing() else { continue };
            let Some(asked) = stream.asked.as_mut() else { continue };
            if !bus_is_open {
                asked.again = now + ASK_FIRST;
                continue;
            }
            asked.times += 1;
            if asked.times >= ASKS_MAX {
                stream.give_up(step);
                self.go_on(now, &key, step);
                continue;
            }
            asked.upto = upto;
            asked.again = now + (ASK_FIRST * 2_u32.pow(asked.times.min(10))).min(ASK_LAST);
            step.ask.push(stream.ask(&key.1, upto));
        }
    }

    fn is_due(&self, key: &Key, now: Monotonic) -> bool {
        let asked = self.streams.get(key).and_then(|stream| stream.asked.as_ref());
        asked.is_some_and(|asked| asked.again <= now)
    }

    /// When something is to be asked again, or confirmed.
    pub fn next_deadline(&self) -> Option<Monotonic> {
        if self.asking.is_empty() {
            return self.confirm_at;
        }
        let streams = self.asking.iter().filter_map(|key| self.streams.get(key));
        let asked = streams.filter_map(|stream| stream.asked.as_ref()).map(|asked| asked.again);
        asked.chain(self.confirm_at).min()
    }

    /// How far each stream has been handed over, where that is news to its writer: at once where it has asked, else a little
    /// later and many together. Nothing while the session is down: writers ask again when it is up.
    pub fn confirmations(&mut self, now: Monotonic, bus_is_open: bool) -> Vec<(Participant, Confirm)> {
        if !self.confirm_at.is_some_and(|at| at <= now || !bus_is_open) {
            return Vec::new();
        }
        self.confirm_at = None;
        if !bus_is_open {
            return Vec::new();
        }
        let mut by_writer: BTreeMap<Participant, Vec<(StreamName, u64)>> = BTreeMap::new();
        for key in std::mem::take(&mut self.unconfirmed) {
            if let Some(stream) = self.streams.get_mut(&key) {
                stream.confirmed = stream.next - 1;
                by_writer.entry(stream.participant).or_default().push((key.1, stream.confirmed));
            }
        }
        by_writer.into_iter().map(|(writer, upto)| (writer, Confirm { to: writer.boot, upto })).collect()
    }

    /// Whether nothing that some prefixes read is missing.
    pub fn is_complete(&self, prefixes: &[Prefix]) -> bool {
        let mut asking = self.asking.iter().map(|key| Address::Name(key.1.topic.clone()));
        !asking.any(|address| prefixes.iter().any(|prefix| prefix.matches(&address)))
    }

    /// What is kept of the streams that are followed.
    pub fn histories(&self) -> impl Iterator<Item = (Address, &History)> {
        self.streams.iter().map(|(key, stream)| (Address::Name(key.1.topic.clone()), &stream.history))
    }

    /// Forgets the streams that nobody here reads any more.
    pub fn retain(&mut self, is_read: impl Fn(&Address) -> bool) {
        self.streams.retain(|key, _| is_read(&Address::Name(key.1.topic.clone())));
        let streams = &self.streams;
        self.asking.retain(|key| streams.contains_key(key));
        self.unconfirmed.retain(|key| streams.contains_key(key));
    }
}

impl Stream {
    /// `heard` is the first sequence that is heard of. What came before it matters only where it is retained.
    fn new(participant: Participant, qos: Qos, heard: u64) -> Self {
        let next = if qos.durability == Durability::Volatile { heard } else { 1 };
        Self {
            participant,
            label: None,
            next,
            end: 0,
            held: BTreeMap::new(),
            asked: None,
            history: History::new(qos),
            former: Former::default(),
            confirmed: 0,
            asked_for: 0,
        }
    }

    fn hand_over(&mut self, envelope: Envelope, step: &mut Step) {
        self.next = envelope.stamp.sequence + 1;
        self.history.add(envelope.clone());
        self.history.settle(envelope.stamp.sequence);
        if self.former.has(&envelope) {
            step.duplicates += 1;
        } else {
            step.deliver.push(envelope);
        }
    }

    fn hand_over_held(&mut self, step: &mut Step) {
        while let Some(first) = self.held.first_entry() {
            let sequence = *first.key();
            let from = sequence.saturating_sub(u64::from(first.get().stamp.skipped));
            if from > self.next {
                return;
            }
            let envelope = first.remove();
            if sequence >= self.next {
                self.hand_over(envelope, step);
            }
        }
    }

    /// The last sequence of the first hole, where there is one.
    fn missing(&self) -> Option<u64> {
        let before_held = self.held.first_key_value().map(|(&sequence, _)| sequence - 1);
        let upto = before_held.unwrap_or(self.end);
        (upto >= self.next).then_some(upto)
    }

    fn ask(&self, name: &StreamName, upto: u64) -> (Participant, Ask) {
        (self.participant, Ask { to: self.participant.boot, stream: name.clone(), from: self.next, upto })
    }

    /// What is missing will not come: what waited for it is handed over.
    fn give_up(&mut self, step: &mut Step) {
        let known = self.held.len() as u64;
        step.lost += (self.end + 1).saturating_sub(self.next).saturating_sub(known);
        for (_, envelope) in std::mem::take(&mut self.held) {
            self.hand_over(envelope, step);
        }
        self.next = self.next.max(self.end + 1);
        self.asked = None;
    }

    fn label_of(&mut self, told: &Told) -> Arc<Label> {
        let same = |label: &&Arc<Label>| {
            label.attributes.content_type == told.content_type && label.attributes.source_group == told.group
        };
        if let Some(label) = self.label.as_ref().filter(same) {
            return label.clone();
        }
        let StreamName { source, topic } = told.stream.clone();
        let mut label = Label::broadcast(told.content_type.clone(), topic, source);
        label.attributes.source_group = told.group.clone();
        let label = Arc::new(label);
        self.label = Some(label.clone());
        label
    }
}
