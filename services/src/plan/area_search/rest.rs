//! What lanes leave open: beside slanted borders, and before borders where the vehicle cannot turn.
//!
//! A place that its lane does not cover is within half a width of a border that blocks the lane, so a sweep along that border
//! covers it. Sweeps are taken by what they gain, the best first.

use super::lanes::Lanes;
use super::line::{Leg, Line};
use crate::plan::free_space::Point;
use crate::plan::free_space::grid::{self, Ring};
use crate::plan::search_plan::{Mover, swept};
use crate::plan::turning::Piece;
use std::collections::BinaryHeap;
use std::f64::consts::FRAC_PI_2;

/// Which share of the target may stay open.
const OPEN: f64 = 0.000_5;

/// Sweeps that gain less than this share of a square of the look's width are not worth a turn.
const GAIN_MIN: f64 = 0.002;

/// How many sweeps are added at most.
const LEGS_MAX: usize = 1_024;

/// How far from a border sweeps along it are, in metres.
const BESIDE_M: f64 = 0.02;

/// A line to sweep along, by what it may gain at most, in square metres.
struct Next(f64, usize);

impl PartialEq for Next {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Next {}

impl PartialOrd for Next {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Next {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0).then(other.1.cmp(&self.1))
    }
}

/// A connected part of what is open.
struct Open {
    rings: Vec<Ring>,
    low: Point,
    high: Point,
}

impl Open {
    fn new(rings: Vec<Ring>) -> Self {
        let places = || rings.iter().flatten().map(|&cell| grid::place(cell));
        let low = places().fold((f64::INFINITY, f64::INFINITY), |low, at| (low.0.min(at.0), low.1.min(at.1)));
        let high = places()
            .fold((f64::NEG_INFINITY, f64::NEG_INFINITY), |high, at| (high.0.max(at.0), high.1.max(at.1)));
        Self { rings, low, high }
    }

    fn middle(&self) -> Point {
        (f64::midpoint(self.low.0, self.high.0), f64::midpoint(self.low.1, self.high.1))
    }

    /// Whether it may lie within this distance of a line.
    fn is_near(&self, line: &Line, distance_m: f64) -> bool {
        let half = (self.high.0 - self.low.0).hypot(self.high.1 - self.low.1) / 2.0;
        line.aside(self.middle()).abs() <= distance_m + half
    }
}

/// Sweeps over what others leave open.
pub(super) fn legs(lanes: &Lanes<'_>, mover: Mover<'_>, direction_rad: f64, swept: &[Piece]) -> Vec<Leg> {
    let width = lanes.look.width_m;
    let covered: Vec<Ring> = swept.iter().flat_map(|piece| swept::outlines(piece, width)).collect();
    let enough = OPEN * grid::area_m2(lanes.target);
    let mut open: Vec<Open> =
        grid::difference_parts(lanes.target, &covered).into_iter().map(Open::new).collect();
    let mut left: f64 = open.iter().map(|open| grid::area_m2(&open.rings)).sum();
    if left <= enough {
        return Vec::new();
    }
    let lines = lines(lanes, mover, direction_rad, &open);
    let best = |line: &Line, open: &[Open]| best(lanes, mover, line, open);
    let mut next: BinaryHeap<Next> =
        (0..lines.len()).filter_map(|at| Some(Next(best(&lines[at], &open)?.0, at))).collect();
    let mut legs = Vec::new();
    while let Some(Next(_, at)) = next.pop().filter(|_| left > enough && legs.len() < LEGS_MAX) {
        // What a line gains only shrinks as others are taken, so an old gain is a bound.
        let Some((gain, leg)) = best(&lines[at], &open) else { continue };
        if next.peek().is_some_and(|other| other.0 > gain) {
            next.push(Next(gain, at));
            continue;
        }
        let outlines = swept::outlines(&leg.piece(), width);
        let (near, mut rest): (Vec<Open>, Vec<Open>) =
            open.into_iter().partition(|open| open.is_near(&lines[at], width / 2.0));
        for part in near {
            rest.extend(grid::difference_parts(&part.rings, &outlines).into_iter().map(Open::new));
        }
        open = rest;
        left = open.iter().map(|open| grid::area_m2(&open.rings)).sum();
        legs.push(leg);
        next.push(Next(gain, at));
    }
    legs
}

/// The sweep along a line that gains most, and how much.
fn best(lanes: &Lanes<'_>, mover: Mover<'_>, line: &Line, open: &[Open]) -> Option<(f64, Leg)> {
    let width = lanes.look.width_m;
    let near: Vec<Ring> = open
        .iter()
        .filter(|open| open.is_near(line, width / 2.0))
        .flat_map(|open| open.rings.clone())
        .collect();
    if near.is_empty() {
        return None;
    }
    let needed = lanes.needed(&near, line, width / 2.0);
    let legs = line.sweeps(lanes.outlines, &needed, mover, &lanes.look);
    let gain = |leg: Leg| {
        let found = grid::intersection(&near, &swept::outlines(&leg.piece(), width));
        (grid::area_m2(&found), leg)
    };
    let best = legs.into_iter().map(gain).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 > GAIN_MIN * width * width).then_some(best)
}

/// Lines along the borders near what is open, and through the middle of each open part.
fn lines(lanes: &Lanes<'_>, mover: Mover<'_>, direction_rad: f64, open: &[Open]) -> Vec<Line> {
    let width = lanes.look.width_m;
    // Where the vehicle cannot turn, or looks ahead, belts wider than a look stay open.
    let belts = ((mover.radius_m() + lanes.look.ahead_m.abs()) / lanes.spacing_m).ceil().min(8.0) as u32;
    let reach = width * (f64::from(belts) + 1.0);
    let mut lines = Vec::new();
    for ring in lanes.outlines {
        for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
            let is_near = |open: &Open| {
                a.0.min(b.0) < open.high.0 + reach
                    && a.0.max(b.0) > open.low.0 - reach
                    && a.1.min(b.1) < open.high.1 + reach
                    && a.1.max(b.1) > open.low.1 - reach
            };
            if !open.iter().any(is_near) {
                continue;
            }
            let border = Line::new(*a, (b.1 - a.1).atan2(b.0 - a.0));
            lines.extend((0..=belts).map(|belt| {
                let aside = BESIDE_M + f64::from(belt) * lanes.spacing_m;
                let at = (a.0 - border.along.1 * aside, a.1 + border.along.0 * aside);
                Line { at, along: border.along }
            }));
        }
    }
    for open in open {
        lines.extend([0.0, FRAC_PI_2].map(|turn| Line::new(open.middle(), direction_rad + turn)));
    }
    lines
}
