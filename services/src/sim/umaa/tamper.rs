//! What stands in the way of a service on purpose: to see that it is found.

use crate::service::{Action, Input};
use aldis_envelope::umaa::{ResourceAllocationReport, Topic};
use aldis_envelope::{Envelope, Monotonic, Now};
use std::collections::VecDeque;
use std::time::Duration;

/// Changes what a service hears and says.
pub(super) trait Tamper: Send {
    /// Whether the service hears this.
    fn hears(&mut self, _now: Now, _input: &Input<'_>) -> bool {
        true
    }

    /// What becomes of a wish. `confirmed` are deliveries that the service is told to be confirmed at once.
    fn wants(&mut self, _now: Now, action: Action, wanted: &mut Vec<Action>, _confirmed: &mut Vec<u64>) {
        wanted.push(action);
    }

    /// What the service hears late.
    fn due(&mut self, _now: Now) -> Option<Envelope> {
        None
    }

    /// When [`Tamper::due`] has something.
    fn next_deadline(&self) -> Option<Monotonic> {
        None
    }
}

/// Nothing is tampered with.
pub(super) struct Honest;

impl Tamper for Honest {}

/// A service is told that its reports are confirmed when they are not.
pub(super) struct Unconfirmed;

impl Tamper for Unconfirmed {
    fn wants(&mut self, _: Now, action: Action, wanted: &mut Vec<Action>, confirmed: &mut Vec<u64>) {
        match action {
            Action::SendConfirmed(message, number, _) => {
                wanted.push(Action::Send(message));
                confirmed.push(number);
            }
            action => wanted.push(action),
        }
    }
}

/// How old the reports are that a stale guard goes by.
const STALE_BY: Duration = Duration::from_secs(1);

/// A service goes by reports of control that are of a while ago. Its node has confirmed them all the same.
#[derive(Default)]
pub(super) struct Stale {
    waiting: VecDeque<(Monotonic, Envelope)>,
    /// What has waited is heard now.
    lets_through: bool,
}

impl Tamper for Stale {
    fn hears(&mut self, now: Now, input: &Input<'_>) -> bool {
        match input {
            Input::Message(envelope)
                if envelope.message.label.descriptor() == ResourceAllocationReport::NAME
                    && !std::mem::take(&mut self.lets_through) =>
            {
                self.waiting.push_back((now.monotonic + STALE_BY, (*envelope).clone()));
                false
            }
            _ => true,
        }
    }

    fn due(&mut self, now: Now) -> Option<Envelope> {
        self.next_deadline().filter(|at| *at <= now.monotonic)?;
        let (_, envelope) = self.waiting.pop_front()?;
        self.lets_through = true;
        Some(envelope)
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.waiting.front().map(|(at, _)| *at)
    }
}

/// A service does not hear what statuses its former life has left.
pub(super) struct Forgetful;

impl Tamper for Forgetful {
    fn hears(&mut self, _: Now, input: &Input<'_>) -> bool {
        !matches!(input, Input::Recovered(envelope) if envelope.message.label.descriptor().ends_with("CommandStatus"))
    }
}
