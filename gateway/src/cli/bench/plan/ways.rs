//! Ways around zones: how good and how fast.

use super::super::statistics::{median, percentile, rounded};
use super::{failed, millis};
use crate::cli::exit::Failure;
use aldis_services::plan::free_space::instance::{anybody, archipelago, nested_map, random_map};
use aldis_services::plan::free_space::{FreeSpace, Point, RouteError, Zone};
use aldis_services::plan::turning::{Piece, Pose, TurningError, TurningSpace};
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// Zones that overlap, lie within each other and keep holes.
fn map(random: &mut fastrand::Rng, number: usize) -> Vec<Zone> {
    match number % 2 {
        0 => random_map(random, 14, 10_000.0),
        _ => nested_map(random, 6, 10_000.0),
    }
}

/// Free space around so many zones of eight corners: how long it takes to build, and to find ways in.
pub(super) fn space(zones: usize) -> Result<Value, Failure> {
    let mut random = fastrand::Rng::with_seed(zones as u64);
    let (map, side) = archipelago(&mut random, zones);
    let mut builds = Vec::new();
    let mut space = FreeSpace::new(&map, &anybody()).map_err(failed)?;
    for _ in 0..9 {
        let begin = Instant::now();
        space = FreeSpace::new(&map, &anybody()).map_err(failed)?;
        builds.push(millis(begin.elapsed()));
    }
    let (mut times, mut worst) = (Vec::new(), Duration::ZERO);
    while times.len() < 5_000 {
        let mut place = || (random.f64() * side, random.f64() * side);
        let (start, goal) = (place(), place());
        if space.contains(start) && space.contains(goal) {
            // The fastest of three: other programs interrupt for longer than a way takes.
            let once = || {
                let begin = Instant::now();
                let found = space.route(start, goal);
                (begin.elapsed(), found)
            };
            let (mut time, found) = once();
            (0..2).for_each(|_| time = time.min(once().0));
            if found.is_ok() || found == Err(RouteError::Disconnected) {
                times.push(time);
                worst = worst.max(time);
            }
        }
    }
    Ok(json!({
        "vertices": space.vertices(), "build_ms": rounded(median(&builds)),
        "build_least_ms": builds.iter().copied().fold(f64::INFINITY, f64::min), "query_p50_ms": millis(percentile(&mut times, 0.5)),
        "query_p99_ms": millis(percentile(&mut times, 0.99)), "query_max_ms": millis(worst),
    }))
}

/// Random ways on random maps, straight and with turns of 135.6 m: how many leave free space, by exact predicates and by samples.
pub(super) fn routes(count: usize) -> Value {
    let mut random = fastrand::Rng::with_seed(3);
    let (mut asked, mut straight, mut turning, mut narrow, mut violations) = (0, 0, 0, 0, 0);
    while asked < count {
        let map = map(&mut random, asked / 50);
        let Ok(turns) = TurningSpace::new(&map, &anybody(), 135.6) else { continue };
        let space = turns.space();
        // Samples of a line along a zone's border are beside it by rounding: they are held against the zones as they were given,
        // from which ways stay a hair away.
        let Ok(given) = FreeSpace::compat(&map) else { continue };
        for _ in 0..50 {
            let mut pose = || Pose {
                at: (random.f64() * 10_000.0, random.f64() * 10_000.0),
                heading_rad: random.f64() * std::f64::consts::TAU,
            };
            let (start, goal) = (pose(), pose());
            asked += 1;
            if let Ok(route) = space.route(start.at, goal.at) {
                straight += 1;
                violations += route.points.windows(2).filter(|pair| !space.sees(pair[0], pair[1])).count();
            }
            match turns.route(start, goal) {
                Ok(route) => {
                    turning += 1;
                    violations += route.pieces.iter().map(|piece| outside(&given, piece)).sum::<usize>();
                    let cuts =
                        |piece: &&Piece| matches!(**piece, Piece::Line { from, to } if !space.sees(from, to));
                    violations += route.pieces.iter().filter(cuts).count();
                }
                Err(TurningError::NarrowerThanTurn { .. }) => narrow += 1,
                Err(_) => {}
            }
        }
    }
    json!({
        "asked": asked, "straight": straight, "turning": turning, "narrower_than_turn": narrow, "violations": violations,
    })
}

/// How many samples of a piece, one each 2 m, lie outside of free space.
fn outside(space: &FreeSpace, piece: &Piece) -> usize {
    let samples = (piece.length_m() / 2.0).ceil().max(1.0);
    let places = (0..=samples as usize).map(|sample| piece.place(sample as f64 / samples));
    places.filter(|place| !space.contains(*place)).count()
}

/// Random ways without turns against the shortest over all corners that see each other, by exact predicates.
pub(super) fn optimum(count: usize) -> Value {
    let mut random = fastrand::Rng::with_seed(4);
    let (mut ways, mut differences, mut worst, mut number) = (0, 0, 0.0_f64, 0);
    while ways < count {
        number += 1;
        let mut zones = map(&mut random, number);
        zones.truncate(7);
        let Ok(space) = FreeSpace::new(&zones, &anybody()) else { continue };
        let corners: Vec<Point> = space.outlines().concat();
        let sees = |from: &Point| corners.iter().map(|to| space.sees(*from, *to)).collect::<Vec<_>>();
        let seen: Vec<Vec<bool>> = corners.iter().map(sees).collect();
        for _ in 0..50 {
            let mut place = || (random.f64() * 10_000.0, random.f64() * 10_000.0);
            let (start, goal) = (place(), place());
            if !(space.contains(start) && space.contains(goal)) {
                continue;
            }
            ways += 1;
            let best = shortest(&space, &corners, &seen, start, goal);
            match space.route(start, goal) {
                Ok(route) => worst = worst.max((route.length_m / best - 1.0).abs()),
                Err(_) => differences += usize::from(best.is_finite()),
            }
        }
    }
    json!({ "ways": ways, "differences": differences, "worst_share": worst })
}

/// The length of the shortest way over corners.
fn shortest(space: &FreeSpace, corners: &[Point], seen: &[Vec<bool>], start: Point, goal: Point) -> f64 {
    let far = |a: Point, b: Point| (b.0 - a.0).hypot(b.1 - a.1);
    let mut best = if space.sees(start, goal) { far(start, goal) } else { f64::INFINITY };
    let begin = |at: &Point| if space.sees(start, *at) { far(start, *at) } else { f64::INFINITY };
    let mut metres: Vec<f64> = corners.iter().map(begin).collect();
    let mut open: Vec<usize> = (0..corners.len()).collect();
    while let Some(next) = (0..open.len()).min_by(|&a, &b| metres[open[a]].total_cmp(&metres[open[b]])) {
        let at = open.swap_remove(next);
        if metres[at] >= best {
            break;
        }
        if space.sees(corners[at], goal) {
            best = best.min(metres[at] + far(corners[at], goal));
        }
        for &other in open.iter().filter(|other| seen[at][**other]) {
            metres[other] = metres[other].min(metres[at] + far(corners[at], corners[other]));
        }
    }
    best
}
