//! Messages that are to cross: refused at once with a reason, or taken in.

use super::body::{LabelEntry, Origin, microseconds, write_message, write_whole};
use super::export::Newest;
use super::inbox::COMMAND_BYTES_MAX;
use super::journal::{AfterWrite, name_key};
use super::names::{Definition, InstanceEntry, NameId, Numbered, Table, TooMany};
use super::outbox::Entry;
use super::record::Kind;
use super::state::Sample;
use super::wire::put_varint;
use super::{Class, Effect, Link, Offer, Reason, Ticket, TicketState};
use aldis_envelope::stamp::VIA_MAX;
use aldis_envelope::{Envelope, Monotonic, Now};
use std::time::Duration;

/// How many command numbers are reserved in the journal at once: after a crash at most so many are told as void.
const RESERVED_AT_ONCE: u64 = 1_024;

impl Link {
    pub(super) fn on_offer(&mut self, now: Now, mut offer: Offer, effects: &mut Vec<Effect>) {
        let taken = match self.check(now.monotonic, &mut offer) {
            Err(reason) => Err(reason),
            Ok(()) => match offer.class {
                Class::Command => self.offer_command(now, &mut offer),
                Class::State if self.fits_a_frame(&offer.envelope) => self.offer_state(now, &offer),
                Class::State | Class::Bulk => self.offer_bulk(now, &offer, effects),
            },
        };
        if let Err(reason) = taken {
            self.counters.commands_refused += u64::from(offer.class == Class::Command);
            self.tell(offer.ticket, TicketState::Refused(reason), effects);
        }
    }

    /// What holds for all classes. The way of the message is noted.
    fn check(&mut self, now: Monotonic, offer: &mut Offer) -> Result<(), Reason> {
        if !self.ready {
            return Err(Reason::NotReady);
        }
        let stamp = &mut offer.envelope.stamp;
        let (own, peer) = (self.config.own, self.config.peer);
        if stamp.node != own && !stamp.via.contains(&own) {
            stamp.via.push(own);
        }
        if stamp.node == peer || stamp.via.contains(&peer) || stamp.via.len() > VIA_MAX {
            self.counters.loops_stopped += 1;
            return Err(Reason::Loop);
        }
        let lifespan = stamp.lifespan_left_ms.map(|left| Duration::from_millis(left.into()));
        if let Some(lifespan) = lifespan
            && offer.class == Class::Command
            && let Some(estimate) = self.estimate(now, offer.envelope.message.content.len())
            && estimate > lifespan
        {
            return Err(Reason::TooSlow { estimate, lifespan });
        }
        if self.silent && lifespan.is_some_and(|lifespan| lifespan < Duration::from_secs(1)) {
            return Err(Reason::Silent);
        }
        Ok(())
    }

    /// About how long a command of so many bytes takes from now; none while nobody is heard.
    pub(super) fn estimate(&self, now: Monotonic, bytes: usize) -> Option<Duration> {
        let path = self.paths.iter().find(|path| path.is_heard(now)).filter(|_| !self.silent)?;
        let copies = 1.0 / (1.0 - path.loss_out.min(0.9));
        let ahead = (self.outbox.bytes() as f64 * copies) as usize;
        Some(path.airtime(ahead + bytes) + path.round_trip() / 2)
    }

    fn offer_command(&mut self, now: Now, offer: &mut Offer) -> Result<(), Reason> {
        let limit = self.config.commands_max;
        if self.outbox.len() >= limit {
            return Err(Reason::QueueFull(limit));
        }
        let (envelope, ticket) = (&offer.envelope, offer.ticket);
        let (label, origin) = self.name_label(now, envelope)?;
        let mut body = Vec::with_capacity(envelope.message.content.len() + 24);
        put_varint(label.into(), &mut body);
        put_varint(origin.into(), &mut body);
        write_message(envelope, self.base(label), &mut body);
        if body.len() > COMMAND_BYTES_MAX {
            let bytes = body.len();
            return Err(Reason::TooLarge { bytes, limit: COMMAND_BYTES_MAX });
        }
        let lifespan = envelope.stamp.lifespan_left_ms.map(|left| Duration::from_millis(left.into()));
        let number = self.outbox.add(Entry {
            ticket,
            accepted: now.monotonic,
            expires: lifespan.map(|lifespan| now.monotonic + lifespan),
            stream: label,
            after: 0,
            urgency: envelope.stamp.priority.into(),
            body: body.into(),
        });
        self.record_command(now, number);
        self.after_write.push(AfterWrite::Release(number));
        Ok(())
    }

    fn record_command(&mut self, now: Now, number: u64) {
        if let Some(value) = self.outbox.encode(number, now) {
            self.records.push(self.keys.put(Kind::Outgoing, number, value));
        }
        if number >= self.reserved {
            self.reserved = number + RESERVED_AT_ONCE;
            let mut value = Vec::new();
            put_varint(self.reserved, &mut value);
            self.records.push(self.keys.put(Kind::Reserved, 0, value));
        }
    }

    fn offer_state(&mut self, now: Now, offer: &Offer) -> Result<(), Reason> {
        let Envelope { message, stamp } = &offer.envelope;
        if message.call.is_some() {
            return Err(Reason::NotAState("it is part of a call"));
        }
        let (label, origin) = self.name_label(now, &offer.envelope)?;
        let usual = message.content.len() as u32;
        let entry = InstanceEntry { label, instance: message.instance.clone(), usual };
        let numbered = self.names.instance(entry);
        let number = self.define(now, Table::Instance, numbered)?;
        let sample = Sample {
            origin,
            sequence: stamp.sequence,
            time: microseconds(stamp.source_time),
            change: message.change,
            content: message.content.clone(),
            expires: stamp.lifespan_left_ms.map(|left| now.monotonic + Duration::from_millis(left.into())),
            since: now.monotonic,
        };
        let named = self.is_named(number, &sample);
        let replaced = self.states.is_waiting(number);
        if offer.newest == Newest::Stream {
            let instances = &self.names.instances;
            let of_stream = |other: u32| instances.get(&other).is_some_and(|entry| entry.label == label);
            self.counters.states_conflated += self.states.supersede(number, of_stream);
        }
        if !self.states.offer(number, sample, (offer.interval, offer.share), named) || replaced {
            self.counters.states_conflated += 1;
        }
        Ok(())
    }

    /// Whether the peer has all names that a sample needs.
    pub(super) fn is_named(&self, number: u32, sample: &Sample) -> bool {
        let label = self.names.instances.get(&number).map_or(0, |entry| entry.label);
        let needed = [(Table::Label, label), (Table::Instance, number), (Table::Origin, sample.origin)];
        needed.into_iter().all(|name| self.names.is_sure(name))
    }

    fn offer_bulk(&mut self, now: Now, offer: &Offer, effects: &mut Vec<Effect>) -> Result<(), Reason> {
        let mut bytes = Vec::with_capacity(offer.envelope.message.content.len() + 128);
        write_whole(&offer.envelope, &mut bytes);
        let limit = self.config.bulk_bytes_max;
        if bytes.len() > limit {
            return Err(Reason::TooLarge { bytes: bytes.len(), limit });
        }
        if self.bulk_out.bytes() + bytes.len() > limit {
            return Err(Reason::QueueFull(self.bulk_out.transfers.len()));
        }
        let message = &offer.envelope.message;
        let state_of = (offer.class == Class::State)
            .then(|| (message.label.clone(), message.instance.as_ref().map(|instance| instance.hash)));
        let superseded = self.bulk_out.add(offer.ticket, now.monotonic, bytes.into(), state_of);
        if let Some(ticket) = superseded {
            self.counters.states_conflated += 1;
            self.tell(ticket, TicketState::Cancelled { tries: 0 }, effects);
        }
        self.tell(offer.ticket, TicketState::Accepted { estimate: None }, effects);
        Ok(())
    }

    /// Whether a state goes as a sample; a larger one goes in pieces.
    fn fits_a_frame(&self, envelope: &Envelope) -> bool {
        let room = self.paths.iter().map(|path| path.config.mtu).min().unwrap_or(super::MTU_MIN);
        // Head, hello, tag, acknowledgement and the item's own fields.
        envelope.message.content.len() + 72 <= room
    }

    /// The numbers of a message's label and origin; the peer is told of new ones.
    fn name_label(&mut self, now: Now, envelope: &Envelope) -> Result<(u32, u32), Reason> {
        let base = microseconds(envelope.stamp.source_time);
        let entry =
            LabelEntry { label: envelope.message.label.clone(), priority: envelope.stamp.priority, base };
        let label = self.names.label(entry);
        let label = self.define(now, Table::Label, label)?;
        let origin = self.names.origin(Origin::of(&envelope.stamp));
        Ok((label, self.define(now, Table::Origin, origin)?))
    }

    pub(super) fn base(&self, label: u32) -> i64 {
        self.names.labels.get(&label).map_or(0, |entry| entry.base)
    }

    fn define(&mut self, now: Now, table: Table, numbered: Result<Numbered, TooMany>) -> Result<u32, Reason> {
        let (number, definition) = numbered.map_err(|TooMany| Reason::TooManyNames)?;
        if let Some(definition) = definition {
            self.record_definition(now, (table, number), &definition);
        }
        Ok(number)
    }

    fn record_definition(&mut self, now: Now, name: NameId, definition: &Definition) {
        let bytes = definition.encode(name.1);
        self.records.push(self.keys.put(Kind::OwnName, name_key(name), bytes.clone()));
        let number = self.add_definition(now, bytes);
        self.after_write.push(AfterWrite::Release(number));
    }

    /// A definition travels as a command before all others, to nobody but the link.
    pub(super) fn add_definition(&mut self, now: Now, bytes: Vec<u8>) -> u64 {
        let body = [&[0], &bytes[..]].concat();
        let number = self.outbox.add(Entry {
            ticket: Ticket::default(),
            accepted: now.monotonic,
            expires: None,
            stream: 0,
            after: 0,
            urgency: 0,
            body: body.into(),
        });
        self.record_command(now, number);
        number
    }

    pub(super) fn on_cancel(&mut self, ticket: Ticket, effects: &mut Vec<Effect>) {
        if let Some(number) = self.outbox.number_of(ticket)
            && let Some(left) = self.outbox.leave(number, true)
        {
            self.records.push(self.keys.forget(Kind::Outgoing, number));
            self.tell(ticket, TicketState::Cancelled { tries: left.tries }, effects);
        }
        let transfer = self.bulk_out.transfers.iter().find(|(_, transfer)| transfer.ticket == ticket);
        if let Some(number) = transfer.map(|(&number, _)| number) {
            let tries = self.bulk_out.remove(number).map_or(0, |transfer| transfer.pieces);
            self.tell(ticket, TicketState::Cancelled { tries }, effects);
        }
    }
}
