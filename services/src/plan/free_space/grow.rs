//! Room around outlines.

use super::Point;
use super::grid::{Cell, Ring, cell, place};

/// Corners that turn less than this keep their point; sharper ones are cut, the cut touching the circle around the corner.
const MITRE_MAX_RAD: f64 = 0.7;

/// Distances below this are not worth cutting corners, in metres.
const CUT_MIN_M: f64 = 0.1;

/// How many times a small distance sides must be long, …
const SIDE_MIN: f64 = 20.0;

/// … and how blunt corners, so that all of an outline can be moved at once: turns of up to 120°.
const BLUNT_MIN_COSINE: f64 = -0.5;

/// Pieces that together cover what lies within a distance of an outline, on its right side: outside of an anticlockwise
/// one. Never less.
pub(super) fn right_of(ring: &Ring, distance_m: f64) -> Vec<Ring> {
    let points: Vec<Point> = ring.iter().map(|&cell| place(cell)).collect();
    let count = points.len();
    let normal = |at: usize| {
        let (a, b) = (points[at], points[(at + 1) % count]);
        let (x, y) = (b.0 - a.0, b.1 - a.1);
        let length = x.hypot(y);
        (y / length * distance_m, -x / length * distance_m)
    };
    let mut pieces = Vec::new();
    for at in 0..count {
        let (a, b, out) = (points[at], points[(at + 1) % count], normal(at));
        pieces.push(vec![ring[at], cell(plus(a, out)), cell(plus(b, out)), ring[(at + 1) % count]]);
        let before = normal((at + count - 1) % count);
        pieces.extend(corner(ring[at], a, before, out, distance_m));
    }
    pieces
}

/// An outline moved by a small distance to its right (to its left where that is negative), every corner kept: for outlines
/// of sides that are long and corners that are blunt against the distance, else none.
pub(super) fn moved(ring: &Ring, distance_m: f64) -> Option<Ring> {
    if distance_m.abs() >= CUT_MIN_M {
        return None;
    }
    let points: Vec<Point> = ring.iter().map(|&cell| place(cell)).collect();
    let count = points.len();
    let normal = |at: usize| {
        let (a, b) = (points[at % count], points[(at + 1) % count]);
        let (x, y) = (b.0 - a.0, b.1 - a.1);
        let length = x.hypot(y);
        (length > SIDE_MIN * distance_m.abs()).then(|| (y / length, -x / length))
    };
    (0..count)
        .map(|at| {
            let (before, after) = (normal(at + count - 1)?, normal(at)?);
            let cosine = before.0 * after.0 + before.1 * after.1;
            let share = distance_m / (1.0 + cosine);
            let corner = points[at];
            let moved = (corner.0 + (before.0 + after.0) * share, corner.1 + (before.1 + after.1) * share);
            (cosine > BLUNT_MIN_COSINE).then(|| cell(moved))
        })
        .collect()
}

fn plus(a: Point, b: Point) -> Point {
    (a.0 + b.0, a.1 + b.1)
}

/// The piece around a corner between two sides, where they leave one open.
fn corner(cell_of: Cell, at: Point, before: Point, after: Point, distance_m: f64) -> Option<Ring> {
    let square = distance_m * distance_m;
    let (sine, cosine) = (
        (before.0 * after.1 - before.1 * after.0) / square,
        (before.0 * after.0 + before.1 * after.1) / square,
    );
    if sine <= 0.0 && cosine > -0.999_999 {
        return None;
    }
    let turn = sine.atan2(cosine).abs();
    let mut piece = vec![cell_of, cell(plus(at, before))];
    if turn < MITRE_MAX_RAD || distance_m < CUT_MIN_M && turn < 2.0 {
        let share = 1.0 / (1.0 + cosine);
        piece.push(cell((at.0 + (before.0 + after.0) * share, at.1 + (before.1 + after.1) * share)));
    } else {
        let beyond = (turn / 4.0).tan();
        // Along the first side, and back along the second: their directions are the normals turned left and right.
        piece.push(cell((at.0 + before.0 - before.1 * beyond, at.1 + before.1 + before.0 * beyond)));
        piece.push(cell((at.0 + after.0 + after.1 * beyond, at.1 + after.1 - after.0 * beyond)));
    }
    piece.push(cell(plus(at, after)));
    Some(piece)
}
