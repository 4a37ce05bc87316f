//! The services that chatter.

use super::{CALL_WITHIN, ChatterFact, MAILBOX, Planted, TICK, Target};
use crate::service::{Input, Outbox, Service, ServiceSpec};
use crate::sim::observe::Facts;
use aldis_envelope::{
    Address, CallId, ContentType, Descriptor, EntityId, Label, Message, Monotonic, Name, Now, Prefix, Role,
    ServiceId, Source, Wall,
};
use bytes::Bytes;
use std::sync::Arc;
use std::time::Duration;

pub(super) fn spec<S: Service + 'static>(
    source: Source,
    make: impl Fn() -> S + Send + Sync + 'static,
) -> ServiceSpec {
    ServiceSpec { source, name: "chatter".into(), factory: Arc::new(move || Box::new(make())) }
}

/// Publishes numbers and hears those of others.
pub(super) struct Ticker {
    source: Source,
    period: Duration,
    label: Option<Arc<Label>>,
    facts: Facts,
    planted: Option<Planted>,
    life: Option<Wall>,
    number: u64,
    next: Option<Monotonic>,
}

impl Ticker {
    pub(super) fn new(source: Source, period_ms: u64, facts: Facts, planted: Option<Planted>) -> Self {
        let name = Name::new(TICK).ok();
        let label = name.map(|name| Arc::new(Label::broadcast(ContentType::Aldis, name, source)));
        let period = Duration::from_millis(period_ms);
        Self { source, period, label, facts, planted, life: None, number: 0, next: None }
    }

    fn tick(&mut self, now: Now, out: &mut Outbox) {
        let life = *self.life.get_or_insert(now.wall);
        self.number += 1;
        if self.planted == Some(Planted::SkipsTick) && self.number.is_multiple_of(20) {
            self.number += 1;
        }
        let content = [life.0.to_le_bytes(), (self.number as i64).to_le_bytes()].concat();
        if let Some(label) = &self.label {
            out.send(Message::new(label.clone(), Bytes::from(content)));
        }
        self.next = Some(now.monotonic + self.period);
    }
}

fn number_at(content: &[u8], at: usize) -> Option<i64> {
    Some(i64::from_le_bytes(content.get(at..at + 8)?.try_into().ok()?))
}

impl Service for Ticker {
    fn subscriptions(&self) -> Vec<Prefix> {
        Prefix::new(TICK).into_iter().collect()
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Started | Input::Deadline => self.tick(now, out),
            Input::Message(envelope) if envelope.message.label.descriptor() == TICK => {
                let content = &envelope.message.content;
                if let (Some(life), Some(number)) = (number_at(content, 0), number_at(content, 8)) {
                    let from = envelope.message.label.source();
                    let (by, life, number) = (self.source, Wall(life), number as u64);
                    self.facts.tell(ChatterFact::Tick { by, from, life, number });
                }
            }
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.next
    }
}

/// Answers each request once.
pub(super) struct Echo {
    planted: Option<Planted>,
    answered: u64,
}

impl Echo {
    pub(super) fn new(planted: Option<Planted>) -> Self {
        Self { planted, answered: 0 }
    }
}

impl Service for Echo {
    fn subscriptions(&self) -> Vec<Prefix> {
        Prefix::new(MAILBOX).into_iter().collect()
    }

    fn handle(&mut self, _: Now, input: Input<'_>, out: &mut Outbox) {
        let (Input::Message(request), Ok(name)) = (input, Name::new("sim.Echoed")) else { return };
        self.answered += 1;
        let twice = self.planted == Some(Planted::AnswersTwice) && self.answered.is_multiple_of(20);
        if twice {
            out.reply(request, ContentType::Aldis, name.clone(), request.message.content.clone(), false);
        }
        out.reply(request, ContentType::Aldis, name, request.message.content.clone(), true);
    }
}

/// Calls all kinds of others.
pub(super) struct Caller {
    source: Source,
    entities: Vec<EntityId>,
    period: Duration,
    random: fastrand::Rng,
    facts: Facts,
    planted: Option<Planted>,
    ended: u64,
    next: Option<Monotonic>,
}

impl Caller {
    pub(super) fn new(
        source: Source,
        entities: Vec<EntityId>,
        period_ms: u64,
        seed: u64,
        facts: Facts,
        planted: Option<Planted>,
    ) -> Self {
        let random = fastrand::Rng::with_seed(seed);
        let period = Duration::from_millis(period_ms);
        Self { source, entities, period, random, facts, planted, ended: 0, next: None }
    }

    fn call(&mut self, now: Now, out: &mut Outbox) {
        let own = self.source.entity;
        let entity = self.random.choice(&self.entities).copied().unwrap_or(own);
        let service = |number| ServiceId::new(number).map(|service| Source::new(entity, service));
        let target = match self.random.u8(0..10) {
            0 => Target::All(entity),
            1 => Target::Mailbox,
            2 => Target::Nobody,
            _ => service(101).map_or(Target::Mailbox, Target::Echo),
        };
        let to = match target {
            Target::All(entity) => Some(Address::EntityServices(entity)),
            Target::Mailbox => Address::new(MAILBOX).ok(),
            Target::Nobody => service(4242).ok().map(Address::Service),
            Target::Echo(to) => Some(Address::Service(to)),
        };
        // A ping is answered for every service by its host.
        let descriptor =
            if matches!(target, Target::All(_)) { aldis_envelope::aldis::PING } else { "sim.Echo" };
        if let (Some(to), Ok(descriptor)) = (to, Descriptor::new(descriptor)) {
            let content = Bytes::copy_from_slice(&self.random.u64(..).to_le_bytes());
            let id = out.call(to, ContentType::Aldis, descriptor, content, CALL_WITHIN);
            self.facts.tell(ChatterFact::Calls { caller: self.source, id, to: target });
        }
        self.next = Some(now.monotonic + self.period);
    }

    fn end(&mut self, id: CallId, outcome: Result<(), aldis_envelope::Refusal>) {
        self.ended += 1;
        if self.planted != Some(Planted::ForgetsEnd) || !self.ended.is_multiple_of(20) {
            self.facts.tell(ChatterFact::CallEnds { caller: self.source, id, outcome });
        }
    }
}

impl Service for Caller {
    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Started | Input::Deadline => self.call(now, out),
            Input::Message(envelope) => {
                if let Some(call) = envelope.message.call.as_deref()
                    && matches!(call.role, Role::Reply { .. })
                {
                    let from = envelope.message.label.source();
                    self.facts.tell(ChatterFact::Answer { caller: self.source, id: call.id, from });
                }
            }
            Input::CallEnded(id, outcome) => self.end(id, outcome),
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.next
    }
}
