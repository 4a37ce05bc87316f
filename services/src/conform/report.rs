//! The monitor's findings, for people and for machines.

use super::{Clause, Evidence, junit};
use serde_json::{Value, json};
use std::fmt;

/// What became of a clause.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It was held whenever it applied.
    Held,
    /// It was broken at least once.
    Broken,
    /// It never applied.
    NotSeen,
}

impl Verdict {
    /// In a word.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Held => "held",
            Self::Broken => "broken",
            Self::NotSeen => "not seen",
        }
    }
}

/// The findings for one clause.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ClauseReport {
    /// The clause.
    pub clause: Clause,
    /// How often it was held.
    pub held: u64,
    /// How often it was broken.
    pub broken: u64,
    /// The first time it was.
    pub first: Option<Evidence>,
}

impl ClauseReport {
    /// What became of it.
    pub fn verdict(&self) -> Verdict {
        match (self.held, self.broken) {
            (_, 1..) => Verdict::Broken,
            (1.., 0) => Verdict::Held,
            (0, 0) => Verdict::NotSeen,
        }
    }
}

/// The findings.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Report {
    /// How many observations of UMAA topics there were.
    pub observations: u64,
    /// How much was owed at the end and not yet due.
    pub open: usize,
    /// How often something was left unjudged because too much was going on.
    pub unfollowed: u64,
    /// Every clause, in the order of the ICD.
    pub clauses: Vec<ClauseReport>,
}

impl Report {
    /// Adds the findings of another watch.
    pub fn add(&mut self, other: &Self) {
        self.observations += other.observations;
        self.open += other.open;
        self.unfollowed += other.unfollowed;
        if self.clauses.is_empty() {
            self.clauses.clone_from(&other.clauses);
            return;
        }
        for (clause, found) in self.clauses.iter_mut().zip(&other.clauses) {
            clause.held += found.held;
            clause.broken += found.broken;
            clause.first = clause.first.take().or_else(|| found.first.clone());
        }
    }

    /// The clauses that were broken.
    pub fn broken(&self) -> impl Iterator<Item = &ClauseReport> {
        self.clauses.iter().filter(|clause| clause.verdict() == Verdict::Broken)
    }

    /// How many clauses have that verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        self.clauses.iter().filter(|clause| clause.verdict() == verdict).count()
    }

    /// As JSON.
    pub fn json(&self) -> Value {
        let clause = |found: &ClauseReport| {
            json!({
                "clause": found.clause.name(), "icd": found.clause.place(), "text": found.clause.text(),
                "verdict": found.verdict().name(), "held": found.held, "broken": found.broken,
                "first": found.first.as_ref().map(|first| json!({
                    "at_ms": first.at.elapsed().as_millis() as u64, "topic": first.topic, "text": first.text,
                })),
            })
        };
        json!({
            "observations": self.observations, "open": self.open, "unfollowed": self.unfollowed,
            "clauses_held": self.count(Verdict::Held), "clauses_broken": self.count(Verdict::Broken),
            "clauses_not_seen": self.count(Verdict::NotSeen),
            "clauses": self.clauses.iter().map(clause).collect::<Vec<_>>(),
        })
    }

    /// As JUnit XML: a test case a clause, a failure where it was broken, skipped where it never applied.
    pub fn junit(&self) -> String {
        junit::render(self)
    }
}

/// As text: the broken clauses first, with their first evidence.
impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = [Verdict::Held, Verdict::Broken, Verdict::NotSeen].map(|verdict| self.count(verdict));
        let [held, broken, not_seen] = counts;
        writeln!(
            f,
            "{} observations: {held} clauses held, {broken} broken, {not_seen} not seen",
            self.observations
        )?;
        for found in self.broken() {
            let (name, place, text) = (found.clause.name(), found.clause.place(), found.clause.text());
            writeln!(f, "broken  {:>6}  {name} (ICD {place}): {text}", found.broken)?;
            if let Some(Evidence { at, topic, text }) = &found.first {
                writeln!(
                    f,
                    "                first at {:.3} s on {topic}: {text}",
                    at.elapsed().as_secs_f64()
                )?;
            }
        }
        for found in self.clauses.iter().filter(|found| found.verdict() == Verdict::Held) {
            writeln!(f, "held    {:>6}  {} (ICD {})", found.held, found.clause.name(), found.clause.place())?;
        }
        Ok(())
    }
}
