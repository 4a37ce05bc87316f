//! The service manager of UxAS: tells that all services have started, ends and starts services when it is asked to, and
//! tells which entities come and go.

use crate::service::{Input, Level, Outbox, Service, ServiceSpec};
use aldis_envelope::lmcp::cmasi::{KeyValuePair, ServiceStatus, ServiceStatusType};
use aldis_envelope::lmcp::uxnative::{
    CreateNewService, EntityExit, EntityJoin, KillService, StartupComplete,
};
use aldis_envelope::lmcp::{self, Object, Ref};
use aldis_envelope::{
    ContentType, EntityId, Envelope, Label, Message, Monotonic, Name, Now, Prefix, Refusal, ServiceId, Source,
};
use std::collections::BTreeSet;
use std::sync::Arc;

const CREATE: &str = "uxas.messages.uxnative.CreateNewService";
const KILL: &str = "uxas.messages.uxnative.KillService";

/// How many entities are told of; more are not, so that tokens of nobody cannot take all memory.
const ENTITIES_MAX: usize = 10_000;

/// Makes the service that a `CreateNewService` asks for, with these ids.
///
/// # Errors
/// Why there is no such service, in words.
type Make = dyn Fn(Source, &CreateNewService) -> Result<ServiceSpec, String> + Send + Sync;

/// Makes services for a manager.
#[derive(Clone)]
pub struct Maker(Arc<Make>);

impl Maker {
    /// A maker of services.
    pub fn new(
        make: impl Fn(Source, &CreateNewService) -> Result<ServiceSpec, String> + Send + Sync + 'static,
    ) -> Self {
        Self(Arc::new(make))
    }
}

impl std::fmt::Debug for Maker {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Maker")
    }
}

/// The service manager of an entity.
pub struct Manager {
    source: Source,
    make: Maker,
    /// When all services of the configuration have started.
    startup: Option<Monotonic>,
    present: BTreeSet<EntityId>,
}

impl Manager {
    /// A manager with these ids, and how it makes services.
    pub fn new(source: Source, make: Maker) -> Self {
        Self { source, make, startup: None, present: BTreeSet::new() }
    }

    fn tell(&self, object: &dyn Object, out: &mut Outbox) {
        let name = Name::new(object.type_info().full_name);
        match (name, lmcp::encode(object)) {
            (Ok(name), Ok(content)) => {
                let label = Label::broadcast(ContentType::Lmcp, name, self.source);
                out.send(Message::new(Arc::new(label), content.into()));
            }
            (_, Err(why)) => out.note(Level::Error, format!("{object:?} cannot be written: {why}")),
            (Err(why), _) => out.note(Level::Error, why.to_string()),
        }
    }

    /// Says what was asked and not done, to people and to UxAS.
    fn refuse(&self, why: String, out: &mut Outbox) {
        let info = KeyValuePair { key: why.as_str().into(), ..Default::default() };
        let status = ServiceStatus {
            status_type: ServiceStatusType::Error,
            info: vec![Ref::new(info)],
            ..Default::default()
        };
        self.tell(&status, out);
        out.note(Level::Warning, why);
    }

    fn asked(&self, envelope: &Envelope, out: &mut Outbox) {
        let (label, content) = (&envelope.message.label, &envelope.message.content);
        let (from, what) = (label.source(), label.descriptor());
        if label.attributes.content_type != ContentType::Lmcp || !matches!(what, CREATE | KILL) {
            return;
        }
        // An entity starts and ends its own services alone.
        if from.entity != self.source.entity {
            out.note(Level::Information, format!("{what} of {from} is not for {}", self.source.entity));
            return;
        }
        let done = match what {
            KILL => self.kill(content, out),
            _ => self.create(content, out),
        };
        if let Err(why) = done {
            self.refuse(format!("{what} of {from}: {why}"), out);
        }
    }

    fn kill(&self, content: &[u8], out: &mut Outbox) -> Result<(), String> {
        let kill = lmcp::decode_as::<KillService>(content).map_err(|why| why.to_string())?;
        match u64::try_from(kill.service_id).ok().and_then(|id| ServiceId::new(id).ok()) {
            Some(id) => {
                out.stop(Source::new(self.source.entity, id));
                Ok(())
            }
            None => Err(format!("{} is no service; a node is ended by a signal", kill.service_id)),
        }
    }

    fn create(&self, content: &[u8], out: &mut Outbox) -> Result<(), String> {
        let create = lmcp::decode_as::<CreateNewService>(content).map_err(|why| why.to_string())?;
        let id = u64::try_from(create.service_id).ok().and_then(|id| ServiceId::new(id).ok());
        let id = id.ok_or_else(|| format!("{} is no service id", create.service_id))?;
        out.spawn((self.make.0)(Source::new(self.source.entity, id), &create)?);
        Ok(())
    }

    /// A node of another entity appeared or vanished. A hint: it may come twice, and is told once.
    fn token(&mut self, of: Source, alive: bool, out: &mut Outbox) {
        if of.service != ServiceId::NODE || of.entity == self.source.entity {
            return;
        }
        let entity_id = i64::try_from(of.entity.get()).unwrap_or(i64::MAX);
        let label = of.entity.to_string().as_str().into();
        if alive && self.present.len() < ENTITIES_MAX && self.present.insert(of.entity) {
            self.tell(&EntityJoin { entity_id, label }, out);
        } else if !alive && self.present.remove(&of.entity) {
            self.tell(&EntityExit { entity_id, label }, out);
        }
    }

    /// Nobody is heard any more.
    fn alone(&mut self, out: &mut Outbox) {
        for entity in std::mem::take(&mut self.present) {
            let entity_id = i64::try_from(entity.get()).unwrap_or(i64::MAX);
            self.tell(&EntityExit { entity_id, label: entity.to_string().as_str().into() }, out);
        }
    }
}

impl Service for Manager {
    fn subscriptions(&self) -> Vec<Prefix> {
        [CREATE, KILL].iter().filter_map(|name| Prefix::new(name).ok()).collect()
    }

    fn follows_bus(&self) -> bool {
        true
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            // All services of the configuration start before the first deadline.
            Input::Started => self.startup = Some(now.monotonic),
            Input::Deadline if self.startup.take().is_some() => self.tell(&StartupComplete::default(), out),
            Input::Message(envelope) if envelope.message.call.is_some() => {
                let what = envelope.message.label.descriptor().to_owned();
                out.refuse(envelope, Refusal::NotUnderstood(what));
            }
            Input::Message(envelope) => self.asked(envelope, out),
            Input::Token(source, alive) => self.token(source, alive, out),
            Input::Bus(false) => self.alone(out),
            Input::Shutdown => self.startup = None,
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.startup
    }
}
