//! Commands that come: taken once, made safe, handed over in the order of their streams.

use super::frame::CommandItem;
use super::outbox::LIFESPAN_UNIT;
use super::ranges::Ranges;
use super::wire::{Malformed, Reader, put_varint, put_zigzag};
use aldis_envelope::{Monotonic, Now};
use bytes::Bytes;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// The longest command in bytes. What is longer is bulk.
pub(super) const COMMAND_BYTES_MAX: usize = 65_536;

/// How many bytes of unfinished commands are kept.
const PARTIAL_BYTES_MAX: usize = 1 << 20;

/// How many unfinished commands are kept.
const PARTIALS_MAX: usize = 512;

/// How many commands are kept until their receivers are done.
const INCOMING_MAX: usize = 65_536;

/// In how many pieces the numbers taken may be. The sender keeps to half of it.
const PIECES_MAX: usize = 1_024;

/// A command that came.
#[derive(Debug, Clone)]
pub(super) struct Incoming {
    pub(super) after: u64,
    /// When its lifespan ends here.
    pub(super) expires: Option<Monotonic>,
    pub(super) body: Bytes,
    /// Its record is written.
    pub(super) safe: bool,
    /// It was handed over.
    pub(super) handed: bool,
    /// It comes from the journal.
    pub(super) recovered: bool,
}

/// What became of an item.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Took {
    /// It is whole and new: its record is to be written, then the frame acknowledged.
    New,
    /// It is a piece, and safe enough: pieces are sent again after a crash.
    Piece,
    /// It came before. Whether its record is written.
    Again(bool),
    /// It came after its lifespan, or there is no room. The frame is not acknowledged.
    No,
}

#[derive(Debug, Default)]
struct Partial {
    length: u32,
    pieces: BTreeMap<u32, Bytes>,
    have: Ranges,
}

/// Commands from the peer.
#[derive(Debug, Default)]
pub(super) struct Inbox {
    /// Numbers that were taken, or are not coming.
    taken: Ranges,
    /// Of those, the ones whose record is not written yet.
    unsafe_numbers: BTreeSet<u64>,
    incoming: BTreeMap<u64, Incoming>,
    partials: BTreeMap<u64, Partial>,
    partial_bytes: usize,
    /// Commands that came after their lifespan.
    pub(super) late: u64,
}

impl Inbox {
    /// Takes an item in; `flight` is how long it was probably on its way.
    pub(super) fn take(&mut self, now: Monotonic, item: &CommandItem<'_>, flight: Duration) -> Took {
        if self.taken.contains(item.number) {
            return Took::Again(!self.unsafe_numbers.contains(&item.number));
        }
        let lifespan = item.lifespan.map(|units| {
            let milliseconds = units.saturating_mul(LIFESPAN_UNIT.as_millis() as u64);
            Duration::from_millis(milliseconds).saturating_sub(flight)
        });
        if lifespan == Some(Duration::ZERO) {
            self.late += 1;
            return Took::No;
        }
        let expires = lifespan.map(|lifespan| now + lifespan);
        let body = match item.piece {
            None => Bytes::copy_from_slice(item.bytes),
            Some((length, at)) => match self.assemble(item, length, at) {
                Ok(Some(body)) => body,
                Ok(None) => return Took::Piece,
                Err(NoRoom) => return Took::No,
            },
        };
        let joins = item.number > 0 && self.taken.contains(item.number - 1);
        if self.incoming.len() >= INCOMING_MAX || (!joins && self.taken.pieces() >= PIECES_MAX) {
            return Took::No;
        }
        self.taken.insert(item.number);
        self.unsafe_numbers.insert(item.number);
        let incoming =
            Incoming { after: item.after, expires, body, safe: false, handed: false, recovered: false };
        self.incoming.insert(item.number, incoming);
        Took::New
    }

    fn assemble(&mut self, item: &CommandItem<'_>, length: u32, at: u32) -> Result<Option<Bytes>, NoRoom> {
        let end = at.checked_add(item.bytes.len() as u32).filter(|end| *end <= length).ok_or(NoRoom)?;
        let known = self.partials.contains_key(&item.number);
        let full = self.partial_bytes + item.bytes.len() > PARTIAL_BYTES_MAX;
        if length as usize > COMMAND_BYTES_MAX || full || (!known && self.partials.len() >= PARTIALS_MAX) {
            // The oldest gives way, so that what nobody finishes does not stay for ever.
            self.drop_partial_of_first();
            return Err(NoRoom);
        }
        let partial =
            self.partials.entry(item.number).or_insert_with(|| Partial { length, ..Default::default() });
        if partial.length != length {
            return Err(NoRoom);
        }
        if !partial.have.covers(at.into(), end.into()) {
            // A longer piece replaces a shorter one that begins at the same place.
            let before = partial.pieces.insert(at, Bytes::copy_from_slice(item.bytes));
            partial.have.insert_range(at.into(), end.into());
            self.partial_bytes =
                self.partial_bytes + item.bytes.len() - before.map_or(0, |piece| piece.len());
        }
        if !partial.have.covers(0, length.into()) {
            return Ok(None);
        }
        let mut body = vec![0; length as usize];
        for (&at, piece) in &partial.pieces {
            body[at as usize..at as usize + piece.len()].copy_from_slice(piece);
        }
        self.drop_partial(item.number);
        Ok(Some(body.into()))
    }

    fn drop_partial_of_first(&mut self) {
        if let Some((&number, _)) = self.partials.first_key_value() {
            self.drop_partial(number);
        }
    }

    fn drop_partial(&mut self, number: u64) {
        if let Some(partial) = self.partials.remove(&number) {
            self.partial_bytes -= partial.pieces.values().map(Bytes::len).sum::<usize>();
        }
    }

    /// Whether numbers up to `count` from `start` can be marked; a peer may not make the set large.
    pub(super) fn void(&mut self, start: u64, count: u64) -> bool {
        let end = start.saturating_add(count);
        if self.taken.pieces() >= PIECES_MAX && !self.taken.contains(start.saturating_sub(1)) {
            return false;
        }
        self.taken.insert_range(start, end);
        let gone: Vec<_> = self.partials.range(start..end).map(|(&number, _)| number).collect();
        gone.into_iter().for_each(|number| self.drop_partial(number));
        true
    }

    /// The peer's journal is another one: its numbers begin anew.
    pub(super) fn begin_anew(&mut self) {
        self.taken = Ranges::default();
        self.partials.clear();
        self.partial_bytes = 0;
    }

    /// A command's record is written.
    pub(super) fn make_safe(&mut self, number: u64) {
        self.unsafe_numbers.remove(&number);
        if let Some(incoming) = self.incoming.get_mut(&number) {
            incoming.safe = true;
        }
    }

    /// A command's record was not written: it counts as not come.
    pub(super) fn undo(&mut self, number: u64) {
        if self.unsafe_numbers.remove(&number) {
            self.incoming.remove(&number);
            self.taken.remove(number);
        }
    }

    /// Commands that may be handed over now, in order: safe, and not before the one that they follow.
    pub(super) fn next_to_hand(&self, from: u64) -> Option<(u64, &Incoming)> {
        let mut waiting =
            self.incoming.range(from..).filter(|(_, incoming)| incoming.safe && !incoming.handed);
        let found = waiting.find(|(_, incoming)| self.is_free(incoming.after));
        found.map(|(&number, incoming)| (number, incoming))
    }

    /// Whether what follows this number may be handed over.
    fn is_free(&self, after: u64) -> bool {
        let held = self.incoming.get(&after).is_some_and(|before| !before.handed);
        after == 0 || (self.taken.contains(after) && !held)
    }

    pub(super) fn set_handed(&mut self, number: u64) {
        if let Some(incoming) = self.incoming.get_mut(&number) {
            incoming.handed = true;
        }
    }

    /// The receiver is done with a command, or it is none for a receiver.
    pub(super) fn finish(&mut self, number: u64) -> bool {
        self.incoming.remove(&number).is_some()
    }

    pub(super) fn get(&self, number: u64) -> Option<&Incoming> {
        self.incoming.get(&number)
    }

    /// All that are kept.
    pub(super) fn numbers(&self) -> Vec<u64> {
        self.incoming.keys().copied().collect()
    }

    /// Those that are safe and wait for one before them.
    pub(super) fn unhanded(&self) -> Vec<u64> {
        let waiting = self.incoming.iter().filter(|(_, incoming)| incoming.safe && !incoming.handed);
        waiting.map(|(&number, _)| number).collect()
    }

    /// How many are kept.
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.incoming.len()
    }

    /// The value of the record of numbers taken.
    pub(super) fn encode_taken(&self) -> Vec<u8> {
        let mut out = Vec::new();
        self.taken.encode(&mut out);
        out
    }

    pub(super) fn restore_taken(&mut self, value: &[u8]) -> Result<(), Malformed> {
        self.taken = Ranges::decode(&mut Reader::new(value, "the record of numbers taken"))?;
        Ok(())
    }

    /// The value of a command's record.
    pub(super) fn encode(&self, number: u64, now: Now) -> Option<Vec<u8>> {
        let incoming = self.incoming.get(&number)?;
        let mut out = Vec::with_capacity(incoming.body.len() + 24);
        put_varint(incoming.after, &mut out);
        match incoming.expires {
            None => out.push(0),
            Some(expires) => {
                out.push(1);
                let left = (expires - now.monotonic).as_millis() as u64;
                put_varint(left, &mut out);
                put_zigzag((now.wall.0 / 1_000_000).saturating_add(left as i64), &mut out);
            }
        }
        out.extend_from_slice(&incoming.body);
        Some(out)
    }

    pub(super) fn restore(&mut self, number: u64, value: &[u8], now: Now) -> Result<(), Malformed> {
        let mut reader = Reader::new(value, "a received command's record");
        let after = reader.varint()?;
        let expires = match reader.byte()? {
            0 => None,
            _ => {
                let left = reader.varint()?;
                let wall = reader.zigzag()?.saturating_sub(now.wall.0 / 1_000_000);
                let left = left.min(u64::try_from(wall).unwrap_or(0));
                Some(now.monotonic + Duration::from_millis(left))
            }
        };
        let body = Bytes::copy_from_slice(reader.rest());
        let incoming = Incoming { after, expires, body, safe: true, handed: false, recovered: true };
        self.incoming.insert(number, incoming);
        self.taken.insert(number);
        Ok(())
    }
}

/// There is no room for a piece, or it contradicts another.
struct NoRoom;

#[cfg(test)]
mod tests;
