//! Other gateways in the domain: what they write is not taken, and of several for one fleet and partition one bridges.

use super::config::DomainConfig;
use crate::service::domain::DomainGuid;
use std::collections::BTreeMap;

/// What gateways say of themselves in their USER_DATA begins so.
const MARK: &str = "aldis-gateway";

/// What another gateway says of itself.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Gateway {
    fleet: String,
    entity: u64,
    partition: String,
}

/// The gateways that are known.
#[derive(Debug)]
pub(super) struct Presence {
    own: Gateway,
    others: BTreeMap<[u8; 12], Gateway>,
}

/// What a gateway says of itself in its USER_DATA.
pub fn mark(config: &DomainConfig) -> String {
    format!("{MARK};{};{};{}", config.fleet.as_str(), config.source.entity.get(), config.partition)
}

fn prefix(guid: DomainGuid) -> [u8; 12] {
    let mut prefix = [0; 12];
    prefix.copy_from_slice(&guid.0[..12]);
    prefix
}

impl Presence {
    pub(super) fn new(config: &DomainConfig) -> Self {
        let (fleet, entity) = (config.fleet.as_str().to_owned(), config.source.entity.get());
        Self { own: Gateway { fleet, entity, partition: config.partition.clone() }, others: BTreeMap::new() }
    }

    /// A participant has come; whether it is a gateway.
    pub(super) fn came(&mut self, guid: DomainGuid, data: &[u8]) -> bool {
        let Some(gateway) = std::str::from_utf8(data).ok().and_then(read) else { return false };
        self.others.insert(prefix(guid), gateway);
        true
    }

    /// A participant is gone; whether it was a gateway.
    pub(super) fn went(&mut self, guid: DomainGuid) -> bool {
        self.others.remove(&prefix(guid)).is_some()
    }

    /// Whether an endpoint or a participant is a gateway's.
    pub(super) fn is_gateway(&self, guid: DomainGuid) -> bool {
        self.others.contains_key(&prefix(guid))
    }

    /// The entity of the gateway that bridges in place of this one: the smallest of the same fleet and partition.
    pub(super) fn stands_by_for(&self) -> Option<u64> {
        let same = |other: &&Gateway| {
            other.fleet == self.own.fleet
                && other.partition == self.own.partition
                && other.entity < self.own.entity
        };
        self.others.values().filter(same).map(|other| other.entity).min()
    }
}

fn read(data: &str) -> Option<Gateway> {
    let mut parts = data.split(';');
    if parts.next() != Some(MARK) {
        return None;
    }
    let (fleet, entity) = (parts.next()?.to_owned(), parts.next()?.parse().ok()?);
    Some(Gateway { fleet, entity, partition: parts.next()?.to_owned() })
}
