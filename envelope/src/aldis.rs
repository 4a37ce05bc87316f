//! Requests and answers of Aldis's own services: content type `aldis`, postcard's format.

pub mod dds;
pub mod entities;
pub mod link;

use crate::guid::Guid;
use crate::id::{BootId, EntityId, Source};
use crate::time::DateTime;
use crate::umaa::{LogLevel, LogReport};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// A request that every service answers: its content comes back unchanged, with the descriptor [`PONG`].
pub const PING: &str = "aldis.Ping";
/// The answer to a ping.
pub const PONG: &str = "aldis.Pong";
/// Asks service 1 for a [`NodeStatus`]; no content.
pub const NODE_QUERY: &str = "aldis.NodeQuery";
/// The answer to a [`NODE_QUERY`].
pub const NODE_STATUS: &str = "aldis.NodeStatus";
/// Asks the bridge to a DDS domain what it bridges.
pub const DOMAIN_QUERY: &str = "aldis.DomainQuery";
/// Its answer.
pub const DOMAIN_STATUS: &str = "aldis.DomainStatus";
/// Asks service 2 for the latest HealthReport of every resource that it has heard of; no content.
pub const HEALTH_QUERY: &str = "aldis.HealthQuery";
/// Asks service 3 for its log; the content is a [`LogQuery`], or nothing for all of it.
pub const LOG_QUERY: &str = "aldis.LogQuery";

/// Which entries of a log are asked for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LogQuery {
    /// Only these levels; none is all.
    pub levels: Vec<LogLevel>,
    /// Only this source.
    pub source: Option<Guid>,
    /// Only what was made at this time or later, by the writers' clocks.
    pub since: Option<DateTime>,
    /// Only the last so many of them.
    pub last: u32,
}

impl LogQuery {
    /// Asks for everything.
    pub fn all() -> Self {
        Self { levels: Vec::new(), source: None, since: None, last: u32::MAX }
    }

    /// Whether an entry is asked for, if it is among the last.
    pub fn wants(&self, entry: &LogReport) -> bool {
        (self.levels.is_empty() || self.levels.contains(&entry.level))
            && self.source.is_none_or(|source| source == entry.source)
            && self.since.is_none_or(|since| entry.time_stamp >= since)
    }
}

/// What a node says of itself.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct NodeStatus {
    /// The node's own entity.
    pub node: EntityId,
    /// Every entity that it speaks for.
    pub entities: Vec<EntityId>,
    /// This life of it.
    pub boot: BootId,
    /// How long it lives, in milliseconds.
    pub uptime_ms: u64,
    /// Its services and bridges.
    pub services: Vec<ServiceStatus>,
    /// Everything that it counts, by name.
    pub counters: Vec<(String, u64)>,
}

/// What a node says of one of its services or bridges.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ServiceStatus {
    /// Its ids.
    pub source: Source,
    /// What it is: a service's kind or a bridge's name.
    pub name: String,
    /// How it is, in words: `running`, `retired`, `listening`, `2 peers`.
    pub state: String,
}

/// Writes a content of type `aldis`.
pub fn encode<T: Serialize>(value: &T) -> Vec<u8> {
    // Postcard fails on a growing buffer only for types without a length, which these have not.
    postcard::to_allocvec(value).unwrap_or_default()
}

/// Reads a content of type `aldis`; none where it is not exactly one value.
pub fn decode<T: DeserializeOwned>(content: &[u8]) -> Option<T> {
    match postcard::take_from_bytes(content) {
        Ok((value, [])) => Some(value),
        _ => None,
    }
}
