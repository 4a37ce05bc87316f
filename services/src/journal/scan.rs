//! Goes through a segment piece by piece: whole frames, and what lies between them.

use super::disk::{DiskDone, DiskOperation, DiskOutcome, read_segment};
use super::format::{FRAME_HEADER, Frame, HEADER, Parsed, parse};
use bytes::Bytes;

/// How much is read at once. Larger holds more memory, smaller asks the disk more often.
const PIECE: usize = 1 << 20;
/// Where a piece cannot be read, it is read again in pieces of this size, and only those that fail count as damaged.
const SMALL_PIECE: usize = 4096;

/// What was found in a segment.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Found<'a> {
    /// A whole frame, where it begins, its body and where that begins.
    Frame { frame: Frame, at: u32, body: &'a [u8], body_at: u32 },
    /// Bytes that are no frame. What lies side by side may come in several.
    Bad { at: u32, bytes: u32 },
}

/// Reads one segment from its header on.
#[derive(Debug)]
pub(super) struct Reader {
    segment: u32,
    seed: u32,
    at: u32,
    end: u32,
    /// Bytes that must be read at once to tell what stands at `at`.
    needed: usize,
    /// What was put together from small pieces so far.
    assembled: Option<Vec<u8>>,
}

impl Reader {
    /// Reads frames up to `end`.
    pub(super) fn new(segment: u32, seed: u32, end: u32) -> Self {
        let at = (HEADER as u32).min(end);
        Self { segment, seed, at, end, needed: 0, assembled: None }
    }

    pub(super) fn is_at_end(&self) -> bool {
        self.at >= self.end
    }

    /// How much is to be read before the next step.
    fn wanted(&self) -> usize {
        self.needed.max(PIECE).min((self.end - self.at) as usize)
    }

    /// What to read next.
    pub(super) fn ask(&self) -> DiskOperation {
        match &self.assembled {
            None => read_segment(self.segment, self.at, self.wanted()),
            Some(done) => {
                let length = SMALL_PIECE.min(self.wanted() - done.len());
                read_segment(self.segment, self.at + done.len() as u32, length)
            }
        }
    }

    /// Takes what was read and tells what is in it.
    pub(super) fn take(&mut self, outcome: DiskOutcome, found: &mut dyn FnMut(Found<'_>)) {
        let wanted = self.wanted();
        let read = match outcome {
            Ok(DiskDone::Read(bytes)) => Some(bytes),
            _ => None,
        };
        let bytes = match (&mut self.assembled, read) {
            (None, Some(bytes)) => bytes,
            (None, None) => {
                self.assembled = Some(Vec::new());
                return;
            }
            (Some(done), read) => {
                let piece = SMALL_PIECE.min(wanted - done.len());
                let begin = done.len();
                done.resize(begin + piece, 0);
                let read = read.unwrap_or_default();
                let length = read.len().min(piece);
                done[begin..begin + length].copy_from_slice(&read[..length]);
                if done.len() < wanted {
                    return;
                }
                Bytes::from(self.assembled.take().unwrap_or_default())
            }
        };
        if bytes.len() < wanted {
            // The file is shorter than the directory said.
            self.end = self.at + bytes.len() as u32;
        }
        self.step(&bytes, found);
    }

    fn step(&mut self, bytes: &[u8], found: &mut dyn FnMut(Found<'_>)) {
        let begin = self.at;
        while !self.is_at_end() {
            let buffer = &bytes[((self.at - begin) as usize).min(bytes.len())..];
            match parse(buffer, (self.end - self.at) as usize, self.seed) {
                Parsed::Frame(frame, body, size) => {
                    let body_at = self.at + FRAME_HEADER as u32;
                    found(Found::Frame { frame, at: self.at, body, body_at });
                    self.at += size as u32;
                }
                Parsed::Bad(skipped) => {
                    let bytes = (skipped as u32).min(self.end - self.at);
                    found(Found::Bad { at: self.at, bytes });
                    self.at += bytes;
                }
                Parsed::Short(needed) => {
                    self.needed = needed;
                    return;
                }
            }
        }
    }
}
