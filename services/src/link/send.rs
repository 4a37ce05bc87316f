//! Frames that go out: each is chosen when its carrier is free, and not before.

mod fill;

use super::frame::{Head, session_byte};
use super::outbox::Hedge;
use super::seal::{FrameId, LinkKey, TAG_BYTES, seal};
use super::sent::{Carried, SentFrame};
use super::{Compare, Effect, Link, TicketState};
use aldis_envelope::{Monotonic, Now};
use fill::Load;
use std::time::Duration;

/// While nobody is heard and something waits, a frame goes out so often, at least twice a second.
const PROBE_EVERY: Duration = Duration::from_millis(100);

/// Of the frames that look for the peer, every so many says hello, in case the peer does not know this place.
const HELLO_EVERY: u32 = 10;

/// How soon something is tried again that could not go.
const STUCK: Duration = Duration::from_millis(20);

/// Why a frame goes out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Reasons {
    /// Commands, states and all else may go in.
    data: bool,
    /// Nobody is heard.
    probing: bool,
    /// Something must go out even if there is no data.
    must: bool,
    /// The peer is asked to answer.
    ask: bool,
}

impl Link {
    /// Sends on every carrier that is free what is due there.
    pub(super) fn transmit(&mut self, now: Now, effects: &mut Vec<Effect>) {
        for index in 0..self.paths.len() {
            while !self.silent && self.paths[index].is_open(now.monotonic) {
                let Some(frame) = self.build(now, index) else { break };
                let path = &mut self.paths[index];
                path.pay(now.monotonic, frame.len());
                self.counters.frames_sent += 1;
                self.counters.bytes_sent += frame.len() as u64;
                effects.push(Effect::Transmit(path.config.id, frame));
                let gone_out = self.gone_out.drain(..);
                effects.extend(
                    gone_out.map(|(ticket, tries)| Effect::Ticket(ticket, TicketState::OnAir { tries })),
                );
            }
        }
    }

    /// The carrier that data goes by: the first that is heard; while none is, they take turns.
    pub(super) fn active(&self, now: Monotonic) -> Option<usize> {
        let heard = self.paths.iter().position(|path| path.is_heard(now));
        heard.or_else(|| {
            let up: Vec<_> = (0..self.paths.len()).filter(|&index| self.paths[index].up).collect();
            up.get(self.probes as usize % up.len().max(1)).copied()
        })
    }

    /// Whether anything but keeping alive is to be done.
    fn has_work(&self) -> bool {
        self.outbox.len() > 0
            || self.states.is_due()
            || self.bulk_out.bytes() > 0
            || !self.states.is_settled()
    }

    fn reasons(&self, now: Monotonic, index: usize) -> Option<Reasons> {
        let path = &self.paths[index];
        let active = self.active(now) == Some(index);
        let probing = !path.is_heard(now);
        let probe = probing && active && self.has_work() && self.next_probe <= now;
        let data = active && (if probing { probe && self.outbox.is_due(now) } else { self.is_due(now) });
        let ask = probe && !data;
        let hello = self.session.hello_due || self.session.hello_again().is_some_and(|at| at <= now);
        let acks = path.acks.copies > 0 && path.acks.due.is_some_and(|due| due <= now);
        let alive = path.keep_alive_at() <= now;
        let must = hello || acks || alive || ask;
        (must || data).then_some(Reasons { data, probing, must, ask })
    }

    /// Whether data is to go out on a carrier that is heard.
    pub(super) fn is_due(&self, now: Monotonic) -> bool {
        self.outbox.is_due(now)
            || self.states.is_due()
            || self.next_void().is_some()
            || self.session.differ_due
            || !self.have.is_empty()
            || self.bulk_out.next(1).is_some()
            || (self.compare == Compare::Wanted && self.states.is_settled())
    }

    /// Commands that the peer is to be told not to expect, and was not told yet.
    fn next_void(&self) -> Option<(u64, u64)> {
        let fresh = self.outbox.voids.iter().find(|(start, end)| !self.voids_on_air.covers(*start, *end));
        fresh.map(|(start, end)| (self.voids_on_air.first_missing(start), end))
    }

    fn hedge(&self, index: usize, probing: bool) -> Hedge {
        let path = &self.paths[index];
        Hedge {
            loss: path.loss_out,
            timeout: path.timeout(0),
            round_trip: path.round_trip(),
            bytes_of_a_second: path.config.rate as usize,
            probing,
        }
    }

    /// The key for frames that go out: the newest that the peer has too.
    fn key_out(&self) -> Option<&LinkKey> {
        let keys = &self.config.keys;
        let shared = keys.iter().filter(|key| key.number <= self.session.peer_key);
        let oldest = || keys.iter().min_by_key(|key| key.number);
        shared.max_by_key(|key| key.number).or_else(oldest)
    }

    /// Builds the next frame for a carrier, if one is due.
    fn build(&mut self, now: Now, index: usize) -> Option<Vec<u8>> {
        let reasons = self.reasons(now.monotonic, index)?;
        let number = self.paths[index].sent.next;
        let looks = reasons.probing && reasons.ask && self.probes.is_multiple_of(HELLO_EVERY);
        let says_hello = self.session.asks() || self.session.hello_due || looks;
        let hello = says_hello.then(|| self.hello(number));
        let mut clear = Vec::with_capacity(self.paths[index].config.mtu);
        let key = self.key_out().cloned();
        let mut head = Head {
            hello: says_hello,
            key: key.as_ref().is_some_and(|key| key.number & 1 == 1),
            eliciting: reasons.ask,
            asks: self.session.asks(),
            session: session_byte(self.boot.0),
            number: number as u16,
        };
        head.write(&mut clear);
        if let Some(hello) = &hello {
            hello.write(&mut clear);
        }
        let tag = if key.is_some() { TAG_BYTES } else { 0 };
        let room = self.paths[index].config.mtu.checked_sub(clear.len() + tag)?;
        // With keys, a peer whose life is not known can take no more than a hello.
        let stranger = key.is_some() && (self.session.peer.is_none() || self.session.remembered);
        let mut load = Load::new(room);
        if !stranger {
            self.fill(now, index, reasons.data, reasons.probing, &mut load);
        }
        let empty = load.is_empty();
        if empty && !reasons.must {
            return None;
        }
        if self.session.asks() {
            load.carried.push(Carried::Hello);
        }
        head.eliciting = reasons.ask || !load.carried.is_empty();
        if head.eliciting {
            clear[0] |= 4;
        }
        self.note_sent(now.monotonic, &reasons, says_hello, clear.len() + load.used());
        let clear_length = clear.len();
        let mut frame = clear;
        self.write_load(now.monotonic, &load, &mut frame);
        if let Some(key) = &key {
            let boot = self.boot.0;
            let carrier = self.paths[index].config.id.0;
            let id = FrameId { sender: self.config.own, boot, carrier, number };
            let peer_boot = self.session.peer.map_or(0, |peer| peer.boot);
            let context = hello.map_or(peer_boot, |hello| hello.known_boot);
            seal(key, id, context, clear_length, &mut frame);
        }
        let (at, bytes, eliciting) = (now.monotonic, frame.len(), head.eliciting);
        self.paths[index].sent.add(SentFrame { at, bytes, eliciting, carried: load.carried });
        Some(frame)
    }

    fn note_sent(&mut self, now: Monotonic, reasons: &Reasons, says_hello: bool, bytes: usize) {
        if says_hello {
            (self.session.hello_due, self.session.hello_at) = (false, now);
        }
        if reasons.probing && (reasons.ask || reasons.data) {
            self.probes = self.probes.wrapping_add(1);
            let path = self.active(now).map(|index| self.paths[index].airtime(bytes)).unwrap_or_default();
            let pause = if reasons.ask { (path * 20).max(PROBE_EVERY) } else { (path * 5).max(PROBE_EVERY) };
            self.next_probe = now + pause;
        }
    }

    /// Asks for the next moment at which something is to be done.
    pub(super) fn arm(&mut self, now: Monotonic, effects: &mut Vec<Effect>) {
        if !self.ready {
            return;
        }
        let mut next: Option<Monotonic> = None;
        let mut at = |moment: Option<Monotonic>| next = next.into_iter().chain(moment).min();
        at(self.outbox.next_expiry());
        at(self.states.deadline());
        at(self.unwritten.due());
        at(self.silence_deadline());
        let idle = !self.is_due(now);
        for index in 0..self.paths.len() {
            let path = &self.paths[index];
            at(path.sent.oldest().map(|(at, bytes)| at + path.overdue_after(idle, bytes)));
            at(path.heard_until().filter(|until| *until > now));
            if path.up && path.free && !self.silent {
                let wish = self.next_wish(now, index).max(path.next_send);
                // What is due and could not go into a frame now is tried again soon.
                at(Some(if wish > now { wish } else { now + STUCK }));
            }
        }
        let next = next.map(|next| next.max(now));
        if let Some(next) = next.filter(|next| self.armed != Some(*next)) {
            self.armed = Some(next);
            effects.push(Effect::Arm(next));
        }
    }

    /// When something is to go out on a carrier.
    fn next_wish(&self, now: Monotonic, index: usize) -> Monotonic {
        let path = &self.paths[index];
        let mut wish = path.keep_alive_at();
        let mut at = |moment: Option<Monotonic>| wish = moment.map_or(wish, |moment| moment.min(wish));
        at(path.acks.due.filter(|_| path.acks.copies > 0));
        at(self.session.hello_due.then_some(now));
        at(self.session.hello_again());
        if self.active(now) == Some(index) {
            if path.is_heard(now) {
                at(self.states_again_at(now));
                at(self.is_due(now).then_some(now));
                at(self.outbox.next_due(now));
            } else {
                at(self.has_work().then_some(self.next_probe));
            }
        }
        wish
    }
}
