//! What a process writes about itself, line by line.

use crate::PATIENCE;
use std::io::{BufRead, BufReader, Read};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// The lines that a process wrote so far. Whoever waits for one is woken by it.
#[derive(Debug, Clone, Default)]
pub struct Log(Arc<(Mutex<State>, Condvar)>);

#[derive(Debug, Default)]
struct State {
    lines: Vec<String>,
    ended: bool,
}

impl Log {
    /// Follows a stream until its end, on a thread of its own.
    pub fn follow(stream: impl Read + Send + 'static) -> Self {
        let log = Self::default();
        let writer = log.clone();
        std::thread::spawn(move || {
            for line in BufReader::new(stream).lines().map_while(Result::ok) {
                writer.change(|state| state.lines.push(line));
            }
            writer.change(|state| state.ended = true);
        });
        log
    }

    /// Waits for a line with this part in it.
    ///
    /// # Panics
    /// When none comes within [`PATIENCE`], or the stream ends without one.
    pub fn wait_for(&self, part: &str) -> String {
        let found = |state: &State| state.lines.iter().find(|line| line.contains(part)).cloned();
        let state = self.wait_until(|state| state.ended || found(state).is_some());
        found(&state).unwrap_or_else(|| panic!("no line with `{part}` in:\n{}", state.lines.join("\n")))
    }

    /// How many lines have this part in them.
    pub fn count(&self, part: &str) -> usize {
        self.lock().lines.iter().filter(|line| line.contains(part)).count()
    }

    /// All lines so far.
    pub fn text(&self) -> String {
        self.lock().lines.join("\n")
    }

    /// Waits for the end of the stream; false when it does not come within [`PATIENCE`].
    pub(crate) fn wait_for_end(&self) -> bool {
        self.wait_until(|state| state.ended).ended
    }

    fn wait_until(&self, done: impl Fn(&State) -> bool) -> MutexGuard<'_, State> {
        let waited = self.0.1.wait_timeout_while(self.lock(), PATIENCE, |state| !done(state));
        waited.unwrap_or_else(PoisonError::into_inner).0
    }

    fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.lock());
        self.0.1.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
