//! Executes priority commands: who may control a resource, and who goes before whom (ICD 5.1.3.9).

use super::super::command::{Commanded, Executor, Failure, FailureKind, Progress, Stop, Stopped, Verdict};
use super::super::command::{Writer, is_about};
use super::settings::{Arbitration, Resource, twice};
use crate::service::{Input, Level, Outbox};
use aldis_envelope::umaa::{
    self, Key, NoExecutionStatus, ResourceAllocationPriorityCommand, ResourceAllocationPriorityInfo,
    ResourceAllocationPriorityReport, Sequence, SourceKey,
};
use aldis_envelope::{Change, EntityId, Envelope, Guid, Now, Source};
use std::collections::BTreeMap;

/// The lists of all resources.
pub(super) struct Priorities {
    guid: Guid,
    resources: BTreeMap<Guid, Resource>,
    reports: Writer<ResourceAllocationPriorityReport>,
    /// The entities that may set lists.
    may_set: Vec<EntityId>,
    recover: bool,
    former: Option<ResourceAllocationPriorityReport>,
    is_reporting: bool,
    is_closing: bool,
    /// The lists that changed since they were last asked for.
    changed: Vec<(Guid, Vec<Guid>)>,
}

impl Priorities {
    pub(super) fn new(source: Source, guid: Guid, arbitration: &Arbitration) -> Self {
        let settings = arbitration.settings();
        let resources = settings.resources.iter().map(|resource| (resource.id, resource.clone()));
        let own = std::iter::once(source.entity);
        Self {
            guid,
            resources: resources.collect(),
            reports: Writer::new(source),
            may_set: own.chain(settings.priority_from.iter().copied()).collect(),
            recover: settings.recover_priorities,
            former: None,
            is_reporting: false,
            is_closing: false,
            changed: Vec::new(),
        }
    }

    /// The lists that changed since the last time.
    pub(super) fn changes(&mut self) -> Vec<(Guid, Vec<Guid>)> {
        std::mem::take(&mut self.changed)
    }

    fn set(&mut self, resource: Guid, priorities: Vec<Guid>) {
        if let Some(known) = self.resources.get_mut(&resource) {
            known.priorities.clone_from(&priorities);
            self.changed.push((resource, priorities));
        }
    }

    fn recovered(&mut self, envelope: &Envelope, out: &mut Outbox) {
        if !is_about::<ResourceAllocationPriorityReport>(envelope) || envelope.message.change != Change::Put {
            return;
        }
        let report = umaa::decode::<ResourceAllocationPriorityReport>(&envelope.message.content);
        match report {
            Ok(report) if report.source == self.guid => self.former = Some(report),
            _ => {
                let key = envelope.message.instance.as_deref().and_then(SourceKey::of_instance);
                if let Some(key) = key.filter(|key| key.source != self.guid) {
                    self.reports.dispose(key, out);
                }
            }
        }
    }

    /// The lists of the former life go before those of the configuration: a list that was set in a mission must not fall
    /// back when a process starts again.
    fn begin(&mut self, out: &mut Outbox) {
        self.is_reporting = true;
        let former = self.former.take().filter(|_| self.recover);
        for info in former.into_iter().flat_map(|report| report.priorities) {
            let Some(known) = self.resources.get(&info.resource_id) else { continue };
            let list = info.priorities.into_vec();
            if known.priorities == list || list.is_empty() || twice(&list).is_some() {
                continue;
            }
            if !known.priorities.is_empty() {
                let text = format!(
                    "the priorities of {} are those of the former life, not of the configuration: set them by a priority \
                     command, or set `recover_priorities = false`",
                    known.name
                );
                out.note(Level::Warning, text);
            }
            self.set(info.resource_id, list);
        }
        if self.changed.is_empty() {
            self.changed.extend(self.resources.values().map(|known| (known.id, known.priorities.clone())));
        }
    }

    fn report(&self, now: Now) -> ResourceAllocationPriorityReport {
        let infos = self.resources.values().map(|resource| {
            let priorities = Sequence::new(resource.priorities.clone()).unwrap_or_default();
            ResourceAllocationPriorityInfo { priorities, resource_id: resource.id }
        });
        // The settings hold no more resources than fit, and no longer lists.
        let priorities = Sequence::new(infos.collect()).unwrap_or_default();
        ResourceAllocationPriorityReport { priorities, time_stamp: now.wall.into(), source: self.guid }
    }
}

impl Executor<ResourceAllocationPriorityCommand> for Priorities {
    fn validate(
        &mut self,
        _: Now,
        commanded: Commanded<'_, ResourceAllocationPriorityCommand>,
        _: &mut Outbox,
    ) -> Verdict {
        let command = commanded.command;
        let text = match twice(&command.priorities) {
            Some(consumer) => format!("the list names {consumer} twice"),
            None if !self.resources.contains_key(&command.resource_id) => {
                format!("{} is no resource of this arbiter", command.resource_id)
            }
            None => return Verdict::Valid,
        };
        Verdict::Failed(Failure::new(FailureKind::Invalid, text))
    }

    fn start(
        &mut self,
        _: Now,
        commanded: Commanded<'_, ResourceAllocationPriorityCommand>,
        _: &mut Outbox,
    ) -> Progress<NoExecutionStatus> {
        let entity = commanded.writer.entity;
        if !self.may_set.contains(&entity) {
            let text = format!(
                "entity {entity} may not set priorities: the arbiter's configuration names those who may"
            );
            return Progress::Failed(Failure::new(FailureKind::Rejected, text));
        }
        self.set(commanded.command.resource_id, commanded.command.priorities.to_vec());
        Progress::Completed
    }

    fn progress(
        &mut self,
        _: Now,
        _: Commanded<'_, ResourceAllocationPriorityCommand>,
        _: &mut Outbox,
    ) -> Progress<NoExecutionStatus> {
        Progress::Completed
    }

    fn stop(
        &mut self,
        _: Now,
        _: Commanded<'_, ResourceAllocationPriorityCommand>,
        _: Stop,
        _: &mut Outbox,
    ) -> Stopped {
        Stopped::Now
    }

    fn observe(&mut self, _: Now, input: &Input<'_>, out: &mut Outbox) {
        match input {
            Input::Recovered(envelope) => self.recovered(envelope, out),
            Input::HistoryComplete(_) => self.begin(out),
            Input::Shutdown => self.is_closing = true,
            _ => {}
        }
    }

    fn settled(&mut self, now: Now, out: &mut Outbox) {
        let key = SourceKey { source: self.guid };
        if std::mem::take(&mut self.is_closing) {
            self.is_reporting = false;
            self.reports.dispose(key, out);
            self.reports.unregister(key, out);
        } else if self.is_reporting && !self.changed.is_empty() {
            self.reports.put(&self.report(now), out);
        }
    }
}
