//! Group commit: what waits is written together, synced once, and only then acknowledged and entered into the index.

use super::batch::{Batch, Views};
use super::disk::{DiskError, DiskOperation, DiskOutcome};
use super::format::{ALIGNMENT, FRAME_HEADER, Frame, Header, checksum_seed, encode_frame, segment_name};
use super::index::{Fingerprint, Place};
use super::{Journal, JournalEvent, JournalOutput, Refused, State};
use aldis_envelope::Monotonic;
use bytes::Bytes;
use std::collections::VecDeque;

/// A group of batches is at most this part of a segment, but for the last batch: 1 MiB by default. Larger makes each wait longer,
/// smaller syncs more often.
const GROUP_PART: usize = 16;

/// A batch that waits.
#[derive(Debug)]
struct Waiting {
    number: u64,
    body: Vec<u8>,
    growth: i64,
}

/// Batches that wait to be written.
#[derive(Debug, Default)]
pub(super) struct Queue {
    waiting: VecDeque<Waiting>,
    last_number: u64,
    bytes: usize,
    growth: i64,
}

impl Queue {
    pub(super) fn next_number(&mut self) -> u64 {
        self.last_number += 1;
        self.last_number
    }

    pub(super) fn push(&mut self, number: u64, batch: &Batch, growth: i64) {
        let mut body = Vec::with_capacity(batch.encoded_bytes());
        batch.operations().iter().for_each(|operation| operation.view().encode(&mut body));
        self.bytes += body.len();
        self.growth += growth;
        self.waiting.push_back(Waiting { number, body, growth });
    }

    fn pop(&mut self) -> Option<Waiting> {
        let first = self.waiting.pop_front()?;
        self.bytes -= first.body.len();
        self.growth -= first.growth;
        Some(first)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Bytes that wait.
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    /// By how much the journal grows with what waits.
    pub(super) fn growth(&self) -> i64 {
        self.growth
    }

    pub(super) fn refuse_all(&mut self, reason: &Refused, out: &mut JournalOutput) {
        let numbers = self.waiting.front().zip(self.waiting.back()).map(|(a, b)| (a.number, b.number));
        if let Some((from, to)) = numbers {
            out.events.push(JournalEvent::Refused { from, to, reason: reason.clone() });
        }
        self.waiting.clear();
        (self.bytes, self.growth) = (0, 0);
    }
}

/// What is written and synced together.
#[derive(Debug)]
pub(super) struct Group {
    segment: u32,
    /// Where it begins.
    offset: u32,
    /// Whether the segment begins with it.
    is_new: bool,
    /// Its bytes, until they are handed to the disk.
    bytes: Vec<u8>,
    length: u32,
    seed: u32,
    /// The last frame before it, which is on disk.
    synced: u64,
    /// The last frame in it.
    sequence: u64,
    /// What changes in the index, in this order.
    changes: Vec<(Fingerprint, Option<Place>)>,
    /// The first and the last of the owner's batches in it.
    numbers: Option<(u64, u64)>,
    /// By how much the journal grows with them.
    pub(super) growth: i64,
    /// How far the oldest segment is cleaned with it.
    pub(super) cleaned_to: Option<u32>,
}

impl Group {
    /// Where the file ends after it.
    fn end(&self) -> u32 {
        self.offset + self.length
    }

    pub(super) fn has_frames(&self) -> bool {
        self.sequence > self.synced
    }

    /// Adds a frame with this body.
    pub(super) fn push(&mut self, body: &[u8]) {
        self.sequence += 1;
        let frame = Frame { sequence: self.sequence, synced: self.synced };
        let begin = self.bytes.len() + FRAME_HEADER;
        encode_frame(&mut self.bytes, self.seed, frame, |buffer| buffer.extend_from_slice(body));
        for (offset, view) in Views::new(body) {
            let at = self.offset as usize + begin + offset;
            let place = view.value.map(|_| Place::new(self.segment, at, view.encoded_bytes()));
            self.changes.push((Fingerprint::of(&view), place));
        }
    }
}

impl Journal {
    /// A group for the end of the newest segment, or for the beginning of the next.
    fn new_group(&self) -> Group {
        let newest = self.index.newest();
        let open = newest.filter(|segment| segment.length < self.config.segment_bytes);
        let segment = open.or(newest).map_or(1, |s| if open.is_some() { s.number } else { s.number + 1 });
        let header =
            Header { segment, salt: self.salt, start: self.start, first_sequence: self.sequence + 1 };
        Group {
            segment,
            offset: open.map_or(0, |segment| segment.length.next_multiple_of(ALIGNMENT as u32)),
            is_new: open.is_none(),
            bytes: if open.is_some() { Vec::new() } else { header.encode().to_vec() },
            length: 0,
            seed: checksum_seed(self.salt, segment),
            synced: self.sequence,
            sequence: self.sequence,
            changes: Vec::new(),
            numbers: None,
            growth: 0,
            cleaned_to: None,
        }
    }

    /// Writes what waits, what cleaning has to keep, or after trouble an empty frame to see whether the disk works.
    pub(super) fn write_group(&mut self, out: &mut JournalOutput) {
        let mut group = self.new_group();
        // Copies go first: a batch that waits may replace or forget what they hold.
        self.keep_what_stands(&mut group);
        let full = group.bytes.len() + self.config.segment_bytes as usize / GROUP_PART;
        while group.bytes.len() <= full
            && let Some(batch) = self.queue.pop()
        {
            group.push(&batch.body);
            group.growth += batch.growth;
            let first = group.numbers.map_or(batch.number, |(first, _)| first);
            group.numbers = Some((first, batch.number));
        }
        if self.trouble.is_some() && !group.has_frames() {
            group.push(&[]);
        }
        if !group.has_frames() {
            self.cleaning.has_cleaned(group.cleaned_to);
            return self.next(out);
        }
        let bytes = Bytes::from(std::mem::take(&mut group.bytes));
        let (file, offset) = (segment_name(group.segment), u64::from(group.offset));
        group.length = bytes.len() as u32;
        self.desk.ask(DiskOperation::Write { file, offset, bytes }, out);
        self.state = State::Writing(group);
    }

    pub(super) fn written(
        &mut self,
        now: Monotonic,
        group: Group,
        outcome: DiskOutcome,
        out: &mut JournalOutput,
    ) {
        match outcome {
            Ok(_) => {
                let (file, is_new) = (segment_name(group.segment), group.is_new);
                self.desk.ask(DiskOperation::Sync { file, is_new }, out);
                self.state = State::Syncing(group);
            }
            Err(why) => self.take_back(now, &group, why, out),
        }
    }

    pub(super) fn synced(
        &mut self,
        now: Monotonic,
        group: Group,
        outcome: DiskOutcome,
        out: &mut JournalOutput,
    ) {
        if let Err(why) = outcome {
            return self.take_back(now, &group, why, out);
        }
        if group.is_new {
            self.index.add_segment(group.segment, 0);
        }
        self.index.set_length(group.end());
        self.sequence = group.sequence;
        for (fingerprint, place) in group.changes {
            self.index.set(fingerprint, place);
        }
        self.cleaning.has_cleaned(group.cleaned_to);
        self.cleaning.let_it_have_a_turn(group.length, self.config.segment_bytes);
        if let Some((_, up_to)) = group.numbers {
            out.events.push(JournalEvent::Written { up_to });
        }
        self.has_worked(out);
        self.next(out);
    }

    /// A group is not on disk, or not for sure: it is cut off again before anything else is written.
    fn take_back(&mut self, now: Monotonic, group: &Group, why: DiskError, out: &mut JournalOutput) {
        if let Some((from, to)) = group.numbers {
            out.events.push(JournalEvent::Refused { from, to, reason: Refused::Disk(why.clone()) });
        }
        let file = segment_name(group.segment);
        if group.is_new {
            self.mends.push_back(DiskOperation::Remove { file });
        } else {
            let length = u64::from(group.offset);
            self.mends.push_back(DiskOperation::Truncate { file: file.clone(), length });
            self.mends.push_back(DiskOperation::Sync { file, is_new: false });
        }
        self.cleaning.forget_what_was_read();
        self.fail(now, why, out);
    }
}
