//! Links: other entities behind a hop that loses, delays and is slow.

mod carrier;
mod keys;

pub(crate) use carrier::{Carrier, CarrierKind};
pub(crate) use keys::{KeyError, KeyFile};

use super::bridge::in_range;
use super::error::Fault;
use super::schema;
use super::text::PlainName;
use aldis_envelope::{EntityId, Prefix};
use aldis_services::link::export::{Export, Newest, Rule};
use aldis_services::link::{Class, LinkConfig, LinkSpec};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

/// One `[[link]]`: the other end of a lossy hop, and what crosses it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Link {
    /// The name in logs and counters, unique on the node.
    pub(crate) name: PlainName,
    /// The entity at the other end.
    #[schemars(with = "schema::EntityId")]
    pub(crate) peer: EntityId,
    /// The entities behind the link; messages of any other that come by it are refused. Default: the peer alone.
    #[serde(default)]
    #[schemars(with = "Vec<schema::EntityId>")]
    pub(crate) entities: Vec<EntityId>,
    /// Keys shared with the peer; the one with the largest number is used. Default: none, frames are not authenticated.
    #[serde(default, rename = "key")]
    pub(crate) keys: Vec<KeyFile>,
    /// Whether the link begins silent: it hears and sends nothing. Default: no.
    #[serde(default)]
    pub(crate) silent: bool,
    /// How many commands may wait. Default: 1 000 000, about 200 MB of disk.
    #[serde(default = "commands_max")]
    #[schemars(range(min = 1, max = 10_000_000))]
    pub(crate) commands_max: u32,
    /// The percentage of bytes that states and bulk get even when commands would take all. Default: 10.
    #[serde(default = "lower_share")]
    #[schemars(range(min = 0, max = 50))]
    pub(crate) lower_share_percent: u8,
    /// What frames go by, the preferred carrier first.
    #[serde(rename = "carrier")]
    pub(crate) carriers: Vec<Carrier>,
    /// What crosses; the first that fits decides, and what none names stays here.
    #[serde(default, rename = "rule")]
    pub(crate) rules: Vec<LinkRule>,
}

/// One `[[link.rule]]`. What it does not say fits everything.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LinkRule {
    /// What the message is: the beginning of its descriptor. Default: anything.
    #[serde(default)]
    pub(crate) descriptor: String,
    /// Where it goes: the beginning of its address, or an id. Default: anywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<schema::Prefix>")]
    pub(crate) address: Option<Prefix>,
    /// Whose messages. Default: everybody's.
    #[serde(default)]
    #[schemars(with = "Vec<schema::EntityId>")]
    pub(crate) sources: Vec<EntityId>,
    /// How it crosses.
    pub(crate) class: LinkClass,
    /// How long it is worth carrying, in seconds. Default: as long as it takes. Parts of calls have the time of their caller.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 2_592_000.0))]
    pub(crate) lifespan_s: Option<f64>,
    /// Samples of one instance a second, at most. Default: as many as the link carries.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.000_1, max = 1000.0))]
    pub(crate) rate_hz: Option<f64>,
    /// Of what the newest sample is enough. Default: of each instance.
    #[serde(default)]
    pub(crate) newest: LinkNewest,
    /// The percentage of the link's bytes that all under this rule may take together. Default: 100.
    #[serde(default = "share")]
    #[schemars(range(min = 1, max = 100))]
    pub(crate) share_percent: u8,
}

/// How a message crosses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum LinkClass {
    /// Kept, exactly once, in order, until its lifespan ends.
    Command,
    /// The newest sample of each instance.
    State,
    /// In the background, in pieces.
    Bulk,
}

/// Of what the newest sample is enough.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum LinkNewest {
    /// Of each instance.
    #[default]
    Instance,
    /// Of the stream, whatever its instances.
    Stream,
}

fn commands_max() -> u32 {
    1_000_000
}

fn lower_share() -> u8 {
    10
}

fn share() -> u8 {
    100
}

impl Link {
    /// The entities behind it.
    pub(crate) fn behind(&self) -> BTreeSet<EntityId> {
        if self.entities.is_empty() { [self.peer].into() } else { self.entities.iter().copied().collect() }
    }

    /// The link as the node is told, still without its keys.
    pub(crate) fn spec(&self, own: EntityId) -> LinkSpec {
        let carriers =
            self.carriers.iter().enumerate().map(|(place, carrier)| carrier.config(place)).collect();
        let mut link = LinkConfig::new(own, self.peer, carriers);
        link.silent = self.silent;
        link.commands_max = self.commands_max as usize;
        link.lower_share = self.lower_share_percent;
        let rules = self.rules.iter().map(LinkRule::rule).collect();
        LinkSpec {
            name: self.name.as_str().to_owned(),
            link,
            export: Export { behind: self.behind(), rules },
        }
    }

    /// Puts a directory before every relative path.
    pub(super) fn resolve(&mut self, directory: &Path) {
        for key in &mut self.keys {
            key.file = directory.join(&key.file);
        }
    }

    /// All that contradicts itself; `own` is what the node speaks for.
    pub(super) fn check(&self, own: &super::Entities) -> Result<(), Fault> {
        if let Some(entity) = self.behind().into_iter().find(|entity| own.contains(*entity)) {
            return Err(Fault::new(
                "peer",
                format!("entity {entity} is on this side of the link: the node speaks for it"),
                "name the entities of the other side in `peer` and `entities`",
            ));
        }
        if self.carriers.is_empty() {
            return Err(Fault::new("", "the link has no carrier", "add a [[link.carrier]] table"));
        }
        if self.carriers.len() > 16 {
            return Err(Fault::new("carrier", "more than 16 carriers", "keep those that are used"));
        }
        in_range("commands_max", self.commands_max, 1..=10_000_000, "commands")?;
        in_range("lower_share_percent", self.lower_share_percent, 0..=50, "percent")?;
        for (place, carrier) in self.carriers.iter().enumerate() {
            carrier.check().map_err(|fault| fault.below(&format!("carrier.{place}")))?;
        }
        for (place, rule) in self.rules.iter().enumerate() {
            rule.check().map_err(|fault| fault.below(&format!("rule.{place}")))?;
        }
        for (place, key) in self.keys.iter().enumerate() {
            if self.keys[..place].iter().any(|other| other.number == key.number) {
                let message = format!("two keys have number {}", key.number);
                return Err(Fault::new(
                    format!("key.{place}.number"),
                    message,
                    "give the newer a larger number",
                ));
            }
        }
        Ok(())
    }
}

impl LinkRule {
    fn rule(&self) -> Rule {
        let class = match self.class {
            LinkClass::Command => Class::Command,
            LinkClass::State => Class::State,
            LinkClass::Bulk => Class::Bulk,
        };
        Rule {
            address: self.address.clone(),
            sources: self.sources.iter().copied().collect(),
            lifespan: self.lifespan_s.map(Duration::from_secs_f64),
            interval: self.rate_hz.map_or(Duration::ZERO, |rate| Duration::from_secs_f64(1.0 / rate)),
            newest: match self.newest {
                LinkNewest::Instance => Newest::Instance,
                LinkNewest::Stream => Newest::Stream,
            },
            share: self.share_percent,
            ..Rule::new(&self.descriptor, class)
        }
    }

    fn check(&self) -> Result<(), Fault> {
        if let Some(lifespan) = self.lifespan_s {
            in_range("lifespan_s", lifespan, 0.1..=2_592_000.0, "seconds")?;
        }
        if let Some(rate) = self.rate_hz {
            in_range("rate_hz", rate, 0.000_1..=1000.0, "samples a second")?;
        }
        in_range("share_percent", self.share_percent, 1..=100, "percent")
    }
}

#[cfg(test)]
mod tests;
