//! What a core service is: a pure machine over LMCP objects, and how the house runs it as a service.

use crate::service::{Input, Job, JobOutput, Level, Outbox, Service};
use aldis_envelope::lmcp::cmasi::{KeyValuePair, ServiceStatus, ServiceStatusType};
use aldis_envelope::lmcp::{self, Header, Object, Ref, Text, TypeInfo};
use aldis_envelope::{
    Address, ContentType, Envelope, Instance, Label, Message, Monotonic, Name, Now, Prefix, Source,
};
use std::sync::Arc;

/// The key of the pair in a [`ServiceStatus`] that names the request which failed.
pub const REQUEST_KEY: &str = "RequestID";

/// The key of the pair in a [`ServiceStatus`] that names the vehicle whose mission is lost: whoever served it is not in control.
pub const LOST_KEY: &str = "MissionLost";

/// The key of the pair that says why a request has no plan, as the reference writes it.
pub const FAILED_KEY: &str = "No UniqueAutomationResponse";

/// A message that a machine hears.
pub struct Heard<'a> {
    /// What it says.
    pub object: &'a dyn Object,
    /// Who sent it.
    pub source: Source,
}

/// A core service without the house around it: messages in, messages out.
pub trait Machine: Send {
    /// The types that it hears, with all that descend from them. What is addressed to the service itself it hears anyway.
    fn hears(&self) -> Vec<&'static TypeInfo>;

    /// The mailboxes that it reads.
    fn mailboxes(&self) -> Vec<String> {
        Vec::new()
    }

    /// It has been started.
    fn start(&mut self, _post: &mut Post<'_>) {}

    /// Takes a message.
    fn take(&mut self, heard: &Heard<'_>, post: &mut Post<'_>);

    /// The moment that it waits for has come.
    fn wake(&mut self, _post: &mut Post<'_>) {}

    /// The moment that it waits for.
    fn deadline(&self) -> Option<Monotonic> {
        None
    }

    /// A job of its own is done, or panicked.
    fn done(&mut self, _number: u64, _output: Result<JobOutput, String>, _post: &mut Post<'_>) {}

    /// A service of another node is gone.
    fn gone(&mut self, _source: Source, _post: &mut Post<'_>) {}
}

/// Where a machine puts what it sends.
pub struct Post<'a> {
    now: Now,
    out: &'a mut Outbox,
}

impl<'a> Post<'a> {
    /// A post into an outbox.
    pub fn new(now: Now, out: &'a mut Outbox) -> Self {
        Self { now, out }
    }

    /// The two clocks.
    pub fn now(&self) -> Now {
        self.now
    }

    /// The wall clock in milliseconds, as LMCP counts.
    pub fn wall_ms(&self) -> i64 {
        self.now.wall.0.div_euclid(1_000_000)
    }

    /// The ids of the service.
    pub fn source(&self) -> Source {
        self.out.source()
    }

    /// Tells everybody who hears its type.
    pub fn broadcast(&mut self, object: &dyn Object) {
        match Name::new(object.type_info().full_name) {
            Ok(name) => self.send(name.into(), object),
            Err(why) => self.out.note(Level::Error, why.to_string()),
        }
    }

    /// Puts it into a mailbox.
    pub fn mail(&mut self, mailbox: &str, object: &dyn Object) {
        match Name::new(mailbox) {
            Ok(name) => self.send(name.into(), object),
            Err(why) => self.out.note(Level::Error, format!("mailbox: {why}")),
        }
    }

    /// Sends it to one service.
    pub fn reply(&mut self, to: Source, object: &dyn Object) {
        self.send(Address::Service(to), object);
    }

    /// Says something to people.
    pub fn note(&mut self, level: Level, text: impl Into<String>) {
        self.out.note(level, text);
    }

    /// Has something computed outside the loop.
    pub fn job(&mut self, number: u64, job: Job) {
        self.out.job(number, job);
    }

    /// Tells what went well.
    pub fn information(&mut self, key: &str, value: &str) {
        self.status(ServiceStatusType::Information, &[(key, value)]);
    }

    /// Tells that a request has no plan, and why; whoever waits for it learns it at once.
    pub fn failed(&mut self, request: i64, why: &str) {
        let number = request.to_string();
        self.status(ServiceStatusType::Error, &[(FAILED_KEY, why), (REQUEST_KEY, &number)]);
    }

    /// Tells how something went.
    pub fn status(&mut self, status_type: ServiceStatusType, pairs: &[(&str, &str)]) {
        let info = pairs.iter().map(|(key, value)| pair(key, value)).collect();
        self.broadcast(&ServiceStatus { percent_complete: 0.0, info, status_type });
    }

    fn send(&mut self, address: Address, object: &dyn Object) {
        let info = object.type_info();
        let written = lmcp::encode(object).map_err(|why| why.to_string());
        let named = Name::new(info.full_name).map_err(|why| why.to_string());
        match written.and_then(|content| Ok((content, named?))) {
            Ok((content, name)) => {
                let natural = lmcp::natural_key(info.full_name, &content);
                let label = Label::limitedcast(address, ContentType::Lmcp, name.into(), self.out.source());
                let message = Message::new(Arc::new(label), content.into());
                self.out.send(match natural {
                    Some(key) => message.of_instance(Instance::of_number(key)),
                    None => message,
                });
            }
            Err(why) => self.out.note(Level::Error, format!("{} cannot be sent: {why}", info.name)),
        }
    }
}

/// A named text.
pub fn pair(key: &str, value: &str) -> Ref<KeyValuePair> {
    Ref::new(KeyValuePair { key: Text::new(key), value: Text::new(value) })
}

/// A machine as a service of the house.
pub struct Hosted<M> {
    machine: M,
    /// What it hears, all descendants named.
    types: Vec<&'static TypeInfo>,
}

impl<M: Machine> Hosted<M> {
    /// The service of a machine.
    pub fn new(machine: M) -> Self {
        let mut types: Vec<_> = machine.hears().into_iter().flat_map(lmcp::descendants).collect();
        types.sort_by_key(|info| info.full_name);
        types.dedup_by_key(|info| info.full_name);
        Self { machine, types }
    }

    /// The machine itself, for services that stand around it.
    pub(super) fn machine(&mut self) -> &mut M {
        &mut self.machine
    }

    fn message(&mut self, now: Now, envelope: &Envelope, out: &mut Outbox) {
        let label = &envelope.message.label;
        if label.attributes.content_type != ContentType::Lmcp {
            return;
        }
        let content = &envelope.message.content;
        let Some(info) = Header::peek(content).ok().and_then(|header| header.type_info().ok()) else {
            return;
        };
        // A prefix on the bus may bring more types than were meant.
        let is_own = matches!(&label.address, Address::Service(to) if *to == out.source());
        let is_mail = matches!(&label.address, Address::Name(name) if self.machine.mailboxes().iter().any(|m| m == name.as_str()));
        if !(is_own || is_mail || self.types.iter().any(|known| known.full_name == info.full_name)) {
            return;
        }
        match lmcp::decode(content) {
            Ok(object) => {
                let heard = Heard { object: object.as_ref(), source: label.source() };
                self.machine.take(&heard, &mut Post::new(now, out));
            }
            Err(why) => {
                out.note(Level::Warning, format!("{} of {} unread: {why}", info.name, label.source()));
            }
        }
    }
}

impl<M: Machine> Service for Hosted<M> {
    fn subscriptions(&self) -> Vec<Prefix> {
        let names = self.types.iter().map(|info| info.full_name.to_owned());
        names.chain(self.machine.mailboxes()).filter_map(|name| Prefix::new(&name).ok()).collect()
    }

    fn follows_bus(&self) -> bool {
        true
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Started => self.machine.start(&mut Post::new(now, out)),
            Input::Message(envelope) if envelope.message.call.is_some() => {
                let what = envelope.message.label.descriptor().to_owned();
                out.refuse(envelope, aldis_envelope::Refusal::NotUnderstood(what));
            }
            Input::Message(envelope) => self.message(now, envelope, out),
            Input::Deadline => self.machine.wake(&mut Post::new(now, out)),
            Input::Job(number, output) => self.machine.done(number, output, &mut Post::new(now, out)),
            Input::Token(source, false) => self.machine.gone(source, &mut Post::new(now, out)),
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.machine.deadline()
    }
}
