//! Many seeds, added up.

use super::fleet::{Planted, UmaaFleet, options};
use super::tally::Tally;
use crate::conform;
use crate::sim::run::{self, Report};
use aldis_envelope::{Envelope, Monotonic};
use serde_json::{Value, json};
use std::sync::PoisonError;
use std::time::Duration;

/// What was written in a run, and when by the world's true time.
pub type Recorded = Vec<(Monotonic, Envelope)>;

/// What came of many runs.
#[derive(Debug, Clone, Default)]
pub struct Campaign {
    /// How many seeds were run.
    pub seeds: u64,
    /// The runs in which something was wrong.
    pub wrong: Vec<Report>,
    /// What was seen.
    pub tally: Tally,
    /// What the monitor found in the runs that went to their ends, added up.
    pub conform: conform::Report,
    /// The time that passed in all worlds.
    pub lasted: Duration,
    /// How much happened.
    pub events: u64,
    /// A hash of it all.
    pub hash: u64,
}

impl Campaign {
    /// Runs a seed and adds what came of it; what was written comes back where it is wanted.
    ///
    /// # Errors
    /// Why a configuration cannot be.
    pub fn run(&mut self, seed: u64, planted: Option<Planted>, records: bool) -> Result<Recorded, String> {
        let options = options(seed);
        let fleet = UmaaFleet::new(seed, &options, planted);
        fleet.findings.lock().unwrap_or_else(PoisonError::into_inner).written = records.then(Vec::new);
        let report = run::run(&fleet, seed, options)?;
        self.seeds += 1;
        self.lasted += report.lasted;
        self.events += report.events;
        self.hash = self.hash.rotate_left(1) ^ report.hash;
        self.tally.add(&fleet.tally.lock().unwrap_or_else(PoisonError::into_inner));
        let findings = std::mem::take(&mut *fleet.findings.lock().unwrap_or_else(PoisonError::into_inner));
        if let Some(found) = &findings.report {
            self.conform.add(found);
        }
        if !report.violations.is_empty() {
            self.wrong.push(report);
        }
        Ok(findings.written.unwrap_or_default())
    }

    /// How much was wrong in all runs.
    pub fn violations(&self) -> usize {
        self.wrong.iter().map(|report| report.violations.len()).sum()
    }

    /// As JSON.
    pub fn json(&self) -> Value {
        let (covered, transitions) = self.tally.covered();
        let sights: serde_json::Map<_, _> =
            self.tally.sights().map(|(sight, count)| (sight.to_owned(), count.into())).collect();
        let wrong = self.wrong.iter().map(|report| {
            json!({
                "seed": report.seed,
                "violations": report.violations.iter().map(ToString::to_string).collect::<Vec<_>>(),
            })
        });
        json!({
            "seeds": self.seeds,
            "violations": self.violations(),
            "wrong": wrong.collect::<Vec<_>>(),
            "transitions_covered": covered,
            "transitions": transitions,
            "seen": sights,
            "missing": self.tally.missing(),
            "clauses_broken": self.conform.count(conform::Verdict::Broken),
            "clauses_held": self.conform.count(conform::Verdict::Held),
            "virtual_hours": self.lasted.as_secs_f64() / 3600.0,
            "events": self.events,
            "hash": format!("{:016x}", self.hash),
        })
    }
}
