//! Ways of vehicles that turn no tighter than a radius, from a place and heading to another.
//!
//! A way of straight lines shows where to go; poses at its corners are joined by Dubins' words, each of which is
//! taken only if its lines and arcs stay in free space. So a way that is given never cuts a zone; where none is found, the
//! error says so.

pub(in crate::plan) mod check;
mod dubins;
mod escape;
#[cfg(test)]
mod tests;

pub use dubins::{Piece, Pose, Word, shortest_m, words};

use crate::plan::free_space::{Conditions, FreeSpace, Point, RouteError, SpaceError, Zone};

/// How far from zones corners are tried, in radii of the turn: first with room to swing, then without.
const ROOMS: [f64; 4] = [0.0, 0.25, 0.5, 1.0];

/// Free space for vehicles that turn no tighter than a radius.
#[derive(Debug, Clone)]
pub struct TurningSpace {
    space: FreeSpace,
    /// The same with ever more room along its border, as far as any is left.
    roomier: Vec<FreeSpace>,
    radius_m: f64,
}

/// A way with turns.
#[derive(Debug, Clone, PartialEq)]
pub struct TurningRoute {
    /// Its lines and arcs.
    pub pieces: Vec<Piece>,
    /// How long it is, in metres.
    pub length_m: f64,
}

/// Why there is no way.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TurningError {
    /// There is none even for who turns on the spot.
    #[error(transparent)]
    Route(#[from] RouteError),
    /// A radius that is none.
    #[error("a turn of {0} m radius is none: it must be above 0 m")]
    Radius(f64),
    /// A heading that is none.
    #[error("a heading of {0} is none")]
    Heading(f64),
    /// There is room for a way, but not for the turns.
    #[error(
        "a way of {straight_m:.0} m leads there, but no way with turns of {radius_m:.1} m was found that stays clear: \
         go slower, turn tighter, or change a heading"
    )]
    NarrowerThanTurn {
        /// The radius.
        radius_m: f64,
        /// The shortest way without turns.
        straight_m: f64,
    },
}

/// The radius of the turn of an aircraft at a speed and bank angle, without wind, in metres.
pub fn radius_of_bank(speed_m_per_s: f64, bank_rad: f64) -> f64 {
    speed_m_per_s * speed_m_per_s / (9.80665 * bank_rad.tan())
}

/// The radius of the turn of a vessel at a speed and yaw rate, in metres.
pub fn radius_of_yaw_rate(speed_m_per_s: f64, yaw_rate_rad_per_s: f64) -> f64 {
    speed_m_per_s / yaw_rate_rad_per_s
}

impl TurningSpace {
    /// The free space that zones leave under these conditions.
    ///
    /// # Errors
    /// A zone that is none, or that nothing is left.
    pub fn new(zones: &[Zone], conditions: &Conditions, radius_m: f64) -> Result<Self, SpaceError> {
        let space = FreeSpace::new(zones, conditions)?;
        let roomy = |room: &f64| {
            let mut zones = zones.to_vec();
            zones.iter_mut().for_each(|zone| zone.padding_m += room * radius_m);
            FreeSpace::new(&zones, conditions).ok()
        };
        let roomier = ROOMS[1..].iter().map_while(roomy).collect();
        Ok(Self { space, roomier, radius_m })
    }

    /// The radius of the tightest turn, in metres.
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// The free space without regard to turns.
    pub fn space(&self) -> &FreeSpace {
        &self.space
    }

    /// A way from a pose to another, as short as was found.
    ///
    /// # Errors
    /// Why there is none.
    pub fn route(&self, start: Pose, goal: Pose) -> Result<TurningRoute, TurningError> {
        if !(self.radius_m > 0.0 && self.radius_m.is_finite()) {
            return Err(TurningError::Radius(self.radius_m));
        }
        if let Some(pose) = [start, goal].iter().find(|pose| !pose.heading_rad.is_finite()) {
            return Err(TurningError::Heading(pose.heading_rad));
        }
        let straight = self.space.route(start.at, goal.at)?;
        let found = self.shortest(start, goal).or_else(|| self.aside(start, goal));
        let (radius_m, straight_m) = (self.radius_m, straight.length_m);
        found.ok_or(TurningError::NarrowerThanTurn { radius_m, straight_m })
    }

    /// The shortest of the ways along straight ones, with more or less room.
    fn shortest(&self, start: Pose, goal: Pose) -> Option<TurningRoute> {
        let mut best: Option<TurningRoute> = None;
        for space in std::iter::once(&self.space).chain(&self.roomier) {
            let points = space.route(start.at, goal.at).map(|route| route.points);
            let found = points.ok().and_then(|points| self.along(start, &points, goal));
            let shorter =
                |found: &TurningRoute| best.as_ref().is_none_or(|best| found.length_m < best.length_m);
            if let Some(found) = found.filter(shorter) {
                best = Some(found);
            }
        }
        best
    }

    /// The shortest way over some of these points' poses, in their order.
    fn along(&self, start: Pose, points: &[Point], goal: Pose) -> Option<TurningRoute> {
        let mut stages = vec![vec![start]];
        stages.extend(points.windows(3).map(|near| poses(near[0], near[1], near[2])));
        stages.push(vec![goal]);
        // The best way to each pose, from the last stage back: its length, and the word and pose that go on.
        let poses: Vec<(usize, Pose)> = stages
            .iter()
            .enumerate()
            .flat_map(|(stage, poses)| poses.iter().map(move |&pose| (stage, pose)))
            .collect();
        let last = poses.len() - 1;
        let mut best: Vec<Option<Onwards>> = vec![None; poses.len()];
        best[last] = Some((0.0, None));
        for at in (0..last).rev() {
            for next in at + 1..=last {
                let Some(rest) = best[next].as_ref().map(|(length, _)| *length) else { continue };
                if poses[next].0 == poses[at].0 {
                    continue;
                }
                let limit = best[at].as_ref().map_or(f64::INFINITY, |(length, _)| *length) - rest;
                if let Some(word) = self.clear_word(poses[at].1, poses[next].1, limit) {
                    best[at] = Some((word.length_m + rest, Some((word, next))));
                }
            }
        }
        let (length_m, mut step) = best[0].clone()?;
        let mut pieces = Vec::new();
        while let Some((word, next)) = step {
            pieces.extend(word.pieces);
            step = best[next].clone()?.1;
        }
        Some(TurningRoute { pieces, length_m })
    }

    /// The shortest word between two poses that stays clear and below a limit.
    fn clear_word(&self, from: Pose, to: Pose, limit_m: f64) -> Option<Word> {
        let mut all = words(from, to, self.radius_m);
        all.retain(|word| word.length_m < limit_m);
        all.sort_by(|a, b| a.length_m.total_cmp(&b.length_m));
        all.into_iter().find(|word| word.pieces.iter().all(|piece| check::is_clear(&self.space, piece)))
    }
}

/// How long it is from a pose to the goal, and how it goes on: by which word to which pose; none at the goal.
type Onwards = (f64, Option<(Word, usize)>);

/// The poses at a corner: as one comes, as one goes, and between.
fn poses(before: Point, at: Point, after: Point) -> Vec<Pose> {
    let heading = |from: Point, to: Point| (to.1 - from.1).atan2(to.0 - from.0);
    let (come, go) = (heading(before, at), heading(at, after));
    let turn = (go - come + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
    [0.5, 0.0, 1.0].map(|share| Pose { at, heading_rad: come + turn * share }).to_vec()
}
