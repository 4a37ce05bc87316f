//! What a node adds to a message when it sends it out.

use crate::id::{BootId, EntityId};
use crate::time::Wall;
use serde::{Deserialize, Serialize};
use std::ops::Deref;

/// How urgent a stream is; the levels and their order are Zenoh's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub enum Priority {
    /// Before everything else.
    RealTime = 1,
    /// People wait for it.
    InteractiveHigh = 2,
    /// People wait for it, less urgently.
    InteractiveLow = 3,
    /// Data before other data.
    DataHigh = 4,
    /// The default.
    #[default]
    Data = 5,
    /// Data after other data.
    DataLow = 6,
    /// When nothing else is to be sent.
    Background = 7,
}

/// The number is not a priority.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("priority {0} is outside 1 (most urgent) to 7")]
pub struct PriorityError(pub u8);

impl TryFrom<u8> for Priority {
    type Error = PriorityError;
    fn try_from(number: u8) -> Result<Self, PriorityError> {
        Ok(match number {
            1 => Self::RealTime,
            2 => Self::InteractiveHigh,
            3 => Self::InteractiveLow,
            4 => Self::DataHigh,
            5 => Self::Data,
            6 => Self::DataLow,
            7 => Self::Background,
            other => return Err(PriorityError(other)),
        })
    }
}

impl From<Priority> for u8 {
    fn from(priority: Priority) -> u8 {
        priority as u8
    }
}

/// The most nodes that a message may have passed: a longer way is a loop, or hostile.
pub const VIA_MAX: usize = 16;

/// The nodes that a message passed after the one that stamped it, at most [`VIA_MAX`].
///
/// It is as small as a pointer, because nearly every message passes none and an envelope is moved often.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[allow(clippy::box_collection, reason = "a vector itself would be three times as large in every envelope")]
pub struct Via(Option<Box<Vec<EntityId>>>);

impl Via {
    /// The message has passed one more node.
    pub fn push(&mut self, node: EntityId) {
        self.0.get_or_insert_default().push(node);
    }
}

impl Deref for Via {
    type Target = [EntityId];
    fn deref(&self) -> &[EntityId] {
        self.0.as_ref().map_or(&[], |nodes| nodes.as_slice())
    }
}

impl FromIterator<EntityId> for Via {
    fn from_iter<I: IntoIterator<Item = EntityId>>(nodes: I) -> Self {
        let nodes: Vec<_> = nodes.into_iter().collect();
        Self((!nodes.is_empty()).then(|| Box::new(nodes)))
    }
}

/// What the stamping node says of a message.
///
/// A **stream** is (stamping node, source, boot id, address): its `sequence` counts from 1 without holes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stamp {
    /// The node that stamped, by its own (first) entity.
    pub node: EntityId,
    /// The life of that node.
    pub boot: BootId,
    /// The number in the stream, from 1.
    pub sequence: u64,
    /// The wall clock of the source.
    pub source_time: Wall,
    /// How long the message is still worth carrying, in milliseconds. None: as long as it takes.
    pub lifespan_left_ms: Option<u32>,
    /// Fixed for a stream.
    pub priority: Priority,
    /// How many samples just before this one were left out by a rule: told, and so not lost.
    pub skipped: u32,
    /// The nodes that the message passed after the one that stamped it, at most [`VIA_MAX`].
    pub via: Via,
}
