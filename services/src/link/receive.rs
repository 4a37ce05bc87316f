//! Frames that come in.

use super::bulk::Piece;
use super::frame::{CommandItem, HEAD_BYTES, Head, Hello, Item, StateItem};
use super::inbox::Took;
use super::journal::{AfterWrite, name_key};
use super::names::{Definition, name_of};
use super::outbox::LIFESPAN_UNIT;
use super::path::{ACK_DELAY, CarrierId};
use super::record::Kind;
use super::seal::{FrameId, LinkKey, open};
use super::session::Greeting;
use super::wire::Reader;
use super::{Class, Delivery, Effect, Link, VERSION, body};
use aldis_envelope::{Monotonic, Now};
use bytes::Bytes;
use std::time::Duration;

/// What the items of a frame came to.
#[derive(Debug, Default, Clone, Copy)]
struct Digested {
    /// Something was not taken: the frame is not acknowledged.
    refused: bool,
    /// A command, or word of one: the acknowledgement is urgent.
    urgent: bool,
    /// Something that was not there before: its acknowledgement is worth copies.
    fresh: bool,
    /// Something must be written before the frame is acknowledged.
    writes: bool,
    /// The numbers taken have changed.
    taken: bool,
    /// There was something besides acknowledgements.
    content: bool,
}

/// A frame that was read, before its items.
struct Opened {
    head: Head,
    hello: Option<Hello>,
    number: u64,
    content: Vec<u8>,
}

impl Link {
    pub(super) fn on_frame(&mut self, now: Now, carrier: CarrierId, frame: &[u8], effects: &mut Vec<Effect>) {
        let Some(index) = self.paths.iter().position(|path| path.config.id == carrier).filter(|_| self.ready)
        else {
            return;
        };
        let Some(opened) = self.open(index, frame, effects) else { return };
        // A hello of the present life that comes again is a replay: it must not be answered.
        let present = self.session.peer.filter(|_| !self.session.remembered).map(|peer| peer.boot);
        let same_life = opened.hello.is_none_or(|hello| Some(hello.boot) == present);
        if same_life && !self.paths[index].received.is_new(opened.number) {
            self.counters.frames_repeated += 1;
            return;
        }
        let greeting = match &opened.hello {
            Some(hello) => self.on_hello(now, hello, effects),
            None => Greeting::Known,
        };
        if greeting == Greeting::Stale {
            self.counters.frames_stale += 1;
            return;
        }
        let path = &mut self.paths[index];
        if !path.received.see(opened.number) {
            self.counters.frames_repeated += 1;
            return;
        }
        self.counters.frames_received += 1;
        path.last_heard = Some(now.monotonic);
        if opened.head.eliciting {
            path.acks.newest = now.monotonic;
        }
        self.session.hello_due |= opened.head.asks;
        // With keys, what is not meant for this life may be a replay; its hello alone counts.
        let unknown = opened.hello.is_some_and(|hello| hello.known_boot != self.boot.0);
        if greeting == Greeting::OldEar || (unknown && !self.config.keys.is_empty()) {
            return;
        }
        let digested = self.digest(now, index, &opened.content, effects);
        if digested.taken {
            self.records.push(self.keys.put(Kind::Taken, 0, self.inbox.encode_taken()));
        }
        if opened.head.eliciting && !digested.refused {
            self.owe_acknowledgement(now.monotonic, index, opened.number, digested);
        }
        self.hand_over(now, effects);
    }

    /// Reads what stands before the items, and undoes the encryption.
    fn open(&mut self, index: usize, frame: &[u8], effects: &mut Vec<Effect>) -> Option<Opened> {
        let mut reader = Reader::new(frame, "a frame");
        let version = frame.first().map_or(0, |first| first >> 5);
        let head = Head::read(&mut reader).ok().filter(|_| version == VERSION);
        let Some(head) = head else {
            self.counters.frames_foreign += 1;
            if frame.len() >= HEAD_BYTES && version != VERSION && !self.session.told_version {
                self.session.told_version = true;
                let text =
                    "frames on the link to {} are of protocol version {}, this is {}: update one of the two";
                let text = text.replacen("{}", &self.config.peer.to_string(), 1);
                let text =
                    text.replacen("{}", &version.to_string(), 1).replacen("{}", &VERSION.to_string(), 1);
                effects.push(Effect::Note(text));
            }
            return None;
        };
        let hello = if head.hello { Hello::read(&mut reader).ok() } else { None };
        let (own, peer) = (self.config.own.get(), self.config.peer.get());
        let ours = |hello: &Hello| {
            hello.sender == peer
                && hello.receiver == own
                && hello.number as u16 == head.number
                && hello.boot > 0
        };
        if head.hello && !hello.as_ref().is_some_and(ours) {
            self.counters.frames_foreign += 1;
            return None;
        }
        let boot = hello.map(|hello| hello.boot).or(self.session.peer.map(|peer| peer.boot));
        let Some(boot) = boot.filter(|boot| super::frame::session_byte(*boot) == head.session) else {
            self.counters.frames_stale += 1;
            return None;
        };
        let path = &self.paths[index];
        let number = hello.map_or_else(|| path.received.whole(head.number), |hello| hello.number);
        let rest = reader.rest();
        if self.config.keys.is_empty() {
            return Some(Opened { head, hello, number, content: rest.to_vec() });
        }
        let context = hello.map_or(self.boot.0, |hello| hello.known_boot);
        let id = FrameId { sender: self.config.peer, boot, carrier: path.config.id.0, number };
        let clear = frame.len() - rest.len();
        let key = self.key_of(head.key);
        let Some(content) = key.and_then(|key| open(key, id, context, clear, frame)) else {
            self.counters.frames_forged += 1;
            return None;
        };
        Some(Opened { head, hello, number, content })
    }

    /// The newest key whose number is odd, or even.
    fn key_of(&self, odd: bool) -> Option<&LinkKey> {
        let fitting = self.config.keys.iter().filter(|key| (key.number & 1 == 1) == odd);
        fitting.max_by_key(|key| key.number)
    }

    fn digest(&mut self, now: Now, index: usize, content: &[u8], effects: &mut Vec<Effect>) -> Digested {
        let mut digested = Digested::default();
        let mut reader = Reader::new(content, "a frame");
        while !reader.is_empty() {
            let Ok(item) = Item::read(&mut reader) else {
                self.counters.frames_foreign += 1;
                digested.refused = true;
                return digested;
            };
            self.on_item(now, index, item, &mut digested, effects);
        }
        digested
    }

    fn on_item(
        &mut self,
        now: Now,
        index: usize,
        item: Item<'_>,
        digested: &mut Digested,
        effects: &mut Vec<Effect>,
    ) {
        digested.content |= !matches!(item, Item::Ack { .. } | Item::Loss(_));
        match item {
            Item::Ack { .. } => self.on_ack(now, index, &item, effects),
            Item::Loss(loss) => self.paths[index].loss_out = f64::from(loss) / 255.0,
            Item::Void { start, count } => {
                digested.fresh = true;
                let marked = self.inbox.void(start, count);
                digested.refused |= !marked;
                (digested.taken, digested.writes, digested.urgent) = (true, true, true);
            }
            Item::Command(command) => self.on_command(now, index, &command, digested),
            Item::State(state) => digested.refused |= !self.on_state(index, &state, effects),
            Item::Compact(block) => digested.refused |= !self.on_compact(block, effects),
            Item::Digest { count, digest } => {
                let held = self.held.digest();
                self.session.differ_due = held.0 != count || held.1.whole() != digest;
            }
            Item::Differ(theirs) => self.states.doubt(theirs),
            Item::Start { transfer, length, digest } => {
                match self.bulk_in.start(transfer, length, digest, self.config.bulk_bytes_max) {
                    None => digested.refused = true,
                    Some(0) => {}
                    Some(prefix) => {
                        self.have.insert(transfer, prefix);
                    }
                }
            }
            Item::Have { transfer, prefix } => {
                self.on_transfer_arrived(now.monotonic, transfer, 0, prefix, effects)
            }
            Item::Piece { transfer, offset, bytes } => {
                digested.refused |= !self.on_piece(transfer, offset, bytes, effects);
            }
        }
    }

    fn on_command(&mut self, now: Now, index: usize, command: &CommandItem<'_>, digested: &mut Digested) {
        digested.urgent = true;
        let flight = self.paths[index].round_trip() / 2;
        match self.inbox.take(now.monotonic, command, flight) {
            Took::Piece | Took::Again(true) => {}
            Took::Again(false) => digested.writes = true,
            Took::No => {
                digested.refused = true;
                self.counters.commands_late = self.inbox.late;
            }
            Took::New => {
                (digested.writes, digested.taken, digested.fresh) = (true, true, true);
                self.after_write.push(AfterWrite::Safe(command.number));
                self.keep(now, command.number);
            }
        }
    }

    /// A new command is written down; a definition is taken at its word.
    fn keep(&mut self, now: Now, number: u64) {
        let Some(incoming) = self.inbox.get(number) else { return };
        let Some(definition) = incoming.body.strip_prefix(&[0]) else {
            if let Some(value) = self.inbox.encode(number, now) {
                self.records.push(self.keys.put(Kind::Incoming, number, value));
            }
            return;
        };
        if let (Ok((named, decoded)), Some(name)) = (Definition::decode(definition), name_of(definition)) {
            let record = self.keys.put(Kind::PeerName, name_key(name), definition.to_vec());
            if self.peer_names.insert(named, decoded).is_ok() {
                self.records.push(record);
            }
        }
        self.inbox.finish(number);
    }

    fn on_state(&mut self, index: usize, state: &StateItem<'_>, effects: &mut Vec<Effect>) -> bool {
        let names = &self.peer_names;
        let Some(instance) = names.instances.get(&state.alias) else { return false };
        let entry = names.labels.get(&instance.label).zip(names.origins.get(&state.origin));
        let (Some((entry, origin)), Ok(change)) = (entry, body::change_of(state.change)) else {
            return false;
        };
        if state.sequence == 0 || (change != aldis_envelope::Change::Put && instance.instance.is_none()) {
            return false;
        }
        let time = entry.base.saturating_add(state.time);
        let flight = self.paths[index].round_trip() / 2;
        let left = state.lifespan.map(|units| {
            let lifespan = Duration::from_millis(units.saturating_mul(LIFESPAN_UNIT.as_millis() as u64));
            lifespan.saturating_sub(flight).as_millis().min(u32::MAX.into()) as u32
        });
        if self.loops(origin) || left == Some(0) {
            return true;
        }
        if !self.held.take(names, state.alias, state.origin, state.sequence, time) {
            self.counters.states_old += 1;
            return true;
        }
        self.counters.states_received += 1;
        let what = (change, state.sequence, time);
        let content = Bytes::copy_from_slice(state.bytes);
        let envelope = body::sample(entry, origin, instance.instance.clone(), what, left, content);
        effects.push(Effect::Deliver(Delivery { id: None, envelope, class: Class::State, recovered: false }));
        true
    }

    fn on_compact(&mut self, block: &[u8], effects: &mut Vec<Effect>) -> bool {
        let Ok(samples) = self.held.read_short(&self.peer_names, block) else { return false };
        for short in samples {
            let names = &self.peer_names;
            let Some(instance) = names.instances.get(&short.number) else { continue };
            let entry = names.labels.get(&instance.label).zip(names.origins.get(&short.origin));
            let Some((entry, origin)) = entry else { continue };
            if self.loops(origin)
                || !self.held.take(names, short.number, short.origin, short.sequence, short.time)
            {
                self.counters.states_old += 1;
                continue;
            }
            self.counters.states_received += 1;
            let what = (aldis_envelope::Change::Put, short.sequence, short.time);
            let content = Bytes::copy_from_slice(short.bytes);
            let envelope = body::sample(entry, origin, instance.instance.clone(), what, None, content);
            effects.push(Effect::Deliver(Delivery {
                id: None,
                envelope,
                class: Class::State,
                recovered: false,
            }));
        }
        true
    }

    fn loops(&self, origin: &body::Origin) -> bool {
        origin.node == self.config.own || origin.via.contains(&self.config.own)
    }

    fn on_piece(&mut self, transfer: u32, at: u32, bytes: &[u8], effects: &mut Vec<Effect>) -> bool {
        match self.bulk_in.piece(transfer, at, bytes) {
            Piece::Kept(None) | Piece::Again => true,
            Piece::Kept(Some((digest, length, start, bytes))) => {
                self.record_partial(digest, length, start, &bytes);
                true
            }
            Piece::No => false,
            Piece::Whole(digest, whole) => {
                self.forget_partial(digest, whole.len() as u32);
                if let Ok(envelope) = body::read_whole(&whole)
                    && envelope.stamp.node != self.config.own
                    && !envelope.stamp.via.contains(&self.config.own)
                {
                    let delivery = Delivery { id: None, envelope, class: Class::Bulk, recovered: false };
                    effects.push(Effect::Deliver(delivery));
                }
                true
            }
        }
    }

    fn owe_acknowledgement(&mut self, now: Monotonic, index: usize, number: u64, digested: Digested) {
        if digested.writes {
            self.after_write.push(AfterWrite::Acknowledge(index, number));
        } else if digested.urgent || !digested.content {
            self.acknowledge_command(now, index, number, digested.fresh || !digested.content);
        } else {
            let path = &mut self.paths[index];
            path.received.acknowledge(number);
            path.acks.taken += 1;
            // Every second frame is acknowledged at once; one alone soon after.
            let delay = (path.round_trip() / 6).min(ACK_DELAY);
            let more = path.acks.taken >= 2;
            path.owe(if more { now } else { now + delay });
            // One that no further frame comes after is worth its copies: they wait for one, which has an acknowledgement of its own.
            path.acks.copies = if more { 1 } else { path.ack_copies() };
            path.acks.apart = path.airtime(path.config.mtu * 5 / 4).min(delay * 3);
        }
    }

    /// All that a frame carried is safe, and its sender waits for word.
    /// What came before gets one copy of the acknowledgement: more copies of the command are on the air, and each is acknowledged.
    pub(super) fn acknowledge_command(&mut self, now: Monotonic, index: usize, number: u64, fresh: bool) {
        let path = &mut self.paths[index];
        path.received.acknowledge(number);
        path.acks.taken += 1;
        path.acks.copies = path.acks.copies.max(if fresh { path.ack_copies() } else { 1 });
        path.acks.apart = Duration::ZERO;
        path.owe(now);
    }
}
