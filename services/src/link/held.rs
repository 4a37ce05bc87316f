//! States that came: what is newer than what is held is handed over, the rest is not.

use super::body::Origin;
use super::names::Names;
use super::state::{DigestParts, SHORT_NUMBERS, SHORT_TIME_US, SHORT_TIMES};
use super::wire::{Malformed, Reader};
use std::collections::BTreeMap;

/// What is held of an instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Mark {
    origin: u32,
    sequence: u64,
    time: i64,
}

/// A sample in short form, made whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Short<'a> {
    pub(super) number: u32,
    pub(super) origin: u32,
    pub(super) sequence: u64,
    pub(super) time: i64,
    pub(super) bytes: &'a [u8],
}

/// What came of the peer's states.
#[derive(Debug, Default)]
pub(super) struct Held {
    marks: BTreeMap<u32, Mark>,
}

impl Held {
    /// Takes a sample down; false where what is held is as new or newer.
    pub(super) fn take(&mut self, names: &Names, number: u32, origin: u32, sequence: u64, time: i64) -> bool {
        if let Some(held) = self.marks.get(&number)
            && !is_newer(names, *held, Mark { origin, sequence, time })
        {
            return false;
        }
        self.marks.insert(number, Mark { origin, sequence, time });
        true
    }

    /// The samples of a block in short form. Those that cannot be made whole because nothing is held are an error.
    pub(super) fn read_short<'a>(&self, names: &Names, block: &'a [u8]) -> Result<Vec<Short<'a>>, Malformed> {
        let mut reader = Reader::new(block, "a block of short samples");
        let bad = reader.malformed();
        let first = reader.varint_u32()?;
        let mut number = u64::from(first).wrapping_sub(1);
        let mut samples = Vec::new();
        while !reader.is_empty() {
            let head = reader.byte()?;
            let (step, low) = (u64::from(head >> 5), u64::from(head & 31));
            if step == 0 {
                number = number.wrapping_add((low + 1) * 7);
                continue;
            }
            number = number.wrapping_add(step);
            let tail = reader.u16()?;
            let (low, time) = (low + u64::from(tail >> 14) * 32, i64::from(tail) % SHORT_TIMES);
            let whole = u32::try_from(number).map_err(|_| bad)?;
            let (entry, held) = names.instances.get(&whole).zip(self.marks.get(&whole)).ok_or(bad)?;
            let bytes = reader.take(entry.usual as usize)?;
            let sequence = held.sequence.saturating_add(low.wrapping_sub(held.sequence) % SHORT_NUMBERS);
            let units = held.time.div_euclid(SHORT_TIME_US);
            let units = units.saturating_add((time - units).rem_euclid(SHORT_TIMES));
            let time = units.saturating_mul(SHORT_TIME_US);
            samples.push(Short { number: whole, origin: held.origin, sequence, time, bytes });
        }
        Ok(samples)
    }

    /// How many instances are held, and the digest of them.
    pub(super) fn digest(&self) -> (u32, DigestParts) {
        let mut parts = DigestParts::default();
        for (&number, held) in &self.marks {
            parts.add(number, held.sequence);
        }
        (self.marks.len() as u32, parts)
    }

    pub(super) fn clear(&mut self) {
        self.marks.clear();
    }
}

/// Within one node: by its life and then by number. Between nodes: by the source's time.
fn is_newer(names: &Names, held: Mark, new: Mark) -> bool {
    if held.origin == new.origin {
        return new.sequence > held.sequence;
    }
    let origin = |number| names.origins.get(&number);
    match (origin(held.origin), origin(new.origin)) {
        (Some(Origin { node: a, boot: before, .. }), Some(Origin { node: b, boot: after, .. })) if a == b => {
            (after, new.sequence) > (before, held.sequence)
        }
        _ => new.time > held.time,
    }
}
