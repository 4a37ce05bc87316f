//! What must outlive the process waits here until it is on disk; only then is it handed on, to anybody.
//!
//! A sample of a persistent topic becomes a record of the journal, under a number that rises. What is superseded is forgotten
//! with the next batch, so that a sample costs one sync. A crash before that leaves records too many: they are told in their
//! order at the next start, and supersede one another again.
//!
//! What a source says keeps its order: behind a sample that waits, everything of its origin waits.

use super::{Origin, Work};
use crate::journal::{BATCH_BYTES_MAX, Batch, RECORD_BYTES_MAX, Refused};
use crate::link;
use aldis_envelope::{Monotonic, Wall};
use bytes::Bytes;
use std::collections::{BTreeMap, VecDeque};

/// The space of samples in the journal. The key is the record's number, big-endian.
pub(super) const SAMPLES: u8 = 1;
/// The space of what the node itself keeps.
pub(super) const OF_NODE: u8 = 2;
/// The space of what its links keep. The keys are theirs.
pub(super) const OF_LINKS: u8 = 3;
/// A batch that holds so much is closed at the next place where nothing is torn apart by it.
const MUCH_BYTES: usize = 1 << 20;
/// The most bytes on their way to the disk: what a journal lets wait.
const BYTES_MAX: usize = 8 << 20;
/// The most batches on their way to the disk.
const BATCHES_MAX: usize = 16_384;
/// The most messages that wait, of persistent topics and behind them.
const WAITING_MAX: usize = 65_536;
/// So many records to forget are worth a batch of their own.
const FORGOTTEN_MAX: usize = 4_096;
/// The most of them in one batch: 2 MiB.
const FORGOTTEN_AT_ONCE: usize = 180_000;
/// What a put or a forget takes beside key and value.
const OPERATION_BYTES: usize = 16;

/// A message that waits.
pub(super) struct Held {
    pub(super) work: Work,
    pub(super) source_time: Wall,
    /// Until when its sender waits for readers.
    pub(super) until: Option<Monotonic>,
    /// The number of its record, and the batch that brings it to disk. None where it only waits behind others.
    record: Option<(u64, u64)>,
}

impl Held {
    /// A message that waits, of now.
    pub(super) fn new(now: aldis_envelope::Now, work: Work) -> Self {
        let until = work.confirm.map(|(_, within)| now.monotonic + within);
        Self { work, source_time: now.wall, until, record: None }
    }

    /// The number of its record.
    pub(super) fn record(&self) -> Option<u64> {
        self.record.map(|(record, _)| record)
    }
}

/// A message that is not kept, and why.
pub(super) type NotKept = Box<(Held, Refused)>;

/// A batch that is not on disk yet.
struct OnItsWay {
    number: u64,
    bytes: usize,
    forgotten: Vec<u64>,
}

/// Messages that wait for the disk, and what is to be told to it.
///
/// What one event brings about stands in one batch, what links keep and what services say: a service that answers a command of a link
/// with a sample of a persistent topic has said it exactly once. Only where one event brings more than a mebibyte is it divided.
#[derive(Default)]
pub(super) struct Keeping {
    waiting: VecDeque<Held>,
    /// How many wait, by whence they come.
    origins: BTreeMap<Origin, usize>,
    /// What this turn brings to disk.
    batch: Batch,
    /// Batches of this turn that are full.
    full: Vec<(u64, Batch)>,
    on_their_way: VecDeque<OnItsWay>,
    bytes: usize,
    last_batch: u64,
    last_record: u64,
    written: u64,
    /// Records that hold nothing any more, in the order in which they are to be forgotten.
    pub(super) forgotten: Vec<u64>,
    /// Whether the last batch was refused: what frees space then goes by itself.
    is_refused: bool,
}

impl Keeping {
    /// Whether anything waits: then each message is to be asked for.
    pub(super) fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Whether something of an origin waits, so that what follows must wait too.
    pub(super) fn holds(&self, origin: Origin) -> bool {
        self.origins.contains_key(&origin)
    }

    /// Whether no more messages can wait.
    pub(super) fn is_full(&self) -> bool {
        self.waiting.len() >= WAITING_MAX
    }

    /// The records of a former life have numbers up to this one.
    pub(super) fn begin_after(&mut self, record: u64) {
        self.last_record = record;
    }

    /// Brings a sample to disk; it waits until it is there.
    ///
    /// # Errors
    /// Why it cannot be kept, with the message.
    pub(super) fn keep(&mut self, mut held: Held, value: Bytes) -> Result<(), NotKept> {
        let bytes = value.len() + OPERATION_BYTES;
        if bytes > RECORD_BYTES_MAX {
            return Err(Box::new((held, crate::journal::BatchError::Record(bytes).into())));
        }
        let pending = self.bytes + self.batch.encoded_bytes() + bytes;
        if pending > BYTES_MAX || self.on_their_way.len() >= BATCHES_MAX || self.is_full() {
            return Err(Box::new((held, Refused::Behind { pending })));
        }
        if self.batch.encoded_bytes() + bytes > BATCH_BYTES_MAX / 2 {
            self.close_batch(Vec::new());
        }
        self.last_record += 1;
        self.batch.put(SAMPLES, self.last_record.to_be_bytes().to_vec(), value);
        held.record = Some((self.last_record, self.last_batch + 1));
        self.hold(held);
        Ok(())
    }

    /// Has a message wait behind those of its origin.
    pub(super) fn hold(&mut self, held: Held) {
        *self.origins.entry(held.work.origin).or_default() += 1;
        self.waiting.push_back(held);
    }

    /// Brings something of the node itself to disk. The number of its batch.
    pub(super) fn keep_of_node(&mut self, key: &'static [u8], value: Vec<u8>) -> u64 {
        self.batch.put(OF_NODE, key, value);
        self.last_batch + 1
    }

    /// Brings what links keep to disk, as one with what services say in this turn. The number of its batch.
    ///
    /// # Errors
    /// Why it cannot be kept.
    pub(super) fn keep_of_links(&mut self, records: Vec<link::Record>) -> Result<u64, Refused> {
        let bytes: usize = records.iter().map(|record| record.bytes() + OPERATION_BYTES).sum();
        let pending = self.bytes + self.batch.encoded_bytes() + bytes;
        if pending > BYTES_MAX || self.on_their_way.len() >= BATCHES_MAX {
            return Err(Refused::Behind { pending });
        }
        if self.batch.encoded_bytes() + bytes > BATCH_BYTES_MAX {
            self.close();
        }
        for record in records {
            match record {
                link::Record::Put { key, value } => self.batch.put(OF_LINKS, key, value),
                link::Record::Forget { key } => self.batch.forget(OF_LINKS, key),
            };
        }
        Ok(self.last_batch + 1)
    }

    /// Whether this turn brings so much to disk that it should be closed.
    pub(super) fn has_much(&self) -> bool {
        self.batch.encoded_bytes() > MUCH_BYTES
    }

    /// What more comes in this turn is another batch.
    pub(super) fn close(&mut self) {
        self.close_batch(Vec::new());
    }

    /// The batches of this turn, with their numbers. What is to be forgotten goes along, or alone where it is much or where
    /// `all` of it is to go.
    pub(super) fn take_batches(&mut self, all: bool) -> Vec<(u64, Batch)> {
        let has_puts = !self.batch.operations().is_empty();
        while !self.forgotten.is_empty() && (has_puts || all || self.forgotten.len() > FORGOTTEN_MAX) {
            let rest = self.forgotten.split_off(self.forgotten.len().min(FORGOTTEN_AT_ONCE));
            let forgotten = std::mem::replace(&mut self.forgotten, rest);
            if self.is_refused || !self.forgotten.is_empty() {
                // What frees space goes by itself, where the rest may be refused.
                self.close_batch(Vec::new());
            }
            for record in &forgotten {
                self.batch.forget(SAMPLES, record.to_be_bytes().to_vec());
            }
            self.close_batch(forgotten);
        }
        self.close_batch(Vec::new());
        std::mem::take(&mut self.full)
    }

    /// Whether this turn has something for the disk.
    pub(super) fn has_batches(&self) -> bool {
        !self.batch.operations().is_empty() || !self.full.is_empty() || self.forgotten.len() > FORGOTTEN_MAX
    }

    fn close_batch(&mut self, forgotten: Vec<u64>) {
        let batch = std::mem::take(&mut self.batch);
        if batch.operations().is_empty() {
            return;
        }
        let bytes = batch.encoded_bytes();
        self.last_batch += 1;
        self.bytes += bytes;
        self.on_their_way.push_back(OnItsWay { number: self.last_batch, bytes, forgotten });
        self.full.push((self.last_batch, batch));
    }

    /// All batches up to a number are on disk, but those that were refused.
    pub(super) fn written(&mut self, up_to: u64) {
        self.written = self.written.max(up_to);
        self.is_refused = false;
        while let Some(first) = self.on_their_way.front()
            && first.number <= up_to
        {
            self.bytes -= first.bytes;
            self.on_their_way.pop_front();
        }
    }

    /// Batches are refused. The messages that are not kept; they wait no longer.
    pub(super) fn refused(&mut self, from: u64, to: u64) -> VecDeque<Held> {
        self.is_refused = true;
        let is_refused = |batch: &OnItsWay| (from..=to).contains(&batch.number);
        let (refused, left) = std::mem::take(&mut self.on_their_way).into_iter().partition(is_refused);
        self.on_their_way = left;
        let refused: VecDeque<OnItsWay> = refused;
        let mut forgotten = Vec::new();
        for batch in refused {
            self.bytes -= batch.bytes;
            forgotten.extend(batch.forgotten);
        }
        forgotten.append(&mut self.forgotten);
        self.forgotten = forgotten;
        let is_refused = |held: &Held| held.record.is_some_and(|(_, batch)| (from..=to).contains(&batch));
        let (refused, left) = std::mem::take(&mut self.waiting).into_iter().partition(is_refused);
        self.waiting = left;
        let refused: VecDeque<Held> = refused;
        refused.iter().for_each(|held| self.leaves(held.work.origin));
        refused
    }

    /// The next message that waits for nothing any more.
    pub(super) fn next_kept(&mut self) -> Option<Held> {
        let first = self.waiting.front()?;
        if first.record.is_some_and(|(_, batch)| batch > self.written) {
            return None;
        }
        let held = self.waiting.pop_front()?;
        self.leaves(held.work.origin);
        Some(held)
    }

    /// Nothing that waits of an origin is handed on, nor kept.
    pub(super) fn drop_all_of(&mut self, origin: Origin) {
        self.origins.remove(&origin);
        let is_its = |held: &Held| held.work.origin == origin;
        let (dropped, left): (VecDeque<_>, _) =
            std::mem::take(&mut self.waiting).into_iter().partition(is_its);
        self.waiting = left;
        self.forgotten.extend(dropped.iter().filter_map(Held::record));
    }

    /// Nobody is told any more when what waits of an origin is confirmed.
    pub(super) fn forget_confirmations(&mut self, origin: Origin) {
        for held in self.waiting.iter_mut().filter(|held| held.work.origin == origin) {
            held.work.confirm = None;
        }
    }

    fn leaves(&mut self, origin: Origin) {
        if let Some(count) = self.origins.get_mut(&origin) {
            *count -= 1;
            if *count == 0 {
                self.origins.remove(&origin);
            }
        }
    }
}

#[cfg(test)]
mod tests;
