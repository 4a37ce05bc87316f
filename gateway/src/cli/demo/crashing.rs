//! A service that crashes on purpose, again and again: its node starts it again, and gives it what it had said.

use aldis_envelope::{Monotonic, Now, Prefix};
use aldis_services::{Input, Outbox, Service, ServiceSpec};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// How long each of its lives lasts. After a shorter one its node would wait longer before the next.
const LIFE: Duration = Duration::from_secs(10);

/// A service in a shell that ends its life.
struct Crashing {
    inner: Box<dyn Service>,
    crashes: Arc<AtomicU64>,
    ends: Option<Monotonic>,
}

/// The same service, which crashes after each ten seconds and counts it.
pub(super) fn crashing(spec: ServiceSpec, crashes: &Arc<AtomicU64>) -> ServiceSpec {
    let (factory, crashes) = (spec.factory.clone(), crashes.clone());
    let factory = Arc::new(move || -> Box<dyn Service> {
        Box::new(Crashing { inner: factory(), crashes: crashes.clone(), ends: None })
    });
    ServiceSpec { factory, ..spec }
}

impl Service for Crashing {
    fn subscriptions(&self) -> Vec<Prefix> {
        self.inner.subscriptions()
    }

    fn follows_bus(&self) -> bool {
        self.inner.follows_bus()
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        let ends = *self.ends.get_or_insert(now.monotonic + LIFE);
        match input {
            Input::Deadline if ends <= now.monotonic => {
                self.crashes.fetch_add(1, Ordering::Relaxed);
                // As a panic would, but without its text over the table.
                std::panic::resume_unwind(Box::new("as the demo has it"));
            }
            // After its last words it lives no longer.
            Input::Shutdown => self.ends = Some(Monotonic::since_start(Duration::MAX)),
            _ => {}
        }
        self.inner.handle(now, input, out);
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        [self.inner.next_deadline(), self.ends].into_iter().flatten().min()
    }
}
