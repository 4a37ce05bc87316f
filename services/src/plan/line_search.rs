//! Search along a line: fly beside it so that the sensor looks at it.
//!
//! The line is simplified, its points are moved aside by the distance at which the sensor looks, and where looks would cross the
//! points between are merged. Axes are x to the north and y to the east, so a turn from x to y is to the right.

mod simplify;
#[cfg(test)]
mod tests;

pub use simplify::Detail;

use std::f64::consts::PI;

/// A point in metres, to the north and to the east.
pub type Point = (f64, f64);

/// Elevations nearer to the horizon, or to straight down, give no distance to stand off.
const ELEVATION_MARGIN_DEG: f64 = 1.0;

/// Looks shorter than this have no direction.
const LOOK_MIN_M: f64 = 1e-4;

/// How the line is looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineSearch {
    /// The angle from the direction of the line to the look, in radians; positive looks left, from the right of the line.
    pub azimuth_rad: f64,
    /// The elevation of the look, in radians; its sign does not matter.
    pub elevation_rad: f64,
    /// The height over the line, in metres.
    pub height_m: f64,
    /// How much of the line's detail the way keeps.
    pub detail: Detail,
}

/// Why there is no way.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LineSearchError {
    /// Less than two different points.
    #[error("the line has no length: it needs two different points")]
    NoLength,
    /// A number that is none.
    #[error("point {0} of the line is not a place")]
    NotAPlace(usize),
}

/// A way along a line.
#[derive(Debug, Clone, PartialEq)]
pub struct LineSearchPath {
    /// The simplified line.
    pub line: Vec<Point>,
    /// Where to fly.
    pub path: Vec<Point>,
    /// Where to look, at each point of the path.
    pub stares: Vec<Point>,
    /// The length of the path, in metres.
    pub length_m: f64,
}

impl LineSearch {
    /// The way along a line, from its first point to its last. For the other direction, reverse the line.
    ///
    /// # Errors
    /// What is wrong with the line.
    pub fn path(&self, line: &[Point]) -> Result<LineSearchPath, LineSearchError> {
        if let Some(at) = line.iter().position(|point| !(point.0.is_finite() && point.1.is_finite())) {
            return Err(LineSearchError::NotAPlace(at));
        }
        let mut line = line.to_vec();
        line.dedup();
        if line.len() < 2 {
            return Err(LineSearchError::NoLength);
        }
        let line = simplify::simplified(&line, self.detail);
        let mut path = self.beside(&line);
        uncross(&mut path, &line);
        let stares = stares(&path, &line);
        let length_m = length(&path);
        Ok(LineSearchPath { line, path, stares, length_m })
    }

    /// The points of a line moved aside.
    fn beside(&self, line: &[Point]) -> Vec<Point> {
        let elevation = self.elevation_rad.abs();
        let margin = ELEVATION_MARGIN_DEG.to_radians();
        let looks = elevation >= margin && elevation <= PI / 2.0 - margin;
        let distance = if looks { self.height_m / elevation.tan() } else { 0.0 };
        let last = line.len() - 1;
        let moved = |at: usize| {
            let (turn, distance) = if at == 0 || at == last {
                (PI - self.azimuth_rad, distance)
            } else {
                let turn = turn(direction(line[at - 1], line[at]), direction(line[at], line[at + 1]));
                ((PI + turn) / 2.0, distance * self.azimuth_rad.sin())
            };
            let ahead = direction(line[at.max(1) - 1], line[at.max(1)]);
            let (sine, cosine) = turn.sin_cos();
            let aside = (ahead.0 * cosine - ahead.1 * sine, ahead.0 * sine + ahead.1 * cosine);
            (line[at].0 + distance * aside.0, line[at].1 + distance * aside.1)
        };
        (0..=last).map(moved).collect()
    }
}

/// The direction from a point to another.
fn direction(from: Point, to: Point) -> Point {
    let distance = far(from, to);
    ((to.0 - from.0) / distance, (to.1 - from.1) / distance)
}

fn cross(a: Point, b: Point) -> f64 {
    a.0 * b.1 - a.1 * b.0
}

/// The signed angle from a direction to another.
fn turn(from: Point, to: Point) -> f64 {
    cross(from, to).atan2(from.0 * to.0 + from.1 * to.1)
}

fn far(a: Point, b: Point) -> f64 {
    (b.0 - a.0).hypot(b.1 - a.1)
}

/// The length of a line, in metres.
pub(crate) fn length(line: &[Point]) -> f64 {
    line.windows(2).map(|pair| far(pair[0], pair[1])).sum()
}

/// The points of a line that are the same share of the way along it as each point of a path along that.
fn stares(path: &[Point], line: &[Point]) -> Vec<Point> {
    let (whole, goal) = (length(path), length(line));
    let mut flown = 0.0;
    let mut former = path[0];
    let stare = |&point: &Point| {
        flown += far(former, point);
        former = point;
        along(line, if whole > 0.0 { goal * flown / whole } else { 0.0 })
    };
    path.iter().map(stare).collect()
}

/// The point so many metres along a line.
fn along(line: &[Point], mut metres: f64) -> Point {
    for pair in line.windows(2) {
        let distance = far(pair[0], pair[1]);
        if metres <= distance {
            let share = metres / distance;
            return (
                pair[0].0 + share * (pair[1].0 - pair[0].0),
                pair[0].1 + share * (pair[1].1 - pair[0].1),
            );
        }
        metres -= distance;
    }
    line[line.len() - 1]
}

/// Merges points of a path while the looks from two neighbours cross; of the last two, the pair before is merged, so that the
/// end stays.
fn uncross(path: &mut Vec<Point>, line: &[Point]) {
    while path.len() > 2 {
        let stares = stares(path, line);
        let crossing = |at: &usize| looks_cross((path[*at], stares[*at]), (path[at + 1], stares[at + 1]));
        let Some(found) = (0..path.len() - 1).find(crossing) else { return };
        let at = found.min(path.len() - 3);
        let middle = ((path[at].0 + path[at + 1].0) / 2.0, (path[at].1 + path[at + 1].1) / 2.0);
        path.splice(at..at + 2, [middle]);
    }
}

/// Whether two looks, each from a point to another, cross or lie on one line.
fn looks_cross(a: (Point, Point), b: (Point, Point)) -> bool {
    let of = |look: (Point, Point)| (look.1.0 - look.0.0, look.1.1 - look.0.1);
    let (along_a, along_b) = (of(a), of(b));
    let (length_a, length_b) = (along_a.0.hypot(along_a.1), along_b.0.hypot(along_b.1));
    if length_a < LOOK_MIN_M || length_b < LOOK_MIN_M {
        return false;
    }
    let between = (b.0.0 - a.0.0, b.0.1 - a.0.1);
    let parallel = cross(along_a, along_b);
    if parallel.abs() < 1e-9 * length_a * length_b {
        return cross(along_a, between).abs() < 1e-6 * length_a;
    }
    let (on_a, on_b) = (cross(between, along_b) / parallel, cross(between, along_a) / parallel);
    (0.0..=1.0).contains(&on_a) && (0.0..=1.0).contains(&on_b)
}
