//! Runs services: gives them inputs, takes what they want done, keeps the crash of one from the others.

use crate::service::{Action, Input, Level, Outbox, Service, ServiceSpec};
use aldis_envelope::{Address, Monotonic, Now, Prefix};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

/// A service that crashes sooner after its start than this waits before it starts again, twice as long each time.
const MIN_RUN_TIME: Duration = Duration::from_secs(10);
/// The first wait before a restart. At zero a service that crashes at its start would hold the node.
const RESTART_DELAY_MIN: Duration = Duration::from_secs(1);
/// The longest wait before a restart.
const RESTART_DELAY_MAX: Duration = Duration::from_secs(60);
/// The longest wait before a restart that the disk is to blame for: it may work again long before a service would that crashes
/// by itself.
const REFUSED_DELAY_MAX: Duration = Duration::from_secs(8);

/// What a service did with an input.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Ran {
    /// It took it, or does not run.
    Well,
    /// It panicked with this text and was retired; it starts again by itself.
    Crashed(String),
}

/// One service with what the host knows of it.
pub(crate) struct Hosted {
    pub(crate) spec: ServiceSpec,
    service: Option<Box<dyn Service>>,
    outbox: Outbox,
    prefixes: Vec<Prefix>,
    congested: bool,
    deadline: Option<Monotonic>,
    started_at: Monotonic,
    restart_at: Option<Monotonic>,
    restart_delay: Duration,
    retired: bool,
    /// Taken away: its place is free for another.
    removed: bool,
}

impl Hosted {
    pub(crate) fn new(spec: ServiceSpec) -> Self {
        let outbox = Outbox::new(spec.source);
        Self {
            spec,
            service: None,
            outbox,
            prefixes: Vec::new(),
            congested: false,
            deadline: None,
            started_at: Monotonic::START,
            restart_at: None,
            restart_delay: RESTART_DELAY_MIN,
            retired: false,
            removed: false,
        }
    }

    /// Makes the service and tells it that it has started.
    pub(crate) fn start(&mut self, now: Now) -> Ran {
        self.restart_at = None;
        self.started_at = now.monotonic;
        let factory = self.spec.factory.clone();
        match catch_unwind(AssertUnwindSafe(|| {
            let service = factory();
            let prefixes = service.subscriptions();
            (service, prefixes)
        })) {
            Ok((service, prefixes)) => {
                self.service = Some(service);
                self.prefixes = prefixes;
                self.run(now, Input::Started)
            }
            Err(panic) => self.crash(now, &*panic),
        }
    }

    /// Gives the service an input.
    pub(crate) fn run(&mut self, now: Now, input: Input<'_>) -> Ran {
        let Some(service) = self.service.as_mut() else { return Ran::Well };
        let outbox = &mut self.outbox;
        let run = catch_unwind(AssertUnwindSafe(|| {
            service.handle(now, input, outbox);
            service.next_deadline()
        }));
        match run {
            Ok(deadline) => {
                self.deadline = deadline;
                Ran::Well
            }
            Err(panic) => self.crash(now, &*panic),
        }
    }

    /// What the service wants done since the last time.
    pub(crate) fn actions(&mut self) -> std::vec::Drain<'_, Action> {
        self.outbox.drain()
    }

    /// Whether the service wants something done.
    pub(crate) fn has_actions(&self) -> bool {
        !self.outbox.is_empty()
    }

    /// The service receives these from now on.
    pub(crate) fn set_prefixes(&mut self, prefixes: Vec<Prefix>) {
        self.prefixes = prefixes;
    }

    /// The service hands on what is not taken, or it is taken again.
    pub(crate) fn set_congested(&mut self, congested: bool) {
        self.congested = congested;
    }

    /// Whether the service hands on what is not taken.
    pub(crate) fn is_congested(&self) -> bool {
        self.congested && self.is_running()
    }

    /// Ends the service for good.
    pub(crate) fn retire(&mut self) {
        self.service = None;
        self.deadline = None;
        self.restart_at = None;
        self.retired = true;
    }

    /// Takes the service away; its place may be given to another.
    pub(crate) fn remove(&mut self) {
        self.retire();
        self.outbox.forget();
        self.prefixes = Vec::new();
        self.removed = true;
    }

    /// Whether its place is free for another.
    pub(crate) fn is_removed(&self) -> bool {
        self.removed
    }

    pub(crate) fn is_running(&self) -> bool {
        self.service.is_some()
    }

    pub(crate) fn follows_bus(&self) -> bool {
        self.service.as_ref().is_some_and(|service| service.follows_bus())
    }

    pub(crate) fn state(&self) -> &'static str {
        match (self.is_running(), self.retired) {
            (true, _) => "running",
            (false, true) => "retired",
            (false, false) => "crashed, starts again",
        }
    }

    /// Every prefix that it receives: its own, its entity's and what it subscribed to.
    pub(crate) fn prefixes(&self) -> impl Iterator<Item = Prefix> + '_ {
        let source = self.spec.source;
        let own = [Prefix::Id(Address::Service(source)), Prefix::Id(Address::EntityServices(source.entity))];
        own.into_iter().filter(|_| !self.removed).chain(self.prefixes.iter().cloned())
    }

    /// What it subscribed to.
    pub(crate) fn subscribed(&self) -> impl Iterator<Item = &Prefix> {
        let running = self.is_running();
        self.prefixes.iter().filter(move |_| running)
    }

    /// Whether a message to this address is for it.
    pub(crate) fn receives(&self, address: &Address) -> bool {
        let source = self.spec.source;
        if self.removed {
            return false;
        }
        match address {
            Address::Service(to) if *to == source => true,
            Address::EntityServices(entity) | Address::Entity(entity) if *entity == source.entity => true,
            _ => self.prefixes.iter().any(|prefix| prefix.matches(address)),
        }
    }

    /// When it wants its deadline, or its restart.
    pub(crate) fn next_deadline(&self) -> Option<Monotonic> {
        match (self.deadline, self.restart_at) {
            (Some(deadline), Some(restart)) => Some(deadline.min(restart)),
            (deadline, restart) => deadline.or(restart),
        }
    }

    pub(crate) fn wants_deadline(&self, now: Monotonic) -> bool {
        self.deadline.is_some_and(|at| at <= now)
    }

    pub(crate) fn wants_restart(&self, now: Monotonic) -> bool {
        self.restart_at.is_some_and(|at| at <= now)
    }

    pub(crate) fn goes_by_what_is_kept(&self) -> bool {
        self.service.as_ref().is_some_and(|service| service.goes_by_what_is_kept())
    }

    /// Whether it has crashed and is to start again: nobody wants what it still had to say.
    pub(crate) fn has_crashed(&self) -> bool {
        self.restart_at.is_some()
    }

    fn crash(&mut self, now: Now, panic: &(dyn Any + Send)) -> Ran {
        self.end_life(now, panic_text(panic), RESTART_DELAY_MAX)
    }

    /// Ends this life of the service because what it says is refused; the next begins by itself.
    pub(crate) fn refuse(&mut self, now: Now, text: String) -> Ran {
        self.end_life(now, text, REFUSED_DELAY_MAX)
    }

    fn end_life(&mut self, now: Now, text: String, delay_max: Duration) -> Ran {
        self.service = None;
        self.deadline = None;
        self.outbox.forget();
        let ran = now.monotonic - self.started_at;
        self.restart_delay =
            if ran >= MIN_RUN_TIME { RESTART_DELAY_MIN } else { (self.restart_delay * 2).min(delay_max) };
        self.restart_at = Some(now.monotonic + self.restart_delay);
        self.outbox.note(Level::Error, format!("service {} crashed: {text}", self.spec.source));
        Ran::Crashed(text)
    }
}

/// What a panic said.
pub(crate) fn panic_text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "without a text".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use aldis_envelope::{EntityId, ServiceId, Source, Wall};
    use std::sync::Arc;

    struct Idle;

    impl Service for Idle {
        fn handle(&mut self, _: Now, _: Input<'_>, _: &mut Outbox) {}
    }

    /// The wait before the last of many restarts, where each life ends as soon as it has begun.
    fn last_wait(end: impl Fn(&mut Hosted, Now) -> Ran) -> Duration {
        let source = Source::new(EntityId::new(400).unwrap(), ServiceId::new(100).unwrap());
        let factory = Arc::new(|| Box::new(Idle) as Box<dyn Service>);
        let mut hosted = Hosted::new(ServiceSpec { source, name: "idle".into(), factory });
        let mut at = Monotonic::START;
        let mut wait = Duration::ZERO;
        for _ in 0..10 {
            let now = Now { monotonic: at, wall: Wall(0) };
            hosted.start(now);
            end(&mut hosted, now);
            let next = hosted.next_deadline().unwrap();
            (wait, at) = (next - at, next);
        }
        wait
    }

    #[test]
    fn a_service_that_the_disk_refuses_is_back_sooner_than_one_that_crashes() {
        assert_eq!(last_wait(|hosted, now| hosted.crash(now, &"a bug")), RESTART_DELAY_MAX);
        assert_eq!(last_wait(|hosted, now| hosted.refuse(now, "a full disk".into())), REFUSED_DELAY_MAX);
    }
}
