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

/// A region of this side with zones in each other's way: in a ring that keeps a hole, in one with a gap, within each other, and
/// some of every form.
pub fn nested_map(random: &mut fastrand::Rng, zones: i64, side_m: f64) -> Vec<Zone> {
    let mut map = random_map(random, zones, side_m);
    let mut id = zones;
    let mut add = |boundary: Boundary, padding_m: f64| {
        id += 1;
        map.push(Zone { padding_m, ..Zone::new(id, ZoneKind::KeepOut, boundary) });
    };
    for walls in [4, 3] {
        let center = (random.f64() * side_m, random.f64() * side_m);
        let (half, turned) = (side_m * (0.08 + 0.08 * random.f64()), random.f64() * TAU);
        for wall in 0..walls {
            let rotation_rad = turned + f64::from(wall) * TAU / 4.0;
            let (sine, cosine) = rotation_rad.sin_cos();
            let center = (center.0 + sine * half, center.1 - cosine * half);
            let (width_m, height_m) = (2.2 * half, 0.2 * half);
            add(Boundary::Rectangle { center, width_m, height_m, rotation_rad }, random.f64() * 30.0);
        }
    }
    let center = (random.f64() * side_m, random.f64() * side_m);
    let radius_m = side_m * (0.04 + 0.06 * random.f64());
    add(Boundary::Circle { center, radius_m }, 0.0);
    add(polygon(center, 6, |_| radius_m * 0.6), 0.0);
    add(polygon((center.0 + radius_m, center.1), 5, |_| radius_m * 0.7), radius_m * 0.1);
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
