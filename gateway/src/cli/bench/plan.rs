//! `aldis bench plan`: how good and how fast plans are.

mod roads;
mod searches;
mod ways;

use super::super::exit::Failure;
use super::super::print_line;
use super::statistics::{median, rounded};
use aldis_services::plan::assignment::instance::{Related, line_searches, random_request};
use aldis_services::plan::assignment::{
    AssignError, Effort, Objective, Request, assign, evaluate, exhaustive,
};
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
    /// Random areas that are searched.
    #[arg(long, default_value_t = 60)]
    areas: usize,
    /// Only these fields.
    #[arg(long, value_name = "FIELD")]
    only: Vec<String>,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

/// A field, and what measures it.
type Field<'a> = (&'a str, Box<dyn Fn() -> Result<Value, Failure> + 'a>);

impl PlanBench {
    pub(super) fn run(self) -> Result<(), Failure> {
        let fields: Vec<Field<'_>> = vec![
            ("exhaustive", Box::new(|| exhaustively(self.instances))),
            ("permuted", Box::new(|| permuted(self.instances))),
            ("tables_12_tasks_4_vehicles", Box::new(tables)),
            ("lines_127_on_2_vehicles", Box::new(|| lines(2, 127))),
            ("lines_64_on_4_vehicles", Box::new(|| lines(4, 64))),
            ("free_space_800", Box::new(|| ways::space(100))),
            ("free_space_3000", Box::new(|| ways::space(375))),
            ("optimum", Box::new(|| Ok(ways::optimum(self.routes / 10)))),
            ("routes", Box::new(|| Ok(ways::routes(self.routes)))),
            ("areas", Box::new(|| searches::areas(self.areas))),
            ("patterns", Box::new(searches::patterns)),
            ("roads", Box::new(roads::roads)),
        ];
        if let Some(unknown) = self.only.iter().find(|only| !fields.iter().any(|(name, _)| name == only)) {
            let names: Vec<_> = fields.iter().map(|(name, _)| *name).collect();
            return Err(Failure::Usage(format!("no field `{unknown}`: there are {}", names.join(", "))));
        }
        let mut told = serde_json::Map::new();
        for (name, measure) in &fields {
            if self.only.is_empty() || self.only.iter().any(|only| only == name) {
                told.insert((*name).to_owned(), measure()?);
            }
        }
        let told = Value::Object(told);
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

/// Random requests, and the same with everything in another order: how many plans differ in a byte.
fn permuted(instances: u64) -> Result<Value, Failure> {
    let mut random = fastrand::Rng::with_seed(1);
    let mut differences = 0;
    for seed in 0..instances {
        let related = if seed % 4 == 3 { Related::General } else { Related::Parallel };
        let request = random_request(seed, 3, 6, 2, related, Objective::MinMax);
        let mut other = request.clone();
        random.shuffle(&mut other.vehicles);
        random.shuffle(&mut other.travel);
        let plan = |request: &Request| format!("{:?}", assign(request, Effort::default()));
        differences += u64::from(plan(&request) != plan(&other));
    }
    Ok(json!({ "instances": instances, "differences": differences }))
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
