//! The start of a journal: what there is, where it is torn or damaged, and what has to be cut off.
//!
//! A hole between frames is judged by the frames behind it. If one of them was written when all that is missing was known to be
//! on disk, the hole is damage, and what lies behind it stands. If not, a crash has torn the last write: nothing in it
//! was acknowledged, and it is cut off at the hole, so that no batch stands without those before it.

mod damage;
mod order;

pub use damage::{Damage, DamageKind};

use super::batch::Views;
use super::disk::{DiskDone, DiskOperation, DiskOutcome, read_segment};
use super::format::{HEADER, Header, IDENTITY, Opened, SLOT, checksum_seed, segment_name, segment_of};
use super::index::{Fingerprint, Index, Place, SEGMENTS_MAX};
use super::scan::{Found, Reader};
use super::{Journal, JournalEvent, JournalOutput, Refused, State, Unusable};
use bytes::Bytes;
use damage::Hole;

/// A segment in the directory.
#[derive(Debug)]
struct File {
    number: u32,
    length: u32,
    header: Option<Header>,
}

/// What is being read.
#[derive(Debug, Default)]
enum Step {
    #[default]
    List,
    Identity,
    /// The header of the file at this place.
    Header(usize),
    /// The frames of the file at this place.
    Frames(usize, Option<Reader>),
    /// The last group, from this offset in this segment.
    LastGroup(u32, u32),
}

/// What is known so far.
#[derive(Debug, Default)]
pub(super) struct Recovery {
    step: Step,
    files: Vec<File>,
    has_identity: bool,
    /// The slots of the identity.
    slots: [Option<Header>; 2],
    /// The number of the next frame, once one is known.
    expected: Option<u64>,
    /// The last frame that any frame knows to be on disk.
    synced: u64,
    /// The file and the offset where the last group begins, and what was on disk when it was written.
    last_group: Option<(usize, u32, u64)>,
    holes: Vec<Hole>,
    /// Where to stop: what lies behind was torn.
    cut: Option<(usize, u32)>,
}

impl Journal {
    /// Goes on with the start.
    pub(super) fn recovering(
        &mut self,
        mut recovery: Box<Recovery>,
        outcome: DiskOutcome,
        out: &mut JournalOutput,
    ) {
        let next = match std::mem::take(&mut recovery.step) {
            Step::List => recovery.listed(outcome),
            Step::Identity => recovery.read_identity(outcome),
            Step::Header(place) => recovery.read_header(place, outcome),
            Step::Frames(place, reader) => {
                if let Some(mut reader) = reader {
                    let index = &mut self.index;
                    reader.take(outcome, &mut |found| recovery.found(place, found, index));
                    recovery.step = Step::Frames(place, Some(reader));
                }
                Ok(None)
            }
            Step::LastGroup(segment, offset) => {
                let offset = u64::from(offset);
                let write = |bytes| DiskOperation::Write { file: segment_name(segment), offset, bytes };
                return self.put_in_order(
                    *recovery,
                    Some(read(outcome)).filter(|b| !b.is_empty()).map(write),
                    out,
                );
            }
        };
        match next {
            Ok(Some(operation)) => {
                self.desk.ask(operation, out);
                self.state = State::Recovering(recovery);
            }
            Ok(None) => self.survey(recovery, out),
            Err(why) => {
                out.events.push(JournalEvent::Unusable(why.clone()));
                self.queue.refuse_all(&Refused::Unusable(why.clone()), out);
                self.state = State::Unusable(why);
            }
        }
    }

    /// Goes through the frames of all segments.
    fn survey(&mut self, mut recovery: Box<Recovery>, out: &mut JournalOutput) {
        loop {
            let (place, reader) = match std::mem::take(&mut recovery.step) {
                Step::Frames(place, Some(reader)) if reader.is_at_end() => (place + 1, None),
                Step::Frames(place, reader) => (place, reader),
                _ => (0, None),
            };
            if place == 0 && reader.is_none() {
                self.index.clear();
                for file in &recovery.files {
                    self.index.add_segment(file.number, file.length);
                }
            }
            if place >= recovery.end() {
                if recovery.must_stop_earlier() {
                    continue;
                }
                return self.surveyed(*recovery, out);
            }
            let reader = reader.unwrap_or_else(|| recovery.reader(place));
            if !reader.is_at_end() {
                self.desk.ask(reader.ask(), out);
                recovery.step = Step::Frames(place, Some(reader));
                self.state = State::Recovering(recovery);
                return;
            }
            recovery.step = Step::Frames(place, Some(reader));
        }
    }

    /// All is read. The last group may be in the system's memory alone, where only the process had ended; and where its
    /// sync had failed, no later sync helps. It is read once more, to be written again.
    fn surveyed(&mut self, mut recovery: Recovery, out: &mut JournalOutput) {
        match recovery.last_group() {
            Some((segment, begin, end)) => {
                self.desk.ask(read_segment(segment, begin, (end - begin) as usize), out);
                recovery.step = Step::LastGroup(segment, begin);
                self.state = State::Recovering(Box::new(recovery));
            }
            None => self.put_in_order(recovery, None, out),
        }
    }
}

impl Recovery {
    fn listed(&mut self, outcome: DiskOutcome) -> Result<Option<DiskOperation>, Unusable> {
        let files = match outcome {
            Ok(DiskDone::Listed(files)) => files,
            Ok(_) => Vec::new(),
            Err(why) => return Err(Unusable::Directory(why)),
        };
        self.has_identity = files.iter().any(|(name, _)| name == IDENTITY);
        let segments = files.iter().filter_map(|(name, length)| {
            let length = u32::try_from(*length).unwrap_or(u32::MAX);
            segment_of(name).map(|number| File { number, length, header: None })
        });
        self.files = segments.collect();
        self.files.sort_by_key(|file| file.number);
        if let (Some(first), Some(last)) = (self.files.first(), self.files.last()) {
            let count = (last.number - first.number) as usize + 1;
            if count >= SEGMENTS_MAX {
                return Err(Unusable::TooMany { count, max: SEGMENTS_MAX - 1 });
            }
        }
        self.step = Step::Identity;
        Ok(Some(DiskOperation::Read { file: IDENTITY.into(), offset: 0, length: 2 * SLOT }))
    }

    fn read_identity(&mut self, outcome: DiskOutcome) -> Result<Option<DiskOperation>, Unusable> {
        let bytes = read(outcome);
        for (slot, place) in self.slots.iter_mut().zip([0, SLOT]) {
            *slot = header(bytes.get(place..).unwrap_or_default(), 0, IDENTITY)?;
        }
        self.next_header(0)
    }

    fn read_header(&mut self, place: usize, outcome: DiskOutcome) -> Result<Option<DiskOperation>, Unusable> {
        let file = &mut self.files[place];
        file.header = header(&read(outcome), file.number, &segment_name(file.number))?;
        self.next_header(place + 1)
    }

    /// All headers come before anything else, so that a journal of a newer version is seen before anything is done.
    fn next_header(&mut self, place: usize) -> Result<Option<DiskOperation>, Unusable> {
        if let Some(file) = self.files.get(place) {
            self.step = Step::Header(place);
            return Ok(Some(read_segment(file.number, 0, HEADER)));
        }
        if let Some(first) = self.files.first()
            && self.salt().is_none()
        {
            return Err(Unusable::NoJournal { file: segment_name(first.number) });
        }
        self.begin();
        Ok(None)
    }

    /// Makes ready to go through all frames.
    fn begin(&mut self) {
        self.holes.clear();
        self.last_group = None;
        let headers = || self.files.iter().filter_map(|file| file.header);
        self.expected = self.files.first().and_then(|file| file.header).map(|h| h.first_sequence);
        // A segment is begun when all before it is on disk.
        self.synced = headers().map(|h| h.first_sequence.saturating_sub(1)).max().unwrap_or(0);
        self.step = Step::Frames(0, None);
    }

    /// The checksums of a journal without any readable header are hopeless; one header gives those of all.
    fn salt(&self) -> Option<u64> {
        let segments = self.files.iter().filter_map(|file| file.header);
        self.slots.iter().flatten().copied().chain(segments).map(|header| header.salt).next()
    }

    fn reader(&mut self, place: usize) -> Reader {
        let file = &self.files[place];
        let salt = file.header.map(|header| header.salt).or_else(|| self.salt()).unwrap_or_default();
        let (number, length) = (file.number, file.length);
        let before = place.checked_sub(1).map(|before| self.files[before].number + 1);
        if file.header.is_none() || before.is_some_and(|before| before != number) {
            let bytes = if file.header.is_none() { length.min(HEADER as u32) } else { 0 };
            self.bad(place, 0, bytes);
        }
        let end = match self.cut {
            Some((cut_place, offset)) if cut_place == place => offset,
            _ => length,
        };
        Reader::new(number, checksum_seed(salt, number), end)
    }

    /// How many files are gone through.
    fn end(&self) -> usize {
        self.cut.map_or(self.files.len(), |(place, _)| place + 1)
    }

    fn found(&mut self, place: usize, found: Found<'_>, index: &mut Index) {
        match found {
            Found::Bad { at, bytes } => self.bad(place, at, bytes),
            Found::Frame { frame, at, body, body_at } => {
                let expected = self.expected.unwrap_or(frame.sequence);
                if frame.sequence < expected {
                    return self.bad(place, at, body_at - at + body.len() as u32);
                }
                if frame.sequence > expected && !self.holes.last().is_some_and(Hole::is_open) {
                    self.bad(place, at, 0);
                }
                self.holes.iter_mut().for_each(|hole| hole.close(frame.sequence));
                self.expected = Some(frame.sequence + 1);
                // All frames of a group were written with the same knowledge.
                if self.last_group.is_none_or(|(_, _, synced)| synced != frame.synced) {
                    self.last_group = Some((place, at, frame.synced));
                }
                self.synced = self.synced.max(frame.synced);
                let number = self.files[place].number;
                for (offset, view) in Views::new(body) {
                    let stands = view
                        .value
                        .map(|_| Place::new(number, body_at as usize + offset, view.encoded_bytes()));
                    index.set(Fingerprint::of(&view), stands);
                }
            }
        }
    }

    fn bad(&mut self, place: usize, at: u32, bytes: u32) {
        match self.holes.last_mut() {
            Some(hole) if hole.continues_at(place, at) => hole.bytes += bytes,
            _ => self.holes.push(Hole::new(place, at, bytes, self.expected)),
        }
    }

    /// The first hole that a crash has torn.
    fn torn(&self) -> Option<&Hole> {
        self.holes.iter().find(|hole| hole.is_torn(self.synced))
    }

    /// Whether something behind a torn place was taken: then all is gone through once more, up to there.
    fn must_stop_earlier(&mut self) -> bool {
        let Some((place, at)) = self.torn().filter(|hole| !hole.is_open()).map(|hole| (hole.place, hole.at))
        else {
            return false;
        };
        let synced = self.synced;
        self.begin();
        (self.synced, self.cut) = (synced, Some((place, at)));
        true
    }

    fn cut_at(&self) -> Option<(usize, u32)> {
        self.cut.or_else(|| self.torn().map(|hole| (hole.place, hole.at)))
    }

    /// The segment of the last group, where it begins, and where it ends.
    fn last_group(&self) -> Option<(u32, u32, u32)> {
        let (place, at, _) = self.last_group?;
        let file = &self.files[place];
        let end = self.cut_at().filter(|(cut, _)| *cut == place).map_or(file.length, |(_, offset)| offset);
        // The header was written with the first frame.
        let begin = if at == HEADER as u32 { 0 } else { at };
        (begin < end).then_some((file.number, begin, end))
    }

    /// Whether anything of a file that is cut stays.
    fn keeps(&self, place: usize, offset: u32) -> bool {
        offset > HEADER as u32 || offset == HEADER as u32 && self.files[place].header.is_some()
    }

    fn damage(&self) -> Vec<Damage> {
        let cut = self.cut_at();
        let whole = |hole: &&Hole| cut.is_none_or(|cut| (hole.place, hole.at) < cut);
        let name = |place: usize| segment_name(self.files[place].number);
        let mut damage: Vec<_> =
            self.holes.iter().filter(whole).map(|hole| hole.damage(name(hole.place))).collect();
        if let Some((place, offset)) = cut {
            let rest: u64 = self.files[place..].iter().map(|file| u64::from(file.length)).sum();
            damage.push(Damage {
                file: name(place),
                offset: u64::from(offset),
                bytes: rest - u64::from(offset),
                kind: DamageKind::TornEnd,
            });
        }
        if self.slots == [None; 2] && (self.has_identity || !self.files.is_empty()) {
            let kind = DamageKind::StartsLost;
            damage.push(Damage { file: IDENTITY.into(), offset: 0, bytes: 2 * SLOT as u64, kind });
        }
        damage
    }
}

/// What was read; nothing where it could not be.
fn read(outcome: DiskOutcome) -> Bytes {
    match outcome {
        Ok(DiskDone::Read(bytes)) => bytes,
        _ => Bytes::new(),
    }
}

fn header(bytes: &[u8], segment: u32, file: &str) -> Result<Option<Header>, Unusable> {
    match Header::decode(bytes, segment) {
        Opened::Header(header) => Ok(Some(header)),
        Opened::Newer(version) => Err(Unusable::Newer { file: file.to_owned(), version }),
        Opened::Damaged => Ok(None),
    }
}
