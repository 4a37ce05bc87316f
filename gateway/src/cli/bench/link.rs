//! `aldis bench link`: the table of goals of the lossy link.

mod charts;
mod plain;
mod real;

use super::super::exit::Failure;
use super::super::link::profile;
use super::super::print_line;
use aldis_services::sim::link::{Bench, Row, bench, row_names};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// The row that has a command of its own: `aldis sim crash`.
const ELSEWHERE: &str = "G10";

/// The lossy link against its table of goals, in virtual time.
#[derive(clap::Args)]
pub(super) struct LinkBench {
    /// L1, L2, L3, L4 or WiFi.
    #[arg(long, default_value = "L1")]
    profile: String,
    /// With keys on both ends: figures may be 10 % worse.
    #[arg(long)]
    keys: bool,
    /// How much of the full measurement: 1 for all of it, 0.05 for a look.
    #[arg(long, default_value_t = 1.0)]
    part: f64,
    /// Draws everything.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// These rows alone: `--only G1,G5`.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Real processes through a relay of datagrams, in real time, instead of the table.
    #[arg(long, conflicts_with_all = ["keys", "part", "only", "curves"])]
    real: bool,
    /// With `--real`: for so many seconds, and a minute at the most for what is under way.
    #[arg(long, default_value_t = 60, requires = "real")]
    seconds: u64,
    /// With `--real`: commands a second.
    #[arg(long, default_value_t = 2.0, requires = "real")]
    rate: f64,
    /// With `--real`: the same load over plain Zenoh too, through the same relay: `zenoh-udp`.
    #[arg(long, requires = "real")]
    against: Option<String>,
    /// Delivery, latency and bytes against loss and rate, as SVG files in this directory, instead of the table.
    #[arg(long, value_name = "DIRECTORY")]
    curves: Option<PathBuf>,
    /// One JSON object with a field for each row.
    #[arg(long)]
    json: bool,
}

impl LinkBench {
    pub(super) fn run(self) -> Result<(), Failure> {
        let profile = profile(&self.profile)?;
        if !(self.part > 0.0 && self.part <= 1.0) {
            return Err(Failure::Usage(format!("--part {}: a number above 0, at most 1", self.part)));
        }
        if self.real {
            return self.real(profile);
        }
        if let Some(directory) = &self.curves {
            let count = (2_000.0 * self.part).max(20.0) as u64;
            let files = charts::write(&profile, count, self.seed, directory)?;
            files.iter().for_each(|file| print_line(file.display()));
            return Ok(());
        }
        let known = row_names(&profile);
        let is_known = |name: &String| known.iter().any(|known| known.eq_ignore_ascii_case(name));
        if let Some(unknown) = self.only.iter().find(|name| !is_known(name)) {
            return Err(Failure::Usage(format!(
                "no row {unknown} on {}: there are {}",
                profile.name,
                known.join(", ")
            )));
        }
        let wanted = |name: &&'static str| match self.only.is_empty() {
            true => *name != ELSEWHERE,
            false => self.only.iter().any(|only| only.eq_ignore_ascii_case(name)),
        };
        let names: Vec<_> = known.iter().copied().filter(wanted).collect();
        let start = Instant::now();
        let rows = self.measure(&profile, &names);
        let mut object = Map::new();
        for (name, (row, seconds)) in names.iter().zip(&rows) {
            if self.json {
                let seconds = (seconds * 10.0).round() / 10.0;
                object.insert(
                    (*name).to_owned(),
                    json!({
                        "goal": row.goal, "measured": row.measured, "met": row.met, "reason": row.reason,
                        "seconds": seconds
                    }),
                );
            } else {
                let met = if row.met { "met   " } else { "MISSED" };
                print_line(format_args!("{name:4} {met} {}\n            goal: {}", row.measured, row.goal));
                if let Some(reason) = &row.reason {
                    print_line(format_args!("            why: {reason}"));
                }
            }
        }
        if self.json {
            for (key, value) in [
                ("profile", json!(profile.name)),
                ("keys", json!(self.keys)),
                ("part", json!(self.part)),
                ("seed", json!(self.seed)),
                ("seconds", json!(start.elapsed().as_secs_f64().round())),
            ] {
                object.insert(key.to_owned(), value);
            }
            print_line(Value::Object(object));
        }
        Ok(())
    }

    fn real(self, profile: aldis_services::sim::link::Profile) -> Result<(), Failure> {
        if !(self.rate > 0.0 && self.rate <= 1_000.0) {
            return Err(Failure::Usage(format!("--rate {}: a number above 0, at most 1000", self.rate)));
        }
        let (seconds, rate, seed) = (self.seconds, self.rate, self.seed);
        let result = real::Real { profile, seconds, rate, seed }.run(self.against.as_deref())?;
        print_line(if self.json { result.to_string() } else { format!("{result:#}") });
        Ok(())
    }

    /// Measures rows side by side, on as many threads as there are cores; the longest first would be better known than guessed.
    fn measure(
        &self,
        profile: &aldis_services::sim::link::Profile,
        names: &[&'static str],
    ) -> Vec<(Row, f64)> {
        let next = Mutex::new(0);
        let done = Mutex::new(BTreeMap::new());
        let work = || {
            loop {
                let place = {
                    let mut next = next.lock().unwrap_or_else(PoisonError::into_inner);
                    *next += 1;
                    *next - 1
                };
                let Some(name) = names.get(place) else { return };
                let start = Instant::now();
                let rows = bench(&Bench {
                    profile: profile.clone(),
                    keyed: self.keys,
                    part: self.part,
                    seed: self.seed,
                    only: vec![(*name).to_owned()],
                });
                let mut done = done.lock().unwrap_or_else(PoisonError::into_inner);
                done.extend(rows.into_iter().map(|row| (place, (row, start.elapsed().as_secs_f64()))));
            }
        };
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(work);
            }
        });
        done.into_inner().unwrap_or_else(PoisonError::into_inner).into_values().collect()
    }
}
