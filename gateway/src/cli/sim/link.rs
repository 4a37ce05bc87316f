//! `aldis sim link`: many links drawn from seeds, and what must hold on all of them.

use crate::cli::exit::Failure;
use crate::cli::print_line;
use aldis_services::sim::link::{self, SwarmReport};
use serde_json::json;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Draw links from seeds, each with its own mixture of troubles, and check what must hold on all of them.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  aldis sim link --hours 1000 --json\n  aldis sim link --only 77  (one link again, by its seed)"
)]
pub(super) struct SimLink {
    /// Hours of links.
    #[arg(long, default_value_t = 1_000.0)]
    hours: f64,
    /// Draws the seeds of the links.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// One link alone, by the seed that a violation named.
    #[arg(long, conflicts_with_all = ["hours", "seed"])]
    only: Option<u64>,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

impl SimLink {
    /// The links of the swarm, shared out among the cores. Each is drawn from its own seed, so that who takes it does not matter.
    fn swarm(&self) -> SwarmReport {
        let shared = Mutex::new((0, SwarmReport::default()));
        let lock = || shared.lock().unwrap_or_else(PoisonError::into_inner);
        let work = || {
            loop {
                let number = {
                    let (next, report) = &mut *lock();
                    if report.hours >= self.hours {
                        return;
                    }
                    *next += 1;
                    *next - 1
                };
                let one = link::swarm_one(link::swarm_seed(self.seed, number));
                lock().1.add(one);
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
                scope.spawn(work);
            }
        });
        shared.into_inner().unwrap_or_else(PoisonError::into_inner).1
    }

    pub(super) fn run(self) -> Result<(), Failure> {
        if !(self.hours.is_finite() && self.hours > 0.0) {
            return Err(Failure::Usage(format!("--hours {}: a number above 0", self.hours)));
        }
        let start = Instant::now();
        let report = match self.only {
            Some(seed) => link::swarm_one(seed),
            None => self.swarm(),
        };
        let seconds = start.elapsed().as_secs_f64();
        if self.json {
            print_line(json!({
                "violations": report.violations.len(), "first": report.violations.first(), "hours": report.hours,
                "links": report.links, "commands": report.commands, "crashes": report.crashes,
                "seed": self.seed, "options": report.options, "seconds": (seconds * 10.0).round() / 10.0,
                "hours_per_second": (report.hours / seconds.max(1e-3) * 10.0).round() / 10.0,
            }));
        } else {
            print_line(format_args!(
                "{:.0} link-hours of {} links, {} commands, {} crashes: {} broken; {:.1} hours a second",
                report.hours,
                report.links,
                report.commands,
                report.crashes,
                report.violations.len(),
                report.hours / seconds.max(1e-3)
            ));
            report.violations.iter().take(10).for_each(print_line);
        }
        match report.violations.first() {
            None => Ok(()),
            Some(first) => {
                Err(Failure::Failed(format!("{} did not hold; the first: {first}", report.violations.len())))
            }
        }
    }
}
