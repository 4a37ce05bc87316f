//! The machine's clocks: the only place that reads them.

use aldis_envelope::{BootId, Monotonic, Now, Wall};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// Tells the time of one node.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Clock {
    start: Instant,
}

impl Clock {
    /// A clock whose monotonic time starts now.
    pub(crate) fn start() -> Self {
        Self { start: Instant::now() }
    }

    pub(crate) fn now(&self) -> Now {
        Now { monotonic: Monotonic::since_start(self.start.elapsed()), wall: wall() }
    }

    /// The moment of the machine's own clock that a monotonic time means.
    pub(crate) fn instant(&self, at: Monotonic) -> Instant {
        self.start + at.elapsed()
    }
}

fn wall() -> Wall {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Wall(i64::try_from(since.as_nanos()).unwrap_or(i64::MAX))
}

/// The boot id of a node without a journal: the wall clock in nanoseconds.
pub(crate) fn boot_id() -> BootId {
    BootId(u64::try_from(wall().0).unwrap_or_default())
}
