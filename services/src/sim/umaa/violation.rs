//! Breaches of the ICD, planted on a bus where all else is as it should be: the monitor has to find each, and nothing else.

use super::act::Act;
use super::fleet::{UmaaFleet, quiet};

use crate::conform::Clause;
use crate::sim::run;
use std::sync::PoisonError;

/// A breach that is planted: its name, the clause that it breaks, and what is done for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Violation {
    /// Its name.
    pub name: &'static str,
    /// The clause that it breaks.
    pub clause: Clause,
    pub(super) act: Act,
}

const fn of(name: &'static str, clause: Clause, act: Act) -> Violation {
    Violation { name, clause, act }
}

const VIOLATIONS: [Violation; 22] = [
    of("no-first-status", Clause::FirstStatus, Act::LeavesOutIssued),
    of("skipped-state", Clause::Transition, Act::LeavesOutCommanded),
    of("state-twice", Clause::Transition, Act::ExecutesTwice),
    of("wrong-reason", Clause::Reason, Act::GivesWrongReason),
    of("late-acknowledgement", Clause::AckFirst, Act::AcknowledgesLate),
    of("wrong-acknowledgement", Clause::AckMatches, Act::AcknowledgesOther),
    of("no-execution-status", Clause::ExecutionStatus, Act::HidesExecution),
    of("update-not-newer", Clause::UpdateNewer, Act::UpdatesWithoutTime),
    of("command-unanswered", Clause::Answered, Act::IgnoresCommand),
    of("cancel-not-asked", Clause::CancelAsked, Act::CancelsUnasked),
    of("cancel-unanswered", Clause::CancelAnswered, Act::HearsCancelLate),
    of("consumer-leaves-command", Clause::ConsumerCleanUp, Act::LeavesCommand),
    of("clean-up-too-early", Clause::CleanUpOrder, Act::CleansUpEarly),
    of("provider-leaves-acknowledgement", Clause::ProviderCleanUp, Act::LeavesAcknowledgement),
    of("provider-unregisters", Clause::ProviderShutdown, Act::UnregistersStatus),
    of("consumer-unregisters", Clause::ConsumerShutdown, Act::UnregistersCommand),
    of("report-unregistered", Clause::ReportShutdown, Act::UnregistersReport),
    of("foreign-status", Clause::Destination, Act::SpeaksForAnother),
    of("session-twice", Clause::SessionUnique, Act::UsesSessionTwice),
    of("second-holder", Clause::OneHolder, Act::NamesSecondHolder),
    of("report-too-late", Clause::ReportFirst, Act::ReportsLate),
    of("unreadable-sample", Clause::Range, Act::WritesNonsense),
];

/// All breaches that can be planted.
pub fn violations() -> &'static [Violation] {
    &VIOLATIONS
}

/// What the monitor found in a run with a breach.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// How often the breach was planted.
    pub planted: u64,
    /// The clauses that were found broken, and what was seen first of each.
    pub broken: Vec<(Clause, String)>,
}

impl Finding {
    /// Whether exactly the planted breach was found.
    pub fn is_exact(&self, violation: &Violation) -> bool {
        let clauses: Vec<_> = self.broken.iter().map(|(clause, _)| *clause).collect();
        self.planted > 0 && clauses == [violation.clause]
    }
}

/// A breach may find no occasion in one run, such as a cancel at the right moment, or a command that its consumer leaves alone until
/// an answer is due: so many seeds are tried.
const TRIES: u64 = 12;

impl Violation {
    /// What the monitor found with the first seed, from this one on, in which it found anything.
    ///
    /// # Errors
    /// Why a configuration cannot be.
    pub fn find(&self, seed: u64) -> Result<Finding, String> {
        let mut finding = self.run(seed)?;
        for next in seed + 1..seed + TRIES {
            if !finding.broken.is_empty() {
                break;
            }
            finding = self.run(next)?;
        }
        Ok(finding)
    }

    /// Runs a quiet fleet with the breach, watched by the monitor alone.
    ///
    /// # Errors
    /// Why a configuration cannot be.
    pub fn run(&self, seed: u64) -> Result<Finding, String> {
        let options = quiet(seed);
        let fleet = UmaaFleet::broken(seed, &options, self.act);
        run::run(&fleet, seed, options)?;
        let planted = fleet.count.load(std::sync::atomic::Ordering::Relaxed);
        let findings = std::mem::take(&mut *fleet.findings.lock().unwrap_or_else(PoisonError::into_inner));
        let report = findings.report.unwrap_or_default();
        let first = |found: &crate::conform::ClauseReport| {
            let text = found.first.as_ref().map(|first| first.text.clone()).unwrap_or_default();
            (found.clause, text)
        };
        Ok(Finding { planted, broken: report.broken().map(first).collect() })
    }
}
