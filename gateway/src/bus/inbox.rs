//! What Zenoh's threads hand to the node's loop: bounded, and it says what it sheds.

use aldis_envelope::Keys;
use aldis_envelope::codec::native::Decoder;
use aldis_services::Event;
use bytes::Bytes;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::Notify;

/// How many events may wait. At a million samples a second this is 65 ms of the loop's absence.
const EVENTS_MAX: usize = 65_536;

/// How long Zenoh's thread waits for a place before it sheds. Its peer's senders wait as long, so it stays well below
/// the five seconds after which Zenoh gives up a transport.
const PATIENCE: Duration = Duration::from_secs(1);

/// Events on their way to the loop.
pub(crate) struct Inbox {
    state: Mutex<State>,
    filled: Notify,
    emptied: Condvar,
}

struct State {
    decoder: Decoder,
    events: Vec<Event>,
    shed: u64,
    /// Keys seen for the first time, to be declared outside of Zenoh's callback.
    learned: Vec<String>,
}

impl Inbox {
    pub(crate) fn new(keys: Keys) -> Self {
        let decoder = Decoder::new(keys);
        let state = State { decoder, events: Vec::new(), shed: 0, learned: Vec::new() };
        Self { state: Mutex::new(state), filled: Notify::new(), emptied: Condvar::new() }
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
        let event = match state.decoder.decode(key, deleted, header, content) {
            Ok(envelope) => Event::Sample(envelope),
            Err(why) => Event::SampleRefused(why),
        };
        if state.decoder.take_learned() {
            state.learned.push(key.to_owned());
        }
        self.push(state, event);
    }

    /// Takes any other event.
    pub(crate) fn event(&self, event: Event) {
        self.push(self.lock(), event);
    }

    fn push(&self, mut state: MutexGuard<'_, State>, event: Event) {
        let was_empty = state.events.is_empty();
        state.events.push(event);
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

    /// Takes all events, in their order, and the keys to declare. `into` must be empty; its memory is reused.
    pub(crate) fn drain(&self, into: &mut Vec<Event>) -> Vec<String> {
        let mut state = self.lock();
        std::mem::swap(&mut state.events, into);
        if state.shed > 0 {
            into.push(Event::SamplesShed(std::mem::take(&mut state.shed)));
        }
        let learned = std::mem::take(&mut state.learned);
        drop(state);
        self.emptied.notify_all();
        learned
    }
}
