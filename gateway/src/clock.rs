//! The machine's clocks: the only place that reads them.

use aldis_envelope::{BootId, Monotonic, Now, Wall};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// How often the wall clock is read; between two readings it is taken to go as the monotonic clock does. Reading it for
/// each message would cost more than to route the message.
const READ_WALL_EVERY: Duration = Duration::from_millis(10);

/// Tells the time of one node.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Clock {
    start: Instant,
    /// The last reading of the wall clock, and when it was.
    wall: (Duration, Wall),
}

impl Clock {
    /// A clock whose monotonic time starts now.
    pub(crate) fn start() -> Self {
        Self { start: Instant::now(), wall: (Duration::ZERO, wall()) }
    }

    pub(crate) fn now(&mut self) -> Now {
        let elapsed = self.start.elapsed();
        if elapsed - self.wall.0 >= READ_WALL_EVERY {
            self.wall = (elapsed, wall());
        }
        let since = i64::try_from((elapsed - self.wall.0).as_nanos()).unwrap_or_default();
        Now { monotonic: Monotonic::since_start(elapsed), wall: Wall(self.wall.1.0.saturating_add(since)) }
    }

    /// The moment of the machine's own clock that a monotonic time means.
    pub(crate) fn instant(&self, at: Monotonic) -> Instant {
        self.start + at.elapsed()
    }
}

/// The wall clock.
pub(crate) fn wall() -> Wall {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Wall(i64::try_from(since.as_nanos()).unwrap_or(i64::MAX))
}

/// The boot id of a node without a journal: the wall clock in nanoseconds.
pub(crate) fn boot_id() -> BootId {
    BootId(u64::try_from(wall().0).unwrap_or_default())
}
