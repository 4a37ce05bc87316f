//! Commands on their way out: queued by urgency and deadline, sent until they are acknowledged or their lifespan ends.

mod flight;

pub(super) use flight::{Flight, Hedge};

use super::event::Ticket;
use super::frame::CommandItem;
use super::ranges::Ranges;
use super::wire::{Malformed, Reader, put_varint, put_zigzag};
use aldis_envelope::{Monotonic, Now};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// Lifespans travel in units of this.
pub(super) const LIFESPAN_UNIT: Duration = Duration::from_millis(64);

/// How many commands may be on the air at once: enough for the bytes that 1 Mbit/s and 60 ms hold.
const FLIGHTS_MAX: usize = 256;

/// In how many pieces the numbers of those that are through may be before the oldest goes first: the peer keeps each piece.
const PIECES_MAX: usize = 512;

/// A command.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    pub(super) ticket: Ticket,
    pub(super) accepted: Monotonic,
    pub(super) expires: Option<Monotonic>,
    /// The number of its label; 0 for a definition.
    pub(super) stream: u32,
    /// The command before it in its stream; 0 for none.
    pub(super) after: u64,
    /// 0 goes before everything: definitions.
    pub(super) urgency: u8,
    pub(super) body: Box<[u8]>,
}

/// A command left the queue.
#[derive(Debug)]
pub(super) struct Left {
    pub(super) number: u64,
    pub(super) entry: Entry,
    pub(super) tries: u32,
    /// Of its bytes, those that arrived.
    pub(super) acknowledged: Ranges,
}

/// All commands on their way out.
#[derive(Debug, Default)]
pub(super) struct Outbox {
    entries: BTreeMap<u64, Entry>,
    /// Those that were never sent: by urgency, deadline, number.
    ready: BTreeSet<(u8, Monotonic, u64)>,
    flights: BTreeMap<u64, Flight>,
    /// When those on the air are to be sent again.
    timers: BTreeSet<(Monotonic, u64)>,
    expiries: BTreeSet<(Monotonic, u64)>,
    /// The last command of each stream.
    last: BTreeMap<u32, u64>,
    /// Numbers that the peer must be told not to expect.
    pub(super) voids: Ranges,
    /// Numbers that are through or void.
    through: Ranges,
    next: u64,
    bytes: usize,
}

const NEVER: Monotonic = Monotonic::since_start(Duration::MAX);

impl Outbox {
    /// Commands count from 1, so that 0 is none.
    pub(super) fn new() -> Self {
        let mut through = Ranges::default();
        through.insert(0);
        Self { next: 1, through, ..Self::default() }
    }

    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// How many commands there are but definitions, and their bytes.
    pub(super) fn commands(&self) -> (usize, usize) {
        let commands = self.entries.values().filter(|entry| entry.stream != 0);
        commands.fold((0, 0), |(count, bytes), entry| (count + 1, bytes + entry.body.len()))
    }

    /// Bytes of all commands that wait or are on the air.
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    pub(super) fn next(&self) -> u64 {
        self.next
    }

    /// No command below this number is to come.
    pub(super) fn floor(&self) -> u64 {
        self.entries.first_key_value().map_or(self.next, |(&number, _)| number)
    }

    /// Whether many wait that were never sent: then none is sent in several copies.
    fn is_crowded(&self, hedge: &Hedge) -> bool {
        self.ready.len() > 4 && self.bytes > hedge.bytes_of_a_second
    }

    /// Takes a command in under the next number. It is sent only after [`Outbox::release`].
    pub(super) fn add(&mut self, mut entry: Entry) -> u64 {
        let number = self.next;
        self.next += 1;
        entry.after = self.last.insert(entry.stream, number).unwrap_or(0);
        if entry.stream == 0 {
            entry.after = 0;
        }
        self.bytes += entry.body.len();
        self.entries.insert(number, entry);
        number
    }

    /// A command is safe: it may be sent. False where it is gone already.
    pub(super) fn release(&mut self, number: u64) -> bool {
        let Some(entry) = self.entries.get(&number) else { return false };
        self.ready.insert((entry.urgency, entry.expires.unwrap_or(NEVER), number));
        if let Some(expires) = entry.expires {
            self.expiries.insert((expires, number));
        }
        true
    }

    pub(super) fn entry(&self, number: u64) -> Option<&Entry> {
        self.entries.get(&number)
    }

    pub(super) fn number_of(&self, ticket: Ticket) -> Option<u64> {
        self.entries.iter().find(|(_, entry)| entry.ticket == ticket).map(|(&number, _)| number)
    }

    /// The command whose turn it is.
    fn turn(&self, now: Monotonic) -> Option<u64> {
        if let Some(&(_, number)) = self.timers.first().filter(|(at, _)| *at <= now) {
            return Some(number);
        }
        if self.flights.len() >= FLIGHTS_MAX {
            return None;
        }
        if self.through.pieces() >= PIECES_MAX {
            return self.ready.iter().map(|(_, _, number)| *number).min();
        }
        self.ready.first().map(|(_, _, number)| *number)
    }

    /// Whether a command is to go out now.
    pub(super) fn is_due(&self, now: Monotonic) -> bool {
        self.turn(now).is_some()
    }

    /// When the next command is to go out.
    pub(super) fn next_due(&self, now: Monotonic) -> Option<Monotonic> {
        let fresh = (!self.ready.is_empty() && self.flights.len() < FLIGHTS_MAX).then_some(now);
        fresh.or_else(|| self.timers.first().map(|(at, _)| *at))
    }

    /// When the next lifespan ends.
    pub(super) fn next_expiry(&self) -> Option<Monotonic> {
        self.expiries.first().map(|(at, _)| *at)
    }

    /// Chooses what goes into a frame with `room` bytes left, of `full` when nothing is in it: a whole command, or a piece of one
    /// that is larger than a frame. The command's next turn is set.
    pub(super) fn take(
        &mut self,
        now: Monotonic,
        room: usize,
        full: usize,
        hedge: &Hedge,
    ) -> Option<(u64, u32, u32)> {
        let number = self.turn(now)?;
        let entry = self.entries.get(&number)?;
        let length = entry.body.len() as u32;
        let whole = self.item(number, 0, length, now)?.overhead() + entry.body.len();
        let flight = self.flights.get(&number);
        let acknowledged = flight.is_some_and(|flight| !flight.acknowledged.is_empty());
        let (start, end) = if whole <= full && !acknowledged {
            if whole > room {
                return None;
            }
            (0, length)
        } else {
            let cursor = flight.map_or(0, |flight| flight.cursor);
            let none = Ranges::default();
            let acknowledged = flight.map_or(&none, |flight| &flight.acknowledged);
            // Word of an earlier copy may have come since the last piece went: what is missing then lies before it.
            let start = [cursor.into(), 0].map(|from| acknowledged.first_missing(from) as u32);
            let start = if start[0] < length { start[0] } else { start[1] };
            let limit = acknowledged.next_start(start.into()).map_or(length, |next| next as u32);
            let overhead = self.item(number, start, start + 1, now)?.overhead();
            let fits = room.checked_sub(overhead + 1).filter(|fits| *fits * 2 > full.min(64))?;
            (start, limit.min(start.saturating_add(fits as u32)))
        };
        let crowded = self.is_crowded(hedge);
        let (expires, bytes) = (entry.expires, entry.body.len());
        self.ready.remove(&(entry.urgency, expires.unwrap_or(NEVER), number));
        let flight = self.flights.entry(number).or_insert_with(|| Flight::new(now, number));
        self.timers.remove(&(flight.next, number));
        flight.sent(now, end, length, expires, &hedge.of(bytes, crowded));
        self.timers.insert((flight.next, number));
        Some((number, start, end))
    }

    /// Bytes `start..end` of a command as an item.
    pub(super) fn item(&self, number: u64, start: u32, end: u32, now: Monotonic) -> Option<CommandItem<'_>> {
        let entry = self.entries.get(&number)?;
        let left = entry.expires.map(|expires| (expires - now).as_millis() / LIFESPAN_UNIT.as_millis());
        let length = entry.body.len() as u32;
        Some(CommandItem {
            number,
            after: entry.after,
            lifespan: left.map(|left| left as u64),
            piece: (end - start < length).then_some((length, start)),
            bytes: entry.body.get(start as usize..end as usize)?,
        })
    }

    /// Bytes `start..end` arrived. The command leaves when all of it did.
    pub(super) fn arrived(&mut self, number: u64, start: u32, end: u32) -> Option<Left> {
        let length = self.entries.get(&number)?.body.len() as u64;
        let flight = self.flights.get_mut(&number)?;
        flight.acknowledged.insert_range(start.into(), end.into());
        let all = flight.acknowledged.covers(0, length);
        if all { self.leave(number, false) } else { None }
    }

    /// Commands whose lifespan has ended.
    pub(super) fn expire(&mut self, now: Monotonic) -> Option<Left> {
        let &(_, number) = self.expiries.first().filter(|(at, _)| *at <= now)?;
        self.leave(number, true)
    }

    /// Takes a command out; a void one is told to the peer.
    pub(super) fn leave(&mut self, number: u64, void: bool) -> Option<Left> {
        let entry = self.entries.remove(&number)?;
        self.bytes -= entry.body.len();
        self.ready.remove(&(entry.urgency, entry.expires.unwrap_or(NEVER), number));
        if let Some(expires) = entry.expires {
            self.expiries.remove(&(expires, number));
        }
        let flight = self.flights.remove(&number);
        if let Some(flight) = &flight {
            self.timers.remove(&(flight.next, number));
        }
        self.through.insert(number);
        if void {
            self.voids.insert(number);
        }
        let (tries, acknowledged) =
            flight.map_or_else(Default::default, |flight| (flight.copies, flight.acknowledged));
        Some(Left { number, entry, tries, acknowledged })
    }

    /// The peer has a new life: what it had of commands in pieces is gone.
    pub(super) fn begin_anew(&mut self, now: Monotonic) {
        self.flights.values_mut().for_each(|flight| flight.acknowledged = Ranges::default());
        self.hurry(now);
    }

    /// The peer is heard again: what is on the air goes again at once.
    pub(super) fn hurry(&mut self, now: Monotonic) {
        self.timers.clear();
        for (&number, flight) in &mut self.flights {
            flight.hurry(now);
            self.timers.insert((flight.next, number));
        }
    }

    /// A frame sent at `at` with this command is lost. Where no later copy is on the air, the command goes again at once.
    pub(super) fn hasten(&mut self, number: u64, now: Monotonic, at: Monotonic) {
        let Some(flight) = self.flights.get_mut(&number).filter(|flight| flight.is_last_copy(at)) else {
            return;
        };
        self.timers.remove(&(flight.next, number));
        flight.next = flight.next.min(now);
        self.timers.insert((flight.next, number));
    }

    /// How often a command was sent whole; none where it waits for its first turn.
    pub(super) fn tries(&self, number: u64) -> Option<u32> {
        self.flights.get(&number).map(|flight| flight.copies)
    }

    /// Whether a command may be sent: it is written down.
    pub(super) fn is_safe(&self, number: u64) -> bool {
        self.flights.contains_key(&number)
            || self.entries.get(&number).is_some_and(|e| self.is_ready(number, e))
    }

    fn is_ready(&self, number: u64, entry: &Entry) -> bool {
        self.ready.contains(&(entry.urgency, entry.expires.unwrap_or(NEVER), number))
    }

    /// How many commands go out before one that waits for its first turn.
    pub(super) fn waiting_before(&self, number: u64) -> usize {
        let Some(entry) = self.entries.get(&number) else { return 0 };
        let place = (entry.urgency, entry.expires.unwrap_or(NEVER), number);
        self.ready.range(..place).count() + self.flights.len()
    }

    pub(super) fn largest_ticket(&self) -> Ticket {
        self.entries.values().map(|entry| entry.ticket).max().unwrap_or_default()
    }

    pub(super) fn numbers(&self) -> Vec<u64> {
        self.entries.keys().copied().collect()
    }

    /// The value of a command's record.
    pub(super) fn encode(&self, number: u64, now: Now) -> Option<Vec<u8>> {
        let entry = self.entries.get(&number)?;
        let mut out = Vec::with_capacity(entry.body.len() + 32);
        put_varint(entry.ticket.0, &mut out);
        put_varint(entry.after, &mut out);
        put_varint(entry.stream.into(), &mut out);
        out.push(entry.urgency);
        match entry.expires {
            None => out.push(0),
            Some(expires) => {
                let left = (expires - now.monotonic).as_millis() as u64;
                out.push(1);
                put_varint(left, &mut out);
                put_zigzag((now.wall.0 / 1_000_000).saturating_add(left as i64), &mut out);
            }
        }
        out.extend_from_slice(&entry.body);
        Some(out)
    }

    /// Takes a command back from the journal. Its lifespan goes on by the wall clock, and never becomes longer.
    pub(super) fn restore(&mut self, number: u64, value: &[u8], now: Now) -> Result<(), Malformed> {
        let mut reader = Reader::new(value, "a command's record");
        let ticket = Ticket(reader.varint()?);
        let after = reader.varint()?;
        let stream = reader.varint_u32()?;
        let urgency = reader.byte()?;
        let expires = match reader.byte()? {
            0 => None,
            _ => {
                let left = reader.varint()?;
                let wall = reader.zigzag()?.saturating_sub(now.wall.0 / 1_000_000);
                let left = left.min(u64::try_from(wall).unwrap_or(0));
                Some(now.monotonic + Duration::from_millis(left))
            }
        };
        let body: Box<[u8]> = reader.rest().into();
        self.bytes += body.len();
        let accepted = now.monotonic;
        self.entries.insert(number, Entry { ticket, accepted, expires, stream, after, urgency, body });
        self.next = self.next.max(number + 1);
        let last = self.last.entry(stream).or_default();
        *last = number.max(*last);
        self.release(number);
        Ok(())
    }

    /// After the journal was read: numbers below `reserved` may have been used, and those that are not in the queue do not
    /// come any more.
    pub(super) fn resume(&mut self, reserved: u64) {
        self.next = self.next.max(reserved);
        self.through = Ranges::default();
        self.through.insert_range(0, self.next);
        for &number in self.entries.keys() {
            self.through.remove(number);
        }
        let floor = self.floor();
        self.voids = self.through.clone();
        self.voids.remove_range(0, floor);
    }
}

#[cfg(test)]
mod tests;
