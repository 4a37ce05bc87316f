//! In what order commands are handed over: in that of their streams, also over numbers that are not coming.
//!
//! A command names the one before it in its stream. Where that one came, it was handed over itself, or it is here and waits. Where
//! it is not coming, it does not tell any more what was before it, and so nothing of the stream may be on its way.

use crate::link::ranges::Ranges;
use crate::link::wire::{Malformed, Reader};
use std::collections::{BTreeMap, BTreeSet};

/// In how many pieces the numbers that are not coming are remembered: the journal gets them with each command.
const PIECES_MAX: usize = 64;

/// What is known of the order of streams.
#[derive(Debug, Default)]
pub(super) struct Order {
    /// Of each stream those that are here and were not handed over.
    waiting: BTreeMap<u32, BTreeSet<u64>>,
    /// Of each stream the last that was handed over in this life. All of the stream that are before it are through.
    handed: BTreeMap<u32, u64>,
    /// Numbers that are not coming, or of which it is not known any more that they came.
    void: Ranges,
    /// Those of them that were told last, and nothing else.
    told: Ranges,
}

impl Order {
    /// A command came.
    pub(super) fn came(&mut self, stream: u32, number: u64) {
        self.waiting.entry(stream).or_default().insert(number);
    }

    /// A command waits no longer: it is gone.
    pub(super) fn gone(&mut self, stream: u32, number: u64) {
        if let Some(waiting) = self.waiting.get_mut(&stream) {
            waiting.remove(&number);
            if waiting.is_empty() {
                self.waiting.remove(&stream);
            }
        }
    }

    /// A command was handed over.
    pub(super) fn handed(&mut self, stream: u32, number: u64) {
        self.gone(stream, number);
        self.handed.insert(stream, number);
    }

    /// Numbers of `start..end` that were not taken are not coming.
    pub(super) fn void(&mut self, start: u64, end: u64, taken: &Ranges) {
        let mut at = taken.first_missing(start);
        while at < end {
            let stop = taken.next_start(at).map_or(end, |next| next.min(end));
            self.void.insert_range(at, stop);
            self.told.insert_range(at, stop);
            at = taken.first_missing(stop);
        }
        self.limit();
    }

    /// What the journal keeps of it.
    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        self.void.encode(out);
    }

    /// Takes it back. An older journal does not tell which of the numbers taken came.
    pub(super) fn restore(&mut self, reader: &mut Reader<'_>, taken: &Ranges) -> Result<(), Malformed> {
        self.void = if reader.is_empty() { taken.clone() } else { Ranges::decode(reader)? };
        self.limit();
        Ok(())
    }

    /// Whether a number was told not to come, and did not. A copy that comes later must not be acknowledged: its sender would take it
    /// for delivered. Only the newest are remembered, because no frame is late for long.
    pub(super) fn is_void(&self, number: u64) -> bool {
        self.told.contains(number)
    }

    /// What is between the oldest pieces counts as not coming too: who follows it may wait longer than it must.
    fn limit(&mut self) {
        while self.told.pieces() > PIECES_MAX {
            let oldest: Vec<_> = self.told.iter().take(1).collect();
            oldest.into_iter().for_each(|(start, end)| self.told.remove_range(start, end));
        }
        while self.void.pieces() > PIECES_MAX {
            let oldest: Vec<_> = self.void.iter().take(2).collect();
            if let [(start, _), (_, end)] = oldest[..] {
                self.void.insert_range(start, end);
            }
        }
    }

    /// Whether a command that follows `after` in its stream may be handed over.
    pub(super) fn is_free(&self, stream: u32, number: u64, after: u64, taken: &Ranges) -> bool {
        let first = self.waiting.get(&stream).and_then(BTreeSet::first);
        if first.is_some_and(|first| *first < number) {
            return false;
        }
        let handed = self.handed.get(&stream).copied().unwrap_or(0);
        let came = taken.contains(after) && !self.void.contains(after);
        after <= handed || came || taken.covers(handed + 1, after.saturating_add(1))
    }

    /// The first of each stream that waits.
    pub(super) fn first(&self) -> impl Iterator<Item = u64> + '_ {
        self.waiting.values().filter_map(|waiting| waiting.first().copied())
    }
}
