//! `aldis assign`: the best plan of a request in a file.

use super::exit::Failure;
use super::print_line;
use aldis_services::plan::algebra::Unnamed;
use aldis_services::plan::assignment::{
    AssignError, Effort, Objective, Plan, Precedence, RequestFile, assign,
};
use serde_json::json;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Say which vehicle does which task, in which way and order.
///
/// FILE is JSON: `rel`, how the tasks are related (process algebra; empty: all, in any order); `V`, the vehicles; `tasks`, by
/// id the composition of its options, and the options by id, each with its cost in milliseconds and its eligible
/// vehicles (none: all); `rows`, each vehicle, task and option it comes from (0, 0: where it is), task and option
/// it goes to, milliseconds. The result depends on the request and the budget alone, not on the machine.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  aldis assign request.json\n  aldis assign request.json --json --objective cumulative"
)]
pub(crate) struct Assign {
    /// The request.
    file: PathBuf,
    /// What must be small first: when the last vehicle has finished, or the sum of when each has.
    #[arg(long, value_enum, default_value_t)]
    objective: ObjectiveArg,
    /// Whether what comes later in `.` waits for another vehicle, or is only chosen later.
    #[arg(long, value_enum, default_value_t)]
    precedence: PrecedenceArg,
    /// Leave out tasks that the relationships do not name, instead of refusing the request.
    #[arg(long)]
    leave_out: bool,
    /// The budget of the search.
    #[arg(long, default_value_t = Effort::default().nodes)]
    nodes: u64,
    /// The seed of all chance in the search.
    #[arg(long, default_value_t = Effort::default().seed)]
    seed: u64,
    /// One JSON object: `makespan_ms`, `total_ms`, `proven`, `gap`, `bound_ms`, `nodes`, `assignments` of `vehicle`, `task`,
    /// `option`, `threshold_ms`, `completed_ms`, and `wall_ms`. Where there is no plan: `error`.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Default, clap::ValueEnum)]
enum ObjectiveArg {
    #[default]
    Minmax,
    Cumulative,
}

#[derive(Clone, Copy, Default, clap::ValueEnum)]
enum PrecedenceArg {
    #[default]
    Choice,
    Temporal,
}

impl Assign {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let file = self.file.display();
        let wrong = |why: String| Failure::Usage(format!("{file}: {why}"));
        let text = std::fs::read_to_string(&self.file).map_err(|why| wrong(why.to_string()))?;
        let request: RequestFile =
            serde_json::from_str(&text).map_err(|why| wrong(format!("no request: {why}")))?;
        let objective = match self.objective {
            ObjectiveArg::Minmax => Objective::MinMax,
            ObjectiveArg::Cumulative => Objective::Cumulative,
        };
        let precedence = match self.precedence {
            PrecedenceArg::Choice => Precedence::Choice,
            PrecedenceArg::Temporal => Precedence::Temporal,
        };
        let unnamed = if self.leave_out { Unnamed::LeaveOut } else { Unnamed::Refuse };
        let request = request.request(objective, precedence, unnamed);
        let begin = Instant::now();
        let planned = assign(&request, Effort { nodes: self.nodes, seed: self.seed });
        let wall = begin.elapsed();
        match planned {
            Ok(plan) if self.json => print_line(told(&plan, wall)),
            Ok(plan) => show(&plan, wall),
            Err(why) => {
                if self.json {
                    print_line(json!({ "error": why.to_string() }));
                }
                return Err(match why {
                    AssignError::Request(_) => wrong(why.to_string()),
                    _ => Failure::Failed(format!("{file}: {why}")),
                });
            }
        }
        Ok(())
    }
}

/// Milliseconds with three digits behind the point.
fn millis(time: Duration) -> f64 {
    (time.as_secs_f64() * 1e6).round() / 1e3
}

fn told(plan: &Plan, wall: Duration) -> serde_json::Value {
    let assignments: Vec<_> = plan.assignments.iter().map(|a| {
        json!({
            "vehicle": a.vehicle, "task": a.task, "option": a.option, "threshold_ms": a.threshold_ms, "completed_ms": a.completed_ms,
        })
    }).collect();
    let certificate = plan.certificate;
    json!({
        "makespan_ms": plan.makespan_ms, "total_ms": plan.total_ms, "proven": certificate.proven, "gap": certificate.gap,
        "bound_ms": certificate.bound_ms, "nodes": certificate.nodes, "assignments": assignments, "wall_ms": millis(wall),
    })
}

fn show(plan: &Plan, wall: Duration) {
    for a in &plan.assignments {
        let (vehicle, task, option) = (a.vehicle, a.task, a.option);
        print_line(format_args!(
            "vehicle {vehicle:<6} task {task:<6} option {option:<6} complete at {:>10} ms",
            a.completed_ms
        ));
    }
    let (certificate, millis) = (plan.certificate, millis(wall));
    let sure = match certificate.proven {
        true => "proven: no plan is better".to_owned(),
        false => format!("at most {:.1} % above the best", certificate.gap * 100.0),
    };
    let (makespan, total, nodes) = (plan.makespan_ms, plan.total_ms, certificate.nodes);
    print_line(format_args!(
        "all complete at {makespan} ms, {total} ms in sum; {sure} ({nodes} nodes, {millis} ms)"
    ));
}
