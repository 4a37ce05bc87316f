//! Control watched from outside: a holder is named before it commands, and nobody acts on a report that is older than one that
//! all have confirmed.

use super::flow::Step;
use aldis_envelope::Guid;
use aldis_envelope::umaa::{
    CommandState, ResourceAllocationCommand, ResourceAllocationPriorityCommand, ResourceAllocationReport,
    Topic,
};
use std::collections::BTreeSet;

/// What is known of the control of one resource.
pub(super) struct Control {
    /// The providers of the resource. Each may command the others.
    related: BTreeSet<Guid>,
    /// Whom reports have named since the last that was confirmed, that one first. What is older nobody may go by.
    named: Vec<Option<Guid>>,
}

impl Control {
    pub(super) fn new(related: impl IntoIterator<Item = Guid>) -> Self {
        Self { related: related.into_iter().collect(), named: Vec::new() }
    }

    /// Whether a provider may execute a consumer's commands only while that controls the resource.
    pub(super) fn is_controlled(&self, provider: Guid, consumer: Guid) -> bool {
        self.related.contains(&provider) && !self.related.contains(&consumer)
    }

    /// Whether a provider of the resource is commanded by another one of it.
    pub(super) fn is_nested(&self, provider: Guid, consumer: Guid) -> bool {
        self.related.contains(&provider) && self.related.contains(&consumer)
    }

    /// The arbiter reports.
    pub(super) fn report(&mut self, report: &ResourceAllocationReport) {
        let session = report.control_info.iter().next().and_then(|info| info.control_session);
        let holder = session.map(|session| session.controlling_consumer);
        if self.named.last() != Some(&holder) {
            self.named.push(holder);
        }
    }

    /// A command has come to another state.
    pub(super) fn step(&mut self, step: &Step) -> Result<(), String> {
        let (CommandState::Executing, Some(consumer)) = (step.transition.to, step.consumer) else {
            return Ok(());
        };
        match step.family {
            ResourceAllocationPriorityCommand::NAME => Ok(()),
            ResourceAllocationCommand::NAME => {
                let named = self.named.pop();
                self.named = vec![named.unwrap_or_default()];
                match named == Some(Some(consumer)) {
                    true => Ok(()),
                    false => Err(format!("control is given to {consumer}, the report names {named:?}")),
                }
            }
            _ if !self.is_controlled(step.key.source, consumer) => Ok(()),
            _ if self.named.contains(&Some(consumer)) => Ok(()),
            _ => Err(format!(
                "{} executes a command of {consumer}; since the last confirmed report {:?} were named",
                step.key.source, self.named
            )),
        }
    }
}
