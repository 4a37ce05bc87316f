//! Searches of areas: how much they cover.

use super::super::statistics::{median, rounded};
use super::{failed, millis};
use crate::cli::exit::Failure;
use aldis_services::plan::area_search::AreaSearch;
use aldis_services::plan::free_space::instance::{anybody, random_map};
use aldis_services::plan::free_space::{Boundary, FreeSpace, Point, Zone, ZoneKind};
use aldis_services::plan::pattern_search::{Pattern, PatternSearch};
use aldis_services::plan::search_plan::{Look, Mover, SearchPlan};
use aldis_services::plan::turning::{Piece, TurningSpace};
use serde_json::{Value, json};
use std::f64::consts::TAU;
use std::time::Instant;

/// How wide the sensor of all searches here looks, in metres.
const WIDTH_M: f64 = 200.0;

/// How many samples an area has along a side.
const SAMPLES: u32 = 200;

/// Convex and concave areas with zones in them, searched by vehicles that turn on the spot: how much is covered, as it is told and
/// by samples.
pub(super) fn areas(count: usize) -> Result<Value, Failure> {
    let look = Look { width_m: WIDTH_M, ahead_m: 0.0 };
    let search = AreaSearch { look, overlap: 0.1, direction_rad: None };
    let mut random = fastrand::Rng::with_seed(9);
    let (mut told, mut sampled, mut walls, mut lengths, mut turning) =
        (vec![], vec![], vec![], vec![], vec![]);
    for number in 0..count {
        let area = area(&mut random, number % 2 == 1);
        let map = random_map(&mut random, 5, 10_000.0);
        let Ok(space) = FreeSpace::new(&map, &anybody()) else { continue };
        let begin = Instant::now();
        let plan = search.plan(&area, Mover::OnTheSpot(&space), None).map_err(failed)?;
        walls.push(millis(begin.elapsed()));
        told.push(plan.coverage.share());
        // Over what can be reached; what zones cut off is told apart.
        if plan.coverage.cut_off_m2 < 1.0 {
            sampled.push(share_of_samples(&area, &space, &plan)?);
        }
        lengths.push(plan.length_m * WIDTH_M / plan.coverage.free_m2);
        if let Ok(space) = TurningSpace::new(&map, &anybody(), 60.0) {
            let plan = search.plan(&area, Mover::Turning(&space), None).map_err(failed)?;
            turning.push(plan.coverage.share());
        }
    }
    let least = |shares: &[f64]| shares.iter().copied().fold(f64::INFINITY, f64::min);
    Ok(json!({
        "areas": told.len(), "least_share": least(&told), "sampled_areas": sampled.len(), "sampled_least_share": least(&sampled),
        "median_ms": rounded(median(&walls)), "max_ms": walls.iter().copied().fold(0.0, f64::max),
        "median_length_over_ideal": rounded(median(&lengths)), "turning_60_m_median_share": median(&turning),
        "turning_60_m_least_share": least(&turning),
    }))
}

/// An area around the middle of a region of 10 km: its corners on a circle, or with every other drawn in.
fn area(random: &mut fastrand::Rng, is_concave: bool) -> Boundary {
    let corners = random.usize(4..10);
    let turned = random.f64() * TAU;
    let corner = |at: usize| {
        let drawn = if is_concave && at.is_multiple_of(2) { 0.5 } else { 1.0 };
        let (sine, cosine) = (turned + at as f64 / corners as f64 * TAU).sin_cos();
        (5_000.0 + cosine * 4_500.0 * drawn, 5_000.0 + sine * 3_500.0 * drawn)
    };
    Boundary::Polygon((0..corners).map(corner).collect())
}

/// The share of free samples in an area that lie beside a line that is swept.
fn share_of_samples(area: &Boundary, space: &FreeSpace, plan: &SearchPlan) -> Result<f64, Failure> {
    let within = Zone::new(1, ZoneKind::KeepIn, area.clone());
    let within = FreeSpace::compat(&[within]).map_err(failed)?;
    let (mut free, mut swept) = (0_u32, 0_u32);
    for at in 0..SAMPLES * SAMPLES {
        let place = |number: u32| (f64::from(number) + 0.4) * 10_000.0 / f64::from(SAMPLES);
        let place = (place(at % SAMPLES), place(at / SAMPLES));
        if within.contains(place) && space.contains(place) {
            free += 1;
            swept += u32::from(plan.swept.iter().any(|piece| is_beside(piece, place)));
        }
    }
    Ok(f64::from(swept) / f64::from(free))
}

fn is_beside(piece: &Piece, place: Point) -> bool {
    let (from, to) = (piece.place(0.0), piece.place(1.0));
    let (side, at) = ((to.0 - from.0, to.1 - from.1), (place.0 - from.0, place.1 - from.1));
    let length = side.0.hypot(side.1);
    let along = (side.0 * at.0 + side.1 * at.1) / length;
    (0.0..=length).contains(&along) && (side.0 * at.1 - side.1 * at.0).abs() <= WIDTH_M / 2.0 * length
}

/// The three patterns over 2 km around a place, by a vehicle with turns of 60 m.
pub(super) fn patterns() -> Result<Value, Failure> {
    let space = TurningSpace::new(&[], &anybody(), 60.0).map_err(failed)?;
    let mut told = serde_json::Map::new();
    for (name, pattern) in
        [("spiral", Pattern::Spiral), ("sector", Pattern::Sector), ("sweep", Pattern::Sweep)]
    {
        let look = Look { width_m: WIDTH_M, ahead_m: 0.0 };
        let (center, extent_m) = ((0.0, 0.0), 2_000.0);
        let search = PatternSearch { pattern, center, extent_m, look, overlap: 0.1, direction_rad: 0.0 };
        let plan = search.plan(Mover::Turning(&space), None).map_err(failed)?;
        let over = rounded(plan.length_m * WIDTH_M / plan.coverage.free_m2);
        told.insert(name.to_owned(), json!({ "share": plan.coverage.share(), "length_over_ideal": over }));
    }
    Ok(Value::Object(told))
}
