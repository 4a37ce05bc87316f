//! `aldis bench plan`: how good and how fast plans are.

use super::super::exit::Failure;
use super::super::print_line;
use super::statistics::{median, percentile, rounded};
use aldis_services::plan::assignment::instance::{Related, line_searches, random_request};
use aldis_services::plan::assignment::{
    AssignError, Effort, Objective, Request, assign, evaluate, exhaustive,
};
use aldis_services::plan::free_space::instance::{anybody, archipelago, random_map};
use aldis_services::plan::free_space::{FreeSpace, RouteError};
use aldis_services::plan::turning::{Piece, Pose, TurningError, TurningSpace};
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// How good and how fast plans are, all from seeds.
///
/// Assignments are compared with every plan there is; large ones are checked by an evaluator that knows nothing of the search.
/// Ways are checked by exact predicates. Times are of this machine.
#[derive(clap::Args)]
pub(super) struct PlanBench {
    /// Random assignments that are compared with every plan there is.
    #[arg(long, default_value_t = 1_000)]
    instances: u64,
    /// Random ways.
    #[arg(long, default_value_t = 10_000)]
    routes: usize,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

impl PlanBench {
    pub(super) fn run(self) -> Result<(), Failure> {
        let told = json!({
            "exhaustive": exhaustively(self.instances)?,
            "tables_12_tasks_4_vehicles": tables()?,
            "lines_127_on_2_vehicles": lines(2, 127)?,
            "lines_64_on_4_vehicles": lines(4, 64)?,
            "free_space_800": space(100)?,
            "free_space_3000": space(375)?,
            "routes": routes(self.routes),
        });
        if self.json {
            print_line(told);
        } else {
            print_line(format_args!("{told:#}"));
        }
        Ok(())
    }
}

fn millis(time: Duration) -> f64 {
    rounded(time.as_secs_f64() * 1e3)
}

fn failed(why: impl std::fmt::Display) -> Failure {
    Failure::Failed(why.to_string())
}

/// Random requests of up to 8 tasks against every plan.
fn exhaustively(instances: u64) -> Result<Value, Failure> {
    let (mut differences, mut unproven, mut infeasible) = (0, 0, 0);
    for seed in 0..instances {
        let objective = [Objective::MinMax, Objective::Cumulative][seed as usize % 2];
        let request = if seed % 4 == 3 {
            random_request(seed, 1 + seed as i64 % 3, 1 + seed as i64 % 6, 3, Related::General, objective)
        } else {
            random_request(seed, 1 + seed as i64 % 3, 1 + seed as i64 % 8, 2, Related::Parallel, objective)
        };
        let best = exhaustive(&request).map_err(failed)?;
        match (assign(&request, Effort::default()), best) {
            (Ok(plan), Some(best)) => {
                unproven += u64::from(!plan.certificate.proven);
                let checked = evaluate(&request, &plan.assignments).map_err(failed)?;
                let same = (checked.makespan_ms, checked.total_ms) == best;
                differences += u64::from(!same || (plan.makespan_ms, plan.total_ms) != best);
            }
            (Err(AssignError::Infeasible(_)), None) => infeasible += 1,
            _ => differences += 1,
        }
    }
    Ok(json!({
        "instances": instances, "differences": differences, "unproven": unproven, "infeasible": infeasible,
    }))
}

/// One request: the plan's certificate, checked, and how long it took.
fn timed(request: &Request) -> Result<(Value, f64), Failure> {
    let begin = Instant::now();
    let plan = assign(request, Effort::default()).map_err(failed)?;
    let wall_ms = millis(begin.elapsed());
    let checked = evaluate(request, &plan.assignments).map_err(failed)?;
    let certificate = plan.certificate;
    let told = json!({
        "makespan_ms": plan.makespan_ms, "proven": certificate.proven, "gap": rounded(certificate.gap), "nodes": certificate.nodes,
        "evaluated": checked.makespan_ms == plan.makespan_ms, "wall_ms": wall_ms,
    });
    Ok((told, wall_ms))
}

fn tables() -> Result<Value, Failure> {
    let mut walls = Vec::new();
    let mut proven = true;
    for seed in 0..20 {
        let request = random_request(seed, 4, 12, 2, Related::Parallel, Objective::MinMax);
        let mut fastest = f64::INFINITY;
        for _ in 0..3 {
            let (told, wall_ms) = timed(&request)?;
            proven &= told["proven"] == true;
            fastest = fastest.min(wall_ms);
        }
        walls.push(fastest);
    }
    let worst = walls.iter().copied().fold(0.0, f64::max);
    Ok(json!({ "instances": 20, "proven": proven, "median_ms": rounded(median(&walls)), "max_ms": worst }))
}

fn lines(vehicles: i64, lines: i64) -> Result<Value, Failure> {
    let sizes = [(10_000.0, 2_000.0), (20_000.0, 1_000.0), (20_000.0, 100.0)];
    let all =
        sizes.iter().map(|&(side, length)| Ok(timed(&line_searches(1, vehicles, lines, side, length))?.0));
    Ok(Value::Array(all.collect::<Result<_, Failure>>()?))
}

/// Free space around so many zones of eight corners: how long it takes to build, and to find ways in.
fn space(zones: usize) -> Result<Value, Failure> {
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
fn routes(count: usize) -> Value {
    let mut random = fastrand::Rng::with_seed(3);
    let (mut asked, mut straight, mut turning, mut narrow, mut violations) = (0, 0, 0, 0, 0);
    while asked < count {
        let map = random_map(&mut random, 14, 10_000.0);
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
