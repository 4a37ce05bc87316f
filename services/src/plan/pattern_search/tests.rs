//! Against dense samples of the disc.

use super::*;
use crate::plan::free_space::instance::anybody;
use crate::plan::free_space::{FreeSpace, Zone, ZoneKind};
use crate::plan::turning::TurningSpace;

fn search(pattern: Pattern) -> PatternSearch {
    PatternSearch {
        pattern,
        center: (200.0, -300.0),
        extent_m: 1_000.0,
        look: Look { width_m: 120.0, ahead_m: 0.0 },
        overlap: 0.1,
        direction_rad: 0.3,
    }
}

const ALL: [Pattern; 3] = [Pattern::Spiral, Pattern::Sector, Pattern::Sweep];

/// Whether a place lies beside a line or arc, no farther than half a width.
fn is_swept(piece: &Piece, half_m: f64, place: Point) -> bool {
    match *piece {
        Piece::Line { from, to } => {
            let (side, at) = ((to.0 - from.0, to.1 - from.1), (place.0 - from.0, place.1 - from.1));
            let length = side.0.hypot(side.1);
            let along = (side.0 * at.0 + side.1 * at.1) / length;
            (0.0..=length).contains(&along) && (side.0 * at.1 - side.1 * at.0).abs() <= half_m * length
        }
        Piece::Arc { center, radius_m, from_rad, sweep_rad } => {
            let (x, y) = (place.0 - center.0, place.1 - center.1);
            let turned = (y.atan2(x) - from_rad) * sweep_rad.signum();
            (x.hypot(y) - radius_m).abs() <= half_m && turned.rem_euclid(2.0 * PI) <= sweep_rad.abs() + 1e-9
        }
    }
}

fn sampled(search: &PatternSearch, swept: &[Piece], is_free: impl Fn(Point) -> bool) -> f64 {
    let (mut free, mut found) = (0, 0);
    for x in -60..=60 {
        for y in -60..=60 {
            let off = (f64::from(x) / 60.0 * search.extent_m, f64::from(y) / 60.0 * search.extent_m);
            let place = (search.center.0 + off.0, search.center.1 + off.1);
            if off.0.hypot(off.1) < search.extent_m && is_free(place) {
                free += 1;
                found += usize::from(swept.iter().any(|piece| is_swept(piece, 60.0, place)));
            }
        }
    }
    found as f64 / f64::from(free)
}

#[test]
fn patterns_cover_all_around_the_place() {
    let space = FreeSpace::new(&[], &anybody()).unwrap();
    for pattern in ALL {
        let search = search(pattern);
        let plan = search.plan(Mover::OnTheSpot(&space), None).unwrap();
        let (told, found) = (plan.coverage.share(), sampled(&search, &plan.swept, |_| true));
        assert!(told >= 0.995 && found >= 0.995, "{pattern:?}: {told} told, {found} sampled");
        let swept: f64 = plan.swept.iter().map(Piece::length_m).sum();
        let least = PI * search.extent_m * search.extent_m / 120.0;
        // Sectors cross the middle each time, as they are meant to.
        let most = if pattern == Pattern::Sector { 2.5 } else { 1.4 };
        assert!(swept < most * least, "{pattern:?}: {swept} m, {least} m would do");
    }
}

#[test]
fn a_spiral_has_no_kinks_and_even_turns() {
    let spiral = search(Pattern::Spiral).pieces(50.0).unwrap();
    for pair in spiral.windows(2) {
        let (end, begin) = (pair[0].pose(1.0), pair[1].pose(0.0));
        assert!((end.at.0 - begin.at.0).hypot(end.at.1 - begin.at.1) < 1e-9, "{pair:?}");
        assert!((end.heading_rad - begin.heading_rad).sin().abs() < 1e-9, "{pair:?}");
        assert!((pair[1].length_m() - pair[0].length_m() - PI * 54.0).abs() < 1e-6);
    }
    assert!(spiral.iter().all(|piece| matches!(piece, Piece::Arc { radius_m, .. } if *radius_m >= 50.0)));
}

#[test]
fn zones_cut_patterns_and_turns_are_kept() {
    let keep_out = Boundary::Circle { center: (600.0, -100.0), radius_m: 250.0 };
    let zones = [Zone::new(1, ZoneKind::KeepOut, keep_out)];
    let space = TurningSpace::new(&zones, &anybody(), 90.0).unwrap();
    let outside = |at: Point| (at.0 - 600.0).hypot(at.1 + 100.0) > 250.0;
    for pattern in ALL {
        let search = search(pattern);
        let plan = search.plan(Mover::Turning(&space), None).unwrap();
        let found = sampled(&search, &plan.swept, outside);
        let told = plan.coverage.share();
        assert!(told > 0.93 && (told - found).abs() < 0.01, "{pattern:?}: {told} told, {found} sampled");
        for pair in plan.pieces.windows(2) {
            let (end, begin) = (pair[0].pose(1.0), pair[1].pose(0.0));
            assert!((end.at.0 - begin.at.0).hypot(end.at.1 - begin.at.1) < 1e-3, "{pair:?}");
            assert!((end.heading_rad - begin.heading_rad).sin().abs() < 1e-3, "{pair:?}");
        }
        for piece in &plan.pieces {
            assert!((0..=40).all(|at| outside(piece.place(f64::from(at) / 40.0))), "{pattern:?} {piece:?}");
        }
    }
}

#[test]
fn what_is_wrong_is_told() {
    let told = |search: PatternSearch| search.pieces(0.0).unwrap_err().to_string();
    let spiral = search(Pattern::Spiral);
    assert!(told(PatternSearch { extent_m: 0.0, ..spiral }).contains("extent of 0 m"));
    assert!(told(PatternSearch { extent_m: 1e9, ..spiral }).contains("too many"));
    assert!(told(PatternSearch { direction_rad: f64::NAN, ..spiral }).contains("direction"));
    assert!(
        told(PatternSearch { look: Look { width_m: -1.0, ahead_m: 0.0 }, ..spiral }).contains("look of -1")
    );
}
