//! Sets of numbers that mostly follow one another.

use super::wire::{Malformed, Reader, put_varint};
use std::collections::BTreeMap;

/// A set of numbers, kept as disjoint ranges.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Ranges {
    /// First number of each range to the one after its last.
    ranges: BTreeMap<u64, u64>,
}

impl Ranges {
    pub(super) fn contains(&self, number: u64) -> bool {
        self.ranges.range(..=number).next_back().is_some_and(|(_, &end)| number < end)
    }

    pub(super) fn insert(&mut self, number: u64) {
        self.insert_range(number, number.saturating_add(1));
    }

    /// Adds `start..end`.
    pub(super) fn insert_range(&mut self, mut start: u64, mut end: u64) {
        if start >= end {
            return;
        }
        if let Some((&before, &before_end)) = self.ranges.range(..=start).next_back()
            && before_end >= start
        {
            start = before;
            end = end.max(before_end);
        }
        while let Some((&next, &next_end)) = self.ranges.range(start..=end).next() {
            end = end.max(next_end);
            self.ranges.remove(&next);
        }
        self.ranges.insert(start, end);
    }

    pub(super) fn remove(&mut self, number: u64) {
        self.remove_range(number, number.saturating_add(1));
    }

    /// Takes `start..end` out.
    pub(super) fn remove_range(&mut self, start: u64, end: u64) {
        if start >= end {
            return;
        }
        while let Some((&first, &last)) =
            self.ranges.range(..end).next_back().filter(|(_, last)| **last > start)
        {
            self.ranges.remove(&first);
            if last > end {
                self.ranges.insert(end, last);
            }
            if first < start {
                self.ranges.insert(first, start);
            }
        }
    }

    /// Whether all of `start..end` is in the set.
    pub(super) fn covers(&self, start: u64, end: u64) -> bool {
        start >= end || self.ranges.range(..=start).next_back().is_some_and(|(_, &last)| last >= end)
    }

    /// The first number from `at` on that is not in the set.
    pub(super) fn first_missing(&self, at: u64) -> u64 {
        match self.ranges.range(..=at).next_back() {
            Some((_, &end)) if end > at => end,
            _ => at,
        }
    }

    /// The first number of a range after `at`.
    pub(super) fn next_start(&self, at: u64) -> Option<u64> {
        self.ranges.range(at..).next().map(|(&start, _)| start)
    }

    /// How many ranges there are.
    pub(super) fn pieces(&self) -> usize {
        self.ranges.len()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.ranges.is_empty()
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (u64, u64)> + '_ {
        self.ranges.iter().map(|(&start, &end)| (start, end))
    }

    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        put_varint(self.ranges.len() as u64, out);
        let mut last = 0;
        for (&start, &end) in &self.ranges {
            put_varint(start - last, out);
            put_varint(end - start, out);
            last = end;
        }
    }

    pub(super) fn decode(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        let mut set = Self::default();
        let mut last = 0u64;
        for _ in 0..reader.varint()? {
            let start = last.checked_add(reader.varint()?).ok_or(reader.malformed())?;
            last = start.checked_add(reader.varint()?).ok_or(reader.malformed())?;
            set.insert_range(start, last);
        }
        Ok(set)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn a_set_of_ranges_is_a_set(steps in prop::collection::vec((any::<bool>(), 0u64..60, 0u64..9), 0..40)) {
            let (mut ranges, mut plain) = (Ranges::default(), BTreeSet::new());
            for (add, start, length) in steps {
                if add {
                    ranges.insert_range(start, start + length);
                    plain.extend(start..start + length);
                } else {
                    ranges.remove_range(start, start + length);
                    plain.retain(|n| !(start..start + length).contains(n));
                }
            }
            for number in 0..70 {
                prop_assert_eq!(ranges.contains(number), plain.contains(&number));
                let missing = (number..).find(|n| !plain.contains(n));
                prop_assert_eq!(Some(ranges.first_missing(number)), missing);
            }
            let mut bytes = Vec::new();
            ranges.encode(&mut bytes);
            prop_assert_eq!(Ranges::decode(&mut Reader::new(&bytes, "test")), Ok(ranges));
        }
    }
}
