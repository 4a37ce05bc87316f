//! Which lives of the two ends speak to each other.

use super::frame::{Head, Hello};
use super::journal::AfterWrite;
use super::record::Kind;
use super::wire::{Reader, put_varint};
use super::{Compare, Effect, Link};
use aldis_envelope::{EntityId, Monotonic, Now};
use std::time::Duration;

/// How many journals that the peer once had are remembered, so that a late frame does not bring one back.
const RETIRED_MAX: usize = 8;

/// How often a hello is repeated until it is answered.
const HELLO_AGAIN: Duration = Duration::from_millis(500);

/// A life of the peer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Life {
    pub(super) boot: u64,
    /// When its journal was born.
    pub(super) origin: u64,
}

/// What both ends know of each other's lives.
#[derive(Debug, Default)]
pub(super) struct Session {
    pub(super) peer: Option<Life>,
    /// The peer's life comes from the journal: nothing was heard of it in this one.
    pub(super) remembered: bool,
    /// The peer knows the life of this end.
    pub(super) confirmed: bool,
    /// The peer has named the life of this end at least once: what it acknowledges is meant for this life.
    pub(super) echoed: bool,
    /// A hello is to go out.
    pub(super) hello_due: bool,
    pub(super) hello_at: Monotonic,
    retired: Vec<u64>,
    /// The peer is to be told what of its digest differs.
    pub(super) differ_due: bool,
    /// That frames are of another version was said.
    pub(super) told_version: bool,
    /// The newest key that the peer has.
    pub(super) peer_key: u32,
}

impl Session {
    /// Whether the peer is to say hello: it is not known to know this life.
    pub(super) fn asks(&self) -> bool {
        !self.confirmed || !self.echoed
    }

    /// When an unanswered hello goes out again.
    pub(super) fn hello_again(&self) -> Option<Monotonic> {
        self.asks().then(|| self.hello_at + HELLO_AGAIN)
    }
}

/// The sender and the receiver that a frame names, where it names them: for a shell that sees a frame from a place it does not know.
/// Nothing is checked.
pub fn sender_of(frame: &[u8]) -> Option<(EntityId, EntityId)> {
    let mut reader = Reader::new(frame, "a frame");
    let head = Head::read(&mut reader).ok().filter(|head| head.hello && frame[0] >> 5 == super::VERSION)?;
    let hello = Hello::read(&mut reader).ok().filter(|hello| hello.number as u16 == head.number)?;
    Some((EntityId::new(hello.sender).ok()?, EntityId::new(hello.receiver).ok()?))
}

/// What to do with a frame that says hello.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Greeting {
    /// Of a life that is over.
    Stale,
    /// Of the present life of the peer, to the present life of this end or to one unknown.
    Known,
    /// The peer does not know yet that this end has a new life: what else it says is not meant for it.
    OldEar,
}

impl Link {
    pub(super) fn hello(&self, number: u64) -> Hello {
        let peer = self.session.peer;
        Hello {
            sender: self.config.own.get(),
            receiver: self.config.peer.get(),
            boot: self.boot.0,
            known_boot: if self.session.remembered { 0 } else { peer.map_or(0, |peer| peer.boot) },
            origin: self.born,
            known_origin: peer.map_or(0, |peer| peer.origin),
            floor: self.outbox.floor(),
            key: self.config.keys.iter().map(|key| key.number).max().unwrap_or(0),
            number,
        }
    }

    /// Takes a hello in. The frame is authentic, where frames are.
    pub(super) fn on_hello(&mut self, now: Now, hello: &Hello, effects: &mut Vec<Effect>) -> Greeting {
        match self.session.peer {
            Some(peer) if peer.origin == hello.origin && hello.boot < peer.boot => return Greeting::Stale,
            Some(peer) if peer.origin != hello.origin && self.session.retired.contains(&hello.origin) => {
                return Greeting::Stale;
            }
            Some(peer) if peer.origin == hello.origin && peer.boot == hello.boot => {
                self.session.remembered = false;
            }
            _ => self.on_new_life(now, hello, effects),
        }
        self.session.peer_key = hello.key;
        let to_this_life = hello.known_boot == self.boot.0;
        if to_this_life {
            (self.session.confirmed, self.session.echoed) = (true, true);
        } else {
            self.session.hello_due = true;
        }
        if self.inbox.void(0, hello.floor) {
            self.hand_over(now, effects);
        }
        if to_this_life || hello.known_boot == 0 { Greeting::Known } else { Greeting::OldEar }
    }

    /// The peer was started anew, or is met for the first time.
    fn on_new_life(&mut self, now: Now, hello: &Hello, effects: &mut Vec<Effect>) {
        let before = self.session.peer.replace(Life { boot: hello.boot, origin: hello.origin });
        self.session.remembered = false;
        self.session.confirmed = false;
        if before.is_some_and(|before| before.origin != hello.origin) {
            self.session.retired.extend(before.map(|before| before.origin));
            if self.session.retired.len() > RETIRED_MAX {
                self.session.retired.remove(0);
            }
            self.on_new_journal(now, effects);
        }
        if hello.known_origin != self.born {
            self.define_all_again(now);
        }
        for path in &mut self.paths {
            path.forget_peer();
            let lost = path.sent.take_all();
            // Whatever it was, the peer's new life does not acknowledge it.
            drop(lost);
        }
        self.voids_on_air = Default::default();
        self.outbox.begin_anew(now.monotonic);
        self.states.doubt_all();
        self.bulk_out.begin_anew();
        self.bulk_in.begin_anew();
        self.have.clear();
        self.compare = Compare::Settled;
        let mut value = Vec::new();
        put_varint(hello.boot, &mut value);
        put_varint(hello.origin, &mut value);
        self.records.push(self.keys.put(Kind::Peer, 0, value));
    }

    /// The peer's journal is another one: its numbers and names mean something else.
    fn on_new_journal(&mut self, now: Now, effects: &mut Vec<Effect>) {
        // What waits for one before it waits in vain.
        for number in self.inbox.unhanded() {
            self.hand_one(now, number, effects);
        }
        for number in self.inbox.numbers() {
            self.inbox.finish(number);
            self.records.push(self.keys.forget(Kind::Incoming, number));
        }
        for ((table, number), _) in std::mem::take(&mut self.peer_names).all() {
            self.records.push(self.keys.forget(Kind::PeerName, super::journal::name_key((table, number))));
        }
        self.inbox.begin_anew();
        self.held.clear();
        self.records.push(self.keys.put(Kind::Taken, 0, self.inbox.encode_taken()));
        effects.push(Effect::Note(format!(
            "the journal of {} is a new one: numbers and names of the link begin anew",
            self.config.peer
        )));
    }

    /// The peer has lost the names of this end.
    fn define_all_again(&mut self, now: Now) {
        for (name, bytes) in self.names.all() {
            self.names.set_sure(name, false);
            let number = self.add_definition(now, bytes);
            self.after_write.push(AfterWrite::Release(number));
        }
    }
}
