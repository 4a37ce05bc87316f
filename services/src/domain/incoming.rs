//! From the domain to the fleet.

use super::routes::Way;
use super::{Domain, EARLY_MAX, EARLY_WRITERS_MAX};
use crate::map::dds::{Body, ImportError, Taken};
use crate::service::Outbox;
use crate::service::domain::{Arrival, DomainGuid, RouteId};
use aldis_envelope::{Change, Instance, KeyHash, Message, Wall};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Who has which instance of a route registered.
#[derive(Debug, Default)]
pub(super) struct Registered {
    instances: BTreeMap<KeyHash, Held>,
    last_time: Wall,
}

#[derive(Debug)]
struct Held {
    instance: Arc<Instance>,
    /// The writers, and whether each wants it disposed of when it leaves.
    writers: BTreeMap<DomainGuid, bool>,
    disposed: bool,
}

/// A change as it is taken.
fn taken(arrival: &Arrival) -> Taken {
    let (change, body) = match (arrival.is_sample, arrival.disposes) {
        (true, _) => (Change::Put, Body::Sample(arrival.cdr.clone())),
        (false, true) => (Change::Dispose, Body::Key(arrival.cdr.clone())),
        (false, false) => (Change::Unregister, Body::Key(arrival.cdr.clone())),
    };
    Taken { writer: arrival.writer.0, source_time: arrival.source_time, change, body }
}

impl Domain {
    /// A change has arrived. Until discovery has told of its writer it waits: it may be a gateway's.
    pub(super) fn arrived(&mut self, id: RouteId, arrival: Arrival, out: &mut Outbox) {
        let writer = arrival.writer;
        if self.presence.is_gateway(writer) {
            self.counters.echoes_stopped += 1;
            return;
        }
        if !self.endpoints.contains_key(&writer) {
            let room = self.early.len() < EARLY_WRITERS_MAX || self.early.contains_key(&writer);
            let waiting = if room { Some(self.early.entry(writer).or_default()) } else { None };
            match waiting.filter(|waiting| waiting.len() < EARLY_MAX) {
                Some(waiting) => waiting.push((id, arrival)),
                None => self.counters.shed_unannounced += 1,
            }
            return;
        }
        let Some(route) = self.routes.get(id).filter(|route| route.way == Way::In) else { return };
        let Some(topic) = self.topics.get_mut(route.map) else { return };
        match topic.import(&taken(&arrival)) {
            Ok(imported) => self.imported(id, &arrival, imported.message, out),
            Err(why) => {
                match why {
                    ImportError::UnknownKey { .. } => self.counters.refused_unknown_key += 1,
                    _ => self.counters.refused_malformed += 1,
                }
                self.trouble(id, &why.to_string(), out);
            }
        }
    }

    fn imported(&mut self, id: RouteId, arrival: &Arrival, message: Message, out: &mut Outbox) {
        let registered = self.registered.entry(id).or_default();
        registered.last_time = registered.last_time.max(arrival.source_time);
        let at = arrival.source_time;
        let Some(instance) = message.instance.clone() else {
            if arrival.is_sample {
                self.say(id, message, at, out);
            }
            return;
        };
        let leaves = registered.note(&instance, arrival);
        if arrival.is_sample {
            self.say(id, message, at, out);
        }
        if arrival.disposes {
            self.ends(id, Change::Dispose, instance.clone(), at, out);
        }
        if let Some(change) = leaves {
            self.counters.instances_left += 1;
            self.ends(id, change, instance, at, out);
        }
    }

    /// A writer is gone: instances that nobody else writes have no writer any more, or are disposed of where it wants that.
    pub(super) fn writer_gone(
        &mut self,
        id: RouteId,
        writer: DomainGuid,
        autodispose: bool,
        out: &mut Outbox,
    ) {
        let Some(registered) = self.registered.get_mut(&id) else { return };
        let at = registered.last_time;
        let mut left = Vec::new();
        for held in registered.instances.values_mut() {
            let Some(wants) = held.writers.remove(&writer) else { continue };
            if let Some(change) = held.left(wants || autodispose) {
                left.push((change, held.instance.clone()));
            }
        }
        registered.instances.retain(|_, held| !held.writers.is_empty());
        for (change, instance) in left {
            self.counters.instances_left += 1;
            self.ends(id, change, instance, at, out);
        }
    }

    /// Nobody writes a route any more.
    pub(super) fn left_by_all(&mut self, id: RouteId, out: &mut Outbox) {
        let writers: BTreeSet<DomainGuid> =
            self.registered.get(&id).map_or_else(BTreeSet::new, |registered| {
                registered.instances.values().flat_map(|held| held.writers.keys().copied()).collect()
            });
        for writer in writers {
            self.writer_gone(id, writer, false, out);
        }
    }

    fn ends(&mut self, id: RouteId, change: Change, instance: Arc<Instance>, at: Wall, out: &mut Outbox) {
        let map = self.routes.get(id).and_then(|route| self.topics.get(route.map));
        if let Some(message) = map.map(|map| map.end(change, instance)) {
            self.say(id, message, at, out);
        }
    }

    /// Tells the fleet, in its own version of UMAA.
    fn say(&mut self, id: RouteId, message: Message, at: Wall, out: &mut Outbox) {
        let Some(route) = self.routes.get_mut(id) else { return };
        route.crossed += 1;
        if !route.translated {
            self.send(message, at, out);
            return;
        }
        match self.topics.for_fleet(&route.topic, &message) {
            Ok((messages, lost)) => {
                self.lost(&lost, out);
                for message in messages {
                    self.send(message, at, out);
                }
            }
            Err(why) => {
                self.counters.refused_malformed += 1;
                self.trouble(id, &why, out);
            }
        }
    }

    fn send(&mut self, mut message: Message, at: Wall, out: &mut Outbox) {
        self.counters.imported += 1;
        if let Some(instance) = message.instance.as_mut().filter(|_| message.change == Change::Put) {
            // The content carries it.
            Arc::make_mut(instance).key = None;
        }
        out.send_at(message, at);
    }
}

impl Registered {
    /// Notes what a change does to who has an instance; what else is to be said of it when its last writer leaves.
    fn note(&mut self, instance: &Arc<Instance>, arrival: &Arrival) -> Option<Change> {
        let held = self.instances.entry(instance.hash).or_insert_with(|| Held {
            instance: instance.clone(),
            writers: BTreeMap::new(),
            disposed: false,
        });
        if arrival.is_sample || arrival.disposes {
            held.writers.insert(arrival.writer, arrival.autodispose);
        }
        if arrival.is_sample {
            held.disposed = false;
        }
        held.disposed |= arrival.disposes;
        if !arrival.unregisters {
            return None;
        }
        held.writers.remove(&arrival.writer);
        let change = held.left(arrival.autodispose);
        if held.writers.is_empty() {
            self.instances.remove(&instance.hash);
        }
        change
    }
}

impl Held {
    /// What is said when a writer has left it: a dispose where the writer wants that and it is not disposed of yet, that it has no
    /// writer where that was the last.
    fn left(&mut self, autodispose: bool) -> Option<Change> {
        if autodispose && !self.disposed {
            self.disposed = true;
            return Some(Change::Dispose);
        }
        self.writers.is_empty().then_some(Change::Unregister)
    }
}
