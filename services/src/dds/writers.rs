//! What the sources of this node have written, who reads it, and how far each reader has it.

mod confirming;
mod records;

use super::Participant;
use super::history::History;
use super::qos::Qos;
use crate::service::Unconfirmed;
use aldis_envelope::aldis::dds::{Ask, Confirm, History as Told, Readers, StreamName, Streams};
use aldis_envelope::{Address, EntityId, Envelope, Label, Monotonic, Source};
use records::retained;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

/// How many streams a node writes with a promise. What is beyond is best effort.
const STREAMS_MAX: usize = 16_384;
/// How many participants are followed. Others read, but nothing waits for them.
const PARTICIPANTS_MAX: usize = 1_024;
/// How many samples are told at once, so that a late joiner of many holds nobody up.
const PAGE_SAMPLES: usize = 256;
/// How many bytes are told at once.
const PAGE_BYTES: usize = 64 * 1024;
/// How many streams are named at once.
const PAGE_STREAMS: usize = 512;
/// How long a reader may be behind before it is reminded of the end of a stream.
const REMIND_FIRST: Duration = Duration::from_millis(300);
/// The longest wait between reminders.
const REMIND_MAX: Duration = Duration::from_secs(5);
/// The longest lease that a reader may ask for.
const LEASE_MAX: Duration = Duration::from_secs(60);

/// A delivery that was waited for is confirmed, or not.
#[derive(Debug, PartialEq, Eq)]
pub struct Confirmed {
    /// Which service waited.
    pub source: Source,
    /// Its number.
    pub number: u64,
    /// How it ended.
    pub outcome: Result<(), Unconfirmed>,
}

#[derive(Debug)]
struct Stream {
    label: Arc<Label>,
    /// Whether it goes out on the bus. If not, services of this node alone are late joiners.
    exported: bool,
    history: History,
    last: u64,
    readers: Vec<Participant>,
}

#[derive(Debug)]
struct Reader {
    announced: Readers,
    heard: Monotonic,
    confirmed: BTreeMap<StreamName, u64>,
    /// The streams whose end it is reminded of, and how long it is then left alone.
    behind: BTreeMap<StreamName, (Monotonic, Duration)>,
}

impl Reader {
    fn reads(&self, address: &Address) -> bool {
        self.announced.prefixes.iter().any(|prefix| prefix.matches(address))
    }

    fn has(&self, stream: &StreamName) -> u64 {
        self.confirmed.get(stream).copied().unwrap_or(0)
    }

    fn lease(&self) -> Duration {
        Duration::from_millis(self.announced.lease_ms.into()).min(LEASE_MAX)
    }
}

#[derive(Debug)]
struct Waiting {
    source: Source,
    number: u64,
    stream: StreamName,
    sequence: u64,
    missing: BTreeSet<Participant>,
    deadline: Monotonic,
}

/// The streams of a node's own sources with their readers.
#[derive(Debug, Default)]
pub struct Writers {
    streams: BTreeMap<StreamName, Stream>,
    readers: BTreeMap<Participant, Reader>,
    waiting: Vec<Waiting>,
    /// Records of the journal that hold nothing any more.
    forgotten: Vec<u64>,
    /// Nothing is due before this; it is looked up anew only then.
    wake: Option<Monotonic>,
}

impl Writers {
    /// Keeps what a source has written, for other nodes where it is exported. What the stream had to drop for it comes back as a number.
    pub fn wrote(&mut self, now: Monotonic, qos: Qos, exported: bool, envelope: &Envelope) -> u64 {
        let Some(name) = name_of(envelope) else { return 0 };
        if !self.streams.contains_key(&name) {
            if self.streams.len() >= STREAMS_MAX {
                return 0;
            }
            let label = envelope.message.label.clone();
            let reads = self.readers.iter().filter(|(_, reader)| exported && reader.reads(&label.address));
            let readers = reads.map(|(&participant, _)| participant).collect();
            let stream = Stream { label, exported, history: History::new(qos), last: 0, readers };
            self.streams.insert(name.clone(), stream);
        }
        let Some(stream) = self.streams.get_mut(&name) else { return 0 };
        stream.last = envelope.stamp.sequence;
        stream.history.add(envelope.clone());
        for participant in &stream.readers {
            if let Some(reader) = self.readers.get_mut(participant) {
                reader.behind.entry(name.clone()).or_insert((now + REMIND_FIRST, REMIND_FIRST));
                wake_by(&mut self.wake, now + REMIND_FIRST);
            }
        }
        if stream.readers.is_empty() {
            stream.history.settle(stream.last);
        }
        stream.history.take_forgotten(&mut self.forgotten);
        stream.history.take_shed()
    }

    /// A participant announces its readers. What its streams hold is the answer. Reliable readers have one life at a time, so
    /// that a later one ends the former; the command line may run several programs as one entity.
    pub fn announced(
        &mut self,
        now: Monotonic,
        from: Participant,
        readers: Readers,
    ) -> (Vec<Streams>, Vec<Confirmed>) {
        let former: Vec<_> = self
            .readers
            .iter()
            .filter(|(p, r)| p.node == from.node && p.boot < from.boot && r.announced.reliable)
            .map(|(&p, _)| p)
            .filter(|_| readers.reliable)
            .collect();
        let mut confirmed: Vec<_> = former.into_iter().flat_map(|p| self.remove(p)).collect();
        if readers.prefixes.is_empty() {
            confirmed.extend(self.remove(from));
            return (Vec::new(), confirmed);
        }
        let full = self.readers.len() >= PARTICIPANTS_MAX;
        let known = self.readers.get_mut(&from);
        let news = known.as_ref().is_none_or(|known| known.announced != readers);
        let answers = readers.number;
        match known {
            Some(known) => {
                known.heard = now;
                known.announced = readers;
            }
            None if full => return (Vec::new(), confirmed),
            None => {
                let (confirmed, behind) = (BTreeMap::new(), BTreeMap::new());
                self.readers.insert(from, Reader { announced: readers, heard: now, confirmed, behind });
            }
        }
        if let Some(reader) = self.readers.get(&from) {
            wake_by(&mut self.wake, now + reader.lease());
        }
        if news {
            self.match_again(from);
        }
        (self.ends(from, answers), confirmed)
    }

    fn match_again(&mut self, participant: Participant) {
        let Some(reader) = self.readers.get(&participant) else { return };
        for stream in self.streams.values_mut() {
            let reads = stream.exported && reader.reads(&stream.label.address);
            match stream.readers.iter().position(|p| *p == participant) {
                None if reads => stream.readers.push(participant),
                Some(place) if !reads => drop(stream.readers.remove(place)),
                _ => {}
            }
        }
    }

    /// Where the streams stand that a participant reads.
    fn ends(&self, reader: Participant, answers: u64) -> Vec<Streams> {
        let read = self.streams.iter().filter(|(_, stream)| stream.readers.contains(&reader));
        let ends: Vec<_> = read.map(|(name, stream)| (name.clone(), stream.last)).collect();
        let mut parts: Vec<_> = ends
            .chunks(PAGE_STREAMS)
            .map(|ends| Streams { to: reader.boot, answers: None, ends: ends.to_vec() })
            .collect();
        if parts.is_empty() {
            parts.push(Streams { to: reader.boot, answers: None, ends: Vec::new() });
        }
        if let Some(last) = parts.last_mut() {
            last.answers = Some(answers);
        }
        parts
    }

    /// What is kept of what a reader asks for; none where the stream is not known.
    pub fn asked(&mut self, now: Monotonic, from: Participant, ask: &Ask) -> Option<Told> {
        self.heard(now, from);
        let stream = self.streams.get(&ask.stream).filter(|stream| stream.exported)?;
        let upto = ask.upto.min(stream.last);
        let page = stream.history.page(ask.from, upto, PAGE_SAMPLES, PAGE_BYTES);
        let label = page.samples.first().map_or(&stream.label, |first| &first.message.label);
        // A page speaks of samples with one content type and group; a stream seldom has two.
        let same = |sample: &&&Envelope| sample.message.label == *label;
        let alike: Vec<_> = page.samples.iter().take_while(same).collect();
        let upto = match page.samples.get(alike.len()) {
            Some(other) => other.stamp.sequence - 1,
            None => page.upto,
        };
        Some(Told {
            to: from.boot,
            stream: ask.stream.clone(),
            content_type: label.attributes.content_type.clone(),
            group: label.attributes.source_group.clone(),
            from: ask.from,
            upto,
            broken: page.broken,
            samples: alike.into_iter().map(|sample| retained(sample)).collect(),
        })
    }

    /// A participant has handed over what it confirms.
    pub fn confirmed(&mut self, now: Monotonic, from: Participant, confirm: &Confirm) -> Vec<Confirmed> {
        self.heard(now, from);
        for (name, upto) in &confirm.upto {
            let Some(stream) = self.streams.get(name) else { continue };
            let Some(reader) = self.readers.get_mut(&from) else { break };
            let upto = (*upto).min(stream.last);
            let has = reader.confirmed.entry(name.clone()).or_default();
            *has = upto.max(*has);
            if *has >= stream.last {
                reader.behind.remove(name);
            } else if let Some((at, wait)) = reader.behind.get_mut(name) {
                (*at, *wait) = (now + REMIND_FIRST, REMIND_FIRST);
            }
            self.settle(name);
            for waiting in self.waiting.iter_mut().filter(|w| w.stream == *name && w.sequence <= upto) {
                waiting.missing.remove(&from);
            }
        }
        self.take_finished()
    }

    fn settle(&mut self, name: &StreamName) {
        let Some(stream) = self.streams.get_mut(name) else { return };
        let counted = stream.readers.iter().filter_map(|p| self.readers.get(p));
        let floor = counted.map(|reader| reader.has(name)).min().unwrap_or(stream.last);
        stream.history.settle(floor);
        stream.history.take_forgotten(&mut self.forgotten);
    }

    fn heard(&mut self, now: Monotonic, from: Participant) {
        if let Some(reader) = self.readers.get_mut(&from) {
            reader.heard = now;
        }
    }

    fn remove(&mut self, participant: Participant) -> Vec<Confirmed> {
        if self.readers.remove(&participant).is_none() {
            return Vec::new();
        }
        let names: Vec<_> = self.streams.keys().cloned().collect();
        for stream in self.streams.values_mut() {
            stream.readers.retain(|p| *p != participant);
        }
        names.iter().for_each(|name| self.settle(name));
        for waiting in &mut self.waiting {
            waiting.missing.remove(&participant);
        }
        self.take_finished()
    }

    fn take_finished(&mut self) -> Vec<Confirmed> {
        let finished = self.waiting.extract_if(.., |waiting| waiting.missing.is_empty());
        finished.map(|w| Confirmed { source: w.source, number: w.number, outcome: Ok(()) }).collect()
    }

    /// Ends what has waited long enough, and forgets readers whose lease has run out.
    fn expire(&mut self, now: Monotonic) -> Vec<Confirmed> {
        let gone: Vec<_> =
            self.readers.iter().filter(|(_, r)| r.heard + r.lease() <= now).map(|(&p, _)| p).collect();
        let mut confirmed: Vec<_> = gone.into_iter().flat_map(|p| self.remove(p)).collect();
        confirmed.extend(self.waiting.extract_if(.., |waiting| waiting.deadline <= now).map(|waiting| {
            let missing: BTreeSet<EntityId> = waiting.missing.iter().map(|p| p.node).collect();
            let outcome = Err(Unconfirmed::Missing { missing: missing.into_iter().collect() });
            Confirmed { source: waiting.source, number: waiting.number, outcome }
        }));
        confirmed
    }

    /// Reminds readers that are behind of the ends of their streams.
    fn remind(&mut self, now: Monotonic) -> Vec<(Participant, Streams)> {
        let mut reminders = Vec::new();
        for (&participant, reader) in &mut self.readers {
            let mut ends = Vec::new();
            for (name, (at, wait)) in &mut reader.behind {
                if *at <= now && ends.len() < PAGE_STREAMS {
                    *wait = (*wait * 2).min(REMIND_MAX);
                    *at = now + *wait;
                    ends.extend(self.streams.get(name).map(|stream| (name.clone(), stream.last)));
                }
            }
            if !ends.is_empty() {
                reminders.push((participant, Streams { to: participant.boot, answers: None, ends }));
            }
        }
        reminders
    }

    /// When something may be to be said or ended next.
    pub fn next_deadline(&self) -> Option<Monotonic> {
        self.wake
    }

    /// Does what is due, once the deadline has come: reminders and ends.
    pub fn due(&mut self, now: Monotonic) -> (Vec<(Participant, Streams)>, Vec<Confirmed>) {
        if self.wake.is_none_or(|wake| wake > now) {
            return (Vec::new(), Vec::new());
        }
        let (confirmed, reminders) = (self.expire(now), self.remind(now));
        let waiting = self.waiting.iter().map(|waiting| waiting.deadline);
        let leases = self.readers.values().map(|reader| reader.heard + reader.lease());
        let ends = self.readers.values().flat_map(|reader| reader.behind.values().map(|(at, _)| *at));
        self.wake = waiting.chain(leases).chain(ends).min();
        (reminders, confirmed)
    }

    /// Whether a participant's readers are known.
    pub fn knows(&self, participant: Participant) -> bool {
        self.readers.contains_key(&participant)
    }

    /// What is kept, stream by stream.
    pub fn histories(&self) -> impl Iterator<Item = (&Address, &History)> {
        self.streams.values().map(|stream| (&stream.label.address, &stream.history))
    }
}

fn wake_by(wake: &mut Option<Monotonic>, at: Monotonic) {
    *wake = Some(wake.map_or(at, |wake| wake.min(at)));
}

/// The stream of a sample; none where it is not for all.
pub fn name_of(envelope: &Envelope) -> Option<StreamName> {
    let label = &envelope.message.label;
    match &label.address {
        Address::Name(topic) if label.is_broadcast() => {
            Some(StreamName { source: label.source(), topic: topic.clone() })
        }
        _ => None,
    }
}
