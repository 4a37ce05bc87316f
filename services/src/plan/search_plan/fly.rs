//! From one piece of a search to the next.

use super::{Look, Mover};
use crate::plan::turning::{Piece, Pose, check};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Poses nearer than this, in metres and radians, are the same.
const SAME: f64 = 1e-6;

/// What is flown of a search.
pub(in crate::plan) struct Flown {
    /// What is swept, in order and direction.
    pub swept: Vec<Piece>,
    /// The whole way.
    pub pieces: Vec<Piece>,
    /// How many pieces no way leads to.
    pub left_out: usize,
}

/// Sweeps pieces one after the other, each backwards where no way leads to its beginning, and leaves out those to which none
/// leads at all.
pub(in crate::plan) fn fly(
    mover: Mover<'_>,
    look: &Look,
    start: Option<Pose>,
    swept: impl IntoIterator<Item = Piece>,
) -> Flown {
    let mut flown = Flown { swept: Vec::new(), pieces: Vec::new(), left_out: 0 };
    let mut at = start;
    for piece in swept {
        let found = [piece, piece.back()].into_iter().find_map(|piece| {
            let track = look.track(&piece);
            let way = match at {
                Some(at) if !is_same(at, track.pose(0.0)) => mover.way(at, track.pose(0.0)).ok()?,
                _ => Vec::new(),
            };
            Some((piece, track, way))
        });
        let Some((piece, track, way)) = found else {
            flown.left_out += 1;
            continue;
        };
        flown.swept.push(piece);
        flown.pieces.extend(way);
        flown.pieces.push(track);
        at = Some(track.pose(1.0));
    }
    flown
}

fn is_same(a: Pose, b: Pose) -> bool {
    let askew = (a.heading_rad - b.heading_rad + PI).rem_euclid(TAU) - PI;
    (a.at.0 - b.at.0).hypot(a.at.1 - b.at.1) < SAME && askew.abs() < SAME
}

/// Whether a vehicle can turn aside after a pose: by a quarter of a circle to one side.
pub(in crate::plan) fn turns_out(mover: Mover<'_>, pose: Pose) -> bool {
    let radius_m = mover.radius_m();
    if radius_m <= 0.0 {
        return true;
    }
    [1.0, -1.0].into_iter().any(|side| {
        let (sine, cosine) = pose.heading_rad.sin_cos();
        let center = (pose.at.0 - sine * radius_m * side, pose.at.1 + cosine * radius_m * side);
        let arc = Piece::Arc {
            center,
            radius_m,
            from_rad: pose.heading_rad - side * FRAC_PI_2,
            sweep_rad: side * FRAC_PI_2,
        };
        check::is_clear(mover.space(), &arc)
    })
}

/// The parts of a piece that the vehicle can sweep, found in steps of a length: clear of zones, and so that it can turn aside
/// before and after.
pub(in crate::plan) fn clear_parts(mover: Mover<'_>, look: &Look, piece: &Piece, step_m: f64) -> Vec<Piece> {
    let steps = (piece.length_m() / step_m).ceil().max(1.0) as usize;
    let share = |step: usize| step as f64 / steps as f64;
    let part = |first: usize, last: usize| piece.part(share(first), share(last));
    let is_clear = |first: usize, last: usize| {
        let part = part(first, last);
        let tracks = [look.track(&part), look.track(&part.back())];
        tracks.iter().all(|track| check::is_clear(mover.space(), track))
    };
    if is_clear(0, steps) {
        return vec![*piece];
    }
    let clear: Vec<bool> = (0..steps).map(|step| is_clear(step, step + 1)).collect();
    let mut parts = Vec::new();
    let mut step = 0;
    while step < steps {
        let first = step;
        while step < steps && clear[step] {
            step += 1;
        }
        let (mut begin, mut end) = (first, step);
        let out = |step: usize, forth: bool| {
            let pose = look.track(&part(step, steps)).pose(0.0);
            let turned = if forth { 0.0 } else { PI };
            turns_out(mover, Pose { heading_rad: pose.heading_rad + turned, ..pose })
        };
        while end > begin && end < steps && !out(end, true) {
            end -= 1;
        }
        while begin < end && begin > 0 && !out(begin, false) {
            begin += 1;
        }
        if begin < end {
            parts.push(part(begin, end));
        }
        step = step.max(first + 1);
    }
    parts
}
