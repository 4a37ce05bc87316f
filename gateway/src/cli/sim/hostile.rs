//! `aldis sim hostile`: frames of strangers.

use crate::cli::exit::Failure;
use crate::cli::print_line;
use aldis_services::sim::link::{self, HostileReport};
use serde_json::json;
use std::time::Instant;

/// Give a link with keys frames that are made up, cut, turned over and replayed: it takes none, and answers none.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  aldis sim hostile --frames 10000000 --json")]
pub(super) struct SimHostile {
    /// Frames.
    #[arg(long, default_value_t = 1_000_000)]
    frames: u64,
    /// Draws everything.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

impl SimHostile {
    pub(super) fn run(self) -> Result<(), Failure> {
        let start = Instant::now();
        let HostileReport { frames, counted, taken, answers, delivered } =
            link::hostile(self.frames, self.seed);
        let seconds = (start.elapsed().as_secs_f64() * 10.0).round() / 10.0;
        if self.json {
            print_line(json!({
                "frames": frames, "counted": counted, "taken": taken, "answers": answers, "delivered": delivered,
                "seed": self.seed, "seconds": seconds,
            }));
        } else {
            print_line(format_args!(
                "{frames} hostile frames in {seconds} s: {counted} counted, {taken} taken, {answers} answered, {delivered} delivered"
            ));
        }
        if taken + answers + delivered > 0 {
            return Err(Failure::Failed(format!("{taken} taken, {answers} answered; seed {}", self.seed)));
        }
        Ok(())
    }
}
