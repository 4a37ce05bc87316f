//! Samples of writers as others hold them: readers' nodes, and the journal.

use super::super::history::History;
use super::{Writers, name_of};
use aldis_envelope::aldis::dds::Retained;
use aldis_envelope::{Envelope, Source};

impl Writers {
    /// What is kept of what a source has written.
    pub fn histories_of(&self, source: Source) -> impl Iterator<Item = &History> {
        self.streams.iter().filter(move |(name, _)| name.source == source).map(|(_, stream)| &stream.history)
    }

    /// A source begins a new life: it waits for nothing that its former one has asked for.
    pub fn forget_confirmations(&mut self, source: Source) {
        self.waiting.retain(|waiting| waiting.source != source);
    }

    /// The journal holds a sample that was just written under a number.
    pub fn recorded(&mut self, sample: &Envelope, record: u64) {
        match name_of(sample).and_then(|name| self.streams.get_mut(&name)) {
            Some(stream) => {
                stream.history.recorded(sample.stamp.sequence, record);
                stream.history.take_forgotten(&mut self.forgotten);
            }
            None => self.forgotten.push(record),
        }
    }

    /// Moves the numbers of records that hold nothing any more. Those of a stream are in the order in which its samples went, and
    /// are to be forgotten in this order: an end goes after what it ended.
    pub fn take_forgotten(&mut self, into: &mut Vec<u64>) {
        into.append(&mut self.forgotten);
    }
}

pub(super) fn retained(sample: &Envelope) -> Retained {
    let instance = sample.message.instance.as_ref();
    Retained {
        sequence: sample.stamp.sequence,
        source_time: sample.stamp.source_time,
        change: sample.message.change,
        hash: instance.map(|instance| instance.hash),
        key: instance.and_then(|instance| instance.key.as_ref()).map(|key| key.to_vec()),
        content: sample.message.content.to_vec(),
    }
}
