//! Routes: a bridge's own readers and writers, as what discovery finds calls for them.

use super::Domain;
use super::topics::{TopicId, Topics, is_described};
use crate::map::dds::{Glob, address_of, offered, requested};
use crate::service::Outbox;
use crate::service::domain::{DomainCommand, DomainGuid, Endpoint, Opening, Quality, RouteId, Xcdr};
use aldis_envelope::Name;
use aldis_envelope::description::Extensibility;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// How many routes a bridge has at the most: beyond it what comes is listed and not bridged.
const ROUTES_MAX: usize = 4_096;

/// Whether a route reads the domain or writes into it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Way {
    /// From the domain to the fleet.
    In,
    /// From the fleet to the domain.
    Out,
}

/// What makes one route: endpoints that differ in it get one each, so that nobody gets a sample twice.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct RouteKey {
    pub(super) topic: String,
    pub(super) way: Way,
    /// How the type may grow, as the endpoint says.
    pub(super) extensibility: Extensibility,
    /// How samples are written for it; of readers alone.
    pub(super) xcdr: Option<Xcdr>,
}

/// A route.
#[derive(Debug, Clone)]
pub(super) struct Route {
    pub(super) topic: String,
    pub(super) map: TopicId,
    /// Where its messages are in the fleet.
    pub(super) address: String,
    /// Whether they are of another version of UMAA there.
    pub(super) translated: bool,
    /// What calls for it.
    key: RouteKey,
    pub(super) way: Way,
    pub(super) extensibility: Extensibility,
    pub(super) xcdr: Xcdr,
    pub(super) type_name: String,
    pub(super) quality: Quality,
    /// None while it is being opened.
    pub(super) state: Option<Result<(), String>>,
    /// Troubles that were told already.
    pub(super) told: Vec<String>,
    pub(super) crossed: u64,
}

/// All routes.
#[derive(Debug, Default)]
pub(super) struct Routes {
    routes: BTreeMap<RouteId, Route>,
    by_key: BTreeMap<RouteKey, RouteId>,
    /// The routes that write, by the address of their messages.
    writing: BTreeMap<String, Arc<[RouteId]>>,
    next: u32,
}

/// A route that is called for, and the endpoint that it takes its type from.
#[derive(Debug, Clone)]
pub(super) struct Wanted {
    pub(super) key: RouteKey,
    pub(super) type_name: String,
    pub(super) like: Option<DomainGuid>,
    pub(super) quality: Quality,
}

impl Routes {
    pub(super) fn get(&self, id: RouteId) -> Option<&Route> {
        self.routes.get(&id)
    }

    pub(super) fn get_mut(&mut self, id: RouteId) -> Option<&mut Route> {
        self.routes.get_mut(&id)
    }

    pub(super) fn all(&self) -> impl Iterator<Item = &Route> {
        self.routes.values()
    }

    /// The routes that write messages of an address into the domain.
    pub(super) fn writing(&self, address: &str) -> Arc<[RouteId]> {
        self.writing.get(address).cloned().unwrap_or_default()
    }

    /// The addresses of which messages are written into the domain.
    pub(super) fn addresses(&self) -> impl Iterator<Item = &str> {
        self.writing.keys().map(String::as_str)
    }

    /// The topics that are in use.
    pub(super) fn topics(&self) -> BTreeSet<TopicId> {
        self.routes.values().map(|route| route.map).collect()
    }

    fn list_writing(&mut self) {
        let mut writing: BTreeMap<String, Vec<RouteId>> = BTreeMap::new();
        for (id, route) in self.routes.iter().filter(|(_, route)| route.way == Way::Out) {
            writing.entry(route.address.clone()).or_default().push(*id);
        }
        self.writing = writing.into_iter().map(|(address, ids)| (address, ids.into())).collect();
    }

    pub(super) fn opened(&mut self, id: RouteId, result: Result<(), String>) -> Option<String> {
        let route = self.routes.get_mut(&id)?;
        let trouble = result.as_ref().err().map(|why| format!("{} is not bridged: {why}", route.topic));
        route.state = Some(result);
        trouble
    }

    /// The text of a trouble, the first time that it comes.
    pub(super) fn first_trouble(&mut self, id: RouteId, text: &str) -> Option<String> {
        let route = self.routes.get_mut(&id)?;
        if route.told.len() >= 8 || route.told.iter().any(|told| told == text) {
            return None;
        }
        route.told.push(text.to_owned());
        Some(text.to_owned())
    }

    /// Has the routes that are called for; what is to be opened, and what is closed. A route whose quality of service must differ from
    /// what it has is opened anew.
    pub(super) fn change(
        &mut self,
        wanted: Vec<Wanted>,
        topics: &mut Topics,
    ) -> (Vec<Opening>, Vec<RouteId>) {
        let keeps = |key: &RouteKey, id: &RouteId, routes: &BTreeMap<RouteId, Route>| {
            wanted.iter().any(|wanted| {
                wanted.key == *key && routes.get(id).is_some_and(|route| route.quality == wanted.quality)
            })
        };
        let closed: Vec<RouteId> =
            self.by_key.iter().filter(|(key, id)| !keeps(key, id, &self.routes)).map(|(_, id)| *id).collect();
        self.by_key.retain(|_, id| !closed.contains(id));
        let mut opened = Vec::new();
        for wanted in wanted {
            if self.by_key.contains_key(&wanted.key) || self.by_key.len() >= ROUTES_MAX {
                continue;
            }
            let key = wanted.key;
            let Some(map) = topics.id(&key.topic, &wanted.type_name) else { continue };
            let (address, translated) = topics.address(&key.topic, &wanted.type_name);
            self.next += 1;
            let id = RouteId(self.next);
            let route = Route {
                topic: key.topic.clone(),
                map,
                address,
                translated,
                key: key.clone(),
                way: key.way,
                extensibility: key.extensibility,
                xcdr: key.xcdr.unwrap_or(Xcdr::V2),
                type_name: wanted.type_name.clone(),
                quality: wanted.quality.clone(),
                state: None,
                told: Vec::new(),
                crossed: 0,
            };
            opened.push(Opening {
                route: id,
                writes: key.way == Way::Out,
                topic: key.topic.clone(),
                type_name: wanted.type_name,
                like: wanted.like,
                extensibility: key.extensibility,
                quality: wanted.quality,
            });
            self.routes.insert(id, route);
            self.by_key.insert(key, id);
        }
        self.list_writing();
        (opened, closed)
    }

    fn forget(&mut self, id: RouteId) {
        self.routes.remove(&id);
        self.list_writing();
    }
}

impl Route {
    /// Whether an endpoint of its topic is one that called for it.
    pub(super) fn serves(&self, endpoint: &Endpoint) -> bool {
        key_of(endpoint) == self.key
    }

    /// Whether an endpoint is on the other side of its topic.
    pub(super) fn faces(&self, endpoint: &Endpoint) -> bool {
        endpoint.topic == self.topic && endpoint.writes == (self.way == Way::In)
    }
}

impl Domain {
    /// The routes that those who are there call for.
    pub(super) fn wanted(&self) -> Vec<Wanted> {
        if self.presence.stands_by_for().is_some() {
            return Vec::new();
        }
        let mut groups: BTreeMap<RouteKey, Vec<&Endpoint>> = BTreeMap::new();
        for endpoint in self.endpoints.values().filter(|endpoint| self.is_bridged(endpoint)) {
            groups.entry(key_of(endpoint)).or_default().push(endpoint);
        }
        let want = |(key, endpoints): (RouteKey, Vec<&Endpoint>)| {
            let first = endpoints.iter().find(|endpoint| endpoint.extensibility.is_some());
            let others: Vec<&Quality> = endpoints.iter().map(|endpoint| &endpoint.quality).collect();
            let (topic, rules, partition) = (&key.topic, &self.config.rules, &self.config.partition);
            let quality = match (key.way, key.xcdr) {
                (Way::In, _) | (_, None) => requested(topic, rules, partition, &others),
                (Way::Out, Some(xcdr)) => offered(topic, rules, partition, &others, xcdr),
            };
            Wanted {
                like: first.map(|endpoint| endpoint.guid),
                type_name: endpoints[0].type_name.clone(),
                key,
                quality,
            }
        };
        groups.into_iter().map(want).collect()
    }

    /// Whether an endpoint is one whose topic crosses.
    pub(super) fn is_bridged(&self, endpoint: &Endpoint) -> bool {
        self.why_not(endpoint).is_none()
    }

    /// Why an endpoint's topic does not cross.
    pub(super) fn why_not(&self, endpoint: &Endpoint) -> Option<&'static str> {
        if self.presence.is_gateway(endpoint.guid) {
            Some("it is a gateway's")
        } else if !self.config.topics.admit(&endpoint.topic) {
            Some("its topic is not allowed")
        } else if !self.is_in_partition(endpoint) {
            Some("it is in another partition")
        } else if !is_described(&self.config.types, &endpoint.type_name) {
            Some("its type is not described: give `idl`")
        } else if Name::new(&address_of(&endpoint.topic)).is_err() {
            Some("its topic's name is too long, or holds `$` or `|`")
        } else {
            None
        }
    }

    fn is_in_partition(&self, endpoint: &Endpoint) -> bool {
        let partitions = &endpoint.quality.partitions;
        let own = &self.config.partition;
        let matches = |name: &String| name == own || name.parse::<Glob>().is_ok_and(|glob| glob.matches(own));
        if partitions.is_empty() { own.is_empty() } else { partitions.iter().any(matches) }
    }

    /// Ends a route: what it had is nobody's any more.
    pub(super) fn close(&mut self, id: RouteId, out: &mut Outbox) {
        let Some(route) = self.routes.get(id).cloned() else { return };
        if route.way == Way::In {
            self.left_by_all(id, out);
        }
        self.registered.remove(&id);
        self.written.remove(&id);
        self.routes.forget(id);
        out.domain(DomainCommand::Close(id));
    }
}

fn key_of(endpoint: &Endpoint) -> RouteKey {
    let xcdr = || if endpoint.quality.xcdr.contains(&Xcdr::V2) { Xcdr::V2 } else { Xcdr::V1 };
    let (way, xcdr) = if endpoint.writes { (Way::In, None) } else { (Way::Out, Some(xcdr())) };
    let extensibility = endpoint.extensibility.unwrap_or_default();
    RouteKey { topic: endpoint.topic.clone(), way, extensibility, xcdr }
}
