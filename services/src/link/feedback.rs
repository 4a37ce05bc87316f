//! What became of what was sent: acknowledged, lost, or too late.

use super::frame::Item;
use super::names::name_of;
use super::outbox::{Entry, Left};
use super::ranges::Ranges;
use super::received::acknowledged;
use super::record::Kind;
use super::sent::{Carried, SentFrame};
use super::{Compare, Effect, GONE_AFTER, Link, Ticket, TicketState};
use aldis_envelope::{Monotonic, Now};
use std::time::Duration;

/// Acknowledgements tell their delay in units of this.
pub(super) const DELAY_UNIT: Duration = Duration::from_millis(8);

/// How many expired commands without word are remembered, so that late word is not lost.
const IN_DOUBT_MAX: usize = 1_024;

/// An expired command of which no word came back, with what was said of it.
#[derive(Debug)]
pub(super) struct InDoubt {
    ticket: Ticket,
    accepted: Monotonic,
    tries: u32,
    /// Of its bytes, those that arrived.
    acknowledged: Ranges,
    length: u64,
}

/// The part of a round trip after which the last samples of a re-synchronisation go again.
const AGAIN_AFTER: u32 = 2;

impl Link {
    pub(super) fn on_ack(&mut self, now: Now, index: usize, item: &Item<'_>, effects: &mut Vec<Effect>) {
        let Item::Ack { delay, .. } = item else { return };
        if !self.session.echoed {
            return;
        }
        let path = &mut self.paths[index];
        let numbers = acknowledged(item, path.sent.next);
        let outcome = path.sent.acknowledge(&numbers);
        if let Some(newest) = outcome.newest {
            path.measure(now.monotonic, newest, DELAY_UNIT * u32::from(*delay));
        }
        for frame in outcome.arrived {
            for carried in frame.carried {
                self.on_arrived(now.monotonic, carried, effects);
            }
        }
        for frame in outcome.lost {
            self.on_lost(now.monotonic, frame, true);
        }
    }

    fn on_arrived(&mut self, now: Monotonic, carried: Carried, effects: &mut Vec<Effect>) {
        match carried {
            Carried::Command { number, start, end } => {
                if let Some(doubt) = self.in_doubt.get_mut(&number) {
                    doubt.acknowledged.insert_range(start.into(), end.into());
                    if doubt.acknowledged.covers(0, doubt.length) {
                        let InDoubt { ticket, accepted, tries, .. } = *doubt;
                        self.in_doubt.remove(&number);
                        self.tell(ticket, TicketState::Delivered { after: now - accepted, tries }, effects);
                    }
                }
                if let Some(left) = self.outbox.arrived(number, start, end) {
                    self.on_through(now, left, effects);
                }
            }
            Carried::Void { start, end } => {
                self.outbox.voids.remove_range(start, end);
                self.voids_on_air.remove_range(start, end);
            }
            Carried::State { alias, origin, sequence } => self.states.arrived(alias, origin, sequence),
            Carried::Piece { transfer, start, end } => {
                self.on_transfer_arrived(now, transfer, start, end, effects);
            }
            Carried::Start { transfer } => {
                if let Some(transfer) = self.bulk_out.transfers.get_mut(&transfer) {
                    transfer.started = true;
                }
            }
            Carried::Digest if self.compare == Compare::OnAir => self.compare = Compare::Settled,
            Carried::Hello => self.session.confirmed = true,
            Carried::Digest | Carried::Differ | Carried::Have { .. } => {}
        }
    }

    /// The peer has a command.
    fn on_through(&mut self, now: Monotonic, left: Left, effects: &mut Vec<Effect>) {
        self.records.push(self.keys.forget(Kind::Outgoing, left.number));
        let after = now - left.entry.accepted;
        if left.entry.stream == 0 {
            if let Some(name) = left.entry.body.get(1..).and_then(name_of) {
                self.names.set_sure(name, true);
                self.name_states();
            }
            return;
        }
        self.counters.commands_delivered += 1;
        self.tell(left.entry.ticket, TicketState::Delivered { after, tries: left.tries }, effects);
    }

    /// Lets those states go whose names the peer has now.
    fn name_states(&mut self) {
        let names = &self.names;
        self.states.name(|number, sample| {
            use super::names::Table;
            let label = names.instances.get(&number).map_or(0, |entry| entry.label);
            let needed = [(Table::Label, label), (Table::Instance, number), (Table::Origin, sample.origin)];
            needed.into_iter().all(|name| names.is_sure(name))
        });
    }

    pub(super) fn on_transfer_arrived(
        &mut self,
        now: Monotonic,
        transfer: u32,
        start: u32,
        end: u32,
        effects: &mut Vec<Effect>,
    ) {
        if let Some(done) = self.bulk_out.arrived(transfer, start, end) {
            let state = TicketState::Delivered { after: now - done.since, tries: done.pieces };
            self.tell(done.ticket, state, effects);
        }
    }

    /// A frame is lost. `overtaken` says that a later one arrived.
    fn on_lost(&mut self, now: Monotonic, frame: SentFrame, overtaken: bool) {
        for carried in frame.carried {
            match carried {
                Carried::Command { number, .. } if overtaken => self.outbox.hasten(number, now, frame.at),
                Carried::Command { .. } | Carried::Start { .. } | Carried::Hello => {}
                Carried::Void { start, end } => self.voids_on_air.remove_range(start, end),
                Carried::State { alias, origin, sequence } => self.states.lost(alias, origin, sequence),
                Carried::Piece { transfer, start, end } => self.bulk_out.lost(transfer, start, end),
                Carried::Digest if self.compare == Compare::OnAir => self.compare = Compare::Wanted,
                Carried::Digest => {}
                Carried::Differ => self.session.differ_due = true,
                // The peer sends what it believes to be missing; without word that is more than needed.
                Carried::Have { .. } => {}
            }
        }
    }

    /// What time alone brings: ends of lifespans, time-outs, silence.
    pub(super) fn pass_time(&mut self, now: Now, effects: &mut Vec<Effect>) {
        while let Some(left) = self.outbox.expire(now.monotonic) {
            self.counters.commands_expired += 1;
            self.records.push(self.keys.forget(Kind::Outgoing, left.number));
            let Left { number, entry, tries, acknowledged } = left;
            if tries > 0 && entry.ticket != Ticket::default() {
                let Entry { ticket, accepted, body, .. } = &entry;
                let (ticket, accepted, length) = (*ticket, *accepted, body.len() as u64);
                self.in_doubt.insert(number, InDoubt { ticket, accepted, tries, acknowledged, length });
                while self.in_doubt.len() > IN_DOUBT_MAX {
                    self.in_doubt.pop_first();
                }
            }
            self.tell(entry.ticket, TicketState::Expired { tries }, effects);
        }
        self.states.tick(now.monotonic);
        let idle = !self.is_due(now.monotonic);
        for index in 0..self.paths.len() {
            let mut sent = std::mem::take(&mut self.paths[index].sent);
            let lost = sent.overdue(now.monotonic, |bytes| self.paths[index].overdue_after(idle, bytes));
            self.paths[index].sent = sent;
            for frame in lost {
                self.on_lost(now.monotonic, frame, false);
            }
        }
        self.send_states_again(now.monotonic);
        self.notice_silence(now.monotonic, effects);
    }

    /// The tail of a re-synchronisation: while nothing else is to go out, the last samples go a second time before their loss can be
    /// known, because a round trip is longer than a frame.
    fn send_states_again(&mut self, now: Monotonic) {
        if self.states_again_at(now).is_some_and(|at| at <= now) {
            self.states.again(now);
        }
    }

    /// When that is to be done next.
    pub(super) fn states_again_at(&self, now: Monotonic) -> Option<Monotonic> {
        if self.compare != Compare::Wanted || self.is_due(now) {
            return None;
        }
        let path = &self.paths[self.active(now)?];
        let lonely = self.states.lonely_since()?;
        let soon = path.is_heard(now) && path.loss_out >= 0.05;
        soon.then_some((lonely + path.round_trip() / AGAIN_AFTER).max(path.next_send))
    }

    fn notice_silence(&mut self, now: Monotonic, effects: &mut Vec<Effect>) {
        let last = self.paths.iter().filter_map(|path| path.last_heard).max();
        let heard = last.is_some_and(|last| now - last < GONE_AFTER);
        if heard == self.heard {
            return;
        }
        self.heard = heard;
        effects.push(Effect::Peer(heard));
        if heard && !self.outbox_is_fresh() {
            // What waited through the silence goes at once, and what the peer holds is compared when that is through.
            self.outbox.hurry(now);
        }
        if heard && self.compare == Compare::Settled {
            self.compare = Compare::Wanted;
        }
    }

    fn outbox_is_fresh(&self) -> bool {
        self.outbox.len() == 0
    }

    /// When a silence becomes too long.
    pub(super) fn silence_deadline(&self) -> Option<Monotonic> {
        let last = self.paths.iter().filter_map(|path| path.last_heard).max()?;
        self.heard.then(|| last + GONE_AFTER)
    }
}
