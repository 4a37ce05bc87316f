//! A service that does with a consumer what its test wishes, and keeps what it was told.

use crate::service::{Input, Outbox, Service};
use crate::umaa::allocation::{ControlTold, ControlledConsumer};
use crate::umaa::command::{Consumer, Told};
use aldis_envelope::umaa::Command;
use aldis_envelope::{Monotonic, Now, Prefix};
use std::sync::{Arc, Mutex};

/// What a test reads while services write it.
pub(crate) type Seen<T> = Arc<Mutex<Vec<T>>>;

/// A part of a service that commands.
pub(crate) trait Part: Send + 'static {
    type Heard: Send;
    fn subscriptions(&self) -> Vec<Prefix>;
    fn handle(&mut self, now: Now, input: &Input<'_>, out: &mut Outbox) -> Vec<Self::Heard>;
    fn next_deadline(&self) -> Option<Monotonic>;
}

impl<C: Command> Part for Consumer<C> {
    type Heard = Told<C::ExecutionStatus>;
    fn subscriptions(&self) -> Vec<Prefix> {
        Consumer::subscriptions(self)
    }
    fn handle(&mut self, now: Now, input: &Input<'_>, out: &mut Outbox) -> Vec<Self::Heard> {
        Consumer::handle(self, now, input, out)
    }
    fn next_deadline(&self) -> Option<Monotonic> {
        Consumer::next_deadline(self)
    }
}

impl<C: Command> Part for ControlledConsumer<C> {
    type Heard = ControlTold<C::ExecutionStatus>;
    fn subscriptions(&self) -> Vec<Prefix> {
        ControlledConsumer::subscriptions(self)
    }
    fn handle(&mut self, now: Now, input: &Input<'_>, out: &mut Outbox) -> Vec<Self::Heard> {
        ControlledConsumer::handle(self, now, input, out)
    }
    fn next_deadline(&self) -> Option<Monotonic> {
        ControlledConsumer::next_deadline(self)
    }
}

type Wish<P> = Box<dyn FnOnce(&mut P, Now, &mut Outbox) + Send>;

/// What a test shares with a service that it has started.
pub(crate) struct Handle<P: Part> {
    wishes: Arc<Mutex<Vec<Wish<P>>>>,
    heard: Seen<P::Heard>,
}

impl<P: Part> Default for Handle<P> {
    fn default() -> Self {
        Self { wishes: Arc::default(), heard: Arc::default() }
    }
}

impl<P: Part> Clone for Handle<P> {
    fn clone(&self) -> Self {
        Self { wishes: self.wishes.clone(), heard: self.heard.clone() }
    }
}

impl<P: Part> Handle<P> {
    /// Has something done at the next input.
    pub(crate) fn wish(&self, wish: impl FnOnce(&mut P, Now, &mut Outbox) + Send + 'static) {
        self.wishes.lock().unwrap().push(Box::new(wish));
    }

    /// What was told since the last time.
    pub(crate) fn take(&self) -> Vec<P::Heard> {
        std::mem::take(&mut *self.heard.lock().unwrap())
    }
}

impl<P: Part<Heard: Clone>> Handle<P> {
    /// What was told, all of it.
    pub(crate) fn heard(&self) -> Vec<P::Heard> {
        self.heard.lock().unwrap().clone()
    }
}

/// The service.
pub(crate) struct Asking<P: Part> {
    pub(crate) part: P,
    pub(crate) handle: Handle<P>,
}

impl<P: Part> Service for Asking<P> {
    fn subscriptions(&self) -> Vec<Prefix> {
        self.part.subscriptions()
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        // What a former life left is known before anything new is begun.
        if !matches!(input, Input::Started | Input::Recovered(_)) {
            for wish in std::mem::take(&mut *self.handle.wishes.lock().unwrap()) {
                wish(&mut self.part, now, out);
            }
        }
        let told = self.part.handle(now, &input, out);
        self.handle.heard.lock().unwrap().extend(told);
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.part.next_deadline()
    }
}
