//! The shortest ways between two poses with a bounded turn, without zones: Dubins' six words.

use crate::plan::free_space::Point;
use std::f64::consts::TAU;

/// Angles below this, in radians, are nothing, also just below a full turn.
const NOTHING_RAD: f64 = 1e-9;

/// A place and a heading, in radians from the first axis towards the second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// The place.
    pub at: Point,
    /// The heading.
    pub heading_rad: f64,
}

/// A line or an arc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Piece {
    /// A straight line.
    Line {
        /// Where it begins.
        from: Point,
        /// Where it ends.
        to: Point,
    },
    /// An arc.
    Arc {
        /// The middle of its circle.
        center: Point,
        /// The radius of its circle.
        radius_m: f64,
        /// The direction from the middle to where it begins.
        from_rad: f64,
        /// How far it goes around; positive from the first axis towards the second.
        sweep_rad: f64,
    },
}

impl Piece {
    /// The place at a share of it, from 0 to 1.
    pub fn place(&self, share: f64) -> Point {
        match *self {
            Self::Line { from, to } => (from.0 + (to.0 - from.0) * share, from.1 + (to.1 - from.1) * share),
            Self::Arc { center, radius_m, from_rad, sweep_rad } => {
                let (sine, cosine) = (from_rad + sweep_rad * share).sin_cos();
                (center.0 + radius_m * cosine, center.1 + radius_m * sine)
            }
        }
    }

    /// The place and the heading at a share of it.
    pub fn pose(&self, share: f64) -> Pose {
        let heading_rad = match *self {
            Self::Line { from, to } => (to.1 - from.1).atan2(to.0 - from.0),
            Self::Arc { from_rad, sweep_rad, .. } => {
                from_rad + sweep_rad * share + std::f64::consts::FRAC_PI_2.copysign(sweep_rad)
            }
        };
        Pose { at: self.place(share), heading_rad }
    }

    /// What lies between two shares of it.
    pub fn part(&self, first: f64, last: f64) -> Self {
        match *self {
            Self::Line { .. } => Self::Line { from: self.place(first), to: self.place(last) },
            Self::Arc { center, radius_m, from_rad, sweep_rad } => Self::Arc {
                center,
                radius_m,
                from_rad: from_rad + sweep_rad * first,
                sweep_rad: sweep_rad * (last - first),
            },
        }
    }

    /// The same, the other way.
    pub fn back(&self) -> Self {
        match *self {
            Self::Line { from, to } => Self::Line { from: to, to: from },
            Self::Arc { center, radius_m, from_rad, sweep_rad } => {
                Self::Arc { center, radius_m, from_rad: from_rad + sweep_rad, sweep_rad: -sweep_rad }
            }
        }
    }

    /// How long it is, in metres.
    pub fn length_m(&self) -> f64 {
        match *self {
            Self::Line { from, to } => (to.0 - from.0).hypot(to.1 - from.1),
            Self::Arc { radius_m, sweep_rad, .. } => radius_m * sweep_rad.abs(),
        }
    }
}

/// Up to three pieces from a pose to another.
#[derive(Debug, Clone, PartialEq)]
pub struct Word {
    /// The pieces.
    pub pieces: Vec<Piece>,
    /// How long they are, in metres.
    pub length_m: f64,
}

/// Left (1), right (-1) or straight (0), and how far in radians or radii.
type Step = (f64, f64);

/// All words that lead from a pose to another, in no order.
pub fn words(from: Pose, to: Pose, radius_m: f64) -> Vec<Word> {
    let found = candidates(from, to, radius_m).into_iter().flatten();
    found.filter_map(|steps| word(from, to, radius_m, steps)).collect()
}

/// The length of the shortest word; none where none leads there.
pub fn shortest_m(from: Pose, to: Pose, radius_m: f64) -> Option<f64> {
    let radii = |steps: &[Step; 3]| steps.iter().map(|step| step.1).sum::<f64>();
    let mut found: Vec<[Step; 3]> = candidates(from, to, radius_m).into_iter().flatten().collect();
    found.sort_by(|a, b| radii(a).total_cmp(&radii(b)));
    found.into_iter().find_map(|steps| Some(word(from, to, radius_m, steps)?.length_m))
}

/// The steps of all words, some of which may not lead there.
fn candidates(from: Pose, to: Pose, radius_m: f64) -> [Option<[Step; 3]>; 6] {
    let (x, y) = (to.at.0 - from.at.0, to.at.1 - from.at.1);
    let (distance, direction) = (x.hypot(y) / radius_m, y.atan2(x));
    let (a, b) = (from.heading_rad - direction, to.heading_rad - direction);
    [
        same_side(1.0, distance, a, b),
        same_side(-1.0, distance, a, b),
        change_side(1.0, distance, a, b),
        change_side(-1.0, distance, a, b),
        three_turns(1.0, distance, a, b),
        three_turns(-1.0, distance, a, b),
    ]
}

/// A turn from 0 to below a full one.
fn turn(angle: f64) -> f64 {
    let turn = angle.rem_euclid(TAU);
    if turn < NOTHING_RAD || TAU - turn < NOTHING_RAD { 0.0 } else { turn }
}

// A word that begins to the right is the mirror of one that begins to the left: with both headings mirrored.

fn same_side(side: f64, distance: f64, a: f64, b: f64) -> Option<[Step; 3]> {
    let (a, b) = (a * side, b * side);
    let (along, aside) = (distance + a.sin() - b.sin(), b.cos() - a.cos());
    let direction = aside.atan2(along);
    Some([(side, turn(direction - a)), (0.0, along.hypot(aside)), (side, turn(b - direction))])
}

fn change_side(side: f64, distance: f64, a: f64, b: f64) -> Option<[Step; 3]> {
    let (a, b) = (a * side, b * side);
    let (along, aside) = (distance + a.sin() + b.sin(), -a.cos() - b.cos());
    let square = along * along + aside * aside - 4.0;
    if square < 0.0 {
        return None;
    }
    let straight = square.sqrt();
    let direction = aside.atan2(along) + 2.0_f64.atan2(straight);
    Some([(side, turn(direction - a)), (0.0, straight), (-side, turn(direction - b))])
}

fn three_turns(side: f64, distance: f64, a: f64, b: f64) -> Option<[Step; 3]> {
    let (a, b) = (a * side, b * side);
    let (along, aside) = (distance + a.sin() - b.sin(), b.cos() - a.cos());
    let between = along.hypot(aside);
    if between > 4.0 {
        return None;
    }
    // The three circles' middles make an isosceles triangle; the middle turn is the long way around.
    let middle = TAU - 2.0 * (between / 4.0).asin();
    let first = turn(aside.atan2(along) - a + middle / 2.0);
    Some([(side, first), (-side, middle), (side, turn(b - a - first + middle))])
}

/// The pieces of a word, if they lead to the goal.
fn word(from: Pose, to: Pose, radius_m: f64, steps: [Step; 3]) -> Option<Word> {
    let (mut pose, mut pieces) = (from, Vec::with_capacity(3));
    for (side, amount) in steps.into_iter().filter(|step| step.1 > NOTHING_RAD) {
        let (sine, cosine) = pose.heading_rad.sin_cos();
        let piece = if side == 0.0 {
            let metres = amount * radius_m;
            Piece::Line { from: pose.at, to: (pose.at.0 + cosine * metres, pose.at.1 + sine * metres) }
        } else {
            let center = (pose.at.0 - sine * radius_m * side, pose.at.1 + cosine * radius_m * side);
            let from_rad = pose.heading_rad - side * std::f64::consts::FRAC_PI_2;
            Piece::Arc { center, radius_m, from_rad, sweep_rad: side * amount }
        };
        pose = Pose { at: piece.place(1.0), heading_rad: pose.heading_rad + side * amount };
        pieces.push(piece);
    }
    let missed = (pose.at.0 - to.at.0).hypot(pose.at.1 - to.at.1);
    let askew = turn(pose.heading_rad - to.heading_rad);
    let leads = missed < 1e-6 * (radius_m + 1.0) && askew.min(TAU - askew) < 1e-6;
    leads.then(|| Word { length_m: pieces.iter().map(Piece::length_m).sum(), pieces })
}
