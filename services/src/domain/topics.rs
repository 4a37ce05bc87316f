//! The topics of a bridge, made ready as they are met: as their bus has them, and as the fleet knows them.

use super::config::DomainConfig;
use crate::map::dds::{Lost, NewerBus, Sample, Sender, TopicMap, address_of};
use crate::service::domain::Xcdr;
use aldis_envelope::codec::cdr::Representation;
use aldis_envelope::description::{Extensibility, Library};
use aldis_envelope::{Group, Message};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A topic of one type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct TopicId(u32);

/// The topics of a bridge.
#[derive(Debug)]
pub(super) struct Topics {
    types: Arc<Library>,
    exact: Arc<BTreeSet<String>>,
    sender: Sender,
    /// Where the bus speaks 6.0.
    newer: Option<NewerBus>,
    ids: BTreeMap<(String, String), TopicId>,
    maps: BTreeMap<TopicId, TopicMap>,
    next: u32,
}

/// Whether samples of a type can be read at all.
pub(super) fn is_described(types: &Library, type_name: &str) -> bool {
    types.structure(type_name).is_some() || types.union(type_name).is_some()
}

/// What a writer writes of types that grow so.
pub(super) fn representation(xcdr: Xcdr, extensibility: Extensibility) -> Representation {
    match xcdr {
        Xcdr::V1 => Representation::XCDR1,
        Xcdr::V2 => Representation::xcdr2(extensibility),
    }
}

impl Topics {
    pub(super) fn new(config: &DomainConfig) -> Self {
        // What cannot be a group is refused where the configuration is read.
        let group = Group::new(&config.partition).unwrap_or_default();
        let sender = Sender { source: config.source, group };
        Self {
            types: config.types.clone(),
            exact: config.exact.clone(),
            // A test of its own rules out that it cannot be made.
            newer: if config.translates { NewerBus::new(&sender).ok() } else { None },
            sender,
            ids: BTreeMap::new(),
            maps: BTreeMap::new(),
            next: 0,
        }
    }

    /// A topic of a type; none where its name is no address.
    pub(super) fn id(&mut self, topic: &str, type_name: &str) -> Option<TopicId> {
        let key = (topic.to_owned(), type_name.to_owned());
        if let Some(id) = self.ids.get(&key) {
            return Some(*id);
        }
        let map = TopicMap::new(topic, type_name, &self.types, &self.sender).ok()?;
        let map = if self.exact.contains(type_name) { map } else { map.as_it_comes() };
        self.next += 1;
        let id = TopicId(self.next);
        self.ids.insert(key, id);
        self.maps.insert(id, map);
        Some(id)
    }

    pub(super) fn get(&self, id: TopicId) -> Option<&TopicMap> {
        self.maps.get(&id)
    }

    pub(super) fn get_mut(&mut self, id: TopicId) -> Option<&mut TopicMap> {
        self.maps.get_mut(&id)
    }

    /// Forgets those that are in use no more.
    pub(super) fn keep(&mut self, used: &BTreeSet<TopicId>) {
        self.ids.retain(|_, id| used.contains(id));
        self.maps.retain(|id, _| used.contains(id));
    }

    /// The address of a topic in the fleet, and whether what it says is translated.
    pub(super) fn address(&self, topic: &str, type_name: &str) -> (String, bool) {
        let newer = self.newer.as_ref().filter(|_| self.exact.contains(type_name));
        match newer.and_then(|bus| bus.older_topic(topic)) {
            Some(older) => (older.to_owned(), true),
            None => (address_of(topic), false),
        }
    }

    /// What the fleet is told of a change of a topic of 6.0, and what is lost.
    pub(super) fn for_fleet(
        &mut self,
        topic: &str,
        came: &Message,
    ) -> Result<(Vec<Message>, Vec<Lost>), String> {
        let Some(bus) = &mut self.newer else { return Ok(Default::default()) };
        bus.for_fleet(topic, came).map_err(|why| why.to_string())
    }

    /// What a message of the fleet is on a bus of 6.0, and what is lost.
    pub(super) fn for_bus(&mut self, message: &Message) -> Result<(Vec<Sample>, Vec<Lost>), String> {
        let Some(bus) = &mut self.newer else { return Ok(Default::default()) };
        bus.for_bus(message).map_err(|why| why.to_string())
    }

    pub(super) fn newer(&self) -> Option<&NewerBus> {
        self.newer.as_ref()
    }

    /// Has all said again that is said once while it does not change.
    pub(super) fn say_all_again(&mut self) {
        if let Some(bus) = &mut self.newer {
            bus.say_all_again();
        }
    }
}
