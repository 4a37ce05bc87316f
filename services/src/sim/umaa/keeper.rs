//! Stands between a service and its node: keeps what the service retains over its lives, as a journal does, and tells the
//! checkers what it writes, whether its bus carries that or not.

use super::tamper::Tamper;
use crate::service::{Action, Input, Outbox, Service};
use crate::sim::observe::{Fact, Facts};
use aldis_envelope::umaa::{
    self, CommandKey, CommandStatus, Key, ResourceAllocationCommand, ResourceAllocationReport, Topic,
};
use aldis_envelope::{
    BootId, Change, Envelope, KeyHash, Message, Monotonic, Now, Prefix, Priority, Source, Stamp,
};
use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

/// A service has written something.
#[derive(Clone, PartialEq)]
pub(super) struct Wrote(pub(super) Envelope);

impl Fact for Wrote {}

/// In one line, for traces: statuses as what they say, the rest by its instance.
impl fmt::Debug for Wrote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let message = &self.0.message;
        let (topic, writer) = (message.label.descriptor(), message.label.source());
        let name = topic.rsplit("::").next().unwrap_or_default();
        write!(f, "{writer} writes {name}: ")?;
        match (message.change, &message.instance) {
            (Change::Put, _) if topic.ends_with("CommandStatus") => {
                // All statuses have the same members.
                match umaa::decode::<CommandStatus<ResourceAllocationCommand>>(&message.content) {
                    Ok(status) => write!(f, "{status:?}"),
                    Err(why) => write!(f, "{why}"),
                }
            }
            (Change::Put, _) if topic == ResourceAllocationReport::NAME => {
                match umaa::decode::<ResourceAllocationReport>(&message.content) {
                    Ok(report) => write!(f, "{:?}", report.control_info),
                    Err(why) => write!(f, "{why}"),
                }
            }
            (change, Some(instance)) => match CommandKey::of_instance(instance) {
                Some(key) => write!(f, "{change:?} of session {} by {}", key.session_id, key.source),
                None => write!(f, "{change:?} of {}", instance.hash),
            },
            (change, None) => write!(f, "{change:?}"),
        }
    }
}

/// How many disposals are kept: a reader may not have heard of one when its writer ends.
const DISPOSALS_MAX: usize = 256;

/// What is kept of a service over its lives: the last message of each instance, in the order of writing.
#[derive(Debug, Clone, Default)]
pub(super) struct Store(Arc<Mutex<Kept>>);

#[derive(Debug, Default)]
struct Kept {
    samples: BTreeMap<(String, KeyHash), (u64, Message)>,
    /// How much was written.
    written: u64,
}

impl Store {
    fn with<T>(&self, act: impl FnOnce(&mut Kept) -> T) -> T {
        act(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Kept {
    fn write(&mut self, message: &Message) {
        self.written += 1;
        let Some(instance) = &message.instance else { return };
        let id = (message.label.descriptor().to_owned(), instance.hash);
        match message.change {
            Change::Put | Change::Dispose => drop(self.samples.insert(id, (self.written, message.clone()))),
            Change::Unregister => drop(self.samples.remove(&id)),
        }
        let disposals = self.samples.iter().filter(|(_, (_, kept))| kept.change == Change::Dispose);
        if message.change == Change::Dispose && disposals.clone().count() > DISPOSALS_MAX {
            let oldest = disposals.min_by_key(|(_, (number, _))| *number).map(|(id, _)| id.clone());
            oldest.map(|id| self.samples.remove(&id));
        }
    }

    fn in_order(&self) -> Vec<Message> {
        let mut samples: Vec<_> = self.samples.values().collect();
        samples.sort_by_key(|(number, _)| *number);
        samples.into_iter().map(|(_, message)| message.clone()).collect()
    }
}

/// The service, with what is kept of it.
pub(super) struct Keeper {
    source: Source,
    inner: Box<dyn Service>,
    outbox: Outbox,
    store: Store,
    facts: Facts,
    tamper: Box<dyn Tamper>,
}

impl Keeper {
    pub(super) fn new(
        source: Source,
        inner: Box<dyn Service>,
        store: Store,
        facts: Facts,
        tamper: Box<dyn Tamper>,
    ) -> Self {
        Self { source, inner, outbox: Outbox::new(source), store, facts, tamper }
    }

    fn envelope(&self, now: Now, message: Message) -> Envelope {
        let stamp = Stamp {
            node: self.source.entity,
            boot: BootId(0),
            sequence: self.store.with(|kept| kept.written),
            source_time: now.wall,
            lifespan_left_ms: None,
            priority: Priority::Data,
            skipped: 0,
            via: Vec::new(),
        };
        Envelope { message, stamp }
    }

    fn give(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        if self.tamper.hears(now, &input) {
            self.inner.handle(now, input, &mut self.outbox);
        }
        self.settle(now, out);
    }

    /// Hands on what the service wants done.
    fn settle(&mut self, now: Now, out: &mut Outbox) {
        let mut actions: Vec<Action> = self.outbox.drain().collect();
        loop {
            let mut wanted = Vec::new();
            let mut told = Vec::new();
            for action in actions {
                self.tamper.wants(now, action, &mut wanted, &mut told);
            }
            for action in wanted {
                if let Action::Send(message) | Action::SendConfirmed(message, ..) = &action {
                    self.wrote(now, message);
                }
                out.push(action);
            }
            if told.is_empty() {
                return;
            }
            for number in told {
                self.inner.handle(now, Input::Confirmed(number, Ok(())), &mut self.outbox);
            }
            actions = self.outbox.drain().collect();
        }
    }

    fn wrote(&self, now: Now, message: &Message) {
        if message.instance.is_some() {
            self.store.with(|kept| kept.write(message));
            self.facts.tell(Wrote(self.envelope(now, message.clone())));
        }
    }
}

impl Service for Keeper {
    fn subscriptions(&self) -> Vec<Prefix> {
        self.inner.subscriptions()
    }

    fn follows_bus(&self) -> bool {
        self.inner.follows_bus()
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        let starts = matches!(input, Input::Started);
        let kept = if starts { self.store.with(|kept| kept.in_order()) } else { Vec::new() };
        for message in &kept {
            // The node of this life has yet to learn of it.
            self.facts.tell(Wrote(self.envelope(now, message.clone())));
            out.send(message.clone());
        }
        self.give(now, input, out);
        for message in kept.into_iter().filter(|message| message.change == Change::Put) {
            let envelope = self.envelope(now, message);
            self.give(now, Input::Recovered(&envelope), out);
        }
        if let Some(envelope) = self.tamper.due(now) {
            self.give(now, Input::Message(&envelope), out);
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        [self.inner.next_deadline(), self.tamper.next_deadline()].into_iter().flatten().min()
    }
}
