//! Stands between a service and its node, where a [`Tamper`] changes what it hears and says.

use super::tamper::Tamper;
use crate::service::{Action, Input, Outbox, Service};
use crate::sim::observe::{Fact, Facts};
use aldis_envelope::{Monotonic, Now, Prefix, Source};

/// A life of a service has ended; others see that its token is withdrawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct LifeEnded(pub(super) Source);

impl Fact for LifeEnded {}

/// A service with what stands in its way.
pub(super) struct Tampered {
    source: Source,
    inner: Box<dyn Service>,
    outbox: Outbox,
    tamper: Box<dyn Tamper>,
    facts: Facts,
}

impl Drop for Tampered {
    fn drop(&mut self) {
        self.facts.tell(LifeEnded(self.source));
    }
}

impl Tampered {
    pub(super) fn new(
        source: Source,
        inner: Box<dyn Service>,
        tamper: Box<dyn Tamper>,
        facts: Facts,
    ) -> Self {
        Self { source, inner, outbox: Outbox::new(source), tamper, facts }
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
            let (mut wanted, mut told) = (Vec::new(), Vec::new());
            for action in actions {
                self.tamper.wants(now, action, &mut wanted, &mut told);
            }
            wanted.into_iter().for_each(|action| out.push(action));
            if told.is_empty() {
                return;
            }
            for number in told {
                self.inner.handle(now, Input::Confirmed(number, Ok(())), &mut self.outbox);
            }
            actions = self.outbox.drain().collect();
        }
    }
}

impl Service for Tampered {
    fn subscriptions(&self) -> Vec<Prefix> {
        self.inner.subscriptions()
    }

    fn follows_bus(&self) -> bool {
        self.inner.follows_bus()
    }

    fn goes_by_what_is_kept(&self) -> bool {
        self.inner.goes_by_what_is_kept()
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        self.give(now, input, out);
        if let Some(envelope) = self.tamper.due(now) {
            self.give(now, Input::Message(&envelope), out);
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        [self.inner.next_deadline(), self.tamper.next_deadline()].into_iter().flatten().min()
    }
}
