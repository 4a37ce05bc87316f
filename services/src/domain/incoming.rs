//! From the domain to the fleet.

use super::forms::address_of;
use super::routes::{Route, Way};
use super::{Domain, EARLY_MAX, EARLY_WRITERS_MAX};
use crate::service::domain::{Arrival, DomainGuid, RouteId};
use crate::service::{Level, Outbox};
use aldis_envelope::{Change, ContentType, Group, Instance, KeyHash, Label, Message, Name, Source, Wall};
use bytes::Bytes;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Who has which instance of a route registered, and how what ends of them is written.
#[derive(Debug, Default)]
pub(super) struct Registered {
    instances: BTreeMap<KeyHash, Held>,
    /// Labels that were used, so that a stream has one.
    labels: BTreeMap<ContentType, Arc<Label>>,
    last_time: Wall,
}

#[derive(Debug)]
struct Held {
    instance: Instance,
    content_type: ContentType,
    /// The writers, and whether each wants it disposed of when it leaves.
    writers: BTreeMap<DomainGuid, bool>,
    disposed: bool,
}

impl Registered {
    fn label(
        &mut self,
        content_type: ContentType,
        route: &Route,
        own: Source,
        partition: &str,
    ) -> Option<Arc<Label>> {
        if let Some(label) = self.labels.get(&content_type) {
            return Some(label.clone());
        }
        let name = Name::new(&address_of(&route.topic)).ok()?;
        let mut label = Label::broadcast(content_type.clone(), name, own);
        label.attributes.source_group = Group::new(partition).ok()?;
        let label = Arc::new(label);
        self.labels.insert(content_type, label.clone());
        Some(label)
    }
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
        let (type_name, extensibility) = (route.type_name.clone(), route.extensibility);
        let Some(form) = self.forms.form(&type_name, extensibility) else { return };
        let read = match form.read(&arrival) {
            Ok(read) => read,
            Err(why) => {
                self.counters.refused_malformed += 1;
                let text = format!("a sample of {} is refused: {why}", route.topic);
                if let Some(text) = self.routes.first_trouble(id, &text) {
                    out.note(Level::Warning, text);
                }
                return;
            }
        };
        self.imported(id, &arrival, read, out);
    }

    fn imported(&mut self, id: RouteId, arrival: &Arrival, read: super::forms::Incoming, out: &mut Outbox) {
        let super::forms::Incoming { content_type, content, instance } = read;
        let registered = self.registered.entry(id).or_default();
        registered.last_time = registered.last_time.max(arrival.source_time);
        let mut leaves = None;
        if let Some(instance) = &instance {
            leaves = registered.note(instance, &content_type, arrival);
        }
        let at = arrival.source_time;
        if arrival.is_sample {
            self.say(id, content_type.clone(), Change::Put, instance.clone(), content, at, out);
        }
        if arrival.disposes {
            self.say(id, content_type.clone(), Change::Dispose, instance.clone(), Bytes::new(), at, out);
        }
        if let Some(change) = leaves {
            self.counters.instances_left += 1;
            self.say(id, content_type, change, instance, Bytes::new(), at, out);
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
                left.push((held.content_type.clone(), change, held.instance.clone()));
            }
        }
        registered.instances.retain(|_, held| !held.writers.is_empty());
        for (content_type, change, instance) in left {
            self.counters.instances_left += 1;
            self.say(id, content_type, change, Some(instance), Bytes::new(), at, out);
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

    #[allow(clippy::too_many_arguments, reason = "a change has so many sides")]
    fn say(
        &mut self,
        id: RouteId,
        content_type: ContentType,
        change: Change,
        instance: Option<Instance>,
        content: Bytes,
        at: Wall,
        out: &mut Outbox,
    ) {
        let Some(route) = self.routes.get_mut(id) else { return };
        if change != Change::Put && instance.is_none() {
            return;
        }
        let registered = self.registered.entry(id).or_default();
        let Some(label) = registered.label(content_type, route, out.source(), &self.config.partition) else {
            return;
        };
        route.crossed += 1;
        self.counters.imported += 1;
        let instance = instance.map(|mut instance| {
            if change == Change::Put {
                // The content carries it.
                instance.key = None;
            }
            Arc::new(instance)
        });
        out.send_at(Message { label, change, instance, call: None, content }, at);
    }
}

impl Registered {
    /// Notes what a change does to who has an instance; what else is to be said of it when its last writer leaves.
    fn note(&mut self, instance: &Instance, content_type: &ContentType, arrival: &Arrival) -> Option<Change> {
        let held = self.instances.entry(instance.hash).or_insert_with(|| Held {
            instance: instance.clone(),
            content_type: content_type.clone(),
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
