//! What Zenoh's threads hand to the node: straight, while it is idle; else by a bounded queue that says what it sheds.

use aldis_envelope::codec::native::Decoder;
use aldis_envelope::{Envelope, Keys};
use aldis_services::Event;
use bytes::Bytes;
use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::Notify;

/// How many events may wait. At a million samples a second this is 65 ms of the loop's absence.
const EVENTS_MAX: usize = 65_536;

/// How many are taken at once: less than what makes a bridge's queue overflow before the node can pause.
const TAKEN_MAX: usize = 512;

/// How many keys are declared at once: each takes as long as many events.
const LEARNED_MAX: usize = 8;

/// How many keys may wait to be declared: what is beyond travels as text.
const LEARNING_MAX: usize = 4_096;

/// How long Zenoh's thread waits for a place before it sheds. Its peer's senders wait as long, so it stays well below
/// the five seconds after which Zenoh gives up a transport.
const PATIENCE: Duration = Duration::from_secs(1);

/// Hands an envelope to the node on Zenoh's thread, where the node is idle; else gives it back.
pub(crate) type Direct = Box<dyn Fn(Envelope) -> Option<Envelope> + Send + Sync>;

/// Events on their way to the node.
pub(crate) struct Inbox {
    direct: Direct,
    state: Mutex<State>,
    filled: Notify,
    emptied: Condvar,
}

struct State {
    decoder: Decoder,
    events: VecDeque<Event>,
    shed: u64,
    /// Keys seen for the first time, to be declared outside of Zenoh's callback.
    learned: Vec<String>,
}

impl Inbox {
    pub(crate) fn new(keys: Keys, direct: Direct) -> Self {
        let decoder = Decoder::new(keys);
        let state = State { decoder, events: VecDeque::new(), shed: 0, learned: Vec::new() };
        Self { direct, state: Mutex::new(state), filled: Notify::new(), emptied: Condvar::new() }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing panics while it holds the lock; if something did, the events are still whole.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a sample from Zenoh's thread.
    pub(crate) fn sample(&self, key: &str, deleted: bool, header: &[u8], content: Bytes) {
        let mut state = self.wait_for_place();
        if state.events.len() >= EVENTS_MAX {
            state.shed += 1;
            return;
        }
        let envelope = match state.decoder.decode(key, deleted, header, content) {
            Ok(envelope) => envelope,
            Err(why) => return self.push(state, Event::SampleRefused(why)),
        };
        if state.decoder.take_learned() && state.learned.len() < LEARNING_MAX {
            state.learned.push(key.to_owned());
        } else if state.events.is_empty() {
            // What waits goes first, and Zenoh hands over the samples of one stream one after the other: so one that
            // finds nothing waiting may pass.
            drop(state);
            if let Some(envelope) = (self.direct)(envelope) {
                self.event(Event::Sample(envelope));
            }
            return;
        }
        self.push(state, Event::Sample(envelope));
    }

    /// Takes any other event.
    pub(crate) fn event(&self, event: Event) {
        self.push(self.lock(), event);
    }

    fn push(&self, mut state: MutexGuard<'_, State>, event: Event) {
        let was_empty = state.events.is_empty();
        state.events.push_back(event);
        drop(state);
        if was_empty {
            self.filled.notify_one();
        }
    }

    fn wait_for_place(&self) -> MutexGuard<'_, State> {
        let state = self.lock();
        if state.events.len() < EVENTS_MAX {
            return state;
        }
        let full = |state: &mut State| state.events.len() >= EVENTS_MAX;
        match self.emptied.wait_timeout_while(state, PATIENCE, full) {
            Ok((state, _)) => state,
            Err(poisoned) => poisoned.into_inner().0,
        }
    }

    /// Waits until there is something.
    pub(crate) async fn filled(&self) {
        self.filled.notified().await;
    }

    /// Takes the next events, in their order, and the keys to declare. Wakes [`Self::filled`] again where some are left.
    pub(crate) fn take(&self, into: &mut Vec<Event>) -> Vec<String> {
        let mut state = self.lock();
        let count = state.events.len().min(TAKEN_MAX);
        into.extend(state.events.drain(..count));
        if state.shed > 0 {
            into.push(Event::SamplesShed(std::mem::take(&mut state.shed)));
        }
        let learned = state.learned.len().min(LEARNED_MAX);
        let learned = state.learned.drain(..learned).collect();
        let some_left = !state.events.is_empty() || !state.learned.is_empty();
        drop(state);
        if some_left {
            self.filled.notify_one();
        }
        self.emptied.notify_all();
        learned
    }
}
