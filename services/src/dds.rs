//! DDS-shaped semantics between nodes: what is retained for late joiners, gaps that are filled, deliveries that are confirmed.
//!
//! A **stream** is what one source writes on one topic; its sequence counts all instances together, so that repairing a stream
//! repairs the order across instances too (PRESENTATION access scope TOPIC, ordered access). [`Writers`] holds what the
//! sources of this node have written, [`Reading`] follows the streams of other nodes. Both speak in the messages of
//! [`aldis_envelope::aldis::dds`] and know neither services nor the bus.

mod history;
mod pattern;
mod qos;
mod reading;
mod record;
mod writers;

pub use history::History;
pub use pattern::Pattern;
pub use qos::{Durability, Keep, Qos, TopicRule, Topics};
pub use reading::{Reading, Step};
pub use record::{Record, RecordError};
pub use writers::{Confirmed, Writers, name_of};

use aldis_envelope::{BootId, EntityId};

/// One life of a node, as others know it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Participant {
    /// The node's own entity.
    pub node: EntityId,
    /// Which life of it.
    pub boot: BootId,
}

#[cfg(test)]
mod tests;
