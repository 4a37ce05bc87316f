//! The journal: what must outlive the process is on disk before it is acknowledged.
//!
//! It holds keyed records. The owner appends batches of puts and forgets; a batch stands whole or not at all. At the start
//! everything that stands is read back, in no order that means anything: an order belongs into the keys.
//!
//! Pure: [`Journal`] asks for operations on named files by [`DiskEffect`]s and is told how they went; the gateway carries them
//! out on real files, the simulator on a simulated disk. At most one operation is under way at any time.
//!
//! # On disk
//!
//! A directory with segments `00000001.journal`, `00000002.journal`, … and one file `identity.journal`. Batches go to the end
//! of the newest segment. The oldest segment is cleaned: what still stands in it is appended again at the end, and once that is
//! synced the segment is removed. A forget is therefore never needed any more when it comes to be cleaned itself, and a
//! crash at any point leaves at worst a record twice, with the same value. Formats: `journal/format`.
//!
//! # What holds
//!
//! - `Written { up_to }` comes after the sync. What it covers stands after any crash; what it says forgotten stays so.
//! - Batches are kept in their order: where one is refused, all that wait behind it are refused with it.
//! - A refused batch is not kept, unless the process ends before the next `Written`: then it may be.
//! - A damaged region costs the batches in it and no others; it is named at the start. A torn end was never acknowledged.

mod batch;
mod clean;
mod commit;
mod disk;
mod format;
mod index;
mod mend;
mod read_back;
mod recover;
mod scan;
mod told;

pub use batch::{BATCH_BYTES_MAX, Batch, BatchError, KEY_BYTES_MAX, Operation, RECORD_BYTES_MAX};
pub use disk::{DiskDone, DiskEffect, DiskError, DiskOperation, DiskOutcome, Token};
pub use format::VERSION;
pub use recover::{Damage, DamageKind};
pub use told::{JournalEvent, Recovered, Refused, Unusable};

use aldis_envelope::Monotonic;
use clean::Cleaning;
use commit::{Group, Queue};
use disk::Desk;
use index::{Index, SEGMENTS_MAX};
use read_back::ReadBack;
use recover::Recovery;
use std::collections::VecDeque;
use std::time::Duration;

/// The first wait after the disk has failed. Shorter hammers a disk that is full.
const RETRY_AFTER_MIN: Duration = Duration::from_secs(1);
/// The longest wait between two tries. Longer leaves a disk unused that works again.
const RETRY_AFTER_MAX: Duration = Duration::from_secs(30);

/// How a journal is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JournalConfig {
    /// Drawn anew for each journal. It goes into all checksums, so that no content can pass for a part of the journal.
    pub seed: u64,
    /// The most bytes that records may take together, keys included. On disk it may be up to twice as much and two segments.
    pub limit_bytes: u64,
    /// The size at which a segment is closed and the next begun; raised where there would be more segments than can be.
    pub segment_bytes: u32,
    /// The most bytes that may wait to be written. Beyond it batches are refused: the disk does not keep up.
    pub pending_bytes_max: usize,
}

impl JournalConfig {
    /// A journal of at most 1 GiB in segments of 16 MiB, with 8 MiB waiting.
    pub fn new(seed: u64) -> Self {
        Self { seed, limit_bytes: 1 << 30, segment_bytes: 16 << 20, pending_bytes_max: 8 << 20 }
    }

    /// With segments so large that a full journal has a quarter of those that can be.
    fn with_segments_in_bounds(self) -> Self {
        let least = self.disk_bytes_max() / (SEGMENTS_MAX as u64 / 4);
        let segment_bytes = self.segment_bytes.max(u32::try_from(least).unwrap_or(u32::MAX / 2));
        Self { segment_bytes, ..self }
    }

    /// The most bytes on disk: beyond them nothing is appended but forgets, and beyond twice as many not even those, until
    /// cleaning has caught up.
    fn disk_bytes_max(&self) -> u64 {
        self.limit_bytes.saturating_mul(2).saturating_add(2 * u64::from(self.segment_bytes))
    }
}

/// How much a journal holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Held {
    /// Records that stand.
    pub records: u64,
    /// Their bytes on disk.
    pub live_bytes: u64,
    /// All bytes on disk.
    pub disk_bytes: u64,
    /// Segments.
    pub segments: usize,
    /// Whether the oldest segment holds something that can no longer be read, so that it cannot be cleaned. The next start
    /// names it and gets over it.
    pub is_stuck: bool,
}

/// What a journal wants done, and what it tells.
#[derive(Debug, Default)]
pub struct JournalOutput {
    /// To be done to files, in this order.
    pub effects: Vec<DiskEffect>,
    /// To be told to the owner, in this order.
    pub events: Vec<JournalEvent>,
}

/// What is under way.
#[derive(Debug)]
enum State {
    /// Not opened yet.
    New,
    Recovering(Box<Recovery>),
    ReadingBack(ReadBack),
    /// Nothing is under way.
    Ready,
    Writing(Group),
    Syncing(Group),
    ReadingToClean,
    Removing,
    /// Putting the files in order after a failure.
    Mending,
    Unusable(Unusable),
}

/// What the disk refused, and when it is tried again.
#[derive(Debug)]
struct Trouble {
    why: DiskError,
    retry_at: Monotonic,
    wait: Duration,
    /// Whether the wait is over and the disk is being tried.
    trying: bool,
}

/// A journal over named files.
#[derive(Debug)]
pub struct Journal {
    config: JournalConfig,
    state: State,
    desk: Desk,
    index: Index,
    queue: Queue,
    cleaning: Cleaning,
    salt: u64,
    /// The number of this start.
    start: u64,
    /// The last batch in the files, by the files' own count.
    sequence: u64,
    /// What must be done to the files before anything is written.
    mends: VecDeque<DiskOperation>,
    /// How many of these are done, but not synced.
    mended: usize,
    /// What was found at the start, until it is told.
    opening: Option<Recovered>,
    trouble: Option<Trouble>,
}

impl Journal {
    /// A journal that has not been opened.
    pub fn new(config: JournalConfig) -> Self {
        let salt = config.seed;
        Self {
            config: config.with_segments_in_bounds(),
            state: State::New,
            desk: Desk::default(),
            index: Index::default(),
            queue: Queue::default(),
            cleaning: Cleaning::default(),
            salt,
            start: 0,
            sequence: 0,
            mends: VecDeque::new(),
            mended: 0,
            opening: None,
            trouble: None,
        }
    }

    /// Reads what is there. Ends with [`JournalEvent::RecoveredAll`] or [`JournalEvent::Unusable`].
    pub fn open(&mut self, out: &mut JournalOutput) {
        if matches!(self.state, State::New) {
            self.desk.ask(DiskOperation::List, out);
            self.state = State::Recovering(Box::default());
        }
    }

    /// Takes a batch, to be written after those before it. The number of the batch; numbers rise by one with each.
    pub fn append(&mut self, batch: &Batch, out: &mut JournalOutput) -> u64 {
        let number = self.queue.next_number();
        match self.judge(batch) {
            Ok(growth) => self.queue.push(number, batch, growth),
            Err(reason) => out.events.push(JournalEvent::Refused { from: number, to: number, reason }),
        }
        number
    }

    /// Starts what is to be done, after appends. Several appends before one call are written together.
    pub fn flush(&mut self, out: &mut JournalOutput) {
        if matches!(self.state, State::Ready) {
            self.next(out);
        }
    }

    /// What became of an operation.
    pub fn done(&mut self, now: Monotonic, token: Token, outcome: DiskOutcome, out: &mut JournalOutput) {
        if !self.desk.is_answered_by(token) {
            return;
        }
        match std::mem::replace(&mut self.state, State::Ready) {
            State::Recovering(recovery) => self.recovering(recovery, outcome, out),
            State::ReadingBack(reading) => self.reading_back(reading, outcome, out),
            State::Writing(group) => self.written(now, group, outcome, out),
            State::Syncing(group) => self.synced(now, group, outcome, out),
            State::ReadingToClean => self.read_to_clean(outcome, out),
            State::Removing => self.removed(now, outcome, out),
            State::Mending => self.mended(now, outcome, out),
            State::Unusable(why) => self.state = State::Unusable(why),
            State::New => self.state = State::New,
            State::Ready => {}
        }
    }

    /// The moment of [`Journal::next_deadline`] has come: a disk that failed is tried again.
    pub fn deadline(&mut self, now: Monotonic, out: &mut JournalOutput) {
        let Some(trouble) = &mut self.trouble else { return };
        if trouble.retry_at <= now && matches!(self.state, State::Ready) {
            trouble.trying = true;
            self.next(out);
        }
    }

    /// When the disk is tried again, after a failure.
    pub fn next_deadline(&self) -> Option<Monotonic> {
        let trouble = self.trouble.as_ref().filter(|trouble| !trouble.trying)?;
        matches!(self.state, State::Ready).then_some(trouble.retry_at)
    }

    /// What the disk refuses at present, or why the journal cannot be used.
    pub fn trouble(&self) -> Option<Refused> {
        match &self.state {
            State::Unusable(why) => Some(Refused::Unusable(why.clone())),
            _ => self.trouble.as_ref().map(|trouble| Refused::Disk(trouble.why.clone())),
        }
    }

    /// How much it holds.
    pub fn held(&self) -> Held {
        Held { is_stuck: self.cleaning.is_stuck(), ..self.index.held() }
    }

    /// Whether nothing is under way and nothing waits.
    pub fn is_idle(&self) -> bool {
        matches!(self.state, State::Ready | State::Unusable(_)) && self.queue.is_empty()
    }

    /// Whether a batch can be taken: by how many bytes it makes the journal grow.
    fn judge(&self, batch: &Batch) -> Result<i64, Refused> {
        batch.check()?;
        if let Some(refused) = self.trouble() {
            return Err(refused);
        }
        let pending = self.queue.bytes() + batch.encoded_bytes();
        if pending > self.config.pending_bytes_max.max(batch.encoded_bytes()) {
            return Err(Refused::Behind { pending });
        }
        let growth = self.index.growth(batch);
        let (held, limit) = (self.index.held(), self.config.limit_bytes);
        let under_way = match &self.state {
            State::Writing(group) | State::Syncing(group) => group.growth,
            _ => 0,
        };
        let would_hold = held.live_bytes.saturating_add_signed(under_way + self.queue.growth() + growth);
        if growth > 0 && would_hold > limit {
            return Err(Refused::Limit { held: would_hold, limit });
        }
        let (disk_bytes, max) = (held.disk_bytes, self.config.disk_bytes_max());
        if growth > 0 && disk_bytes > max || disk_bytes > 2 * max {
            return Err(Refused::Crowded { disk_bytes, max });
        }
        Ok(growth)
    }

    /// Does what is most urgent. Called while nothing is under way.
    fn next(&mut self, out: &mut JournalOutput) {
        let left_alone = self.trouble.as_ref().is_some_and(|trouble| !trouble.trying);
        if !left_alone && self.mend(out) {
            return;
        }
        // A disk that cannot be written can still be read.
        if let Some(found) = self.opening.take() {
            return self.read_back(found, out);
        }
        if left_alone {
            return;
        }
        let waiting = !self.queue.is_empty() || self.trouble.is_some();
        // Cleaning and writing take turns, so that neither holds up the other.
        if !(waiting && self.cleaning.had_its_turn()) && self.clean(out) {
            return;
        }
        if waiting || self.cleaning.has_read() {
            self.write_group(out);
        }
    }
}

#[cfg(test)]
mod tests;
