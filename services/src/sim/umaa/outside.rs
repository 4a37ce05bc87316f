//! The checker of commands and of control.

use super::actors::LastWord;
use super::control::Control;
use super::flow::Flow;
use super::tally::Tally;
use super::wrote::Wrote;
use crate::sim::observe::{Checker, Observation, Seen};
use crate::sim::world::NodeHandle;
use aldis_envelope::umaa::{self, ResourceAllocationReport, Topic};
use aldis_envelope::{Change, EntityId, Envelope, Monotonic, Source};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// How long after all faults have ended nobody executes commands of a consumer that is not in control.
const SETTLED: Duration = Duration::from_secs(30);

/// Watches what is written.
pub(super) struct Outside {
    pub(super) flow: Flow,
    pub(super) control: Control,
    pub(super) tally: Arc<Mutex<Tally>>,
    healed: Option<Monotonic>,
    /// Who owes a last word, and what it was.
    last_words: BTreeMap<Source, Option<Result<(), String>>>,
}

/// Checks nothing: tells the consumers that all faults have ended.
pub(super) struct Calm(pub(super) Arc<AtomicBool>);

impl Checker for Calm {
    fn name(&self) -> &'static str {
        "calm"
    }

    fn observe(&mut self, observation: &Observation<'_>) -> Result<(), String> {
        if matches!(observation.seen, Seen::Healed) {
            self.0.store(true, Ordering::Relaxed);
        }
        Ok(())
    }
}

/// The entity of a machine: the first has 1.
pub(super) fn entity_of(node: NodeHandle) -> Option<EntityId> {
    EntityId::new(node.place() as u64 + 1).ok()
}

impl Outside {
    pub(super) fn new(
        flow: Flow,
        control: Control,
        tally: Arc<Mutex<Tally>>,
        owing: impl IntoIterator<Item = Source>,
    ) -> Self {
        let last_words = owing.into_iter().map(|source| (source, None)).collect();
        Self { flow, control, tally, healed: None, last_words }
    }

    fn wrote(&mut self, at: Monotonic, envelope: &Envelope) -> Result<(), String> {
        if envelope.message.label.descriptor() == ResourceAllocationReport::NAME
            && envelope.message.change == Change::Put
            && let Ok(report) = umaa::decode::<ResourceAllocationReport>(&envelope.message.content)
        {
            self.control.report(&report);
        }
        self.flow.published(envelope);
        for step in self.flow.take_steps() {
            self.tally.lock().unwrap_or_else(PoisonError::into_inner).step(&step, &self.control);
            self.control.step(&step)?;
        }
        if self.healed.is_some_and(|healed| at > healed + SETTLED) {
            let is_controlled = |provider, consumer| self.control.is_controlled(provider, consumer);
            if let Some(stranger) = self.flow.strangers(is_controlled).into_iter().next() {
                return Err(stranger);
            }
        }
        self.flow.violations.first().map_or(Ok(()), |what| Err(what.clone()))
    }
}

impl Checker for Outside {
    fn name(&self) -> &'static str {
        "commands"
    }

    fn observe(&mut self, observation: &Observation<'_>) -> Result<(), String> {
        match &observation.seen {
            Seen::Ended(_) => {
                if let Some(entity) = entity_of(observation.node) {
                    self.flow.node_ended(entity);
                }
            }
            Seen::Healed => self.healed = Some(observation.at),
            Seen::Fact(fact) => {
                if let Some(Wrote(envelope)) = fact.downcast() {
                    return self.wrote(observation.at, envelope);
                }
                if let Some(LastWord { by, outcome }) = fact.downcast() {
                    self.last_words.insert(*by, Some(outcome.clone()));
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn finish(&mut self) -> Vec<String> {
        let left = self.flow.left().into_iter().map(|left| format!("left at the end: {left}"));
        let words = self.last_words.iter().filter_map(|(by, word)| match word {
            Some(Ok(())) => None,
            Some(Err(why)) => Some(format!("all faults have ended, and the last command of {by} ends {why}")),
            None => Some(format!("all faults have ended, and the last command of {by} does not end")),
        });
        left.chain(words).collect()
    }
}
