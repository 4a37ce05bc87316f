//! The arbiter: the service that provides ResourceAllocation.

use super::super::command::{Everybody, Provider, Writer, is_about};
use super::control::Control;
use super::priority::Priorities;
use super::settings::Arbitration;
use crate::service::{Input, Outbox, Service};
use aldis_envelope::umaa::{
    Key, ResourceAllocationCommand, ResourceAllocationConfigReport, ResourceAllocationDefinition,
    ResourceAllocationPriorityCommand, Sequence, SourceKey,
};
use aldis_envelope::{Change, Guid, Guids, Monotonic, Now, Prefix, Refusal, Source};

/// Gives control of its resources to one consumer at a time.
pub struct Arbiter {
    guid: Guid,
    arbitration: Arbitration,
    allocation: Provider<ResourceAllocationCommand, Control, Everybody>,
    priority: Provider<ResourceAllocationPriorityCommand, Priorities, Everybody>,
    configs: Writer<ResourceAllocationConfigReport>,
}

impl Arbiter {
    /// An arbiter that runs as a service with these ids.
    pub fn new(source: Source, guids: &Guids, arbitration: Arbitration) -> Self {
        let guid = guids.of_service(source);
        let control = Control::new(source, guid, &arbitration);
        let priorities = Priorities::new(source, guid, &arbitration);
        let settings = arbitration.commands();
        Self {
            guid,
            allocation: Provider::new(source, guids.clone(), settings.clone(), control, Everybody),
            priority: Provider::new(source, guids.clone(), settings, priorities, Everybody),
            configs: Writer::new(source),
            arbitration,
        }
    }

    fn config(&self, now: Now) -> ResourceAllocationConfigReport {
        let resources = self.arbitration.settings().resources.iter().map(|resource| {
            let related_sources = Sequence::new(resource.related_sources.clone()).unwrap_or_default();
            ResourceAllocationDefinition { related_sources, resource_id: resource.id }
        });
        // The settings hold no more resources than fit, and no more providers.
        let resources = Sequence::new(resources.collect()).unwrap_or_default();
        ResourceAllocationConfigReport { resources, time_stamp: now.wall.into(), source: self.guid }
    }

    /// The report of the configuration: takes over that of a former life, and ends with this one (ICD 4.2.1.1, 4.2.1.3).
    fn tell_config(&self, now: Now, input: &Input<'_>, out: &mut Outbox) {
        let own = SourceKey { source: self.guid };
        match input {
            Input::HistoryComplete(_) => self.configs.put(&self.config(now), out),
            Input::Shutdown => {
                self.configs.dispose(own, out);
                self.configs.unregister(own, out);
            }
            Input::Recovered(envelope)
                if is_about::<ResourceAllocationConfigReport>(envelope)
                    && envelope.message.change == Change::Put =>
            {
                let key = envelope.message.instance.as_deref().and_then(SourceKey::of_instance);
                if let Some(key) = key.filter(|key| *key != own) {
                    self.configs.dispose(key, out);
                }
            }
            _ => {}
        }
    }
}

impl Service for Arbiter {
    fn subscriptions(&self) -> Vec<Prefix> {
        self.allocation.subscriptions().into_iter().chain(self.priority.subscriptions()).collect()
    }

    fn follows_bus(&self) -> bool {
        true
    }

    fn goes_by_what_is_kept(&self) -> bool {
        true
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        if let Input::Message(envelope) = &input
            && envelope.message.call.is_some()
        {
            let what = envelope.message.label.descriptor().to_owned();
            out.refuse(envelope, Refusal::NotUnderstood(what));
            return;
        }
        // Lists first: an allocation that came with a list is judged by it.
        self.priority.handle(now, &input, out);
        for (resource, priorities) in self.priority.executor_mut().changes() {
            self.allocation.executor_mut().set_priorities(resource, priorities);
        }
        self.tell_config(now, &input, out);
        self.allocation.handle(now, &input, out);
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        [self.allocation.next_deadline(), self.priority.next_deadline()].into_iter().flatten().min()
    }
}

#[cfg(test)]
mod tests;
