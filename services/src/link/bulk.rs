//! Large messages: in the background, in pieces, taken up again where they were cut off.

use super::event::Ticket;
use super::ranges::Ranges;
use aldis_envelope::{KeyHash, Label, Monotonic};
use bytes::Bytes;
use std::collections::BTreeMap;
use std::sync::Arc;

/// How many large messages of the peer may be unfinished.
const UNFINISHED_MAX: usize = 4;

/// How many bytes of a message lie in one record of the journal.
pub(super) const RECORD_BYTES: u32 = 8_192;

/// A message on its way out.
#[derive(Debug)]
pub(super) struct Transfer {
    pub(super) ticket: Ticket,
    pub(super) since: Monotonic,
    pub(super) bytes: Bytes,
    pub(super) digest: u64,
    arrived: Ranges,
    on_air: Ranges,
    /// The peer knows its length and digest.
    pub(super) started: bool,
    /// How many pieces went out.
    pub(super) pieces: u32,
    /// Where it is a state: of what, so that a newer one takes its place.
    state_of: Option<StateOf>,
}

/// What a large state is of.
pub(super) type StateOf = (Arc<Label>, Option<KeyHash>);

/// A digest that tells two messages apart.
pub(super) fn digest_of(bytes: &[u8]) -> u64 {
    let hash = KeyHash::md5(&[bytes]).0;
    hash.iter().take(8).fold(0, |number, byte| number << 8 | u64::from(*byte))
}

/// Messages on their way out, oldest first.
#[derive(Debug, Default)]
pub(super) struct BulkOut {
    pub(super) transfers: BTreeMap<u32, Transfer>,
    next: u32,
    bytes: usize,
}

impl BulkOut {
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    /// Takes a message in. A state takes the place of an older one of its instance of which nothing went out yet: that one's
    /// ticket comes back.
    pub(super) fn add(
        &mut self,
        ticket: Ticket,
        since: Monotonic,
        bytes: Bytes,
        state_of: Option<StateOf>,
    ) -> Option<Ticket> {
        let older = |transfer: &Transfer| {
            state_of.is_some() && transfer.state_of == state_of && transfer.pieces == 0 && !transfer.started
        };
        let older = self.transfers.iter().find(|(_, transfer)| older(transfer)).map(|(&number, _)| number);
        let superseded = older.and_then(|number| self.remove(number)).map(|transfer| transfer.ticket);
        self.next += 1;
        self.bytes += bytes.len();
        let digest = digest_of(&bytes);
        let (arrived, on_air) = (Ranges::default(), Ranges::default());
        let transfer =
            Transfer { ticket, since, bytes, digest, arrived, on_air, started: false, pieces: 0, state_of };
        self.transfers.insert(self.next, transfer);
        superseded
    }

    /// The next piece of at most `length` bytes: transfer, start, end.
    pub(super) fn next(&self, length: u32) -> Option<(u32, u32, u32)> {
        self.transfers.iter().find_map(|(&number, transfer)| {
            let mut start = 0;
            loop {
                let next = transfer.on_air.first_missing(transfer.arrived.first_missing(start));
                if next == start {
                    break;
                }
                start = next;
            }
            let total = transfer.bytes.len() as u64;
            let limit = [transfer.arrived.next_start(start), transfer.on_air.next_start(start)];
            let limit = limit.into_iter().flatten().fold(total, u64::min);
            (start < total).then(|| (number, start as u32, limit.min(start + u64::from(length)) as u32))
        })
    }

    pub(super) fn sent(&mut self, number: u32, start: u32, end: u32) {
        if let Some(transfer) = self.transfers.get_mut(&number) {
            transfer.on_air.insert_range(start.into(), end.into());
            transfer.pieces += 1;
        }
    }

    pub(super) fn lost(&mut self, number: u32, start: u32, end: u32) {
        if let Some(transfer) = self.transfers.get_mut(&number) {
            transfer.on_air.remove_range(start.into(), end.into());
        }
    }

    /// Bytes arrived; the transfer when all of it did.
    pub(super) fn arrived(&mut self, number: u32, start: u32, end: u32) -> Option<Transfer> {
        let transfer = self.transfers.get_mut(&number)?;
        transfer.arrived.insert_range(start.into(), u64::from(end).min(transfer.bytes.len() as u64));
        let all = transfer.arrived.covers(0, transfer.bytes.len() as u64);
        if all { self.remove(number) } else { None }
    }

    pub(super) fn remove(&mut self, number: u32) -> Option<Transfer> {
        let transfer = self.transfers.remove(&number)?;
        self.bytes -= transfer.bytes.len();
        Some(transfer)
    }

    /// The peer has a new life: it says anew what it holds.
    pub(super) fn begin_anew(&mut self) {
        for transfer in self.transfers.values_mut() {
            (transfer.arrived, transfer.on_air, transfer.started) =
                (Ranges::default(), Ranges::default(), false);
        }
    }
}

/// A message that is coming.
#[derive(Debug, Clone, Default)]
pub(super) struct Partial {
    pub(super) length: u32,
    pub(super) digest: u64,
    pieces: BTreeMap<u32, Bytes>,
    have: Ranges,
    /// How many bytes from its beginning are in the journal.
    pub(super) recorded: u32,
}

impl Partial {
    /// How many bytes from the beginning are there without a hole.
    pub(super) fn prefix(&self) -> u32 {
        self.have.first_missing(0).min(self.length.into()) as u32
    }

    fn add(&mut self, at: u32, bytes: &[u8]) -> bool {
        let Some(end) = at.checked_add(bytes.len() as u32).filter(|end| *end <= self.length) else {
            return false;
        };
        if !self.have.covers(at.into(), end.into()) {
            self.pieces.insert(at, Bytes::copy_from_slice(bytes));
            self.have.insert_range(at.into(), end.into());
        }
        true
    }

    /// Bytes `start..end`, all of which are there.
    pub(super) fn bytes(&self, start: u32, end: u32) -> Vec<u8> {
        let mut out = vec![0; (end - start) as usize];
        for (&at, piece) in self.pieces.range(..end) {
            let (from, to) = (at.max(start), (at + piece.len() as u32).min(end));
            if from < to {
                out[(from - start) as usize..(to - start) as usize]
                    .copy_from_slice(&piece[(from - at) as usize..(to - at) as usize]);
            }
        }
        out
    }
}

/// What became of a piece.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Piece {
    /// It is kept; so much may be written to the journal: digest, length of the whole, start, bytes.
    Kept(Option<(u64, u32, u32, Vec<u8>)>),
    /// It completes the message.
    Whole(u64, Vec<u8>),
    /// The message is known to be through.
    Again,
    /// Nothing is known of the message, or there is no room.
    No,
}

/// Messages that are coming.
#[derive(Debug, Default)]
pub(super) struct BulkIn {
    /// By the number that the peer's present life gave them.
    partials: BTreeMap<u32, Partial>,
    /// Beginnings from the journal, or of the peer's earlier life, by digest.
    beginnings: BTreeMap<u64, Partial>,
    through: Ranges,
}

impl BulkIn {
    /// A message begins, of at most `limit` bytes. How much of it is here already; none where it is not taken.
    pub(super) fn start(&mut self, number: u32, length: u32, digest: u64, limit: usize) -> Option<u32> {
        if self.through.contains(number.into()) {
            return Some(length);
        }
        if let Some(partial) = self.partials.get(&number) {
            return (partial.digest == digest && partial.length == length).then(|| partial.prefix());
        }
        if length as usize > limit || length == 0 || self.partials.len() >= UNFINISHED_MAX {
            return None;
        }
        let known = self.beginnings.remove(&digest).filter(|partial| partial.length == length);
        let partial = known.unwrap_or(Partial { length, digest, ..Partial::default() });
        let prefix = partial.prefix();
        self.partials.insert(number, partial);
        Some(prefix)
    }

    pub(super) fn piece(&mut self, number: u32, at: u32, bytes: &[u8]) -> Piece {
        if self.through.contains(number.into()) {
            return Piece::Again;
        }
        let Some(partial) = self.partials.get_mut(&number) else { return Piece::No };
        if !partial.add(at, bytes) {
            return Piece::No;
        }
        let prefix = partial.prefix();
        if prefix < partial.length {
            let start = partial.recorded;
            if prefix - start < RECORD_BYTES {
                return Piece::Kept(None);
            }
            partial.recorded = start + RECORD_BYTES;
            let bytes = partial.bytes(start, partial.recorded);
            return Piece::Kept(Some((partial.digest, partial.length, start, bytes)));
        }
        let (digest, whole) = (partial.digest, partial.bytes(0, prefix));
        self.partials.remove(&number);
        if digest_of(&whole) != digest {
            return Piece::No;
        }
        self.through.insert(number.into());
        Piece::Whole(digest, whole)
    }

    /// A piece from the journal.
    pub(super) fn restore(&mut self, digest: u64, length: u32, at: u32, bytes: &[u8]) {
        if self.beginnings.len() >= UNFINISHED_MAX && !self.beginnings.contains_key(&digest) {
            return;
        }
        let fresh = Partial { length, digest, ..Partial::default() };
        let partial = self.beginnings.entry(digest).or_insert(fresh);
        if partial.add(at, bytes) {
            partial.recorded = partial.recorded.max(at + bytes.len() as u32);
        }
    }

    /// The peer has a new life and numbers anew; what is unfinished waits for its digest to be named again.
    pub(super) fn begin_anew(&mut self) {
        self.through = Ranges::default();
        for partial in std::mem::take(&mut self.partials).into_values() {
            if self.beginnings.len() < UNFINISHED_MAX {
                self.beginnings.insert(partial.digest, partial);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn message() -> Bytes {
        (0..20_000u32).map(|n| (n * 7 % 251) as u8).collect::<Vec<_>>().into()
    }

    #[test]
    fn pieces_go_out_once_unless_they_are_lost() {
        let mut out = BulkOut::default();
        assert_eq!(out.add(Ticket(1), Monotonic::START, message(), None), None);
        let number = 1;
        let mut pieces = Vec::new();
        while let Some((_, start, end)) = out.next(9_000) {
            out.sent(number, start, end);
            pieces.push((start, end));
        }
        assert_eq!(pieces, [(0, 9_000), (9_000, 18_000), (18_000, 20_000)]);
        out.lost(number, 9_000, 18_000);
        assert_eq!(out.next(5_000), Some((number, 9_000, 14_000)));
        assert!(out.arrived(number, 0, 9_000).is_none() && out.arrived(number, 18_000, 20_000).is_none());
        assert!(out.arrived(number, 9_000, 18_000).is_some() && out.bytes() == 0);
    }

    #[test]
    fn a_message_goes_on_where_the_journal_has_it() {
        let (message, mut coming) = (message(), BulkIn::default());
        let digest = digest_of(&message);
        assert_eq!(coming.piece(1, 0, &message[..10]), Piece::No);
        assert_eq!(coming.start(1, 20_000, digest, 1 << 20), Some(0));
        let Piece::Kept(Some((_, _, at, bytes))) = coming.piece(1, 0, &message[..10_000]) else { panic!() };
        assert_eq!((at, &bytes[..]), (0, &message[..RECORD_BYTES as usize]));
        let mut later = BulkIn::default();
        later.restore(digest, 20_000, at, &bytes);
        assert_eq!(later.start(9, 20_000, digest, 1 << 20), Some(RECORD_BYTES));
        let rest = RECORD_BYTES as usize;
        assert_eq!(later.piece(9, RECORD_BYTES, &message[rest..]), Piece::Whole(digest, message.to_vec()));
        assert_eq!(later.piece(9, 0, &message[..10]), Piece::Again);
    }

    #[test]
    fn a_message_that_is_not_what_it_said_is_not_handed_over() {
        let mut coming = BulkIn::default();
        coming.start(1, 4, 99, 100);
        assert_eq!(coming.piece(1, 0, b"abcd"), Piece::No);
        assert_eq!(coming.start(2, 101, 99, 100), None);
    }

    proptest! {
        #[test]
        fn pieces_in_any_order_make_the_message(
            cuts in prop::collection::vec((0u32..500, 1u32..200), 0..40)
        ) {
            let message = message().slice(..500);
            let (digest, mut coming) = (digest_of(&message), BulkIn::default());
            coming.start(1, 500, digest, 1_000);
            let rest = (0..500).step_by(60).map(|start| (start, 60));
            let mut whole = None;
            for (start, length) in cuts.into_iter().chain(rest) {
                let end = (start + length).min(500);
                if let Piece::Whole(_, bytes) = coming.piece(1, start, &message[start as usize..end as usize]) {
                    whole = Some(bytes);
                }
            }
            prop_assert_eq!(whole.as_deref(), Some(&message[..]));
        }
    }
}
