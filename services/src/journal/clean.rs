//! Cleaning: what still stands in the oldest segment moves to the end, a piece at a time, and then the segment goes.
//!
//! Only the oldest segment is ever cleaned. What a forget in it forgot stood in segments that are gone, so it can go too.

use super::batch::{View, Views};
use super::commit::Group;
use super::disk::{DiskDone, DiskOperation, DiskOutcome, read_segment};
use super::format::{FRAME_HEADER, HEADER, Parsed, checksum_seed, parse, segment_name};
use super::index::{Fingerprint, Place, Segment};
use super::{Journal, JournalOutput, State};
use aldis_envelope::Monotonic;
use bytes::Bytes;

/// The least that is read of a segment in one step, as a part of it: 256 KiB by default.
const PIECE_PART_MIN: u32 = 64;
/// The most: 4 MiB by default. Larger makes batches wait longer.
const PIECE_PART_MAX: u32 = 4;
/// For each byte written so many are cleaned: with half of all dead, two would only keep pace.
const PIECE_PER_WRITTEN: u32 = 4;
/// What is kept is written in frames of about this part of a segment: 64 KiB by default. Larger loses more to one damaged byte,
/// smaller takes more space.
const FRAME_PART: u32 = 256;
/// The least size of such a frame: below it the heads of frames would be what is cleaned for ever.
const FRAME_BYTES_MIN: u32 = 256;

/// How far cleaning has come.
#[derive(Debug, Default)]
pub(super) struct Cleaning {
    /// The segment being cleaned.
    segment: u32,
    /// How far it is cleaned.
    at: u32,
    /// What was read from there on, and is to be kept where it still stands.
    read: Option<Bytes>,
    /// How much to read next.
    piece: u32,
    /// How much must be read for the next frame to be whole.
    needed: u32,
    /// How much is being read.
    asked: u32,
    /// Cleaning goes on up to this segment.
    until: Option<u32>,
    had_its_turn: bool,
    /// The segment cannot be cleaned: something that stands in it cannot be read.
    stuck: bool,
}

impl Cleaning {
    /// Whether it is for what waits to be written now.
    pub(super) fn had_its_turn(&self) -> bool {
        self.had_its_turn
    }

    pub(super) fn has_read(&self) -> bool {
        self.read.is_some()
    }

    pub(super) fn is_stuck(&self) -> bool {
        self.stuck
    }

    /// So much was written.
    pub(super) fn let_it_have_a_turn(&mut self, written: u32, segment_bytes: u32) {
        self.had_its_turn = false;
        let (least, most) = (segment_bytes / PIECE_PART_MIN, segment_bytes / PIECE_PART_MAX);
        self.piece = written.saturating_mul(PIECE_PER_WRITTEN).clamp(least, most);
    }

    /// What was kept up to here is on disk.
    pub(super) fn has_cleaned(&mut self, to: Option<u32>) {
        if let Some(to) = to {
            self.at = to;
            self.read = None;
        }
    }

    pub(super) fn forget_what_was_read(&mut self) {
        self.read = None;
    }
}

impl Journal {
    /// Begins a step of cleaning, if one is due.
    pub(super) fn clean(&mut self, out: &mut JournalOutput) -> bool {
        if self.cleaning.has_read() {
            return false;
        }
        let (Some(oldest), Some(newest)) = (self.index.oldest(), self.index.newest()) else { return false };
        if oldest.number == newest.number {
            return false;
        }
        if self.cleaning.segment != oldest.number {
            let Cleaning { until, piece, .. } = self.cleaning;
            let (segment, at) = (oldest.number, HEADER as u32);
            self.cleaning = Cleaning { segment, at, until, piece, ..Default::default() };
        }
        if oldest.live == 0 {
            self.desk.ask(DiskOperation::Remove { file: segment_name(oldest.number) }, out);
            self.state = State::Removing;
        } else if self.is_worth_cleaning(oldest, newest) && self.cleaning.at < oldest.length {
            let least = self.config.segment_bytes / PIECE_PART_MIN;
            let length = self.cleaning.piece.max(least).max(self.cleaning.needed);
            self.cleaning.asked = length.min(oldest.length - self.cleaning.at);
            let read = read_segment(oldest.number, self.cleaning.at, self.cleaning.asked as usize);
            self.desk.ask(read, out);
            self.state = State::ReadingToClean;
        } else {
            self.cleaning.stuck = self.cleaning.at >= oldest.length;
            return false;
        }
        self.cleaning.had_its_turn = true;
        true
    }

    /// Begins where more than half is dead, and goes on until no more than a quarter is, or all was cleaned once.
    fn is_worth_cleaning(&mut self, oldest: Segment, newest: Segment) -> bool {
        let held = self.index.held();
        let dead = held.disk_bytes - held.live_bytes;
        if held.disk_bytes >= 2 * u64::from(self.config.segment_bytes) && dead * 2 > held.disk_bytes {
            self.cleaning.until.get_or_insert(newest.number);
        }
        let goes_on = |until: &u32| oldest.number <= *until && dead * 4 > held.disk_bytes;
        self.cleaning.until = self.cleaning.until.filter(goes_on);
        self.cleaning.until.is_some()
    }

    pub(super) fn read_to_clean(&mut self, outcome: DiskOutcome, out: &mut JournalOutput) {
        match outcome {
            Ok(DiskDone::Read(bytes)) if bytes.len() == self.cleaning.asked as usize => {
                self.cleaning.read = Some(bytes)
            }
            // What cannot be read is left where it is: the next start names it.
            _ => self.cleaning.at = self.index.oldest().map_or(0, |oldest| oldest.length),
        }
        self.next(out);
    }

    /// Adds to a group what still stands in the piece that was read.
    pub(super) fn keep_what_stands(&mut self, group: &mut Group) {
        let (Some(read), Some(oldest)) = (self.cleaning.read.clone(), self.index.oldest()) else { return };
        let seed = checksum_seed(self.salt, oldest.number);
        let frame_bytes = (self.config.segment_bytes / FRAME_PART).max(FRAME_BYTES_MIN) as usize;
        let mut kept = Vec::new();
        let mut at = 0;
        while at < read.len() {
            let place = self.cleaning.at as usize + at;
            match parse(&read[at..], oldest.length as usize - place, seed) {
                Parsed::Frame(_, body, size) => {
                    let stands = |view: &View<'_>, offset| {
                        let here =
                            Place::new(oldest.number, place + FRAME_HEADER + offset, view.encoded_bytes());
                        self.index.stands_at(Fingerprint::of(view), here)
                    };
                    for (_, view) in Views::new(body).filter(|(offset, view)| stands(view, *offset)) {
                        view.encode(&mut kept);
                        if kept.len() >= frame_bytes {
                            group.push(&std::mem::take(&mut kept));
                        }
                    }
                    at += size;
                }
                Parsed::Bad(size) => at += size,
                Parsed::Short(needed) => {
                    self.cleaning.needed = needed as u32;
                    break;
                }
            }
        }
        if !kept.is_empty() {
            group.push(&kept);
        }
        group.cleaned_to = Some(self.cleaning.at + at as u32);
    }

    pub(super) fn removed(&mut self, now: Monotonic, outcome: DiskOutcome, out: &mut JournalOutput) {
        match outcome {
            Ok(_) => self.index.remove_oldest(),
            Err(why) => self.fail(now, why, out),
        }
        self.next(out);
    }
}
