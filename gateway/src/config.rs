//! The configuration of one node: a TOML file a machine, which shows the running system.
//!
//! `load` is the one road in: unknown keys are refused, every value is checked, and a mistake is told with file,
//! line, column and cure. The same types give the JSON Schema (`schema`), the router's access control (`acl`) and
//! Zenoh's configuration (`bus::zenoh_config`).

mod acl;
mod allow;
mod bridge;
pub(crate) mod bus;
mod check;
mod cure;
mod entities;
mod error;
mod journal;
mod link;
mod locator;
mod read;
mod recorder;
mod resource;
mod roads;
mod schema;
mod send_messages;
mod service;
mod text;
mod topic;
mod uxas;
pub(crate) mod uxas_file;

pub(crate) use acl::acl;
pub(crate) use allow::Allow;
#[cfg(feature = "dds")]
pub(crate) use bridge::{BENCH_TYPE, bench_types, dds_types};
pub(crate) use bridge::{Bridge, Check, Dds, DdsVersion, Endpoint, Framing, Sockets};
pub(crate) use bus::Bus;
pub(crate) use entities::{Entities, Operators};
pub(crate) use error::ConfigError;
pub(crate) use journal::Journal;
pub(crate) use link::{CarrierKind, KeyError, KeyFile, Link};
pub(crate) use locator::Locator;
pub(crate) use resource::{Allocation, Party, Resource};
pub(crate) use schema::schema;
pub(crate) use service::Service;
pub(crate) use text::PlainName;
pub(crate) use topic::Topic;

use aldis_envelope::{Fleet, GuidForm, Guids, Prefix};
use aldis_services::umaa::allocation::Arbitration;
use error::Fault;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::Duration;

/// The configuration of one node.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Config {
    /// The fleet that the node belongs to. Default: "fleet".
    #[serde(default = "default_fleet")]
    #[schemars(with = "schema::Fleet")]
    pub(crate) fleet: Fleet,
    /// The name of the node: in logs, as common name of its certificate, and as its user where `bus.user` names none.
    pub(crate) name: PlainName,
    /// The entities that the node speaks for, its own first. Messages of any other source are refused.
    pub(crate) entities: Entities,
    /// Entities that may administer the node, besides its own. Default: none.
    #[serde(default)]
    pub(crate) operators: Operators,
    /// How the GUIDs of the node's own services are made. Default: readable.
    #[serde(default)]
    #[schemars(with = "schema::GuidForm")]
    pub(crate) guid: GuidForm,
    /// How the node joins the bus.
    #[serde(default)]
    pub(crate) bus: Bus,
    /// What passes between the node and the bus.
    #[serde(default)]
    pub(crate) routing: Routing,
    /// Where other worlds are joined.
    #[serde(default, rename = "bridge")]
    pub(crate) bridges: Vec<Bridge>,
    /// Lossy hops to other entities, and what crosses them.
    #[serde(default, rename = "link")]
    pub(crate) links: Vec<Link>,
    /// Who may call what, beyond the defaults.
    #[serde(default)]
    pub(crate) allow: Vec<Allow>,
    /// What the node's arbiter gives control of.
    #[serde(default, rename = "resource")]
    pub(crate) resources: Vec<Resource>,
    /// How the arbiter works.
    #[serde(default)]
    pub(crate) allocation: Allocation,
    /// What topics promise to their readers, where it is not what the patterns of UMAA say.
    #[serde(default, rename = "topic")]
    pub(crate) topics: Vec<Topic>,
    /// Where the node keeps what must outlive the program. Default: nowhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) journal: Option<Journal>,
    /// What the program writes about itself.
    #[serde(default)]
    pub(crate) log: Log,
    /// The health reports of the node.
    #[serde(default)]
    pub(crate) health: Health,
    /// Services that the node runs beyond the built-in ones.
    #[serde(default, rename = "service")]
    pub(crate) services: Vec<Service>,
}

impl Config {
    /// Reads a configuration file. Relative paths in it are taken from its directory.
    ///
    /// # Errors
    /// [`ConfigError`] with the place and the cure of every mistake found.
    pub(crate) fn load(path: &Path) -> Result<Self, ConfigError> {
        let file = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|e| ConfigError::unreadable(&file, &e))?;
        let mut config = Self::parse(&file, &text)?;
        let base = path.parent().unwrap_or(Path::new(""));
        config.bus.resolve(base);
        config.links.iter_mut().for_each(|link| link.resolve(base));
        config.journal.iter_mut().for_each(|journal| journal.resolve(base));
        read::read_files(&mut config, &file, &text, base)?;
        Ok(config)
    }

    /// Reads the configuration that a file of OpenUxAS becomes.
    ///
    /// # Errors
    /// [`ConfigError`] where what it becomes is wrong, with places in that.
    pub(crate) fn of_uxas(path: &Path, imported: &uxas_file::Imported) -> Result<Self, ConfigError> {
        let file = format!("what becomes of {}", path.display());
        let mut config = Self::parse(&file, &imported.toml)?;
        let base = path.parent().unwrap_or(Path::new(""));
        config.bus.resolve(base);
        read::read_files(&mut config, &file, &imported.toml, base)?;
        Ok(config)
    }

    /// Reads a configuration from its text; `file` is how mistakes name it.
    ///
    /// # Errors
    /// [`ConfigError`] with the place and the cure of every mistake found.
    pub(crate) fn parse(file: &str, text: &str) -> Result<Self, ConfigError> {
        read::read(file, text)
    }
}

impl Config {
    /// What the node's arbiter is told; none where it has none. A configuration that was read has been checked.
    pub(crate) fn arbitration(&self) -> Option<Arbitration> {
        self.checked_arbitration().ok().flatten()
    }

    fn checked_arbitration(&self) -> Result<Option<Arbitration>, Fault> {
        let guids = Guids::new(&self.fleet, self.guid);
        let operators = self.operators.iter().collect();
        resource::arbitration(self.entities.own(), &guids, (&self.resources, &self.allocation), operators)
    }
}

fn default_fleet() -> Fleet {
    Fleet::new("fleet").expect("`fleet` is made of letters")
}

/// The `[routing]` table: what passes between the node and the bus. A message passes where one prefix fits; an empty
/// list lets nothing through.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Routing {
    /// Addresses taken from the bus. Default: all.
    #[schemars(with = "Vec<schema::Prefix>")]
    pub(crate) import: Vec<Prefix>,
    /// Addresses given to the bus. Default: all.
    #[schemars(with = "Vec<schema::Prefix>")]
    pub(crate) export: Vec<Prefix>,
}

impl Default for Routing {
    fn default() -> Self {
        Self { import: bridge::all(), export: bridge::all() }
    }
}

/// The `[log]` table: what the program writes about itself, to standard error.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Log {
    /// The least important that is written. Default: info.
    pub(crate) level: Level,
    /// Lines for people or JSON for machines. Default: text.
    pub(crate) format: LogFormat,
}

/// How important a line of the log is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Level {
    /// Something does not work.
    Error,
    /// Something may soon not work, or was refused.
    Warn,
    /// What an operator wants to know.
    #[default]
    Info,
    /// What an integrator wants to know.
    Debug,
    /// Everything.
    Trace,
}

/// How the log is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum LogFormat {
    /// Lines for people.
    #[default]
    Text,
    /// One JSON object a line.
    Json,
}

/// The `[health]` table.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Health {
    /// How often each health report is repeated, in milliseconds. Default: 5000; shorter finds silence sooner and
    /// costs bandwidth on every link.
    #[schemars(range(min = 100, max = 3_600_000))]
    pub(crate) report_period_ms: u32,
}

impl Health {
    /// How often each health report is repeated.
    pub(crate) fn report_period(&self) -> Duration {
        Duration::from_millis(u64::from(self.report_period_ms))
    }

    fn check(&self) -> Result<(), Fault> {
        bridge::in_range("report_period_ms", self.report_period_ms, 100..=3_600_000, "milliseconds")
    }
}

impl Default for Health {
    fn default() -> Self {
        Self { report_period_ms: 5000 }
    }
}

#[cfg(test)]
mod tests;
