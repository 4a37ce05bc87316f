//! Which segment is nearest: boxes around boxes, packed once, so that memory is in proportion whatever the segments are.

use crate::plan::free_space::Point;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// How many boxes are in a box.
const IN_A_BOX: usize = 8;

#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: Point,
    high: Point,
}

impl Bounds {
    const NOTHING: Self =
        Self { low: (f64::INFINITY, f64::INFINITY), high: (f64::NEG_INFINITY, f64::NEG_INFINITY) };

    fn with(self, other: Self) -> Self {
        Self {
            low: (self.low.0.min(other.low.0), self.low.1.min(other.low.1)),
            high: (self.high.0.max(other.high.0), self.high.1.max(other.high.1)),
        }
    }

    /// The squared distance of a place.
    fn square(&self, place: Point) -> f64 {
        let x = (self.low.0 - place.0).max(place.0 - self.high.0).max(0.0);
        let y = (self.low.1 - place.1).max(place.1 - self.high.1).max(0.0);
        x * x + y * y
    }
}

/// Segments in boxes.
#[derive(Debug, Clone)]
pub(super) struct Boxes {
    ends: Vec<(Point, Point)>,
    /// The segments, near ones near each other.
    order: Vec<u32>,
    /// The boxes of each level; the lowest holds one for each segment.
    levels: Vec<Vec<Bounds>>,
}

/// A box or a segment by its squared distance.
#[derive(PartialEq)]
struct Near(f64, usize, usize);

impl Eq for Near {}

impl PartialOrd for Near {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Near {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0).then((self.1, self.2).cmp(&(other.1, other.2)))
    }
}

impl Boxes {
    pub(super) fn new(ends: Vec<(Point, Point)>) -> Self {
        let bounds = |&(a, b): &(Point, Point)| Bounds { low: a, high: a }.with(Bounds { low: b, high: b });
        let all = ends.iter().map(bounds).fold(Bounds::NOTHING, Bounds::with);
        let size = (all.high.0 - all.low.0).max(all.high.1 - all.low.1).max(f64::MIN_POSITIVE);
        let cell = |at: f64, low: f64| ((at - low) / size * 65_535.0) as u32;
        let key = |&(a, b): &(Point, Point)| {
            let middle = (f64::midpoint(a.0, b.0), f64::midpoint(a.1, b.1));
            interleaved(cell(middle.0, all.low.0), cell(middle.1, all.low.1))
        };
        let mut order: Vec<u32> = (0..ends.len() as u32).collect();
        order.sort_by_cached_key(|&at| key(&ends[at as usize]));
        let mut levels = vec![order.iter().map(|&at| bounds(&ends[at as usize])).collect::<Vec<_>>()];
        while levels[levels.len() - 1].len() > 1 {
            let below = &levels[levels.len() - 1];
            let joined = |boxes: &[Bounds]| boxes.iter().copied().fold(Bounds::NOTHING, Bounds::with);
            levels.push(below.chunks(IN_A_BOX).map(joined).collect());
        }
        Self { ends, order, levels }
    }

    /// The nearest segment, and how far along it the nearest place is, from 0 to 1.
    pub(super) fn nearest(&self, place: Point) -> Option<(u32, f64)> {
        let top = self.levels.len() - 1;
        let mut next = BinaryHeap::new();
        next.push(Reverse(Near(0.0, top, 0)));
        let mut best: Option<(f64, u32, f64)> = None;
        while let Some(Reverse(Near(square, level, at))) = next.pop() {
            if best.is_some_and(|best| best.0 <= square) || self.levels[level].is_empty() {
                break;
            }
            if level == 0 {
                let (square, share) = self.measured(self.order[at], place);
                if best.is_none_or(|best| square < best.0) {
                    best = Some((square, self.order[at], share));
                }
                continue;
            }
            for below in self.below(level, at) {
                next.push(Reverse(Near(self.levels[level - 1][below].square(place), level - 1, below)));
            }
        }
        best.map(|(_, segment, share)| (segment, share))
    }

    /// The segments whose boxes are within a distance.
    pub(super) fn within(&self, place: Point, distance_m: f64) -> Vec<u32> {
        let mut found = Vec::new();
        let mut open = vec![(self.levels.len() - 1, 0)];
        while let Some((level, at)) = open.pop() {
            match self.levels[level].get(at) {
                Some(bounds) if bounds.square(place) <= distance_m * distance_m => {
                    if level == 0 {
                        found.push(self.order[at]);
                    } else {
                        open.extend(self.below(level, at).map(|below| (level - 1, below)));
                    }
                }
                _ => {}
            }
        }
        found
    }

    fn below(&self, level: usize, at: usize) -> std::ops::Range<usize> {
        at * IN_A_BOX..((at + 1) * IN_A_BOX).min(self.levels[level - 1].len())
    }

    /// The squared distance of a segment, and how far along it the nearest place is.
    fn measured(&self, segment: u32, place: Point) -> (f64, f64) {
        let (a, b) = self.ends[segment as usize];
        let (side, to) = ((b.0 - a.0, b.1 - a.1), (place.0 - a.0, place.1 - a.1));
        let square = side.0 * side.0 + side.1 * side.1;
        let share = (side.0 * to.0 + side.1 * to.1) / square;
        let share = if square > 0.0 { share.clamp(0.0, 1.0) } else { 0.0 };
        let (x, y) = (to.0 - share * side.0, to.1 - share * side.1);
        (x * x + y * y, share)
    }
}

/// The bits of two numbers in turn: cells that are near each other mostly have keys near each other.
fn interleaved(x: u32, y: u32) -> u64 {
    (0..16).fold(0, |key, bit| {
        let of = |number: u32| u64::from(number >> bit & 1);
        key | of(x) << (2 * bit) | of(y) << (2 * bit + 1)
    })
}
