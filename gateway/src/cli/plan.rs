//! `aldis plan`: from the messages of a scenario to missions, offline.

pub(super) mod outcome;
pub(super) mod scenario;
mod svg;

use super::exit::Failure;
use super::print_line;
use aldis_envelope::Monotonic;
use aldis_services::registry::Kind;
use aldis_services::sim::offline::{Offline, Overheard, Played};
use aldis_services::uxas::Core;
use outcome::Outcome;
use scenario::Scenario;
use serde_json::json;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// How long an answer is waited for, in virtual time: longer than any planner may take.
const ANSWER_WITHIN: Duration = Duration::from_secs(60);

/// Plan what a scenario asks for: one node with the core services, alone, in virtual time.
///
/// DIR holds LMCP messages as XML files, in `MessagesToSend` or by themselves: entities, zones, regions, geometry and tasks are
/// told first, then the requests in the order of their file names, each when the one before is answered.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  aldis plan configs/scenarios/harbour\n  aldis plan DIR --json --svg plan.svg"
)]
pub(crate) struct Plan {
    /// The scenario.
    #[arg(value_name = "DIR")]
    directory: PathBuf,
    /// Measure as the reference does: flat earth, straight ways, whole metres.
    #[arg(long)]
    compat_cost: bool,
    /// How far ahead of where vehicles are their plans begin, in metres.
    #[arg(long, default_value_t = 0.0)]
    lead_m: f64,
    /// Draw zones, tasks and missions into this file.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// One JSON object for each request, and at the end one of all: `wall_ms` from request to response, `makespan_ms`, `total_ms`,
    /// `flown_ms` (the longest mission with its turns), `proven`, `gap`, `assignments`, `missions`, `errors`.
    #[arg(long)]
    json: bool,
}

impl Plan {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let scenario = Scenario::read(&self.directory)?;
        let services = Core::pipeline(self.compat_cost, self.lead_m);
        let services = services.into_iter().map(|core| (core.name().to_owned(), Kind::Core(core))).collect();
        let mut node = Offline::new(scenario.entity, services).map_err(Failure::Failed)?;
        node.play(scenario.told().into_iter().map(|object| Played { at: Duration::ZERO, object }).collect());
        let mut all = Outcome::default();
        // What is wrong before anything is asked.
        outcome::hear(&mut all, &node.heard());
        for (name, object) in scenario.requests() {
            let mut one = Outcome::default();
            let begin = Instant::now();
            let at = node.now().elapsed();
            node.play(vec![Played { at, object }]);
            let heard = until_answered(&mut node);
            one.wall = begin.elapsed();
            outcome::hear(&mut one, &heard);
            if self.json {
                let mut told = one.json();
                told["request"] = json!(name);
                print_line(told);
            } else {
                print_line(format_args!("{name}:"));
                one.print();
            }
            all.add(one);
        }
        if let Some(path) = &self.svg {
            let picture = svg::picture(&scenario, &all);
            std::fs::write(path, picture)
                .map_err(|why| Failure::Failed(format!("cannot write {}: {why}", path.display())))?;
        }
        if self.json {
            print_line(all.json());
        }
        match all.errors.is_empty() {
            true => Ok(()),
            false => Err(Failure::Failed(format!("{}: {}", self.directory.display(), all.errors.join("; ")))),
        }
    }
}

/// Lets a node work until it has answered a request.
pub(super) fn until_answered(node: &mut Offline) -> Vec<Overheard> {
    let until = Monotonic::since_start(node.now().elapsed() + ANSWER_WITHIN);
    let mut heard = Vec::new();
    loop {
        let news = node.heard();
        let is_answered = news.iter().any(|one| outcome::is_answer(&one.descriptor));
        heard.extend(news);
        if is_answered || !node.step(until) {
            heard.extend(node.heard());
            return heard;
        }
    }
}
