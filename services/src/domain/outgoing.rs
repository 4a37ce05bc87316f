//! From the fleet to the domain.

use super::Domain;
use super::forms::topic_of;
use crate::service::domain::{DomainCommand, RouteId, Sending};
use crate::service::{Level, Outbox};
use aldis_envelope::{Change, Envelope, KeyHash, Source, Wall};
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
    /// A message of the fleet, for those who read its topic in the domain.
    pub(super) fn leaves(&mut self, envelope: &Envelope, out: &mut Outbox) {
        let label = &envelope.message.label;
        let address = label.address.to_string();
        let Some(topic) = topic_of(&address) else { return };
        if label.attributes.source_group.as_str() != self.config.partition {
            return;
        }
        for id in self.routes.writing(topic) {
            if let Err(why) = self.write(id, envelope, out) {
                self.counters.refused_malformed += 1;
                let text = format!("a message of {} for {topic} is refused: {why}", label.source());
                if let Some(text) = self.routes.first_trouble(id, &text) {
                    out.note(Level::Warning, text);
                }
            }
        }
    }

    fn write(&mut self, id: RouteId, envelope: &Envelope, out: &mut Outbox) -> Result<(), String> {
        let Some(route) = self.routes.get(id) else { return Ok(()) };
        let (type_name, extensibility, xcdr) = (route.type_name.clone(), route.extensibility, route.xcdr);
        let Some(form) = self.forms.form(&type_name, extensibility) else { return Ok(()) };
        let message = &envelope.message;
        let written = self.written.entry(id).or_default();
        let at = envelope.stamp.source_time;
        written.last_time = written.last_time.max(at);
        let known = message.instance.as_ref().and_then(|instance| written.instances.get(&instance.hash));
        let (sending, cdr) = match (message.change, known) {
            (Change::Dispose, Some(live)) => (Sending::Dispose, live.key.clone()),
            (Change::Unregister, Some(live)) if live.source == message.label.source() => {
                (Sending::Unregister, live.key.clone())
            }
            // Somebody else writes it now, or nobody here knows it.
            (Change::Unregister, _) => return Ok(()),
            _ => match form.write(message, xcdr).map_err(|why| why.to_string())? {
                Some(written) => written,
                None => {
                    self.counters.refused_unknown_key += 1;
                    return Ok(());
                }
            },
        };
        if let Some(instance) = &message.instance {
            let source = message.label.source();
            match (message.change, written.instances.get_mut(&instance.hash)) {
                (Change::Unregister, _) => drop(written.instances.remove(&instance.hash)),
                (_, Some(live)) => live.source = source,
                (Change::Dispose, None) => {
                    written.instances.insert(instance.hash, Live { key: cdr.clone(), source });
                }
                (Change::Put, None) => {
                    if let Some(key) = form.key(message, xcdr).map_err(|why| why.to_string())? {
                        written.instances.insert(instance.hash, Live { key, source });
                    }
                }
            }
        }
        self.counters.exported += 1;
        if let Some(route) = self.routes.get_mut(id) {
            route.crossed += 1;
        }
        out.domain(DomainCommand::Write(id, sending, cdr, at));
        Ok(())
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
    }
}
