//! Where the records stand: 24 bytes a record beside the tree that holds them, whatever keys and values are.

use super::Held;
use super::batch::{Batch, View};
use aldis_envelope::KeyHash;
use std::collections::{BTreeMap, VecDeque};

/// The bytes of a key that a fingerprint holds as they are.
const EXACT: usize = 14;

/// How many segments there can be: places name them by 12 bits.
pub(super) const SEGMENTS_MAX: usize = 1 << 12;

/// Stands for a space and a key: the key itself up to 14 bytes, else 14 bytes of its MD5, as DDS names instances.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Fingerprint([u8; 16]);

impl Fingerprint {
    pub(super) fn new(space: u8, key: &[u8]) -> Self {
        let mut bytes = [0; 16];
        bytes[0] = space;
        if key.len() <= EXACT {
            bytes[1] = key.len() as u8;
            bytes[2..2 + key.len()].copy_from_slice(key);
        } else {
            bytes[1] = u8::MAX;
            bytes[2..].copy_from_slice(&KeyHash::md5(&[key]).0[..EXACT]);
        }
        Self(bytes)
    }

    pub(super) fn of(view: &View<'_>) -> Self {
        Self::new(view.space, view.key)
    }
}

/// Where a record stands: 32 bits of offset, the last 12 of the segment's number, 20 of size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place(u64);

impl Place {
    pub(super) fn new(segment: u32, offset: usize, size: usize) -> Self {
        Self((offset as u64) << 32 | u64::from(segment % SEGMENTS_MAX as u32) << 20 | size as u64)
    }

    fn size(self) -> u64 {
        self.0 & 0xf_ffff
    }

    fn segment_low(self) -> u32 {
        (self.0 >> 20) as u32 % SEGMENTS_MAX as u32
    }
}

/// A segment, by its sizes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Segment {
    pub(super) number: u32,
    /// Bytes on disk.
    pub(super) length: u32,
    /// Bytes of records that stand in it.
    pub(super) live: u64,
}

/// All records that stand, and the segments that hold them.
#[derive(Debug, Default)]
pub(super) struct Index {
    places: BTreeMap<Fingerprint, Place>,
    segments: VecDeque<Segment>,
    live: u64,
    length: u64,
}

impl Index {
    pub(super) fn held(&self) -> Held {
        Held {
            records: self.places.len() as u64,
            live_bytes: self.live,
            disk_bytes: self.length,
            segments: self.segments.len(),
            is_stuck: false,
        }
    }

    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// By how many bytes a batch makes the journal grow.
    pub(super) fn growth(&self, batch: &Batch) -> i64 {
        let growth = |view: View<'_>| {
            let old = self.places.get(&Fingerprint::of(&view)).map_or(0, |place| place.size() as i64);
            view.value.map_or(0, |_| view.encoded_bytes() as i64) - old
        };
        batch.operations().iter().map(|operation| growth(operation.view())).sum()
    }

    /// Whether the record of a key stands just there.
    pub(super) fn stands_at(&self, fingerprint: Fingerprint, place: Place) -> bool {
        self.places.get(&fingerprint) == Some(&place)
    }

    /// A record stands at a place from now on, or nowhere.
    pub(super) fn set(&mut self, fingerprint: Fingerprint, place: Option<Place>) {
        let old = match place {
            Some(place) => {
                self.count(place, true);
                self.places.insert(fingerprint, place)
            }
            None => self.places.remove(&fingerprint),
        };
        if let Some(old) = old {
            self.count(old, false);
        }
    }

    fn count(&mut self, place: Place, stands: bool) {
        let Some(first) = self.segments.front() else { return };
        let back = place.segment_low().wrapping_sub(first.number) % SEGMENTS_MAX as u32;
        let number = first.number.wrapping_add(back);
        // Numbers of segments may have holes where files are missing.
        let found = self.segments.binary_search_by_key(&number, |segment| segment.number);
        let Ok(position) = found else { return };
        let live = &mut self.segments[position].live;
        for live in [live, &mut self.live] {
            *live = if stands { *live + place.size() } else { *live - place.size() };
        }
    }

    /// A segment that is newer than all others.
    pub(super) fn add_segment(&mut self, number: u32, length: u32) {
        self.segments.push_back(Segment { number, length, live: 0 });
        self.length += u64::from(length);
    }

    /// Only so many of the oldest segments are left; nothing stands in the others.
    pub(super) fn cut(&mut self, segments: usize) {
        self.segments.truncate(segments);
        self.length = self.segments.iter().map(|segment| u64::from(segment.length)).sum();
    }

    /// The newest segment is so long.
    pub(super) fn set_length(&mut self, length: u32) {
        if let Some(newest) = self.segments.back_mut() {
            self.length = self.length - u64::from(newest.length) + u64::from(length);
            newest.length = length;
        }
    }

    pub(super) fn oldest(&self) -> Option<Segment> {
        self.segments.front().copied()
    }

    pub(super) fn newest(&self) -> Option<Segment> {
        self.segments.back().copied()
    }

    pub(super) fn segments(&self) -> impl Iterator<Item = Segment> + '_ {
        self.segments.iter().copied()
    }

    /// The oldest segment is gone; nothing stood in it.
    pub(super) fn remove_oldest(&mut self) {
        if let Some(gone) = self.segments.pop_front() {
            self.length -= u64::from(gone.length);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fingerprints_tell_spaces_keys_and_lengths_apart() {
        let long = [7_u8; 255];
        let keys: [&[u8]; 6] = [b"", &[0], &[0, 0], &long[..14], &long[..15], &long];
        let mut all: Vec<_> = keys.iter().flat_map(|key| [0, 1].map(|s| Fingerprint::new(s, key))).collect();
        all.sort();
        all.dedup();
        assert_eq!(all.len(), 12);
    }

    #[test]
    fn bytes_are_counted_in_the_segment_where_they_stand() {
        let mut index = Index::default();
        // Numbers beyond 12 bits, and one of them missing.
        for number in [SEGMENTS_MAX as u32 - 1, SEGMENTS_MAX as u32 + 1] {
            index.add_segment(number, 1000);
        }
        let (a, b) = (Fingerprint::new(0, b"a"), Fingerprint::new(0, b"b"));
        index.set(a, Some(Place::new(SEGMENTS_MAX as u32 - 1, 64, 0xf_ffff)));
        index.set(b, Some(Place::new(SEGMENTS_MAX as u32 - 1, 70, 10)));
        index.set(b, Some(Place::new(SEGMENTS_MAX as u32 + 1, 64, 20)));
        let live: Vec<_> = index.segments().map(|segment| segment.live).collect();
        assert_eq!(live, [0xf_ffff, 20]);
        index.set(a, None);
        assert_eq!(
            index.held(),
            Held { records: 1, live_bytes: 20, disk_bytes: 2000, segments: 2, is_stuck: false }
        );
        assert!(index.stands_at(b, Place::new(SEGMENTS_MAX as u32 + 1, 64, 20)));
        assert!(!index.stands_at(b, Place::new(SEGMENTS_MAX as u32 + 1, 65, 20)));
    }
}
