//! Deliveries that somebody waits for.

use super::super::Participant;
use super::{Confirmed, Waiting, Writers, name_of, wake_by};
use aldis_envelope::aldis::dds::{StreamName, Streams};
use aldis_envelope::{Envelope, Monotonic, Source};
use std::collections::BTreeSet;

impl Writers {
    /// Has a service told once every reliable reader of a stream has a sample, and all that stand for readers beyond a link.
    pub fn confirm(
        &mut self,
        (source, number): (Source, u64),
        sample: &Envelope,
        beyond: &[Participant],
        deadline: Monotonic,
    ) -> Option<Confirmed> {
        let upto = (name_of(sample)?, sample.stamp.sequence);
        self.confirm_upto((source, number), upto, beyond, deadline)
    }

    /// The same for a stream up to a sequence.
    pub fn confirm_upto(
        &mut self,
        (source, number): (Source, u64),
        (stream, sequence): (StreamName, u64),
        beyond: &[Participant],
        deadline: Monotonic,
    ) -> Option<Confirmed> {
        let readers = self.streams.get(&stream).map(|stream| stream.readers.as_slice()).unwrap_or_default();
        let lacks = |p: &&Participant| {
            self.readers.get(p).is_some_and(|r| r.announced.reliable && r.has(&stream) < sequence)
        };
        let missing: BTreeSet<_> = readers.iter().filter(lacks).chain(beyond).copied().collect();
        if missing.is_empty() {
            return Some(Confirmed { source, number, outcome: Ok(()) });
        }
        wake_by(&mut self.wake, deadline);
        self.waiting.push(Waiting { source, number, stream, sequence, missing, deadline });
        None
    }

    /// Where a stream stands, for the readers that are waited for: what they are asked to confirm at once.
    pub fn awaited(&self, stream: &StreamName, sequence: u64) -> Vec<(Participant, Streams)> {
        let waiting = self.waiting.iter().filter(|w| w.stream == *stream && w.sequence == sequence);
        let missing: BTreeSet<_> = waiting.flat_map(|waiting| waiting.missing.iter().copied()).collect();
        let here = missing.into_iter().filter(|p| self.readers.contains_key(p));
        let ends = vec![(stream.clone(), sequence)];
        here.map(|p| (p, Streams { to: p.boot, answers: None, ends: ends.clone() })).collect()
    }

    /// All readers beyond a link have a stream up to a sequence, as who stands for them says.
    pub fn confirmed_beyond(&mut self, from: Participant, stream: &StreamName, upto: u64) -> Vec<Confirmed> {
        for waiting in self.waiting.iter_mut().filter(|w| w.stream == *stream && w.sequence <= upto) {
            waiting.missing.remove(&from);
        }
        self.take_finished()
    }
}
