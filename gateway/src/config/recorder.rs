//! `kind = "recorder"` and `kind = "entity-states"`: what is kept of what comes by.

use super::bridge::{all, in_range};
use super::error::Fault;
use super::schema;
use super::service::named_service;
use aldis_envelope::{Prefix, ServiceId};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Keeps what comes by in files that `aldis replay` sends again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Recorder {
    /// The service id, 100 or more, unique on the node.
    #[schemars(with = "schema::NamedServiceId")]
    pub(crate) service: ServiceId,
    /// Where the files go; it is made where there is none. A relative one begins beside the configuration.
    pub(crate) directory: PathBuf,
    /// Beginnings of the addresses that are kept. Default: all.
    #[serde(default = "all")]
    #[schemars(with = "Vec<schema::Prefix>")]
    pub(crate) addresses: Vec<Prefix>,
    /// How many messages a file holds. Default: 10 000.
    #[serde(default = "messages_per_file")]
    #[schemars(range(min = 1))]
    pub(crate) messages_per_file: u32,
}

fn messages_per_file() -> u32 {
    10_000
}

impl Recorder {
    /// Checks what the types do not.
    pub(super) fn check(self) -> Result<Self, Fault> {
        named_service(self.service)?;
        in_range("messages_per_file", self.messages_per_file, 1..=u32::MAX, "messages")?;
        Ok(self)
    }

    /// The directory as seen from where the configuration stands.
    pub(super) fn stand(&mut self, base: &Path) {
        self.directory = base.join(&self.directory);
    }
}

/// Holds the latest state of each vehicle that it hears of; `aldis fleet --states` shows them with their ages.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct EntityStates {
    /// The service id, 100 or more, unique on the node.
    #[schemars(with = "schema::NamedServiceId")]
    pub(crate) service: ServiceId,
}
