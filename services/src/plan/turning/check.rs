//! Whether a line or an arc stays in free space.

use super::Piece;
use crate::plan::free_space::FreeSpace;

/// The most that one slice of an arc goes around, in radians.
const SLICE_MAX_RAD: f64 = 0.15;

/// How much wider slices are than their arc, so that rounding never leaves a part of it out, in metres.
const WIDER_M: f64 = 1e-6;

/// Whether a piece stays in free space. Of an arc, a triangle around each slice must be free: the chord and the two tangents; so
/// a narrow escape counts as none, but nothing that is cut counts as free.
pub(in crate::plan) fn is_clear(space: &FreeSpace, piece: &Piece) -> bool {
    match *piece {
        Piece::Line { from, to } => space.sees(from, to),
        Piece::Arc { center, radius_m, sweep_rad, .. } => {
            let slices = (sweep_rad.abs() / SLICE_MAX_RAD).ceil().max(1.0);
            let step = sweep_rad / slices;
            let tip = (radius_m / (step / 2.0).cos() + WIDER_M) / radius_m;
            (0..slices as usize).all(|slice| {
                let share = |part: f64| (slice as f64 + part) / slices;
                let (from, to, middle) =
                    (piece.place(share(0.0)), piece.place(share(1.0)), piece.place(share(0.5)));
                let tip = (center.0 + (middle.0 - center.0) * tip, center.1 + (middle.1 - center.1) * tip);
                let sides = [(from, tip), (tip, to), (from, to)];
                sides.iter().all(|side| space.sees(side.0, side.1)) && !space.has_corner_in([from, tip, to])
            })
        }
    }
}

/// The places of a piece, for whoever checks by samples.
#[cfg(test)]
pub(super) fn samples(piece: &Piece, count: u32) -> impl Iterator<Item = (f64, f64)> {
    (0..=count).map(move |sample| piece.place(f64::from(sample) / f64::from(count)))
}
