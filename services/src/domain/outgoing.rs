//! From the fleet to the domain.

use super::Domain;
use super::topics::representation;
use crate::map::dds::Given;
use crate::service::domain::{DomainCommand, RouteId, Sending};
use crate::service::{Level, Outbox};
use aldis_envelope::{Address, Change, Envelope, Instance, KeyHash, Source, Wall};
use bytes::Bytes;
use std::collections::BTreeMap;

/// What a route has written: by instance its key as it is written, and for whom.
#[derive(Debug, Default)]
pub(super) struct Written {
    instances: BTreeMap<KeyHash, Live>,
    last_time: Wall,
}

#[derive(Debug)]
struct Live {
    key: Bytes,
    /// Who wrote it last.
    source: Source,
}

impl Domain {
    /// A message of the fleet, for those who read its topic in the domain. `again` where it is for those alone who have come since
    /// it was written.
    pub(super) fn leaves(&mut self, envelope: &Envelope, again: bool, out: &mut Outbox) {
        let label = &envelope.message.label;
        let Address::Name(address) = &label.address else { return };
        if label.attributes.source_group.as_str() != self.config.partition {
            return;
        }
        let routes = self.routes.writing(address.as_str());
        let wanted = |id: &&RouteId| !again || self.fresh.contains(id);
        let routes: Vec<RouteId> = routes.iter().filter(wanted).copied().collect();
        let Some(&first) = routes.first() else { return };
        if self.routes.get(first).is_some_and(|route| route.translated) {
            let written = self.write_translated(&routes, envelope, out);
            self.refuses(written, envelope, out);
        } else {
            for id in routes {
                let written = self.write(id, envelope, out).map_err(|why| (id, why));
                self.refuses(written, envelope, out);
            }
        }
    }

    fn refuses(&mut self, written: Result<(), (RouteId, String)>, envelope: &Envelope, out: &mut Outbox) {
        if let Err((id, why)) = written {
            self.counters.refused_malformed += 1;
            let source = envelope.message.label.source();
            self.trouble(id, &format!("a message of {source} is refused: {why}"), out);
        }
    }

    fn write(&mut self, id: RouteId, envelope: &Envelope, out: &mut Outbox) -> Result<(), String> {
        let Some(route) = self.routes.get(id) else { return Ok(()) };
        let form = representation(route.xcdr, route.extensibility);
        let Some(topic) = self.topics.get_mut(route.map) else { return Ok(()) };
        let message = &envelope.message;
        let written = self.written.entry(id).or_default();
        let instance = message.instance.as_deref();
        let Given { change, bytes } = match written.known(instance, message.change, message.label.source()) {
            Known::Nothing => topic.export(message, form).map_err(|why| why.to_string())?,
            Known::Key(bytes) => Given { change: message.change, bytes },
            Known::Others => return Ok(()),
        };
        let is_new = |instance: &Instance| !written.instances.contains_key(&instance.hash);
        let key = if change == Change::Put && instance.is_some_and(is_new) {
            topic.key_sample(&bytes, form).map_err(|why| why.to_string())?
        } else {
            Some(bytes.clone())
        };
        self.give(id, (instance, key), Given { change, bytes }, envelope, out);
        Ok(())
    }

    fn write_translated(
        &mut self,
        routes: &[RouteId],
        envelope: &Envelope,
        out: &mut Outbox,
    ) -> Result<(), (RouteId, String)> {
        let (samples, lost) = self.topics.for_bus(&envelope.message).map_err(|why| (routes[0], why))?;
        self.lost(&lost, out);
        for sample in &samples {
            for &id in routes {
                let Some(route) = self.routes.get(id).filter(|route| route.topic == sample.topic) else {
                    continue;
                };
                let form = representation(route.xcdr, route.extensibility);
                let Some(bus) = self.topics.newer() else { continue };
                let given = bus.given(sample, form).and_then(|(instance, given)| {
                    let topic = self.topics.get(route.map).filter(|_| given.change == Change::Put);
                    let key = topic.map(|topic| topic.key_sample(&given.bytes, form)).transpose()?.flatten();
                    Ok((instance, key.unwrap_or_else(|| given.bytes.clone()), given))
                });
                let (instance, key, given) = given.map_err(|why| (id, why.to_string()))?;
                let written = self.written.entry(id).or_default();
                let source = envelope.message.label.source();
                if !matches!(written.known(instance.as_ref(), given.change, source), Known::Others) {
                    self.give(id, (instance.as_ref(), Some(key)), given, envelope, out);
                }
            }
        }
        Ok(())
    }

    /// Writes a change, and notes who has written its instance, of which the key is given where it is new.
    fn give(
        &mut self,
        id: RouteId,
        (instance, key): (Option<&Instance>, Option<Bytes>),
        given: Given,
        envelope: &Envelope,
        out: &mut Outbox,
    ) {
        let (at, source) = (envelope.stamp.source_time, envelope.message.label.source());
        let written = self.written.entry(id).or_default();
        written.last_time = written.last_time.max(at);
        if let Some(instance) = instance {
            match (given.change, written.instances.get_mut(&instance.hash), key) {
                (Change::Unregister, _, _) => drop(written.instances.remove(&instance.hash)),
                (_, Some(live), _) => live.source = source,
                (_, None, Some(key)) => drop(written.instances.insert(instance.hash, Live { key, source })),
                (_, None, None) => {}
            }
        }
        self.counters.exported += 1;
        if let Some(route) = self.routes.get_mut(id) {
            route.crossed += 1;
        }
        let sending = match given.change {
            Change::Put => Sending::Sample,
            Change::Dispose => Sending::Dispose,
            Change::Unregister => Sending::Unregister,
        };
        out.domain(DomainCommand::Write(id, sending, given.bytes, at));
    }

    /// A service of another node is gone: what it wrote has no writer any more. That is lost contact and no cancel.
    pub(super) fn source_gone(&mut self, source: Source, out: &mut Outbox) {
        for (&id, written) in &mut self.written {
            let at = written.last_time;
            written.instances.retain(|_, live| {
                if live.source == source {
                    self.counters.exported += 1;
                    out.domain(DomainCommand::Write(id, Sending::Unregister, live.key.clone(), at));
                }
                live.source != source
            });
        }
        self.topics.say_all_again();
    }

    /// Tells a trouble of a route once.
    pub(super) fn trouble(&mut self, id: RouteId, text: &str, out: &mut Outbox) {
        let topic = self.routes.get(id).map(|route| route.topic.clone()).unwrap_or_default();
        if let Some(text) = self.routes.first_trouble(id, &format!("{topic}: {text}")) {
            out.note(Level::Warning, text);
        }
    }
}

/// What is known of the end of an instance.
enum Known {
    /// Nothing: the message says all of it.
    Nothing,
    /// Its key as it is written.
    Key(Bytes),
    /// Somebody else writes it now, or nobody here knows it.
    Others,
}

impl Written {
    fn known(&self, instance: Option<&Instance>, change: Change, source: Source) -> Known {
        let live = instance.and_then(|instance| self.instances.get(&instance.hash));
        match (change, live) {
            (Change::Put, _) | (Change::Dispose, None) => Known::Nothing,
            (Change::Dispose, Some(live)) => Known::Key(live.key.clone()),
            (Change::Unregister, Some(live)) if live.source == source => Known::Key(live.key.clone()),
            (Change::Unregister, _) => Known::Others,
        }
    }
}
