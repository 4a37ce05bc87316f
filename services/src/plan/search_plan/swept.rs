//! What is swept along a line or an arc, as outlines. Never more than is.

use crate::plan::free_space::Point;
use crate::plan::free_space::grid::{Ring, anticlockwise, cell};
use crate::plan::turning::Piece;

/// The most that one outline of an arc goes around, in radians.
const SLICE_MAX_RAD: f64 = 0.1;

/// What a look of this width covers along a piece: anticlockwise outlines.
pub(in crate::plan) fn outlines(piece: &Piece, width_m: f64) -> Vec<Ring> {
    let half = width_m / 2.0;
    match *piece {
        Piece::Line { from, to } => vec![strip(from, to, half)],
        Piece::Arc { center, radius_m, sweep_rad, .. } => {
            let slices = (sweep_rad.abs() / SLICE_MAX_RAD).ceil().max(1.0) as usize;
            let bulge = 1.0 / (sweep_rad / slices as f64 / 2.0).cos();
            // Chords lie within the outer circle; tangents of the inner circle lie outside of it.
            let inner = if radius_m > half { (radius_m - half) * bulge / radius_m } else { 0.0 };
            let outer = (radius_m + half) / radius_m;
            let at = |share: f64, scale: f64| {
                let place = piece.place(share);
                (center.0 + (place.0 - center.0) * scale, center.1 + (place.1 - center.1) * scale)
            };
            let slice = |number: usize| {
                let (first, last) = (number as f64 / slices as f64, (number + 1) as f64 / slices as f64);
                let corners = [at(first, inner), at(first, outer), at(last, outer), at(last, inner)];
                anticlockwise(corners.map(cell).to_vec())
            };
            (0..slices).map(slice).collect()
        }
    }
}

/// The strip to both sides of a line.
pub(in crate::plan) fn strip(from: Point, to: Point, half_m: f64) -> Ring {
    let (x, y) = (to.0 - from.0, to.1 - from.1);
    let length = x.hypot(y);
    let left = (-y / length * half_m, x / length * half_m);
    let corners = [
        (from.0 - left.0, from.1 - left.1),
        (to.0 - left.0, to.1 - left.1),
        (to.0 + left.0, to.1 + left.1),
        (from.0 + left.0, from.1 + left.1),
    ];
    anticlockwise(corners.map(cell).to_vec())
}
