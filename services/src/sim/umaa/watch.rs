//! The conformance monitor as a checker: it is told what is written, at its source and in its order.

use super::commands::{RudderCommand, VectorCommand, VectorExecutionStatus};
use super::fleet::ORPHANS_WAIT;
use super::outside::entity_of;
use super::tampered::LifeEnded;
use super::wrote::Wrote;
use crate::conform::{self, Bounds, Decoder, Monitor, Watcher};
use crate::sim::observe::{Checker, Observation, Seen};
use crate::sim::options::Options;
use aldis_envelope::umaa::{Command, CommandAckReport, CommandStatus, Topic, TopicInfo};
use aldis_envelope::{EntityId, Envelope, Monotonic, ServiceId};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// What a run came to, for those who want to know more than whether something was wrong.
#[derive(Debug, Clone, Default)]
pub(super) struct Findings {
    pub(super) report: Option<conform::Report>,
    /// What was written, and when by the world's true time, where it is wanted.
    pub(super) written: Option<Vec<(Monotonic, Envelope)>>,
}

/// Feeds the monitor.
pub(super) struct Watch {
    watcher: Option<Watcher>,
    now: Monotonic,
    findings: Arc<Mutex<Findings>>,
}

fn family<C: Command>() -> [TopicInfo; 3] {
    [TopicInfo::of::<C>(), TopicInfo::of::<CommandStatus<C>>(), TopicInfo::of::<CommandAckReport<C>>()]
}

/// The topics of this workload beside those of Support Operations.
pub(super) fn topics() -> impl Iterator<Item = TopicInfo> {
    let execution = [TopicInfo::of::<VectorExecutionStatus>()];
    family::<VectorCommand>().into_iter().chain(family::<RudderCommand>()).chain(execution)
}

/// How long the monitor waits for what is owed: as long as faults may hold it up.
fn bounds(options: &Options) -> Bounds {
    let faults = &options.faults;
    // What one says is on its way to the disk and to the other, and an answer to what was before on its way back.
    let written = 8 * options.disk_latency.1;
    let unheard = 4 * options.delay.1 + written;
    // Commands here run for seconds, and what does not follow within them would never be missed.
    let usual = Bounds { unheard, written, follow: Duration::from_secs(2), ..Bounds::default() };
    let some = [faults.session_drops, faults.partitions, faults.crashes, faults.stalls];
    // A service that the disk refuses starts again.
    let shares = [faults.sample_loss, faults.disk.sync_fails, faults.disk.write_fails];
    if some.iter().all(Option::is_none) && shares == [0.0; 3] {
        return usual;
    }
    let outage = Duration::from_secs(30) + 2 * faults.lasts_at_most + 2 * options.notice;
    Bounds {
        answer: usual.answer + outage,
        // What was said of a command that was lost is cleaned up when nobody waits for it any more.
        clean_up: usual.clean_up + outage.max(ORPHANS_WAIT + 2 * faults.lasts_at_most),
        follow: usual.follow + outage,
        unheard: outage,
        ..usual
    }
}

impl Watch {
    pub(super) fn new(options: &Options, findings: Arc<Mutex<Findings>>) -> Self {
        let executions = [VectorExecutionStatus::NAME.to_owned()];
        let monitor = Monitor::new(bounds(options), executions);
        Self {
            watcher: Some(Watcher::from_the_start(monitor, Decoder::new(topics()))),
            now: Monotonic::START,
            findings,
        }
    }

    fn wrote(&mut self, at: Monotonic, envelope: &Envelope) {
        if let Some(watcher) = &mut self.watcher {
            watcher.message(at, envelope);
        }
        let mut findings = self.findings.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(written) = &mut findings.written {
            written.push((at, envelope.clone()));
        }
    }

    /// Nobody speaks for what the writers of a node wrote.
    fn node_ended(&mut self, at: Monotonic, entity: EntityId) {
        let Some(watcher) = &mut self.watcher else { return };
        let gone: Vec<_> = watcher.writers().filter(|writer| writer.entity == entity).collect();
        gone.into_iter().for_each(|writer| watcher.vanished(at, writer));
    }
}

impl Checker for Watch {
    fn name(&self) -> &'static str {
        "conform"
    }

    fn observe(&mut self, observation: &Observation<'_>) -> Result<(), String> {
        self.now = observation.at;
        match &observation.seen {
            Seen::Ended(_) => {
                if let Some(entity) = entity_of(observation.node) {
                    self.node_ended(observation.at, entity);
                }
            }
            Seen::Fact(fact) => {
                if let Some(Wrote(envelope)) = fact.downcast() {
                    self.wrote(observation.at, envelope);
                }
                if let (Some(LifeEnded(of)), Some(watcher)) = (fact.downcast(), &mut self.watcher) {
                    watcher.vanished(observation.at, *of);
                }
            }
            // What the services write that every node has outlives no process; it is judged as far as the bus carries it.
            Seen::Published(envelope) if envelope.message.label.source().service < ServiceId::ALLOCATION => {
                self.wrote(observation.at, envelope);
            }
            _ => {}
        }
        Ok(())
    }

    fn finish(&mut self) -> Vec<String> {
        let Some(watcher) = self.watcher.take() else { return Vec::new() };
        let report = watcher.finish(self.now);
        let told = report.broken().map(|found| {
            let first = found.first.as_ref();
            let (at, text) = first.map_or((0.0, ""), |e| (e.at.elapsed().as_secs_f64(), e.text.as_str()));
            format!("{} is broken {} times, first at {at:.6} s: {text}", found.clause.name(), found.broken)
        });
        let told = told.collect();
        self.findings.lock().unwrap_or_else(PoisonError::into_inner).report = Some(report);
        told
    }
}
