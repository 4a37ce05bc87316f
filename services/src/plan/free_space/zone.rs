//! Zones, and for whom and when they hold.

use super::{Point, SpaceError};

/// What a zone means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ZoneKind {
    /// Vehicles stay within one of the zones of this kind, where there are any.
    KeepIn,
    /// Vehicles stay out.
    KeepOut,
    /// Vehicles of the surface stay within one of the zones of this kind, where there are any.
    Water,
}

/// The outline of a zone, in metres on the plane.
#[derive(Debug, Clone, PartialEq)]
pub enum Boundary {
    /// Corners in any direction; the outline closes by itself, and what it crosses itself around counts as inside.
    Polygon(Vec<Point>),
    /// A circle.
    Circle {
        /// Its middle.
        center: Point,
        /// Its radius.
        radius_m: f64,
    },
    /// A rectangle.
    Rectangle {
        /// Its middle.
        center: Point,
        /// Its extent along x before it is turned.
        width_m: f64,
        /// Its extent along y before it is turned.
        height_m: f64,
        /// How far it is turned from x towards y, in radians.
        rotation_rad: f64,
    },
}

/// A zone.
#[derive(Debug, Clone, PartialEq)]
pub struct Zone {
    /// Its id, for errors.
    pub id: i64,
    /// What it means.
    pub kind: ZoneKind,
    /// Its outline.
    pub boundary: Boundary,
    /// How far vehicles stay away from its outline, in metres.
    pub padding_m: f64,
    /// From which altitude to which it holds, in metres.
    pub altitude_m: (f64, f64),
    /// From when to when it holds, in milliseconds; an end of 0 is no end.
    pub time_ms: (i64, i64),
    /// The vehicles that it concerns; empty means all.
    pub affected: Vec<i64>,
}

impl Zone {
    /// A zone that holds always, everywhere and for all.
    pub fn new(id: i64, kind: ZoneKind, boundary: Boundary) -> Self {
        let altitude_m = (f64::NEG_INFINITY, f64::INFINITY);
        Self { id, kind, boundary, padding_m: 0.0, altitude_m, time_ms: (0, 0), affected: Vec::new() }
    }
}

/// Who plans, for where and when.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// The vehicle.
    pub vehicle: i64,
    /// Whether it is bound to water.
    pub on_water: bool,
    /// From which altitude to which it will be, in metres.
    pub altitude_m: (f64, f64),
    /// From when to when it will be under way, in milliseconds.
    pub time_ms: (i64, i64),
}

impl Conditions {
    /// Whether a zone is to be respected.
    pub(super) fn concern(&self, zone: &Zone) -> bool {
        let whom = zone.affected.is_empty() || zone.affected.contains(&self.vehicle);
        let high = zone.altitude_m.0 <= self.altitude_m.1 && self.altitude_m.0 <= zone.altitude_m.1;
        let (from, to) = zone.time_ms;
        let when = from <= self.time_ms.1 && (to == 0 || self.time_ms.0 <= to);
        let what = zone.kind != ZoneKind::Water || self.on_water;
        whom && high && when && what
    }
}

/// The sides of the polygon that stands for a circle: less than half a percent of the radius is lost.
const CIRCLE_SIDES: u32 = 36;

/// The corners of a zone. A circle's polygon lies around it where vehicles stay out, and within it where they stay in.
pub(super) fn corners(zone: &Zone) -> Result<Vec<Point>, SpaceError> {
    let wrong = |what: &str| Err(SpaceError::Zone { zone: zone.id, what: what.to_owned() });
    if !(zone.padding_m >= 0.0 && zone.padding_m.is_finite()) {
        return wrong("its padding is not a distance of 0 m or more");
    }
    let corners = match &zone.boundary {
        Boundary::Polygon(corners) => corners.clone(),
        Boundary::Circle { center, radius_m } => {
            let step = std::f64::consts::TAU / f64::from(CIRCLE_SIDES);
            let radius = match zone.kind {
                ZoneKind::KeepOut => radius_m / (step / 2.0).cos(),
                ZoneKind::KeepIn | ZoneKind::Water => *radius_m,
            };
            if radius.is_nan() || radius <= 0.0 {
                return wrong("its radius is not above 0 m");
            }
            let corner = |side: u32| {
                let (sine, cosine) = (f64::from(side) * step).sin_cos();
                (center.0 + radius * cosine, center.1 + radius * sine)
            };
            (0..CIRCLE_SIDES).map(corner).collect()
        }
        Boundary::Rectangle { center, width_m, height_m, rotation_rad } => {
            let (sine, cosine) = rotation_rad.sin_cos();
            let corner = |(x, y): (f64, f64)| {
                let (x, y) = (x * width_m / 2.0, y * height_m / 2.0);
                (center.0 + x * cosine - y * sine, center.1 + x * sine + y * cosine)
            };
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(corner).to_vec()
        }
    };
    if corners.len() < 3 {
        return wrong("its outline has less than three corners");
    }
    match corners.iter().all(|corner| super::grid::fits(*corner)) {
        true => Ok(corners),
        false => wrong("a corner is no place, or farther than 1 000 km from the origin of the plane"),
    }
}
