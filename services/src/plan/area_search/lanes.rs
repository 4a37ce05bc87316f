//! Lanes in one direction, and the direction with the fewest.

use super::line::{Interval, Leg, Line, merged};
use crate::plan::free_space::grid::{self, Ring};
use crate::plan::free_space::{FreeSpace, Point};
use crate::plan::search_plan::{Look, Mover, SearchError, swept};
use std::f64::consts::PI;

/// How many lanes may be.
const LANES_MAX: u64 = 4_096;

/// How many directions are tried: those of the longest sides.
const DIRECTIONS_MAX: usize = 24;

/// Gaps between what is needed on a lane that are flown through, in widths of the look.
const GAP_MAX: f64 = 2.0;

/// What lanes are made of.
pub(super) struct Lanes<'a> {
    /// What is to be covered.
    pub target: &'a [Ring],
    /// The outlines of free space.
    pub outlines: &'a [Vec<Point>],
    pub look: Look,
    /// The most metres from one lane to the next.
    pub spacing_m: f64,
}

impl Lanes<'_> {
    /// The sweeps of each lane of a direction.
    pub(super) fn of(&self, mover: Mover<'_>, direction_rad: f64) -> Result<Vec<Vec<Leg>>, SearchError> {
        let axis = Line::new((0.0, 0.0), direction_rad);
        let (low, high) = self.extent(|place| axis.aside(place));
        let lanes = ((high - low) / self.spacing_m - 1e-9).ceil().max(1.0);
        if lanes > LANES_MAX as f64 {
            return Err(SearchError::TooManyLanes { lanes: lanes as u64, most: LANES_MAX });
        }
        let pitch = (high - low) / lanes;
        let lane = |number: u32| {
            let aside = low + (f64::from(number) + 0.5) * pitch;
            let line = Line { at: (-axis.along.1 * aside, axis.along.0 * aside), along: axis.along };
            let needed = self.needed(self.target, &line, pitch / 2.0);
            line.sweeps(self.outlines, &needed, mover, &self.look)
        };
        Ok((0..lanes as u32).map(lane).collect())
    }

    /// From where to where along a line something is to be covered to its sides.
    pub(super) fn needed(&self, target: &[Ring], line: &Line, half_m: f64) -> Vec<Interval> {
        let (first, last) = extent(target, |place| line.along(place));
        if last <= first {
            return Vec::new();
        }
        let strip = swept::strip(line.place(first - 1.0), line.place(last + 1.0), half_m);
        let parts = grid::intersection_parts(target, &[strip]);
        let spans = parts.iter().map(|part| extent(part, |place| line.along(place))).collect();
        merged(spans, GAP_MAX * self.look.width_m)
    }

    /// The direction in which lanes are fewest; of those, the one in which they are shortest in sum.
    pub(super) fn best_direction(&self, space: &FreeSpace) -> Result<f64, SearchError> {
        let mut best: Option<(usize, f64, f64)> = None;
        let mut fault = SearchError::NothingSwept;
        for direction in self.directions() {
            let lanes = match self.of(Mover::OnTheSpot(space), direction) {
                Ok(lanes) => lanes,
                Err(error) => {
                    fault = error;
                    continue;
                }
            };
            let legs = lanes.iter().flatten();
            let length: f64 = legs.clone().map(|leg| leg.span.1 - leg.span.0).sum();
            let found = (legs.count(), length, direction);
            let better = |best: &(usize, f64, f64)| (found.0, found.1) < (best.0, best.1 * (1.0 - 1e-9));
            if found.0 > 0 && best.as_ref().is_none_or(better) {
                best = Some(found);
            }
        }
        best.map(|best| best.2).ok_or(fault)
    }

    /// The directions of the sides of the target's hull, and of its outlines, without the short ones where they are many.
    fn directions(&self) -> Vec<f64> {
        let rings: Vec<Vec<Point>> =
            self.target.iter().map(|ring| ring.iter().map(|&cell| grid::place(cell)).collect()).collect();
        let hull = hull(rings.iter().flatten().copied().collect());
        let mut sides = sides(&hull);
        sides.truncate(DIRECTIONS_MAX);
        let mut others: Vec<_> = rings.iter().flat_map(|ring| self::sides(ring)).collect();
        others.sort_by(|a, b| b.0.total_cmp(&a.0));
        sides.extend(others.into_iter().take(DIRECTIONS_MAX));
        let mut directions: Vec<f64> = sides.into_iter().map(|side| side.1).collect();
        directions.sort_by(f64::total_cmp);
        directions.dedup_by(|a, b| (*a - *b).abs() < 1e-6);
        directions
    }

    fn extent(&self, of: impl Fn(Point) -> f64) -> Interval {
        extent(self.target, of)
    }
}

/// The least and the most of a measure over all corners.
fn extent(rings: &[Ring], of: impl Fn(Point) -> f64) -> Interval {
    let all = rings.iter().flatten().map(|&cell| of(grid::place(cell)));
    all.fold((f64::INFINITY, f64::NEG_INFINITY), |found, at| (found.0.min(at), found.1.max(at)))
}

/// The length and direction of each side, the longest first; a direction and its opposite are one.
fn sides(ring: &[Point]) -> Vec<(f64, f64)> {
    let side = |(a, b): (&Point, &Point)| {
        let (x, y) = (b.0 - a.0, b.1 - a.1);
        (x.hypot(y), y.atan2(x).rem_euclid(PI))
    };
    let mut sides: Vec<_> = ring.iter().zip(ring.iter().cycle().skip(1)).map(side).collect();
    sides.sort_by(|a, b| b.0.total_cmp(&a.0));
    sides
}

/// The corners of the hull, anticlockwise.
fn hull(mut points: Vec<Point>) -> Vec<Point> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    points.dedup();
    let turn = |a: Point, b: Point, c: Point| (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0);
    let half = |points: &mut dyn Iterator<Item = Point>| {
        let mut chain: Vec<Point> = Vec::new();
        for point in points {
            while chain.len() > 1 && turn(chain[chain.len() - 2], chain[chain.len() - 1], point) <= 0.0 {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied());
    hull.extend(half(&mut points.iter().rev().copied()));
    hull
}
