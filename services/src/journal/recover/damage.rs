//! What cannot be read, and what that says.

use std::fmt;

/// A part of a journal that could not be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// The file in the journal's directory.
    pub file: String,
    /// Where it begins.
    pub offset: u64,
    /// How many bytes, up to what could be read again; those of the files behind it too where the end was torn.
    pub bytes: u64,
    /// What it is.
    pub kind: DamageKind,
}

/// What a damaged part was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DamageKind {
    /// It was on disk and is lost, with so many batches.
    Lost {
        /// How many batches, where that can be told from the batches around it.
        batches: Option<u64>,
    },
    /// The last write, torn by a crash and cut off: it was not acknowledged.
    TornEnd,
    /// The count of starts. It goes on far beyond the last that is known.
    StartsLost,
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, offset, bytes, .. } = self;
        write!(f, "{file}: {bytes} bytes from {offset} on ")?;
        match self.kind {
            DamageKind::Lost { batches: Some(batches) } => {
                write!(f, "are damaged: {batches} batches are lost")
            }
            DamageKind::Lost { batches: None } => write!(f, "are damaged: what was in them is lost"),
            DamageKind::TornEnd => write!(f, "are torn and cut off: they were not acknowledged"),
            DamageKind::StartsLost => write!(f, "are damaged: the count of starts jumps ahead"),
        }
    }
}

/// A place where no frame stands, while all is gone through.
#[derive(Debug)]
pub(super) struct Hole {
    /// The file, by its place in the list.
    pub(super) place: usize,
    pub(super) at: u32,
    pub(super) bytes: u32,
    /// The frame that should follow.
    expected: Option<u64>,
    /// The frame that does.
    next: Option<u64>,
}

impl Hole {
    pub(super) fn new(place: usize, at: u32, bytes: u32, expected: Option<u64>) -> Self {
        Self { place, at, bytes, expected, next: None }
    }

    /// Whether no frame was found behind it yet.
    pub(super) fn is_open(&self) -> bool {
        self.next.is_none()
    }

    /// A frame was found behind it.
    pub(super) fn close(&mut self, sequence: u64) {
        self.next.get_or_insert(sequence);
    }

    pub(super) fn continues_at(&self, place: usize, at: u32) -> bool {
        self.is_open() && self.place == place && self.at + self.bytes == at
    }

    /// Whether it is the work of a crash: something is missing that was not on disk for sure, as far as is known from
    /// the frame behind which all up to `synced` was.
    pub(super) fn is_torn(&self, synced: u64) -> bool {
        match (self.expected, self.next) {
            (_, None) => true,
            (Some(expected), Some(next)) => next > expected && next - 1 > synced,
            (None, Some(_)) => false,
        }
    }

    pub(super) fn damage(&self, file: String) -> Damage {
        let batches = self.expected.zip(self.next).map(|(expected, next)| next - expected);
        Damage {
            file,
            offset: u64::from(self.at),
            bytes: u64::from(self.bytes),
            kind: DamageKind::Lost { batches },
        }
    }
}
