//! Lanes over an area: as far apart as the sensor sees, long enough that it sees all.

use crate::uxas::ground::Point;
use aldis_envelope::lmcp::uxtask::SensorFootprint;

/// The share of a footprint's width by which lanes lie apart: neighbours overlap by the rest.
pub(super) const APART: f64 = 0.9;

/// The most lanes of an area.
const LANES_MAX: usize = 2000;

/// How an area is swept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sweep {
    /// The direction of the first lane, in degrees from north.
    pub heading_deg: f64,
    /// How far apart lanes are, in metres.
    pub spacing_m: f64,
    /// How far ahead the sensor's near and far edges see, in metres.
    pub sees_m: (f64, f64),
    /// Whether the first lane is the one to the left, seen along it.
    pub left_first: bool,
    /// Whether a lane is as long as its middle line within the area, as in the reference, or as its whole strip.
    pub middle_alone: bool,
}

impl Sweep {
    /// How a footprint sweeps.
    pub(super) fn of(footprint: &SensorFootprint, heading_deg: f64) -> Self {
        let sees_m = (
            f64::from(footprint.horizontal_to_trailing_edge),
            f64::from(footprint.horizontal_to_leading_edge),
        );
        let spacing_m = APART * f64::from(footprint.width_center);
        Self { heading_deg, spacing_m, sees_m, left_first: true, middle_alone: false }
    }

    /// The lanes over a polygon, in the order in which they are gone.
    ///
    /// # Errors
    /// Why there are none, in words.
    pub(super) fn lanes(&self, area: &[Point]) -> Result<Vec<(Point, Point)>, String> {
        if self.spacing_m.is_nan() || self.spacing_m <= 0.01 {
            return Err("Lane Spacing is Zero: no sensor covers any width of ground".to_owned());
        }
        let (sine, cosine) = self.heading_deg.to_radians().sin_cos();
        // Along the lanes, and across them to the right.
        let turned: Vec<Point> =
            area.iter().map(|p| (p.0 * cosine + p.1 * sine, -p.0 * sine + p.1 * cosine)).collect();
        let back = |p: Point| (p.0 * cosine - p.1 * sine, p.0 * sine + p.1 * cosine);
        let low = turned.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
        let high = turned.iter().map(|p| p.1).fold(f64::NEG_INFINITY, f64::max);
        let count = ((high - low) / self.spacing_m).ceil().max(1.0);
        if count.is_nan() || count > LANES_MAX as f64 {
            return Err(format!("the area takes more than {LANES_MAX} lanes of {:.3} m", self.spacing_m));
        }
        let first = if count <= 1.0 { (low + high) / 2.0 } else { low + self.spacing_m / 2.0 };
        let half = if self.middle_alone { 0.0 } else { self.spacing_m / 2.0 };
        let mut lanes = Vec::new();
        for at in 0..count as usize {
            let across = first + at as f64 * self.spacing_m;
            let across_in = across.min(high);
            let Some((near, far)) = extent(&turned, across_in - half, across_in + half) else { continue };
            lanes.push((across, near, far));
        }
        if !self.left_first {
            lanes.reverse();
        }
        let (behind, before) = self.sees_m;
        let lane = |(at, &(across, near, far)): (usize, &(f64, f64, f64))| match at % 2 {
            // The sensor looks ahead: the lane is left when its far edge is over the end.
            0 => (back((near - behind, across)), back(((far - before).max(near - behind + 1.0), across))),
            _ => (back((far + behind, across)), back(((near + before).min(far + behind - 1.0), across))),
        };
        let lanes: Vec<_> = lanes.iter().enumerate().map(lane).collect();
        if lanes.is_empty() { Err("the area has no extent".to_owned()) } else { Ok(lanes) }
    }
}

/// How far a polygon reaches along the first axis within a strip of the second.
fn extent(area: &[Point], low: f64, high: f64) -> Option<(f64, f64)> {
    let mut reach: Option<(f64, f64)> = None;
    let mut add = |x: f64| {
        let (near, far) = reach.unwrap_or((x, x));
        reach = Some((near.min(x), far.max(x)));
    };
    for (a, b) in area.iter().zip(area.iter().cycle().skip(1)) {
        for end in [low, high] {
            if (a.1 - end) * (b.1 - end) <= 0.0 && a.1 != b.1 {
                add(a.0 + (b.0 - a.0) * (end - a.1) / (b.1 - a.1));
            }
        }
        if (low..=high).contains(&a.1) {
            add(a.0);
        }
    }
    reach
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::sensor::{Footprint, Sensor, Swath};

    /// A footprint as the message has it, from what a sensor sees.
    fn message(footprint: &Footprint) -> SensorFootprint {
        SensorFootprint {
            horizontal_to_leading_edge: footprint.to_leading_edge_m as f32,
            horizontal_to_trailing_edge: footprint.to_trailing_edge_m as f32,
            horizontal_to_center: footprint.to_center_m as f32,
            width_center: footprint.width_center_m as f32,
            slant_range_to_center: footprint.slant_range_m as f32,
            achieved_gsd: footprint.ground_sample_distance_m as f32,
            ..SensorFootprint::default()
        }
    }

    /// The share of points of a polygon's box, inside it, that the sensor's strip passes.
    fn covered(area: &[Point], sweep: &Sweep) -> f64 {
        let lanes = sweep.lanes(area).unwrap();
        let inside = |p: Point| {
            let crossing = |(a, b): (&Point, &Point)| {
                (a.1 > p.1) != (b.1 > p.1) && p.0 < (b.0 - a.0) * (p.1 - a.1) / (b.1 - a.1) + a.0
            };
            area.iter().zip(area.iter().cycle().skip(1)).filter(|pair| crossing(*pair)).count() % 2 == 1
        };
        let sees = |p: Point| {
            lanes.iter().any(|&(from, to)| {
                let length = (to.0 - from.0).hypot(to.1 - from.1);
                let way = ((to.0 - from.0) / length, (to.1 - from.1) / length);
                let (dx, dy) = (p.0 - from.0, p.1 - from.1);
                let (along, across) = (dx * way.0 + dy * way.1, dx * way.1 - dy * way.0);
                let width = sweep.spacing_m / APART;
                across.abs() <= width / 2.0
                    && along >= sweep.sees_m.0 - 1e-6
                    && along <= length + sweep.sees_m.1 + 1e-6
            })
        };
        let points = (0..10_000).map(|i| (f64::from(i % 100) * 50.0 + 7.0, f64::from(i / 100) * 50.0 + 3.0));
        let within: Vec<_> = points.filter(|p| inside(*p)).collect();
        within.iter().filter(|p| sees(**p)).count() as f64 / within.len() as f64
    }

    #[test]
    fn all_of_an_area_is_seen_from_every_direction() {
        let area = [(100.0, 200.0), (4000.0, 900.0), (4500.0, 3000.0), (2500.0, 4700.0), (400.0, 3000.0)];
        let swath = message(&Swath { width_m: 300.0 }.footprint(1.0, -1.0).unwrap());
        for heading in [0.0, 22.5, 45.0, 137.0, 270.0] {
            let plain = Sweep::of(&swath, heading);
            for sweep in [plain, Sweep { sees_m: (116.0, 533.0), left_first: false, ..plain }] {
                let share = covered(&area, &sweep);
                assert!(share >= 0.995, "{share} at {heading}");
            }
        }
    }

    #[test]
    fn without_a_width_there_are_no_lanes() {
        let sweep = Sweep { spacing_m: 0.0, ..Sweep::of(&SensorFootprint::default(), 0.0) };
        assert!(sweep.lanes(&[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]).unwrap_err().contains("Spacing is Zero"));
    }
}
