//! Tells the owner what stands.

use super::batch::Views;
use super::disk::DiskOutcome;
use super::format::checksum_seed;
use super::index::{Fingerprint, Place, Segment};
use super::scan::{Found, Reader};
use super::{Journal, JournalEvent, JournalOutput, Recovered, State};
use bytes::Bytes;
use std::collections::VecDeque;

/// How far telling has come.
#[derive(Debug)]
pub(super) struct ReadBack {
    /// Segments that are not read yet.
    left: VecDeque<Segment>,
    reading: Option<(u32, Reader)>,
    told: Recovered,
}

impl Journal {
    /// Begins to tell what stands.
    pub(super) fn read_back(&mut self, mut told: Recovered, out: &mut JournalOutput) {
        told.is_kept = self.mends.is_empty();
        let left = self.index.segments().filter(|segment| segment.live > 0).collect();
        self.go_on_reading_back(ReadBack { left, reading: None, told }, out);
    }

    pub(super) fn reading_back(&mut self, mut back: ReadBack, outcome: DiskOutcome, out: &mut JournalOutput) {
        if let Some((segment, reader)) = &mut back.reading {
            let (segment, index, records) = (*segment, &self.index, &mut back.told.records);
            reader.take(outcome, &mut |found| {
                let Found::Frame { body, body_at, .. } = found else { return };
                for (offset, view) in Views::new(body) {
                    let place = Place::new(segment, body_at as usize + offset, view.encoded_bytes());
                    let Some(value) = view.value else { continue };
                    if index.stands_at(Fingerprint::of(&view), place) {
                        *records += 1;
                        // Copied, so that a small record does not keep the piece that it was read in.
                        let (key, value) = (Bytes::copy_from_slice(view.key), Bytes::copy_from_slice(value));
                        out.events.push(JournalEvent::Recovered { space: view.space, key, value });
                    }
                }
            });
        }
        self.go_on_reading_back(back, out);
    }

    fn go_on_reading_back(&mut self, mut back: ReadBack, out: &mut JournalOutput) {
        if back.reading.as_ref().is_some_and(|(_, reader)| reader.is_at_end()) {
            back.reading = None;
        }
        if back.reading.is_none()
            && let Some(next) = back.left.pop_front()
        {
            let seed = checksum_seed(self.salt, next.number);
            back.reading = Some((next.number, Reader::new(next.number, seed, next.length)));
        }
        match &back.reading {
            Some((_, reader)) => {
                self.desk.ask(reader.ask(), out);
                self.state = State::ReadingBack(back);
            }
            None => {
                out.events.push(JournalEvent::RecoveredAll(back.told));
                self.state = State::Ready;
                self.next(out);
            }
        }
    }
}
