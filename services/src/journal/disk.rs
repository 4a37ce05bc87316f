//! What the journal asks of a disk.

use super::JournalOutput;
use super::format::segment_name;
use bytes::Bytes;

/// Names one operation; its outcome is told with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Token(pub u64);

/// An operation to carry out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DiskEffect {
    /// Comes back with the outcome.
    pub token: Token,
    /// What to do.
    pub operation: DiskOperation,
}

/// An operation on files in the journal's directory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DiskOperation {
    /// Tell the files of the directory with their lengths in bytes.
    List,
    /// Read so many bytes from an offset; fewer where the file ends before.
    Read {
        /// The file.
        file: String,
        /// Where.
        offset: u64,
        /// How many bytes.
        length: usize,
    },
    /// Write at an offset, making the file where there is none.
    Write {
        /// The file.
        file: String,
        /// Where.
        offset: u64,
        /// What.
        bytes: Bytes,
    },
    /// Have all that was written to a file on disk, its length and, where it is new, its name too.
    Sync {
        /// The file.
        file: String,
        /// Whether it was made since its directory was last synced.
        is_new: bool,
    },
    /// Cut a file to a length.
    Truncate {
        /// The file.
        file: String,
        /// Its new length in bytes.
        length: u64,
    },
    /// Remove a file. Done when the removal itself is on disk. A file that is not there counts as removed.
    Remove {
        /// The file.
        file: String,
    },
}

/// What became of an operation.
pub type DiskOutcome = Result<DiskDone, DiskError>;

/// What a successful operation gives.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DiskDone {
    /// The files of the directory with their lengths in bytes.
    Listed(Vec<(String, u64)>),
    /// What was read.
    Read(Bytes),
    /// It is done.
    Done,
}

/// Why an operation failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DiskError {
    /// There is no space.
    #[error("no space left ({0})")]
    Full(String),
    /// Anything else.
    #[error("{0}")]
    Failed(String),
}

/// Numbers operations, and knows which answer is awaited.
#[derive(Debug, Default)]
pub(super) struct Desk {
    last: Token,
    awaited: bool,
}

impl Desk {
    pub(super) fn ask(&mut self, operation: DiskOperation, out: &mut JournalOutput) {
        self.last = Token(self.last.0 + 1);
        self.awaited = true;
        out.effects.push(DiskEffect { token: self.last, operation });
    }

    pub(super) fn is_answered_by(&mut self, token: Token) -> bool {
        let answered = self.awaited && token == self.last;
        self.awaited &= !answered;
        answered
    }
}

/// Reads from a segment.
pub(super) fn read_segment(segment: u32, offset: u32, length: usize) -> DiskOperation {
    DiskOperation::Read { file: segment_name(segment), offset: u64::from(offset), length }
}
