//! The node with everything that carries out its effects. Whoever has events locks it and hands them in; the effects
//! are carried out on the spot, so that a message passes without a change of thread or task.

use super::Ends;
use crate::bridge::Peers;
use crate::bus::{Bus, BusError};
use crate::carrier::Carriers;
use crate::clock::Clock;
use crate::journal::JournalThread;
use aldis_envelope::{Envelope, Monotonic};
use aldis_services::service::{Job, Level, Note};
use aldis_services::{Effect, Event, Node};
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Duration;
use tokio::sync::{Notify, mpsc, watch};

/// A core that the tasks of a node share.
#[derive(Clone)]
pub(crate) struct Shared {
    core: Arc<Mutex<Core>>,
    /// How many wait for the lock. Callbacks, which come in quick succession, stand back for them.
    waiting: Arc<AtomicUsize>,
    /// Wakes the loop.
    #[cfg_attr(not(feature = "dds"), allow(dead_code, reason = "only domains have events beside the bus"))]
    wake: Arc<Notify>,
}

impl Shared {
    pub(crate) fn lock(&self) -> MutexGuard<'_, Core> {
        // Services' panics are caught inside the node; a panic here is a fault of the shell, and the node is whole.
        self.waiting.fetch_add(1, Ordering::Relaxed);
        let core = self.core.lock().unwrap_or_else(PoisonError::into_inner);
        self.waiting.fetch_sub(1, Ordering::Relaxed);
        core
    }

    /// Hands in an event of a domain on the thread that has it, where the node is idle; otherwise it waits in order. `false` where too
    /// many wait.
    #[cfg(feature = "dds")]
    pub(crate) fn domain_event(&self, inbox: &crate::bridge::dds::Inbox, event: Event, must: bool) -> bool {
        let event = match self.try_lock().filter(|_| inbox.is_empty()) {
            Some(mut core) => match core.handle_on_callback(event) {
                None => return true,
                Some(event) => event,
            },
            None => event,
        };
        let taken = inbox.push(event, must);
        self.wake.notify_one();
        taken
    }

    /// Locks the node where nobody else has it or waits for it.
    pub(super) fn try_lock(&self) -> Option<MutexGuard<'_, Core>> {
        if self.waiting.load(Ordering::Relaxed) > 0 {
            return None;
        }
        match self.core.try_lock() {
            Ok(core) => Some(core),
            Err(TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => None,
        }
    }
}

/// A callback sends things out itself only after this long without: while more goes out, the loop does it, in larger pieces.
/// Putting on the bus may also block until the far side takes something, and a far side that is blocked in the same way
/// would never do; so Zenoh's thread, which must go on taking, does not put when much goes out.
const QUIET: Duration = Duration::from_micros(20);

/// So many puts may go out on callbacks one after the other, one more for each [`QUIET`] that has passed: a command is answered
/// with a handful of samples, and the next may follow at once.
const PUTS_ON_CALLBACK_MAX: u32 = 16;

/// On whose thread effects are carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum On {
    /// The node's own loop.
    Loop,
    /// A callback of Zenoh's.
    Callback,
}

/// The node and its hands.
pub(crate) struct Core {
    node: Node,
    /// What a callback left for the loop to carry out on the bus. While something is here, more goes behind it.
    deferred: VecDeque<Effect>,
    wake: Arc<Notify>,
    last_out: Option<Monotonic>,
    /// How many puts callbacks may still make, and until when that has been reckoned.
    puts_left: (u32, Monotonic),
    clock: Clock,
    /// Kept for their memory.
    events: Vec<Event>,
    effects: Vec<Effect>,
    journal: Option<JournalThread>,
    bus: Option<Bus>,
    peers: Peers,
    carriers: Carriers,
    #[cfg(feature = "dds")]
    domains: crate::bridge::dds::Domains,
    runtime: tokio::runtime::Handle,
    timer: watch::Sender<Option<Monotonic>>,
    paused: watch::Sender<bool>,
    /// What was said last on `paused`: each message on a callback asks.
    is_paused: bool,
    exited: watch::Sender<bool>,
    jobs: mpsc::UnboundedSender<Event>,
}

impl Core {
    /// A core and what the tasks around it follow.
    pub(super) fn build(
        node: Node,
        journal: Option<JournalThread>,
        runtime: tokio::runtime::Handle,
    ) -> (Shared, Ends) {
        let (timer, timer_end) = watch::channel(None);
        let (paused, paused_end) = watch::channel(false);
        let (exited, exited_end) = watch::channel(false);
        let (jobs, jobs_end) = mpsc::unbounded_channel();
        let peers = Peers::default();
        let (clock, effects) = (Clock::start(), Vec::new());
        let wake = Arc::new(Notify::new());
        let core = Self {
            node,
            deferred: VecDeque::new(),
            wake: wake.clone(),
            last_out: None,
            puts_left: (PUTS_ON_CALLBACK_MAX, Monotonic::START),
            clock,
            events: Vec::new(),
            effects,
            journal,
            bus: None,
            peers,
            carriers: Carriers::default(),
            #[cfg(feature = "dds")]
            domains: crate::bridge::dds::Domains::default(),
            runtime,
            timer,
            paused,
            is_paused: false,
            exited,
            jobs,
        };
        let wakes = wake.clone();
        let ends = Ends { timer: timer_end, paused: paused_end, exited: exited_end, jobs: jobs_end, wake };
        (Shared { core: Arc::new(Mutex::new(core)), waiting: Arc::default(), wake: wakes }, ends)
    }

    pub(crate) fn clock(&self) -> Clock {
        self.clock
    }

    pub(crate) fn peers(&mut self) -> &mut Peers {
        &mut self.peers
    }

    pub(crate) fn carriers(&mut self) -> &mut Carriers {
        &mut self.carriers
    }

    #[cfg(feature = "dds")]
    pub(crate) fn domains(&mut self) -> &mut crate::bridge::dds::Domains {
        &mut self.domains
    }

    /// Takes a session, or gives it up; the node is to be told by an event.
    pub(crate) fn set_bus(&mut self, bus: Option<Bus>) -> Option<Bus> {
        std::mem::replace(&mut self.bus, bus)
    }

    pub(crate) fn bus(&mut self) -> Option<&mut Bus> {
        self.bus.as_mut()
    }

    pub(crate) fn exited(&self) -> watch::Receiver<bool> {
        self.exited.subscribe()
    }

    pub(super) fn disarm(&mut self) {
        self.timer.send_replace(None);
    }

    /// Hands events to the node and carries out what it wants, until nothing is left to do. The events are taken; their
    /// memory stays with the caller.
    pub(crate) fn handle(&mut self, events: &mut Vec<Event>) {
        while let Some(effect) = self.deferred.pop_front() {
            self.carry_out_on_bus(effect, events);
        }
        #[cfg(feature = "dds")]
        self.domains.take_arrivals(events);
        self.work(events, On::Loop);
    }

    /// Hands a sample to the node on Zenoh's thread; gives it back while input is paused.
    pub(super) fn sample_on_callback(&mut self, envelope: Envelope) -> Option<Envelope> {
        if self.is_paused {
            return Some(envelope);
        }
        let now = self.clock.now();
        self.node.handle_sample(now, &envelope, &mut self.effects);
        if !self.effects.is_empty() {
            let mut events = std::mem::take(&mut self.events);
            self.carry_out_all(now.monotonic, On::Callback, &mut events);
            if !events.is_empty() {
                self.work(&mut events, On::Callback);
            }
            self.events = events;
        }
        None
    }

    /// Hands an event to the node on the thread of a domain; gives it back while input is paused.
    #[cfg(feature = "dds")]
    fn handle_on_callback(&mut self, event: Event) -> Option<Event> {
        if self.is_paused {
            return Some(event);
        }
        let mut events = std::mem::take(&mut self.events);
        events.push(event);
        self.work(&mut events, On::Callback);
        self.events = events;
        None
    }

    fn work(&mut self, events: &mut Vec<Event>, on: On) {
        loop {
            let now = self.clock.now();
            self.node.handle(now, events, &mut self.effects);
            if !self.effects.is_empty() || self.has_output() {
                self.carry_out_all(now.monotonic, on, events);
            }
            if events.is_empty() {
                return;
            }
        }
    }

    /// Carries out what the node wants; what comes of that is in the events.
    fn carry_out_all(&mut self, now: Monotonic, on: On, events: &mut Vec<Event>) {
        self.allow_puts(now);
        let mut effects = std::mem::take(&mut self.effects);
        for effect in effects.drain(..) {
            self.carry_out(now, effect, on, events);
        }
        self.effects = effects;
        if on == On::Callback && self.has_output() && !self.is_quiet(now) {
            self.wake.notify_one();
        } else if self.has_output() {
            self.last_out = Some(now);
            self.peers.flush(events);
            #[cfg(feature = "dds")]
            self.domains.flush();
        }
    }

    /// Whether anything is prepared that is not written yet.
    fn has_output(&self) -> bool {
        #[cfg(feature = "dds")]
        if self.domains.has_output() {
            return true;
        }
        self.peers.has_output()
    }

    fn carry_out(&mut self, now: Monotonic, effect: Effect, on: On, events: &mut Vec<Event>) {
        match effect {
            Effect::Send(bridge, peer, label, content) => self.peers.send(bridge, peer, &label, &content),
            Effect::Transmit(link, carrier, frame) => self.carriers.send(link, carrier, &frame),
            Effect::Found(link, carrier, place) => self.carriers.found(link, carrier, place),
            Effect::Arm(at) => {
                self.timer.send_replace(Some(at));
            }
            Effect::PauseInput(paused) => {
                self.is_paused = paused;
                self.paused.send_replace(paused);
            }
            Effect::Append(_, batch) => {
                if let Some(journal) = &mut self.journal {
                    journal.hand_over(batch);
                }
            }
            Effect::Say(note) => say(&note),
            #[cfg(feature = "dds")]
            Effect::Domain(source, command) => self.domains.carry_out(source, command, events),
            #[cfg(not(feature = "dds"))]
            Effect::Domain(..) => {}
            Effect::Job(source, number, job) => self.start_job(source, number, job),
            Effect::Exit => {
                self.exited.send_replace(true);
            }
            bus if on == On::Loop || self.may_put_here(&bus) => {
                self.puts_left.0 = self.puts_left.0.saturating_sub(1);
                self.last_out = Some(now);
                self.carry_out_on_bus(bus, events);
            }
            bus => {
                self.deferred.push_back(bus);
                self.wake.notify_one();
            }
        }
    }

    /// What has passed without puts allows for more.
    fn allow_puts(&mut self, now: Monotonic) {
        let (left, since) = self.puts_left;
        let more = (now - since).as_nanos() / QUIET.as_nanos();
        if more > 0 {
            let left = u128::from(left).saturating_add(more).min(PUTS_ON_CALLBACK_MAX.into()) as u32;
            self.puts_left = (left, now);
        }
    }

    fn is_quiet(&self, now: Monotonic) -> bool {
        self.last_out.is_none_or(|last| now - last > QUIET)
    }

    /// Whether a callback may do this on the bus itself: it never declares, and puts only while little goes out.
    fn may_put_here(&self, effect: &Effect) -> bool {
        let puts = matches!(effect, Effect::Publish(..) | Effect::PublishOn(..));
        puts && self.puts_left.0 > 0 && self.deferred.is_empty()
    }

    fn carry_out_on_bus(&mut self, effect: Effect, events: &mut Vec<Event>) {
        let Some(bus) = &mut self.bus else { return };
        if let Err(why) = carry_out_on_bus(bus, effect) {
            self.bus_failed(&why, events);
        }
    }

    fn bus_failed(&mut self, why: &BusError, events: &mut Vec<Event>) {
        // The session itself is given up by the task that keeps it: dropping it here could block.
        if self.bus.as_ref().is_some_and(Bus::is_closed) {
            events.push(Event::BusClosed(why.to_string()));
        } else {
            tracing::warn!("bus: {why}");
        }
    }

    fn start_job(&self, source: aldis_envelope::Source, number: u64, job: Job) {
        let jobs = self.jobs.clone();
        self.runtime.spawn_blocking(move || {
            let result = catch_unwind(AssertUnwindSafe(job)).map_err(|panic| {
                let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
                text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default()
            });
            // Nobody listens any more where the node has ended.
            let _ = jobs.send(Event::Job(source, number, result));
        });
    }
}

fn carry_out_on_bus(bus: &mut Bus, effect: Effect) -> Result<(), BusError> {
    match effect {
        Effect::Publish(publisher, envelope) => bus.publish(publisher, envelope),
        Effect::PublishOn(key, envelope) => bus.publish_on(key, *envelope),
        Effect::Subscribe(expressions) => bus.subscribe(expressions),
        Effect::Declare { publisher, key, constant, priority } => {
            bus.declare(publisher, key, constant, priority)
        }
        Effect::Token(source, shown) => bus.token(source, shown),
        _ => Ok(()),
    }
}

fn say(note: &Note) {
    match note.level {
        Level::Information => tracing::info!("{}", note.text),
        Level::Warning => tracing::warn!("{}", note.text),
        Level::Error => tracing::error!("{}", note.text),
    }
}
