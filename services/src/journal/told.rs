//! What the owner of a journal is told.

use super::batch::BatchError;
use super::disk::DiskError;
use super::format::VERSION;
use super::recover::Damage;
use bytes::Bytes;

/// Why a batch is not kept.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refused {
    /// The batch itself cannot be kept.
    #[error(transparent)]
    Batch(#[from] BatchError),
    /// The journal is as large as it may be.
    #[error("the journal holds {held} bytes of at most {limit}: let it hold more, or less be kept")]
    Limit {
        /// Bytes of records that it would hold.
        held: u64,
        /// Bytes that it may hold.
        limit: u64,
    },
    /// The files are as large as they may be, with what is no longer needed in them.
    #[error("the journal takes {disk_bytes} bytes on disk of at most {max}: cleaning does not keep up")]
    Crowded {
        /// Bytes on disk.
        disk_bytes: u64,
        /// Bytes that may be on disk.
        max: u64,
    },
    /// Too much waits to be written.
    #[error("{pending} bytes wait to be written: the disk does not keep up")]
    Behind {
        /// Bytes that wait.
        pending: usize,
    },
    /// The disk refuses; it is tried again from time to time.
    #[error("the disk refuses: {0}")]
    Disk(DiskError),
    /// The journal cannot be used at all.
    #[error(transparent)]
    Unusable(Unusable),
}

/// Why a journal cannot be used. Nothing in it has been changed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unusable {
    /// It was written by a newer program.
    #[error(
        "{file} has format {version}, this program knows {VERSION}: use the newer program, or another directory"
    )]
    Newer {
        /// The file that says so.
        file: String,
        /// The version of its format.
        version: u16,
    },
    /// Files have the names of a journal's, but nothing in them can be read.
    #[error("{file} is no journal of Aldis, or its beginning is damaged beyond reading: move it away")]
    NoJournal {
        /// The first of these files.
        file: String,
    },
    /// The directory cannot be read.
    #[error("the directory of the journal cannot be read: {0}")]
    Directory(DiskError),
    /// There are more segments than a journal of this size has.
    #[error("the directory holds {count} segments, {max} can be: move them away")]
    TooMany {
        /// How many there are.
        count: usize,
        /// How many can be.
        max: usize,
    },
}

/// What the owner of a journal is told.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum JournalEvent {
    /// A record that stands.
    Recovered {
        /// Its space.
        space: u8,
        /// Its key.
        key: Bytes,
        /// Its value.
        value: Bytes,
    },
    /// All that stands has been told.
    RecoveredAll(Recovered),
    /// All batches up to this number are on disk, but those that were refused before.
    Written {
        /// The number of the last.
        up_to: u64,
    },
    /// Batches that are not kept.
    Refused {
        /// The number of the first.
        from: u64,
        /// The number of the last.
        to: u64,
        /// Why.
        reason: Refused,
    },
    /// The disk takes what is written again.
    Resumed,
    /// The journal cannot be used; all batches are refused.
    Unusable(Unusable),
}

/// What was found at the start.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Recovered {
    /// The number of this start, from 1. Larger than that of every start before, also where the count was damaged.
    pub start: u64,
    /// Whether the number of this start and all that was told are on disk for sure. If not, the disk cannot be written; they
    /// are with [`JournalEvent::Resumed`], and until then another start may have the same number.
    pub is_kept: bool,
    /// Drawn when the journal was begun: another one in its place has another.
    pub identity: u64,
    /// How many records stand.
    pub records: u64,
    /// What could not be read, and where.
    pub damage: Vec<Damage>,
}
