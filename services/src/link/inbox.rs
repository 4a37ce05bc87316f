//! Commands that come: taken once, made safe, handed over in the order of their streams.

mod order;

use super::frame::CommandItem;
use super::outbox::LIFESPAN_UNIT;
use super::ranges::Ranges;
use super::wire::{Malformed, Reader, put_varint, put_zigzag};
use aldis_envelope::{Monotonic, Now};
use bytes::Bytes;
use order::Order;
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
    /// The number of its label, which is its stream.
    stream: u32,
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

impl Incoming {
    fn new(after: u64, expires: Option<Monotonic>, body: Bytes) -> Self {
        // What does not begin with a label is dropped when its turn comes.
        let stream = Reader::new(&body, "a command").varint_u32().unwrap_or(u32::MAX);
        Self { after, stream, expires, body, safe: false, handed: false, recovered: false }
    }
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
    /// It came after its lifespan, or after word that it does not come, or there is no room. The frame is not acknowledged.
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
    order: Order,
    partials: BTreeMap<u64, Partial>,
    partial_bytes: usize,
    /// Commands that came after their lifespan.
    pub(super) late: u64,
}

impl Inbox {
    /// Takes an item in; `flight` is how long it was probably on its way.
    pub(super) fn take(&mut self, now: Monotonic, item: &CommandItem<'_>, flight: Duration) -> Took {
        if self.order.is_void(item.number) {
            return Took::No;
        }
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
        self.insert(item.number, Incoming::new(item.after, expires, body));
        Took::New
    }

    fn insert(&mut self, number: u64, incoming: Incoming) {
        self.order.came(incoming.stream, number);
        self.incoming.insert(number, incoming);
    }

    fn assemble(&mut self, item: &CommandItem<'_>, length: u32, at: u32) -> Result<Option<Bytes>, NoRoom> {
        let end = at.checked_add(item.bytes.len() as u32).filter(|end| *end <= length).ok_or(NoRoom)?;
        let known = self.partials.contains_key(&item.number);
        // Pieces that are kept are acknowledged and do not come again, so none gives way. The oldest command may always be finished:
        // that makes room for the others.
        let oldest = known && self.partials.first_key_value().is_some_and(|(&first, _)| first == item.number);
        let more = if oldest { 2 * COMMAND_BYTES_MAX } else { 0 };
        let full = self.partial_bytes + item.bytes.len() > PARTIAL_BYTES_MAX + more;
        if length as usize > COMMAND_BYTES_MAX || full || (!known && self.partials.len() >= PARTIALS_MAX) {
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
        self.order.void(start, end, &self.taken);
        self.taken.insert_range(start, end);
        let gone: Vec<_> = self.partials.range(start..end).map(|(&number, _)| number).collect();
        gone.into_iter().for_each(|number| self.drop_partial(number));
        true
    }

    /// The peer's journal is another one: its numbers begin anew.
    pub(super) fn begin_anew(&mut self) {
        (self.taken, self.order) = Default::default();
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
            self.finish(number);
            self.taken.remove(number);
        }
    }

    /// The first command that may be handed over now: safe, and the next of its stream.
    pub(super) fn next_to_hand(&self, from: u64) -> Option<(u64, &Incoming)> {
        let first = self.order.first().filter(|number| *number >= from);
        let next = first.filter(|number| self.is_free(*number)).min()?;
        Some((next, self.incoming.get(&next)?))
    }

    fn is_free(&self, number: u64) -> bool {
        let incoming = self.incoming.get(&number).filter(|incoming| incoming.safe);
        incoming.is_some_and(|i| self.order.is_free(i.stream, number, i.after, &self.taken))
    }

    pub(super) fn set_handed(&mut self, number: u64) {
        if let Some(incoming) = self.incoming.get_mut(&number) {
            incoming.handed = true;
            self.order.handed(incoming.stream, number);
        }
    }

    /// The receiver is done with a command, or it is none for a receiver.
    pub(super) fn finish(&mut self, number: u64) -> bool {
        let gone = self.incoming.remove(&number);
        if let Some(incoming) = &gone {
            self.order.gone(incoming.stream, number);
        }
        gone.is_some()
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
        self.order.encode(&mut out);
        out
    }

    pub(super) fn restore_taken(&mut self, value: &[u8]) -> Result<(), Malformed> {
        let mut reader = Reader::new(value, "the record of numbers taken");
        self.taken = Ranges::decode(&mut reader)?;
        self.order.restore(&mut reader, &self.taken)?;
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
        self.insert(number, Incoming { safe: true, recovered: true, ..Incoming::new(after, expires, body) });
        self.taken.insert(number);
        Ok(())
    }
}

/// There is no room for a piece, or it contradicts another.
struct NoRoom;

#[cfg(test)]
mod tests;
