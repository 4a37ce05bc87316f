//! What goes wrong in a world, and how it comes right again.

use super::super::disk::DiskFaults;
use super::bus::BusFaults;
use super::{Arrival, NodeHandle, Seen, World};
use crate::event::Event;
use std::time::Duration;

impl World {
    /// The link of a machine to the bus fails: what is on its way is lost, and what it sends goes nowhere, until the loss is
    /// noticed after `notice`. Then it is without a session until [`World::open_bus`].
    pub fn drop_session(&mut self, of: NodeHandle, notice: Duration) {
        self.note(of, "loses its session, unnoticed");
        self.cut_off(of.0);
        self.put(self.now + notice, of.0, Arrival::SessionLost);
    }

    /// Divides the bus: machines hear only those with the same number. Samples on their way across are lost; the tokens of the
    /// others are gone after `notice`. All the same number heals it, and they are back after `notice`.
    pub fn partition(&mut self, sides: &[u32], notice: Duration) {
        for (machine, side) in self.machines.iter_mut().zip(sides) {
            machine.side = *side;
        }
        let first = NodeHandle(0);
        self.note(first, &format!("and all others: the bus is divided as {sides:?}"));
        let machines = &self.machines;
        self.arrivals.retain(|_, (to, arrival)| match arrival {
            Arrival::Sample { from, .. } => machines[*from].side == machines[*to].side,
            _ => true,
        });
        self.put(self.now + notice, 0, Arrival::Tokens);
    }

    /// A node ends without a word. With `power_loss` its disk loses of what was not synced whatever it likes.
    pub fn crash(&mut self, node: NodeHandle, power_loss: bool, notice: Duration) {
        self.note(node, if power_loss { "loses its power" } else { "is killed" });
        self.end(node.0);
        self.cut_off(node.0);
        self.arrivals.retain(|_, (to, arrival)| *to != node.0 || matches!(arrival, Arrival::Tokens));
        self.machines[node.0].forget();
        self.routes.clear();
        self.crash_disk(node.0, power_loss);
        self.put(self.now + notice, node.0, Arrival::Tokens);
    }

    /// Starts the node of a machine again: at once, or where it has a journal when that is read back.
    pub fn restart(&mut self, node: NodeHandle) {
        let machine = &mut self.machines[node.0];
        if machine.is_on {
            return;
        }
        machine.is_on = true;
        if !self.open_journal(node.0) {
            self.start_again(node.0, None);
        }
    }

    /// A machine stalls: it handles nothing until [`World::resume`].
    pub fn stall(&mut self, node: NodeHandle) {
        self.note(node, "stalls");
        self.machines[node.0].stalled.get_or_insert_default();
    }

    /// A machine goes on and handles what has come meanwhile.
    pub fn resume(&mut self, node: NodeHandle) {
        for event in self.machines[node.0].stalled.take().unwrap_or_default() {
            self.deliver(node.0, event);
        }
    }

    /// Sets a machine's wall clock: how far it is wrong, in nanoseconds.
    pub fn set_clock(&mut self, node: NodeHandle, offset_ns: i64) {
        self.note(node, &format!("its wall clock is wrong by {offset_ns} ns"));
        self.machines[node.0].clocks.offset_ns = offset_ns;
    }

    /// Sets how much faster a machine's clocks go than they should, in parts per million. Only before its node starts, or
    /// its monotonic clock would step.
    pub(in super::super) fn set_drift(&mut self, node: NodeHandle, drift_ppm: i64) {
        self.machines[node.0].clocks.drift_ppm = drift_ppm;
    }

    /// Sets the shares of samples that the bus drops, lets others overtake and delivers twice.
    pub fn set_bus_faults(&mut self, loss: f64, reordering: f64, duplication: f64) {
        self.bus_faults = BusFaults { loss, reordering, duplication };
    }

    /// Ends all faults: every machine is on and connected, its disk is good. Clocks stay as wrong as they are.
    pub fn heal(&mut self) {
        self.bus_faults = BusFaults::default();
        let sides = vec![0; self.machines.len()];
        self.partition(&sides, Duration::ZERO);
        for place in 0..self.machines.len() {
            let node = NodeHandle(place);
            self.set_disk(node, DiskFaults::default(), None);
            self.resume(node);
            self.restart(node);
            if !self.machines[place].is_connected {
                self.session_is_lost(place);
                self.open_bus(node);
            }
        }
        self.observe(0, Seen::Healed);
    }

    /// A life ends: the checkers see its counters.
    pub(super) fn end(&mut self, place: usize) {
        if let Some(node) = self.machines[place].node.take() {
            self.observe(place, Seen::Ended(node.counters()));
        }
    }

    fn note(&mut self, node: NodeHandle, text: &str) {
        self.trace.text(self.now, node, text.to_owned());
    }

    /// Whether the loss of a session is still to be noticed.
    pub(in super::super) fn is_deaf(&self, node: NodeHandle) -> bool {
        !self.machines[node.0].is_connected
    }

    /// Shuts a node down in order.
    pub fn shut_down(&mut self, node: NodeHandle) {
        self.give(node, Event::Shutdown);
    }
}
