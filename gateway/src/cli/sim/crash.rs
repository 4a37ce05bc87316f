//! `aldis sim crash`: nothing that was accepted is lost, nothing is handled twice.

use crate::cli::exit::Failure;
use crate::cli::print_line;
use aldis_services::sim::custody::{self, CrashReport};
use serde_json::json;
use std::time::Instant;

/// Kill both ends of a link at moments of chance, with torn writes, and count what was lost and what came twice.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  aldis sim crash --points 1000 --json")]
pub(super) struct SimCrash {
    /// Crashes.
    #[arg(long, default_value_t = 1_000)]
    points: u64,
    /// Draws everything.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

impl SimCrash {
    pub(super) fn run(self) -> Result<(), Failure> {
        let start = Instant::now();
        let report = custody::crash(self.points, self.seed).map_err(Failure::Failed)?;
        let CrashReport { points, during_a_write, power_losses, accepted, lost, twice } = report;
        let seconds = start.elapsed().as_secs_f64();
        if self.json {
            print_line(json!({
                "points": points, "during_a_write": during_a_write, "power_losses": power_losses, "accepted": accepted, "lost": lost, "twice": twice,
                "seed": self.seed, "seconds": (seconds * 10.0).round() / 10.0,
            }));
        } else {
            print_line(format_args!(
                "{points} crashes, {during_a_write} during a write: of {accepted} commands accepted {lost} lost, {twice} handled twice"
            ));
        }
        if lost + twice > 0 {
            return Err(Failure::Failed(format!("{lost} lost, {twice} handled twice; seed {}", self.seed)));
        }
        Ok(())
    }
}
