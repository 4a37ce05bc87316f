//! The node with everything that carries out its effects. Whoever has events locks it and hands them in; the effects
//! are carried out on the spot, so that a message passes without a change of thread or task.

use super::Ends;
use crate::bridge::uxas_tcp::Peers;
use crate::bus::{Bus, BusError};
use crate::clock::Clock;
use aldis_envelope::{Dialect, Monotonic};
use aldis_services::service::{Job, Level, Note};
use aldis_services::{Effect, Event, Node};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::{mpsc, watch};

/// A core that the tasks of a node share.
#[derive(Clone)]
pub(crate) struct Shared(Arc<Mutex<Core>>);

impl Shared {
    pub(crate) fn lock(&self) -> MutexGuard<'_, Core> {
        // Services' panics are caught inside the node; a panic here is a fault of the shell, and the node is whole.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The node and its hands.
pub(crate) struct Core {
    node: Node,
    clock: Clock,
    effects: Vec<Effect>,
    bus: Option<Bus>,
    peers: Peers,
    runtime: tokio::runtime::Handle,
    timer: watch::Sender<Option<Monotonic>>,
    paused: watch::Sender<bool>,
    exited: watch::Sender<bool>,
    jobs: mpsc::UnboundedSender<Event>,
}

impl Core {
    pub(super) fn new(node: Node, dialects: Vec<Dialect>, runtime: tokio::runtime::Handle) -> (Shared, Ends) {
        let (timer, timer_end) = watch::channel(None);
        let (paused, paused_end) = watch::channel(false);
        let (exited, exited_end) = watch::channel(false);
        let (jobs, jobs_end) = mpsc::unbounded_channel();
        let peers = Peers::new(dialects);
        let (clock, effects) = (Clock::start(), Vec::new());
        let core = Self { node, clock, effects, bus: None, peers, runtime, timer, paused, exited, jobs };
        let ends = Ends { timer: timer_end, paused: paused_end, exited: exited_end, jobs: jobs_end };
        (Shared(Arc::new(Mutex::new(core))), ends)
    }

    pub(crate) fn clock(&self) -> Clock {
        self.clock
    }

    pub(crate) fn peers(&mut self) -> &mut Peers {
        &mut self.peers
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
        loop {
            let now = self.clock.now();
            let mut effects = std::mem::take(&mut self.effects);
            self.node.handle(now, events, &mut effects);
            for effect in effects.drain(..) {
                if let Err(why) = self.carry_out(effect) {
                    self.bus_failed(&why, events);
                }
            }
            self.effects = effects;
            self.peers.flush(events);
            if events.is_empty() {
                return;
            }
        }
    }

    fn carry_out(&mut self, effect: Effect) -> Result<(), BusError> {
        match effect {
            Effect::Send(bridge, peer, label, content) => self.peers.send(bridge, peer, &label, &content),
            Effect::Arm(at) => {
                self.timer.send_replace(Some(at));
            }
            Effect::PauseInput(paused) => {
                self.paused.send_replace(paused);
            }
            Effect::Say(note) => say(&note),
            Effect::Job(source, number, job) => self.start_job(source, number, job),
            Effect::Exit => {
                self.exited.send_replace(true);
            }
            bus => {
                if let Some(on) = &mut self.bus {
                    return carry_out_on_bus(on, bus);
                }
            }
        }
        Ok(())
    }

    fn bus_failed(&mut self, why: &BusError, events: &mut Vec<Event>) {
        let gone = self.bus.as_ref().is_some_and(Bus::is_closed);
        if gone {
            self.bus = None;
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
        Effect::PublishOn(key, envelope) => bus.publish_on(key, envelope),
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
