//! Made-up maps: for tests and measurements.

use super::{Boundary, Conditions, Point, Zone, ZoneKind};
use std::f64::consts::TAU;

/// Nobody in particular, now, at no height.
pub fn anybody() -> Conditions {
    Conditions { vehicle: 1, on_water: false, altitude_m: (0.0, 0.0), time_ms: (0, 0) }
}

/// A region of this side with zones of every form, overlapping, nested and turned, some with padding.
pub fn random_map(random: &mut fastrand::Rng, zones: i64, side_m: f64) -> Vec<Zone> {
    let mut map = vec![region(side_m)];
    for id in 1..=zones {
        let center = (random.f64() * side_m, random.f64() * side_m);
        let size = 200.0 + random.f64() * 1200.0;
        let corners = random.usize(3..9);
        let star = random.bool();
        let boundary = match random.u32(0..4) {
            0 => Boundary::Circle { center, radius_m: size * 0.7 },
            1 => Boundary::Rectangle {
                center,
                width_m: size,
                height_m: size / 3.0,
                rotation_rad: random.f64(),
            },
            _ => polygon(center, corners, |at| if star && at % 2 == 0 { size * 0.4 } else { size }),
        };
        let mut zone = Zone::new(id, ZoneKind::KeepOut, boundary);
        zone.padding_m = if random.bool() { 0.0 } else { random.f64() * 150.0 };
        map.push(zone);
    }
    map
}

/// A region with eight-cornered zones in rows, each a little out of place, so that some overlap.
pub fn archipelago(random: &mut fastrand::Rng, zones: usize) -> (Vec<Zone>, f64) {
    let (row, cell) = ((zones as f64).sqrt().ceil() as usize, 1000.0);
    let side_m = row as f64 * cell;
    let mut map = vec![region(side_m)];
    for at in 0..zones {
        let mut jitter = || (random.f64() - 0.5) * 0.2 * cell;
        let center =
            ((at % row) as f64 * cell + 500.0 + jitter(), (at / row) as f64 * cell + 500.0 + jitter());
        let radius = cell * (0.2 + 0.25 * random.f64());
        let boundary = polygon(center, 8, |_| radius);
        map.push(Zone::new(1 + at as i64, ZoneKind::KeepOut, boundary));
    }
    (map, side_m)
}

fn region(side_m: f64) -> Zone {
    let corners = vec![(0.0, 0.0), (side_m, 0.0), (side_m, side_m), (0.0, side_m)];
    Zone::new(0, ZoneKind::KeepIn, Boundary::Polygon(corners))
}

fn polygon(center: Point, corners: usize, radius: impl Fn(usize) -> f64) -> Boundary {
    let corner = |at: usize| {
        let (sine, cosine) = (at as f64 / corners as f64 * TAU).sin_cos();
        (center.0 + cosine * radius(at), center.1 + sine * radius(at))
    };
    Boundary::Polygon((0..corners).map(corner).collect())
}
