//! What was seen in a run, so that one knows that it was tested at all.

use super::control::Control;
use super::flow::Step;
use crate::umaa::command::table::{Transition, transitions};
use aldis_envelope::Guid;
use aldis_envelope::umaa::{CommandState, CommandStatusReason, ResourceAllocationCommand, SessionKey, Topic};
use std::collections::{BTreeMap, BTreeSet};

/// What may be seen, beside transitions.
const SIGHTS: [&str; 16] = [
    "update",
    "cancel_won",
    "cancel_lost",
    "failed_validation_failed",
    "failed_objective_failed",
    "failed_resource_failed",
    "failed_resource_rejected",
    "failed_service_failed",
    "failed_interrupted",
    "failed_timeout",
    "recovery_continued",
    "recovery_failed",
    "take_over",
    "expiry",
    "renewal",
    "nested_provider",
];

/// How often something was seen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tally {
    transitions: BTreeMap<Transition, u64>,
    sights: BTreeMap<&'static str, u64>,
    /// Allocations that are renewed just now.
    renewing: BTreeSet<SessionKey>,
    /// Allocations that are COMMANDED, by consumer.
    commanded: BTreeMap<SessionKey, Guid>,
}

impl Default for Tally {
    fn default() -> Self {
        Self {
            transitions: BTreeMap::new(),
            sights: SIGHTS.iter().map(|&sight| (sight, 0)).collect(),
            renewing: BTreeSet::new(),
            commanded: BTreeMap::new(),
        }
    }
}

impl Tally {
    /// Everything that is looked for, with how often it was seen.
    pub fn sights(&self) -> impl Iterator<Item = (&'static str, u64)> + '_ {
        SIGHTS.iter().map(|sight| (*sight, self.sights.get(sight).copied().unwrap_or_default()))
    }

    /// How many of the transitions of figure 5 were seen, and how many there are.
    pub fn covered(&self) -> (usize, usize) {
        let seen = transitions().filter(|transition| self.transitions.contains_key(transition));
        (seen.count(), transitions().count())
    }

    /// What was not seen, in words.
    pub fn missing(&self) -> Vec<String> {
        let unseen = transitions().filter(|transition| !self.transitions.contains_key(transition));
        let unseen = unseen.map(|Transition { from, to, reason }| {
            format!("{} to {to} {reason}", from.map_or("(initial)", CommandState::name))
        });
        let sights = self.sights().filter(|(_, count)| *count == 0).map(|(sight, _)| sight.to_owned());
        unseen.chain(sights).collect()
    }

    /// Adds what another run has seen.
    pub fn add(&mut self, other: &Self) {
        for (transition, count) in &other.transitions {
            *self.transitions.entry(*transition).or_default() += count;
        }
        for (sight, count) in &other.sights {
            *self.sights.entry(sight).or_default() += count;
        }
    }

    fn see(&mut self, sight: &'static str) {
        *self.sights.entry(sight).or_default() += 1;
    }

    /// A command has come to another state.
    pub(super) fn step(&mut self, step: &Step, control: &Control) {
        let Transition { from, to, reason } = step.transition;
        *self.transitions.entry(step.transition).or_default() += 1;
        if reason == CommandStatusReason::Updated {
            self.see("update");
        }
        if step.is_recovered {
            let failed = (to, reason) == (CommandState::Failed, CommandStatusReason::ServiceFailed);
            self.see(if failed { "recovery_failed" } else { "recovery_continued" });
        }
        match to {
            CommandState::Canceled => self.see("cancel_won"),
            CommandState::Completed if step.was_disposed => self.see("cancel_lost"),
            CommandState::Failed => {
                let name = format!("failed_{}", reason.name().to_lowercase());
                if let Some(sight) = SIGHTS.iter().find(|sight| **sight == name) {
                    self.see(sight);
                }
            }
            CommandState::Executing
                if step.consumer.is_some_and(|c| control.is_nested(step.key.source, c)) =>
            {
                self.see("nested_provider");
            }
            _ => {}
        }
        if step.family == ResourceAllocationCommand::NAME {
            self.allocation(step, from, to, reason);
        }
    }

    fn allocation(
        &mut self,
        step: &Step,
        from: Option<CommandState>,
        to: CommandState,
        reason: CommandStatusReason,
    ) {
        let others = self.commanded.iter().filter(|(key, _)| **key != step.key);
        let is_replaced = others.map(|(_, consumer)| Some(*consumer)).any(|other| other == step.consumer);
        match (to, reason) {
            (CommandState::Issued, CommandStatusReason::Updated) if from == Some(CommandState::Executing) => {
                self.renewing.insert(step.key);
            }
            (CommandState::Executing, _) if self.renewing.remove(&step.key) => self.see("renewal"),
            (CommandState::Failed, CommandStatusReason::Interrupted) => self.see("take_over"),
            (CommandState::Completed, _) if !is_replaced && !step.was_disposed => self.see("expiry"),
            _ => {}
        }
        match (to, step.consumer) {
            (CommandState::Commanded, Some(consumer)) => drop(self.commanded.insert(step.key, consumer)),
            _ => drop(self.commanded.remove(&step.key)),
        }
    }
}
