//! What a turn of the node ends with, and the turn of one sample, which mostly has nothing to end with.

use super::Node;
use crate::bridge::Bridge;
use crate::event::{Effect, Event};
use crate::host::Hosted;
use aldis_envelope::{Envelope, Now};

impl Node {
    /// Handles one sample from the bus, as [`Event::Sample`] would be: what comes on the hottest path is not moved once more.
    pub fn handle_sample(&mut self, now: Now, envelope: &Envelope, effects: &mut Vec<Effect>) {
        if self.started.is_none() || self.journaling.is_opening() {
            return self.handle(now, &mut vec![Event::Sample(envelope.clone())], effects);
        }
        self.sample(now, envelope, effects);
        self.end_event(now, effects);
        self.end_turn(now, effects);
    }

    /// Does what came of an event.
    pub(super) fn end_event(&mut self, now: Now, effects: &mut Vec<Effect>) {
        if !self.stirred {
            return;
        }
        self.settle(now, effects);
        if self.keeping.has_much() {
            // What came of this event is written as one, and not with what more comes in this turn.
            self.run_links(now, effects);
            self.keeping.close();
        }
    }

    /// Does what waits for the end of a turn.
    pub(super) fn end_turn(&mut self, now: Now, effects: &mut Vec<Effect>) {
        if !self.stirred {
            return;
        }
        self.run_links(now, effects);
        self.finish_sharing(now, effects);
        self.run_links(now, effects);
        self.append(effects);
        self.update_pause(effects);
        self.arm(effects);
        self.stirred = false;
    }

    /// Stops reading while a peer that is not given up has too much waiting.
    fn update_pause(&mut self, effects: &mut Vec<Effect>) {
        let held_up = self.services.iter().any(Hosted::is_congested);
        let congested =
            held_up || self.bridges.iter().any(Bridge::is_congested) || self.journaling.is_opening();
        if congested != self.input_is_paused {
            self.input_is_paused = congested;
            effects.push(Effect::PauseInput(congested));
        }
    }

    fn arm(&mut self, effects: &mut Vec<Effect>) {
        let services = self.services.iter().filter_map(Hosted::next_deadline);
        let bridges = self.bridges.iter().filter_map(Bridge::next_deadline);
        let shared = self.sharing.next_deadline();
        let others = [self.calls.next_deadline(), shared, self.links.next_deadline()];
        let next = services.chain(bridges).chain(others.into_iter().flatten()).min();
        let next = if self.ending { self.journaling.end_by() } else { next };
        if let Some(at) = next
            && self.armed != next
        {
            self.armed = next;
            effects.push(Effect::Arm(at));
        }
    }
}
