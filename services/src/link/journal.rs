//! What is written before it counts, and what is read back after a start.

use super::names::{Definition, NameId, name_of};
use super::record::Kind;
use super::session::Life;
use super::unwritten::{Batch, RECORDS_MAX};
use super::wire::{Malformed, Reader};
use super::{BatchId, Class, Delivery, DeliveryId, Effect, Link, Reason, Record, Ticket, TicketState};
use crate::link::{body, bulk};
use aldis_envelope::{Monotonic, Now};

/// What follows when a batch is safe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AfterWrite {
    /// A command is accepted and may be sent.
    Release(u64),
    /// A command of the peer is safe.
    Safe(u64),
    /// A frame may be acknowledged: path, number.
    Acknowledge(usize, u64),
}

/// The number of a name's record.
pub(super) fn name_key(name: NameId) -> u64 {
    u64::from(name.0 as u8) << 32 | u64::from(name.1)
}

impl Link {
    /// Hands what is to be written to the journal, as one batch. What was not written before goes along.
    pub(super) fn flush(&mut self, now: Monotonic, effects: &mut Vec<Effect>) {
        let again = self.unwritten.due().is_some_and(|due| due <= now);
        if self.records.is_empty() && self.after_write.is_empty() && !again {
            return;
        }
        if self.records.is_empty()
            && !again
            && let Some(last) = self.batches.values_mut().next_back()
        {
            // It waits for what is being written already.
            last.after.append(&mut self.after_write);
            return;
        }
        let (mut records, mut after) = self.unwritten.take(now, &self.records);
        records.append(&mut self.records);
        after.append(&mut self.after_write);
        let batch = BatchId(self.next_batch);
        self.next_batch += 1;
        self.batches.insert(batch, Batch { records: records.clone(), after });
        effects.push(Effect::Persist(batch, records));
    }

    /// Hands on what has come together, where it is much: a batch of the journal has a limit.
    pub(super) fn flush_much(&mut self, now: Monotonic, effects: &mut Vec<Effect>) {
        if self.records.len() > RECORDS_MAX {
            self.flush(now, effects);
        }
    }

    pub(super) fn on_written(&mut self, now: Now, batch: BatchId, effects: &mut Vec<Effect>) {
        for after in self.batches.remove(&batch).unwrap_or_default().after {
            match after {
                AfterWrite::Release(number) => self.release(now, number, effects),
                AfterWrite::Safe(number) => self.inbox.make_safe(number),
                AfterWrite::Acknowledge(path, number) => {
                    self.acknowledge_command(now.monotonic, path, number, true)
                }
            }
        }
        self.hand_over(now, effects);
    }

    fn release(&mut self, now: Now, number: u64, effects: &mut Vec<Effect>) {
        let Some(entry) = self.outbox.entry(number) else { return };
        let ticket = entry.ticket;
        if self.outbox.release(number) && ticket != Ticket::default() {
            self.counters.commands_accepted += 1;
            let estimate = self.estimate(now.monotonic, 0);
            effects.push(Effect::Ticket(ticket, TicketState::Accepted { estimate }));
        }
    }

    /// A batch was not written: commands in it are neither accepted nor acknowledged. All else in it holds all the same, and is
    /// written later.
    pub(super) fn on_write_failed(
        &mut self,
        now: Monotonic,
        batch: BatchId,
        why: &str,
        effects: &mut Vec<Effect>,
    ) {
        self.counters.journal_failures += 1;
        effects.push(Effect::Note(format!("the journal failed, nothing is accepted or acknowledged: {why}")));
        let Batch { records, after } = self.batches.remove(&batch).unwrap_or_default();
        self.unwritten.keep(now, records);
        let mut taken = false;
        for after in after {
            match after {
                AfterWrite::Acknowledge(..) => {}
                AfterWrite::Safe(number) => {
                    self.inbox.undo(number);
                    self.unwritten.keep(now, vec![self.keys.forget(Kind::Incoming, number)]);
                    taken = true;
                }
                AfterWrite::Release(number) => {
                    let is_definition = self.outbox.entry(number).is_some_and(|entry| entry.stream == 0);
                    if is_definition {
                        // Nobody else gives this name: it goes out when it is written after all.
                        self.unwritten.release_later(after);
                    } else if let Some(left) = self.outbox.leave(number, true) {
                        let reason = Reason::Journal(why.to_owned());
                        self.unwritten.keep(now, vec![self.keys.forget(Kind::Outgoing, number)]);
                        self.tell(left.entry.ticket, TicketState::Refused(reason), effects);
                    }
                }
            }
        }
        if taken {
            self.unwritten.keep(now, vec![self.keys.put(Kind::Taken, 0, self.inbox.encode_taken())]);
        }
    }

    pub(super) fn tell(&self, ticket: Ticket, state: TicketState, effects: &mut Vec<Effect>) {
        if ticket != Ticket::default() {
            effects.push(Effect::Ticket(ticket, state));
        }
    }

    pub(super) fn on_read_back(&mut self, now: Now, key: &[u8], value: &[u8]) {
        let read = match self.keys.parse(key) {
            Some((kind, number)) => self.restore(now, kind, number, value),
            None => Err(Malformed("a key")),
        };
        if read.is_err() {
            self.counters.journal_failures += 1;
        }
    }

    fn restore(&mut self, now: Now, kind: Kind, number: u64, value: &[u8]) -> Result<(), Malformed> {
        let mut reader = Reader::new(value, "a record");
        match kind {
            Kind::Born => self.born = reader.u64()?,
            Kind::Reserved => self.reserved = reader.varint()?,
            Kind::Outgoing => self.outbox.restore(number, value, now)?,
            Kind::Taken => self.inbox.restore_taken(value)?,
            Kind::Incoming => self.inbox.restore(number, value, now)?,
            Kind::Peer => {
                self.session.peer = Some(Life { boot: reader.varint()?, origin: reader.varint()? });
                self.session.remembered = true;
            }
            Kind::OwnName | Kind::PeerName => {
                let (number, definition) = Definition::decode(value)?;
                let names = if kind == Kind::OwnName { &mut self.names } else { &mut self.peer_names };
                names.insert(number, definition).map_err(|_| reader.malformed())?;
            }
            Kind::Partial => {
                let (digest, length, at) = (reader.u64()?, reader.varint_u32()?, reader.varint_u32()?);
                self.bulk_in.restore(digest, length, at, reader.rest());
            }
        }
        Ok(())
    }

    pub(super) fn on_read_back_end(&mut self, now: Now, effects: &mut Vec<Effect>) {
        if self.born == 0 {
            // Two journals of one end are not born at the same nanosecond; 0 means none.
            self.born = now.wall.0.unsigned_abs().max(1);
            self.records.push(self.keys.put(Kind::Born, 0, self.born.to_be_bytes().to_vec()));
        }
        self.outbox.resume(self.reserved);
        self.reserved = self.reserved.max(self.outbox.next());
        for number in self.outbox.numbers() {
            let body = self.outbox.entry(number).filter(|entry| entry.stream == 0);
            if let Some(name) = body.and_then(|entry| name_of(entry.body.get(1..)?)) {
                self.names.set_sure(name, false);
            }
        }
        self.session.hello_due = true;
        self.ready = true;
        self.hand_over(now, effects);
    }

    /// Hands over the commands whose turn it is.
    pub(super) fn hand_over(&mut self, now: Now, effects: &mut Vec<Effect>) {
        let mut from = 0;
        while let Some((number, _)) = self.inbox.next_to_hand(from) {
            // Its label may still be missing; what follows it waits too, others do not. One handed over may free an earlier one
            // only in a frame that came before, so that a second pass is made then.
            if self.hand_one(now, number, effects) {
                from = 0;
            } else {
                from = number + 1;
            }
        }
    }

    /// Hands a command over; false where a name in it is not known yet.
    pub(super) fn hand_one(&mut self, now: Now, number: u64, effects: &mut Vec<Effect>) -> bool {
        let Some(incoming) = self.inbox.get(number) else { return false };
        let left = incoming.expires.map(|expires| (expires - now.monotonic).as_millis().min(u32::MAX.into()));
        let recovered = incoming.recovered;
        let mut reader = Reader::new(&incoming.body, "a command");
        let names = (reader.varint_u32(), reader.varint_u32());
        let (Ok(label), Ok(origin)) = names else { return self.drop_incoming(number) };
        let entry = self.peer_names.labels.get(&label).zip(self.peer_names.origins.get(&origin));
        let Some((entry, origin)) = entry else { return false };
        let Ok(envelope) = body::read_message(&mut reader, entry, origin, left.map(|left| left as u32))
        else {
            return self.drop_incoming(number);
        };
        let own = self.config.own;
        if envelope.stamp.node == own || envelope.stamp.via.contains(&own) {
            self.counters.loops_stopped += 1;
            return self.drop_incoming(number);
        }
        self.inbox.set_handed(number);
        self.counters.commands_received += 1;
        let id = Some(DeliveryId(number));
        effects.push(Effect::Deliver(Delivery { id, envelope, class: Class::Command, recovered }));
        true
    }

    /// A command that nobody can use: it is done.
    fn drop_incoming(&mut self, number: u64) -> bool {
        self.inbox.finish(number);
        self.records.push(self.keys.forget(Kind::Incoming, number));
        true
    }

    /// The journal keeps a part of a large message.
    pub(super) fn record_partial(&mut self, digest: u64, length: u32, at: u32, bytes: &[u8]) {
        let mut value = digest.to_be_bytes().to_vec();
        super::wire::put_varint(length.into(), &mut value);
        super::wire::put_varint(at.into(), &mut value);
        value.extend_from_slice(bytes);
        self.records.push(self.keys.put(Kind::Partial, partial_key(digest, at), value));
    }

    /// A large message is whole: its parts leave the journal.
    pub(super) fn forget_partial(&mut self, digest: u64, length: u32) {
        for at in (0..length).step_by(bulk::RECORD_BYTES as usize) {
            if at + bulk::RECORD_BYTES <= length {
                let key = self.keys.key(Kind::Partial, partial_key(digest, at));
                self.records.push(Record::Forget { key });
            }
        }
    }
}

fn partial_key(digest: u64, at: u32) -> u64 {
    digest.wrapping_add((at / bulk::RECORD_BYTES).into())
}
