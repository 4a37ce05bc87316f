//! Straight lines across an area, and where they can be swept.

use crate::plan::free_space::Point;
use crate::plan::search_plan::{Look, Mover, turns_out};
use crate::plan::turning::{Piece, Pose};
use std::f64::consts::PI;

/// How far sweeps end before a border, in metres: more than rounding moves their ends.
const MARGIN_M: f64 = 0.01;

/// Sweeps shorter than this share of the look's width are not worth a turn.
const SHORTEST: f64 = 0.02;

/// How far ends are moved at a time until the vehicle can turn aside, in radii of its turn.
const TRIM: f64 = 0.25;

/// From where to where on a line, in metres.
pub(super) type Interval = (f64, f64);

/// A line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    /// A place on it.
    pub at: Point,
    /// Its direction: of length 1.
    pub along: Point,
}

impl Line {
    pub(super) fn new(at: Point, direction_rad: f64) -> Self {
        Self { at, along: (direction_rad.cos(), direction_rad.sin()) }
    }

    pub(super) fn place(&self, metres: f64) -> Point {
        (self.at.0 + self.along.0 * metres, self.at.1 + self.along.1 * metres)
    }

    /// How far along it a place is.
    pub(super) fn along(&self, place: Point) -> f64 {
        (place.0 - self.at.0) * self.along.0 + (place.1 - self.at.1) * self.along.1
    }

    /// How far to its left a place is.
    pub(super) fn aside(&self, place: Point) -> f64 {
        (place.1 - self.at.1) * self.along.0 - (place.0 - self.at.0) * self.along.1
    }

    /// Where it lies within outlines.
    fn within(&self, outlines: &[Vec<Point>]) -> Vec<Interval> {
        let mut crossings = Vec::new();
        for ring in outlines {
            for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
                let (of_a, of_b) = (self.aside(*a), self.aside(*b));
                if (of_a <= 0.0) != (of_b <= 0.0) {
                    let (from, to) = (self.along(*a), self.along(*b));
                    crossings.push(from + (to - from) * of_a / (of_a - of_b));
                }
            }
        }
        crossings.sort_by(f64::total_cmp);
        crossings.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect()
    }

    /// What of these intervals can be swept in either direction.
    pub(super) fn sweeps(
        &self,
        outlines: &[Vec<Point>],
        needed: &[Interval],
        mover: Mover<'_>,
        look: &Look,
    ) -> Vec<Leg> {
        let room = MARGIN_M + look.ahead_m.abs();
        let mut legs = Vec::new();
        for (first, last) in self.within(outlines) {
            for need in needed {
                let span = (need.0.max(first + room), need.1.min(last - room));
                let leg = Leg { line: *self, span: self.trimmed(mover, look, span) };
                let tracks = || [look.track(&leg.piece()), look.track(&leg.piece().back())];
                let ends = |track: Piece| (track.place(0.0), track.place(1.0));
                let sees = |track: Piece| mover.space().sees(ends(track).0, ends(track).1);
                if leg.span.1 - leg.span.0 > SHORTEST * look.width_m && tracks().into_iter().all(sees) {
                    legs.push(leg);
                }
            }
        }
        legs
    }

    /// The interval with its ends moved inwards until the vehicle can turn aside before and after.
    fn trimmed(&self, mover: Mover<'_>, look: &Look, span: Interval) -> Interval {
        let step = TRIM * mover.radius_m();
        if step <= 0.0 {
            return span;
        }
        let direction = self.along.1.atan2(self.along.0);
        let turns = |metres: f64, heading_rad: f64| {
            [-look.ahead_m, look.ahead_m]
                .into_iter()
                .all(|ahead| turns_out(mover, Pose { at: self.place(metres + ahead), heading_rad }))
        };
        let (mut first, mut last) = span;
        while last > first && !turns(last, direction) {
            last -= step;
        }
        while last > first && !turns(first, direction + PI) {
            first += step;
        }
        (first, last)
    }
}

/// A part of a line that is swept.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leg {
    line: Line,
    /// From where to where on the line.
    pub span: Interval,
}

impl Leg {
    pub(super) fn piece(&self) -> Piece {
        Piece::Line { from: self.line.place(self.span.0), to: self.line.place(self.span.1) }
    }
}

/// Intervals in order, with those made one that lie no farther apart than a gap.
pub(super) fn merged(mut intervals: Vec<Interval>, gap_m: f64) -> Vec<Interval> {
    intervals.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut merged: Vec<Interval> = Vec::new();
    for interval in intervals {
        match merged.last_mut() {
            Some(last) if interval.0 - last.1 <= gap_m => last.1 = last.1.max(interval.1),
            _ => merged.push(interval),
        }
    }
    merged
}
