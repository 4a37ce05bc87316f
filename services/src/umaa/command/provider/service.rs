//! A provider as a service of a node.

use super::super::executor::{Admission, Executor};
use super::super::writer::is_about;
use super::{Provider, Stage};
use crate::service::{Input, Outbox, Service};
use aldis_envelope::umaa::{Command, ExecutionStatus, Topic};
use aldis_envelope::{Monotonic, Now, Prefix, Refusal};

impl<C: Command, E: Executor<C>, A: Admission> Provider<C, E, A> {
    /// What a provider subscribes to: its commands, and by the same prefix statuses and acknowledgements, among them those of
    /// its former life.
    pub fn subscriptions(&self) -> Vec<Prefix> {
        let names = [C::NAME, C::ExecutionStatus::NAME];
        let defined = names.into_iter().take(1 + usize::from(C::ExecutionStatus::DEFINED));
        let own = defined.filter_map(|name| Prefix::new(name).ok());
        own.chain(self.executor.subscriptions()).chain(self.admission.subscriptions()).collect()
    }

    /// Takes one input of the service.
    pub fn handle(&mut self, now: Now, input: &Input<'_>, out: &mut Outbox) {
        self.admission.observe(now, input, out);
        self.executor.observe(now, input, out);
        match input {
            Input::Recovered(envelope) => self.remember(envelope, true),
            Input::Message(envelope) if is_about::<C>(envelope) => self.command(now, envelope, out),
            Input::Message(envelope) => self.remember(envelope, false),
            Input::Token(source, alive) => self.alive(*source, *alive),
            Input::HistoryComplete(all_is_told) => self.recover(now, *all_is_told, out),
            Input::Shutdown => self.shut_down(now, out),
            _ => {}
        }
        if self.stage == Stage::Serving {
            self.give_up_orphans(now, false, out);
            self.poll(now, out);
        }
        self.executor.settled(now, out);
    }

    /// When it wants [`Input::Deadline`].
    pub fn next_deadline(&self) -> Option<Monotonic> {
        if self.stage != Stage::Serving {
            return None;
        }
        let limits = self.held.values().filter_map(|held| held.limit);
        let others =
            [self.executor.next_deadline(), self.admission.next_deadline(), self.past.next_deadline()];
        limits.chain(others.into_iter().flatten()).min()
    }
}

impl<C: Command, E: Executor<C>, A: Admission> Service for Provider<C, E, A> {
    fn subscriptions(&self) -> Vec<Prefix> {
        Provider::subscriptions(self)
    }

    /// The guard of a resource wants to know who is alive.
    fn follows_bus(&self) -> bool {
        true
    }

    fn goes_by_what_is_kept(&self) -> bool {
        true
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        if let Input::Message(envelope) = &input
            && envelope.message.call.is_some()
        {
            let what = envelope.message.label.descriptor().to_owned();
            out.refuse(envelope, Refusal::NotUnderstood(what));
            return;
        }
        Provider::handle(self, now, &input, out);
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        Provider::next_deadline(self)
    }
}
