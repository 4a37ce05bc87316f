//! `aldis sim umaa`: UMAA fleets in the simulator, from seeds.

use super::super::exit::Failure;
use super::super::print_line;
use aldis_envelope::Fleet;
use aldis_envelope::codec::recording::Writer;
use aldis_services::sim::umaa::{Campaign, Planted, Recorded, Violation, reject_all_illegal, violations};
use serde_json::{Value, json};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// The fleet's name in recordings of simulations.
const FLEET: &str = "sim";

/// Exit code 1 where something was wrong.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis sim umaa --seeds 500 --json               what was wrong, and what was seen
  aldis sim umaa --seed 42                        one seed again, with the end of its trace
  aldis sim umaa --plant stale-guard --seeds 100  a bug on purpose: it has to be found
  aldis sim umaa --seeds 500 --conform            what the conformance monitor says of it, clause by clause
  aldis sim umaa --violations                     breaches of the ICD on purpose: each has to be found alone
  aldis sim umaa --seed 10 --record watch.aldis   for `aldis conform --file`")]
pub(super) struct Umaa {
    /// How many seeds.
    #[arg(long, default_value_t = 100, conflicts_with = "seed")]
    seeds: u64,
    /// The first of them.
    #[arg(long, default_value_t = 0, conflicts_with = "seed")]
    first: u64,
    /// One seed alone.
    #[arg(long)]
    seed: Option<u64>,
    /// A bug on purpose; the run ends with the first seed that finds it.
    #[arg(long, value_parser = planted)]
    plant: Option<Planted>,
    /// Print what the conformance monitor found.
    #[arg(long)]
    conform: bool,
    /// Plant breaches of the ICD one after the other, each in a run of its own that the monitor watches.
    #[arg(long, conflicts_with_all = ["plant", "conform", "record"])]
    violations: bool,
    /// Write what was written on the bus into a file, of one seed.
    #[arg(long, requires = "seed")]
    record: Option<PathBuf>,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

fn planted(text: &str) -> Result<Planted, String> {
    let names = || Planted::ALL.map(Planted::name).join(", ");
    Planted::ALL
        .into_iter()
        .find(|planted| planted.name() == text)
        .ok_or_else(|| format!("one of {}", names()))
}

impl Umaa {
    pub(super) fn run(self) -> Result<(), Failure> {
        if self.violations { self.plant_violations() } else { self.play() }
    }

    fn play(&self) -> Result<(), Failure> {
        let mut campaign = Campaign::default();
        let (first, count) = self.seed.map_or((self.first, self.seeds), |seed| (seed, 1));
        for seed in first..first.saturating_add(count) {
            let written = campaign.run(seed, self.plant, self.record.is_some()).map_err(Failure::Failed)?;
            if let Some(file) = &self.record {
                record(file, &written)?;
            }
            if self.plant.is_some() && !campaign.wrong.is_empty() {
                break;
            }
        }
        self.tell(&campaign);
        match (self.plant, campaign.wrong.first()) {
            (None, None) | (Some(_), Some(_)) => Ok(()),
            (None, Some(_)) => Err(Failure::Failed(format!("{} runs were wrong", campaign.wrong.len()))),
            (Some(plant), None) => Err(Failure::Failed(format!("{} is not found", plant.name()))),
        }
    }

    fn tell(&self, campaign: &Campaign) {
        if self.json {
            print_line(self.json_of(campaign));
            return;
        }
        for report in &campaign.wrong {
            print_line(report);
            if self.seed.is_some() {
                print_line(&report.trace);
            }
        }
        let (covered, transitions) = campaign.tally.covered();
        let hours = campaign.lasted.as_secs_f64() / 3600.0;
        print_line(format_args!(
            "{} seeds, {hours:.1} hours, {} events: {} violations, {covered} of {transitions} transitions",
            campaign.seeds,
            campaign.events,
            campaign.violations(),
        ));
        let sights: Vec<_> =
            campaign.tally.sights().map(|(sight, count)| format!("{sight} {count}")).collect();
        print_line(sights.join(", "));
        if self.conform {
            print_line(campaign.conform.to_string().trim_end());
        }
    }

    fn json_of(&self, campaign: &Campaign) -> Value {
        let mut value = campaign.json();
        let illegal = reject_all_illegal();
        value["illegal"] = illegal.illegal.into();
        value["illegal_rejected"] = illegal.rejected.into();
        if let Some(plant) = self.plant {
            value["planted"] = plant.name().into();
            value["found_with_seed"] = campaign.wrong.first().map(|report| report.seed).into();
        }
        if self.conform {
            value["conform"] = campaign.conform.json();
        }
        value
    }

    /// Every breach has to be found, and nothing else.
    fn plant_violations(&self) -> Result<(), Failure> {
        let seed = self.seed.unwrap_or(1);
        let mut rows = Vec::new();
        let mut missed = 0;
        for violation in violations() {
            let finding = violation.find(seed).map_err(Failure::Failed)?;
            let exact = finding.is_exact(violation);
            missed += usize::from(!exact);
            let Violation { name, clause, .. } = violation;
            let broken: Vec<_> = finding.broken.iter().map(|(clause, _)| clause.name()).collect();
            if self.json {
                rows.push(json!({
                    "violation": name, "clause": clause.name(), "planted": finding.planted, "broken": broken,
                    "exact": exact,
                }));
            } else {
                let mark = if exact { "found" } else { "WRONG" };
                print_line(format_args!("{mark}  {name}: {} broken", broken.join(", ")));
            }
        }
        if self.json {
            let planted = violations().len();
            print_line(json!({ "violations": planted, "exact": planted - missed, "runs": rows }));
        }
        match missed {
            0 => Ok(()),
            _ => Err(Failure::Failed(format!("{missed} violations were not found as they should be"))),
        }
    }
}

/// Writes a recording, with the world's true time as that of receipt.
fn record(path: &Path, written: &Recorded) -> Result<(), Failure> {
    let wrong =
        |why: &dyn std::fmt::Display| Failure::Failed(format!("cannot write {}: {why}", path.display()));
    let fleet = Fleet::new(FLEET).map_err(|why| wrong(&why))?;
    let (writer, head) = Writer::new(&fleet);
    let mut file = BufWriter::new(File::create_new(path).map_err(|why| wrong(&why))?);
    file.write_all(&head).map_err(|why| wrong(&why))?;
    for (at, envelope) in written {
        let received = aldis_envelope::Wall(i64::try_from(at.elapsed().as_nanos()).unwrap_or(i64::MAX));
        file.write_all(&writer.record(received, envelope)).map_err(|why| wrong(&why))?;
    }
    file.flush().map_err(|why| wrong(&why))
}
