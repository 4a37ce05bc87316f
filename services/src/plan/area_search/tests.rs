//! Against dense samples of areas, by plain geometry that shares nothing with the outlines.

use super::*;
use crate::plan::free_space::instance::{anybody, random_map};
use crate::plan::free_space::{FreeSpace, Point, Zone, ZoneKind};
use crate::plan::search_plan::SearchError;
use crate::plan::turning::TurningSpace;

fn search(width_m: f64) -> AreaSearch {
    AreaSearch { look: Look { width_m, ahead_m: 0.0 }, overlap: 0.1, direction_rad: None }
}

fn box_of((x, y): Point, (width, height): Point) -> Boundary {
    Boundary::Polygon(vec![(x, y), (x + width, y), (x + width, y + height), (x, y + height)])
}

/// How far a place is inside an outline; below 0 outside.
fn depth(boundary: &Boundary, place: Point) -> f64 {
    let corners = match boundary {
        Boundary::Circle { center, radius_m } => {
            return radius_m - (place.0 - center.0).hypot(place.1 - center.1);
        }
        Boundary::Polygon(corners) => corners.clone(),
        Boundary::Rectangle { center, width_m, height_m, rotation_rad } => {
            let (sine, cosine) = rotation_rad.sin_cos();
            let (x, y) = (place.0 - center.0, place.1 - center.1);
            let (along, across) = (x * cosine + y * sine, y * cosine - x * sine);
            return (width_m / 2.0 - along.abs()).min(height_m / 2.0 - across.abs());
        }
    };
    let (mut inside, mut near) = (false, f64::INFINITY);
    for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        let (side, to) = ((b.0 - a.0, b.1 - a.1), (place.0 - a.0, place.1 - a.1));
        let share = ((side.0 * to.0 + side.1 * to.1) / (side.0 * side.0 + side.1 * side.1)).clamp(0.0, 1.0);
        near = near.min((to.0 - side.0 * share).hypot(to.1 - side.1 * share));
        if (a.1 <= place.1) != (b.1 <= place.1) {
            inside ^= to.0 < side.0 * to.1 / side.1;
        }
    }
    if inside { near } else { -near }
}

fn is_swept(swept: &[Piece], width_m: f64, place: Point) -> bool {
    swept.iter().any(|piece| {
        let Piece::Line { from, to } = *piece else { panic!("lanes are straight: {piece:?}") };
        let (side, at) = ((to.0 - from.0, to.1 - from.1), (place.0 - from.0, place.1 - from.1));
        let length = side.0.hypot(side.1);
        let along = (side.0 * at.0 + side.1 * at.1) / length;
        let aside = (side.0 * at.1 - side.1 * at.0) / length;
        (0.0..=length).contains(&along) && aside.abs() <= width_m / 2.0
    })
}

/// The share of samples of the free area that is swept.
fn sampled(area: &Boundary, zones: &[Zone], plan: &SearchPlan, width_m: f64, side_m: f64) -> f64 {
    let (mut free, mut swept) = (0, 0);
    for x in 0..100 {
        for y in 0..100 {
            let place = ((f64::from(x) + 0.37) / 100.0 * side_m, (f64::from(y) + 0.61) / 100.0 * side_m);
            let is_out = |zone: &Zone| match zone.kind {
                ZoneKind::KeepOut => depth(&zone.boundary, place) < -zone.padding_m,
                _ => depth(&zone.boundary, place) > zone.padding_m,
            };
            if depth(area, place) > 0.0 && zones.iter().all(is_out) {
                free += 1;
                swept += usize::from(is_swept(&plan.swept, width_m, place));
            }
        }
    }
    assert!(free > 500, "{free} samples");
    swept as f64 / f64::from(free)
}

/// The way has no gaps and stays in free space.
fn is_flown(plan: &SearchPlan, space: &FreeSpace) {
    for pair in plan.pieces.windows(2) {
        let (end, begin) = (pair[0].place(1.0), pair[1].place(0.0));
        assert!((end.0 - begin.0).hypot(end.1 - begin.1) < 1e-3, "a gap between {pair:?}");
    }
    for piece in &plan.pieces {
        for sample in 0..=20 {
            let place = piece.place(f64::from(sample) / 20.0);
            let near = [(0.0, 0.0), (1e-3, 0.0), (-1e-3, 0.0), (0.0, 1e-3), (0.0, -1e-3)];
            let is_free = near.iter().any(|off| space.contains((place.0 + off.0, place.1 + off.1)));
            assert!(is_free, "{place:?} of {piece:?}");
        }
    }
}

/// An L, and a comb with two gaps.
fn concave() -> [Boundary; 2] {
    let ell = [(500., 500.), (5500., 500.), (5500., 2200.), (2600., 2600.), (2400., 5500.), (500., 5500.)];
    let comb = [
        (400., 400.),
        (5600., 400.),
        (5600., 5000.),
        (4300., 5200.),
        (4200., 1500.),
        (3600., 1500.),
        (3500., 5400.),
        (2500., 5400.),
        (2400., 1600.),
        (1700., 1600.),
        (1600., 5000.),
        (400., 5000.),
    ];
    [Boundary::Polygon(ell.to_vec()), Boundary::Polygon(comb.to_vec())]
}

#[test]
fn convex_and_concave_areas_with_zones_are_covered() {
    let mut random = fastrand::Rng::with_seed(4);
    let convex = [(500., 900.), (4200., 300.), (5700., 2600.), (4500., 5400.), (1500., 5600.), (300., 3800.)];
    let mut areas = vec![
        Boundary::Polygon(convex.to_vec()),
        Boundary::Circle { center: (3000., 3000.), radius_m: 2500.0 },
        Boundary::Rectangle { center: (3000., 3000.), width_m: 4000., height_m: 2500., rotation_rad: 0.4 },
    ];
    areas.extend(concave());
    for (number, area) in areas.iter().enumerate() {
        let zones = random_map(&mut random, 4, 6_000.0);
        let space = FreeSpace::new(&zones, &anybody()).unwrap();
        let plan = search(180.0).plan(area, Mover::OnTheSpot(&space), None).unwrap();
        is_flown(&plan, &space);
        let (told, found) = (plan.coverage.share(), sampled(area, &zones, &plan, 180.0, 6_000.0));
        assert!(told >= 0.995 && found >= 0.995, "area {number}: {told} told, {found} sampled");
        let lanes: f64 = plan.swept.iter().map(Piece::length_m).sum();
        let least = plan.coverage.free_m2 / 180.0;
        assert!(lanes < 1.6 * least, "area {number}: {lanes} m of lanes where {least} m would do");
        assert!(plan.length_m < 2.2 * lanes, "area {number}: {} m for {lanes} m", plan.length_m);
    }
}

#[test]
fn convex_areas_take_no_more_lanes_than_they_are_wide() {
    let space = FreeSpace::new(&[], &anybody()).unwrap();
    let mut random = fastrand::Rng::with_seed(8);
    for _ in 0..8 {
        let center = (random.f64() * 1000.0, random.f64() * 1000.0);
        let mut angles: Vec<f64> = (0..7).map(|_| random.f64() * std::f64::consts::TAU).collect();
        angles.sort_by(f64::total_cmp);
        let corners: Vec<Point> = angles
            .iter()
            .map(|angle| (center.0 + 3000.0 * angle.cos(), center.1 + 1200.0 * angle.sin()))
            .collect();
        // The least width over directions in small steps: never less than the true one.
        let width = |direction: f64| {
            let aside = corners.iter().map(|at| at.1 * direction.cos() - at.0 * direction.sin());
            let (low, high) =
                aside.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)));
            high - low
        };
        let least = (0..4_000).map(|step| width(f64::from(step) * 8e-4)).fold(f64::INFINITY, f64::min);
        let plan = search(100.0).plan(&Boundary::Polygon(corners), Mover::OnTheSpot(&space), None).unwrap();
        assert!(plan.swept.len() as f64 <= (least / 90.0).ceil(), "{} lanes, {least} m", plan.swept.len());
        assert!(plan.coverage.share() > 0.9999, "{:?}", plan.coverage);
    }
}

#[test]
fn vehicles_that_turn_wide_are_led_clear_of_zones() {
    let area = box_of((1000., 1000.), (4000., 3000.));
    let zones = [
        Zone::new(1, ZoneKind::KeepOut, Boundary::Circle { center: (2500., 2500.), radius_m: 500.0 }),
        Zone::new(2, ZoneKind::KeepOut, box_of((3800., 900.), (400., 1500.))),
    ];
    let space = TurningSpace::new(&zones, &anybody(), 120.0).unwrap();
    let start = Pose { at: (0.0, 0.0), heading_rad: 0.7 };
    for ahead_m in [0.0, 60.0] {
        let mut search = search(200.0);
        search.look.ahead_m = ahead_m;
        let plan = search.plan(&area, Mover::Turning(&space), Some(start)).unwrap();
        is_flown(&plan, space.space());
        let begin = plan.pieces[0].place(0.0);
        assert!(begin.0.hypot(begin.1) < 1e-6, "{begin:?}");
        let (told, found) = (plan.coverage.share(), sampled(&area, &zones, &plan, 200.0, 6_000.0));
        assert!(
            told >= 0.995 && (told - found).abs() < 0.003,
            "{ahead_m} m: {told} told, {found} sampled, {} left out",
            plan.left_out
        );
        for pair in plan.pieces.windows(2) {
            let askew = pair[0].pose(1.0).heading_rad - pair[1].pose(0.0).heading_rad;
            assert!(askew.sin().abs() < 1e-3 && askew.cos() > 0.0, "a kink between {pair:?}");
        }
    }
}

#[test]
fn areas_between_slanted_zones_are_found() {
    let mut random = fastrand::Rng::with_seed(3);
    for _ in 0..24 {
        let mut place = || (random.f64() * 900.0, random.f64() * 900.0);
        let area = Boundary::Polygon(vec![place(), place(), place()]);
        let zones = [Zone::new(1, ZoneKind::KeepIn, Boundary::Polygon(vec![place(), place(), place()]))];
        let Ok(space) = FreeSpace::new(&zones, &anybody()) else { continue };
        let corners = |boundary: &Boundary| match boundary {
            Boundary::Polygon(corners) => corners.clone(),
            _ => Vec::new(),
        };
        let (a, b) = (corners(&area), corners(&zones[0].boundary));
        let middle = |corners: &[Point]| {
            let sum = corners.iter().fold((0.0, 0.0), |sum, at| (sum.0 + at.0, sum.1 + at.1));
            (sum.0 / 3.0, sum.1 / 3.0)
        };
        let found = search(40.0).plan(&area, Mover::OnTheSpot(&space), None);
        // The middle of one triangle well within the other: they share an area.
        if depth(&area, middle(&b)) > 30.0 || depth(&zones[0].boundary, middle(&a)) > 30.0 {
            assert!(found.unwrap().coverage.share() > 0.9);
        } else if let Err(error) = found {
            assert!(matches!(error, SearchError::NothingFree | SearchError::NothingSwept), "{error}");
        }
    }
}

#[test]
fn what_is_cut_off_or_wrong_is_told() {
    let area = box_of((0., 0.), (1000., 500.));
    let region = Zone::new(1, ZoneKind::KeepIn, box_of((-100., -100.), (1200., 700.)));
    let wall = Zone::new(2, ZoneKind::KeepOut, box_of((700., -200.), (50., 900.)));
    let space = FreeSpace::new(&[region.clone(), wall], &anybody()).unwrap();
    let start = |at: Point| Some(Pose { at, heading_rad: 0.0 });
    let plan = search(50.0).plan(&area, Mover::OnTheSpot(&space), start((800., 100.))).unwrap();
    let coverage = plan.coverage;
    assert!((coverage.free_m2 - 125_000.0).abs() < 10.0, "{coverage:?}");
    assert!((coverage.cut_off_m2 - 350_000.0).abs() < 10.0 && coverage.share() > 0.999, "{coverage:?}");
    assert!((coverage.asked_m2 - 500_000.0).abs() < 1.0, "{coverage:?}");
    let of = |search: AreaSearch, area: &Boundary, at| search.plan(area, Mover::OnTheSpot(&space), start(at));
    let told = |search, area: &Boundary, at| of(search, area, at).unwrap_err().to_string();
    assert!(told(search(50.0), &area, (710., 0.)).contains("start lies in keep-out zone 2"));
    assert!(told(search(0.0), &area, (0., 0.)).contains("a look of 0 m"));
    assert!(told(search(1e-4), &area, (0., 0.)).contains("lanes are too many"));
    assert!(told(AreaSearch { overlap: 1.0, ..search(9.0) }, &area, (0., 0.)).contains("overlap of 1"));
    assert_eq!(of(search(9.0), &box_of((9e3, 0.), (5., 5.)), (0., 0.)), Err(SearchError::NothingFree));
    let line = Boundary::Polygon(vec![(0., 0.), (5., 5.), (9., 9.)]);
    assert!(told(search(9.0), &line, (0., 0.)).contains("the area to search"));
}
