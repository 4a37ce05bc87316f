//! What nodes tell one another so that retained samples reach late joiners, gaps are filled and deliveries confirmed.
//!
//! A **participant** is one life of a node. Its readers announce themselves ([`Readers`]); a writer's node answers with what
//! its streams hold ([`Streams`]); a reader asks for what it misses ([`Ask`]) until it is told ([`History`]), and confirms
//! what it has handed over ([`Confirm`]). All but [`Readers`] are for one life of the receiving node, `to`: several programs
//! may run as one entity.

use crate::change::{Change, KeyHash};
use crate::id::{BootId, Source};
use crate::name::{ContentType, Group, Name};
use crate::prefix::Prefix;
use crate::time::Wall;
use serde::{Deserialize, Serialize};

/// The descriptor of [`Readers`]; broadcast, or for one node.
pub const READERS: &str = "aldis.dds.Readers";
/// The descriptor of [`Streams`].
pub const STREAMS: &str = "aldis.dds.Streams";
/// The descriptor of [`Ask`].
pub const ASK: &str = "aldis.dds.Ask";
/// The descriptor of [`History`].
pub const HISTORY: &str = "aldis.dds.History";
/// The descriptor of [`Confirm`].
pub const CONFIRM: &str = "aldis.dds.Confirm";

/// A stream of retained samples, within one life of its node: a source and the topic that it writes.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct StreamName {
    /// Who writes.
    pub source: Source,
    /// The topic: address and descriptor of a broadcast.
    pub topic: Name,
}

/// The readers of a participant; none where it leaves.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Readers {
    /// Grows with each change of what follows; the answer names it.
    pub number: u64,
    /// Whether a delivery is confirmed only when these have it too.
    pub reliable: bool,
    /// How long they count without being heard, in milliseconds.
    pub lease_ms: u32,
    /// What they read.
    pub prefixes: Vec<Prefix>,
}

/// Where streams stand that a participant reads: an answer to [`Readers`], or a reminder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Streams {
    /// For this life of the node.
    pub to: BootId,
    /// The number of the announcement that this answers, with its last part; none in reminders and earlier parts.
    pub answers: Option<u64>,
    /// The streams with their last sequences.
    pub ends: Vec<(StreamName, u64)>,
}

/// Samples that a reader misses.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ask {
    /// For this life of the node.
    pub to: BootId,
    /// Of which stream.
    pub stream: StreamName,
    /// The first sequence that is missing.
    pub from: u64,
    /// The last one.
    pub upto: u64,
}

/// All that is retained of a part of a stream. What is not in it is superseded or gone.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct History {
    /// For this life of the node.
    pub to: BootId,
    /// Of which stream.
    pub stream: StreamName,
    /// What the contents are written in.
    pub content_type: ContentType,
    /// Free text of the source.
    pub group: Group,
    /// The first sequence that this speaks of.
    pub from: u64,
    /// The last one; less than asked for where there is more to tell.
    pub upto: u64,
    /// Whether samples of this part were dropped against the topic's promise: they are lost, not superseded.
    pub broken: bool,
    /// The samples, by sequence.
    pub samples: Vec<Retained>,
}

/// One retained sample.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Retained {
    /// Its number in the stream.
    pub sequence: u64,
    /// The wall clock of its source.
    pub source_time: Wall,
    /// What it does to its instance.
    pub change: Change,
    /// The key hash of its instance; none where the topic has no key.
    pub hash: Option<KeyHash>,
    /// The serialized key, where it is known.
    pub key: Option<Vec<u8>>,
    /// The content.
    pub content: Vec<u8>,
}

/// How far a participant has handed over streams to its services.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Confirm {
    /// For this life of the node.
    pub to: BootId,
    /// The streams, each with the last sequence before which nothing is missing.
    pub upto: Vec<(StreamName, u64)>,
}
