//! The conformance monitor: watches a bus from outside and says clause by clause what of the ICD it saw held or broken.
//!
//! It shares no code and no table with the machines that it watches: [`clause`](Clause), `schema` and `transition` are typed
//! in from the ICD anew. It hears what any reader hears, and judges by that alone.
//!
//! Observations come in the order of their receipt; those of one writer in the order in which it wrote them. What the ICD asks
//! of somebody without a time limit is owed within a bound of [`Bounds`].

mod allocation;
mod clause;
mod collection;
mod command;
mod junit;
mod ledger;
mod observation;
mod report;
mod sample;
mod schema;
#[cfg(test)]
mod tests;
pub(crate) mod transition;
mod watcher;

pub use clause::Clause;
pub use command::{Role, role_of};
pub use ledger::Evidence;
pub use observation::{Content, Decoder, Observation, Observed};
pub use report::{ClauseReport, Report, Verdict};
pub use watcher::Watcher;

use allocation::Allocations;
use collection::Collections;
use command::Commands;
use ledger::Ledger;
use sample::Sample;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use aldis_envelope::{KeyHash, Monotonic};

/// How long the monitor waits for what is owed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounds {
    /// For an answer to a command, an update or a cancel.
    pub answer: Duration,
    /// For the disposal of what is no longer needed.
    pub clean_up: Duration,
    /// For the end of an update of a large collection, and for a report that has to follow a change.
    pub follow: Duration,
    /// How much later than the truth an observation of one writer may come beside those of another. Zero in a simulation
    /// that is watched at its source.
    pub slack: Duration,
    /// How much later than it is decided something may be written, because it waits for a disk first.
    pub written: Duration,
    /// How long a participant may go by what it has not heard yet, because a link is silent or a machine stands still.
    pub unheard: Duration,
}

impl Default for Bounds {
    fn default() -> Self {
        let second = Duration::from_secs(1);
        Self {
            answer: 5 * second,
            clean_up: 10 * second,
            follow: 10 * second,
            slack: Duration::ZERO,
            written: Duration::ZERO,
            unheard: Duration::ZERO,
        }
    }
}

/// How much is followed at a time, of instances, commands and elements each: what is beyond is counted in
/// [`Report::unfollowed`], and not judged. A fleet of 100 vehicles is far below it.
const FOLLOWED_MAX: usize = 100_000;

/// Which instance an observation is of.
type InstanceId = (String, KeyHash);

/// Watches a bus.
#[derive(Debug)]
pub struct Monitor {
    ledger: Ledger,
    commands: Commands,
    allocations: Allocations,
    collections: Collections,
    /// The keys of instances: a disposal may tell a hash alone.
    keys: BTreeMap<InstanceId, Sample>,
    /// Reports that are on the bus.
    reports: BTreeSet<InstanceId>,
    observations: u64,
}

impl Monitor {
    /// A monitor that has seen nothing. `execution_statuses` are the topics `…ExecutionStatusReport` that are defined for the
    /// commands on the bus: where one is, a provider owes it.
    pub fn new(bounds: Bounds, execution_statuses: impl IntoIterator<Item = String>) -> Self {
        Self {
            ledger: Ledger::new(bounds),
            commands: Commands::new(execution_statuses.into_iter().collect()),
            allocations: Allocations::default(),
            collections: Collections::default(),
            keys: BTreeMap::new(),
            reports: BTreeSet::new(),
            observations: 0,
        }
    }

    /// Takes what was observed. Topics outside UMAA are no concern of it.
    pub fn observe(&mut self, observation: &Observation) {
        self.ledger.advance(observation.at, &observation.topic);
        if !observation.topic.starts_with("UMAA::") {
            return;
        }
        self.observations += 1;
        schema::check_names(observation, &mut self.ledger);
        let id = (observation.topic.clone(), observation.instance);
        match &observation.observed {
            Observed::Put(Content::Sample(value)) => {
                let sample = Sample::new(value.clone());
                schema::check_sample(observation, &sample, &mut self.ledger);
                if self.keys.len() < FOLLOWED_MAX || self.keys.contains_key(&id) {
                    self.keys.insert(id.clone(), sample.key());
                } else {
                    self.ledger.unfollowed();
                }
                self.put(observation, &id, &sample);
            }
            Observed::Put(Content::Unreadable(why)) => {
                self.ledger.broken(Clause::Range, format!("the sample cannot be read: {why}"));
            }
            Observed::Put(Content::Unknown) => {}
            change => {
                if let Some(sample) = self.key(observation) {
                    self.change(change, &id, &observation.topic, &sample);
                }
            }
        }
    }

    /// What is known of the instance's key: as it is told, or as an earlier sample told it.
    fn key(&self, observation: &Observation) -> Option<Sample> {
        let told = observation.key.clone().map(Sample::new);
        told.or_else(|| self.keys.get(&(observation.topic.clone(), observation.instance)).cloned())
    }

    fn put(&mut self, observation: &Observation, id: &InstanceId, sample: &Sample) {
        let Observation { topic, retained, .. } = observation;
        let ledger = &mut self.ledger;
        if let Some(part) = command::part_of(topic) {
            if let Some(step) = self.commands.put(&part, sample, *retained, ledger) {
                self.allocations.step(&step, ledger);
            }
        } else if collection::is_element(topic) {
            self.collections.element(sample, *retained, ledger);
        } else {
            if self.reports.len() < FOLLOWED_MAX {
                self.reports.insert(id.clone());
            }
            self.collections.report(sample, *retained, ledger);
            self.allocations.report(topic, sample, ledger);
        }
    }

    fn change(&mut self, change: &Observed, id: &InstanceId, topic: &str, sample: &Sample) {
        let ledger = &mut self.ledger;
        if let Some(part) = command::part_of(topic) {
            if part.family == allocation::ALLOCATION
                && part.role == command::Role::Status
                && let Some(session) = sample.guid("sessionID")
            {
                self.allocations.forgotten(session, *change == Observed::Dispose, ledger);
            }
            match change {
                Observed::Dispose => self.commands.disposed(&part, sample, ledger),
                Observed::Unregister => self.commands.unregistered(&part, sample, ledger),
                _ => self.commands.lost(&part, sample, ledger),
            }
        } else if collection::is_element(topic) {
            if *change == Observed::Dispose {
                self.collections.element_disposed(sample, ledger);
            }
        } else {
            match change {
                Observed::Dispose => {
                    self.reports.remove(id);
                    self.allocations.report_gone(topic, sample);
                }
                Observed::Unregister => {
                    let left = self.reports.remove(id);
                    let told =
                        || format!("unregistered while its report was on the bus: {}", sample.key_text());
                    ledger.judge(Clause::ReportShutdown, !left, told);
                }
                _ => {
                    self.reports.remove(id);
                }
            }
        }
    }

    /// Ends the watch: what is owed by now and has not come is broken, what is not yet owed is left open.
    pub fn finish(mut self, now: Monotonic) -> Report {
        self.ledger.advance(now, "");
        self.ledger.into_report(self.observations)
    }
}
