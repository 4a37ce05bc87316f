//! The bus of a world: samples, tokens, sessions.

use super::super::network::meets;
use super::{Arrival, NodeHandle, Seen, World};
use crate::event::{Effect, Event};
use aldis_envelope::codec::native::{encode, encode_variable};
use aldis_envelope::{Change, Envelope, Source};
use std::collections::BTreeSet;

/// How many keys are remembered with those who subscribe to them.
const ROUTES_MAX: usize = 65_536;

/// What the bus does wrong, as shares of samples from 0 to 1.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct BusFaults {
    pub(super) loss: f64,
    pub(super) reordering: f64,
    pub(super) duplication: f64,
}

impl World {
    /// Opens the session of a node: it hears the tokens that are there.
    pub fn open_bus(&mut self, of: NodeHandle) {
        let machine = &mut self.machines[of.0];
        if machine.node.is_none() {
            return;
        }
        (machine.is_connected, machine.is_open) = (true, true);
        machine.seen.clear();
        self.deliver(of.0, Event::BusOpened);
        self.tell_tokens();
        self.arrive(of.0, of.0, Arrival::Event(Event::AliveKnown));
    }

    /// Closes the session of a node, and all notice it at once: it is silent and deaf until it opens again.
    pub fn close_bus(&mut self, of: NodeHandle) {
        self.cut_off(of.0);
        self.session_is_lost(of.0);
    }

    /// From now on nothing passes to or from a machine, and what is on its way is lost.
    pub(super) fn cut_off(&mut self, place: usize) {
        self.machines[place].is_connected = false;
        self.arrivals.retain(|_, (to, arrival)| match arrival {
            Arrival::Sample { from, .. } => *from != place && *to != place,
            Arrival::Event(Event::Alive(..) | Event::AliveKnown) => *to != place,
            _ => true,
        });
    }

    /// The session of a machine that was cut off is lost, and it and the others know.
    pub(super) fn session_is_lost(&mut self, place: usize) {
        let machine = &mut self.machines[place];
        if machine.is_connected {
            return;
        }
        machine.tokens.clear();
        machine.seen.clear();
        if std::mem::take(&mut machine.is_open) {
            self.deliver(place, Event::BusClosed("the simulator closed it".into()));
        }
        self.tell_tokens();
    }

    pub(super) fn carry_out_on_bus(&mut self, place: usize, effect: Effect) {
        let machine = &mut self.machines[place];
        match effect {
            Effect::Subscribe(expressions) => {
                machine.subscriptions = expressions;
                self.routes.clear();
            }
            Effect::Declare { publisher, key, constant, .. } => {
                machine.publishers.insert(publisher, (key, constant));
            }
            Effect::Publish(publisher, envelope) => {
                let (key, mut header) = machine.publishers[&publisher].clone();
                encode_variable(&envelope.message, &envelope.stamp, &mut header);
                self.publish(place, &key, &header, &envelope);
            }
            Effect::PublishOn(key, envelope) => {
                let mut header = Vec::new();
                encode(&envelope, &mut header);
                self.publish(place, &key, &header, &envelope);
            }
            Effect::Token(source, shown) => {
                if shown {
                    machine.tokens.insert(source);
                } else {
                    machine.tokens.remove(&source);
                }
                self.tell_tokens();
            }
            _ => {}
        }
    }

    fn publish(&mut self, from: usize, key: &str, header: &[u8], envelope: &Envelope) {
        self.observe(from, Seen::Published(envelope));
        let deleted = envelope.message.change == Change::Dispose;
        for to in self.subscribers(key) {
            if to == from || !self.machines[to].hears(&self.machines[from]) {
                continue;
            }
            let faults = self.bus_faults;
            if self.happens(faults.loss) {
                continue;
            }
            let times = 1 + usize::from(self.happens(faults.duplication));
            for _ in 0..times {
                let (key, header) = (key.to_owned(), header.to_vec());
                let content = envelope.message.content.clone();
                let sample = Arrival::Sample { from, key, deleted, header, content };
                if self.happens(faults.reordering) {
                    // It keeps no order with what goes the same way.
                    let at = self.now + self.draw(self.delay) * 3;
                    self.put(at, to, sample);
                } else {
                    self.arrive(from, to, sample);
                }
            }
        }
    }

    /// Whether something happens that has this chance. What never happens draws nothing.
    fn happens(&mut self, chance: f64) -> bool {
        chance > 0.0 && self.random.f64() < chance
    }

    /// The machines that subscribe to a key.
    fn subscribers(&mut self, key: &str) -> Vec<usize> {
        if let Some(known) = self.routes.get(key) {
            return known.clone();
        }
        let subscribes = |to: &usize| {
            let mut expressions = self.machines[*to].subscriptions.iter();
            expressions.any(|expression| meets(expression, key))
        };
        let found: Vec<_> = (0..self.machines.len()).filter(subscribes).collect();
        if self.routes.len() >= ROUTES_MAX {
            self.routes.clear();
        }
        self.routes.insert(key.to_owned(), found.clone());
        found
    }

    /// Tells every node which tokens have come and gone since it was told last. They come in one order to each.
    pub(super) fn tell_tokens(&mut self) {
        for to in 0..self.machines.len() {
            let machine = &self.machines[to];
            if !machine.is_connected || machine.node.is_none() {
                continue;
            }
            let heard =
                self.machines.iter().enumerate().filter(|(from, other)| *from != to && other.hears(machine));
            let there: BTreeSet<Source> = heard.flat_map(|(_, other)| other.tokens.iter().copied()).collect();
            let gone = machine.seen.difference(&there).map(|&source| (source, false));
            let come = there.difference(&machine.seen).map(|&source| (source, true));
            let changes: Vec<_> = gone.chain(come).collect();
            self.machines[to].seen = there;
            for (source, alive) in changes {
                self.arrive(to, to, Arrival::Event(Event::Alive(source, alive)));
            }
        }
    }
}
