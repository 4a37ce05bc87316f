//! Service 2: reports the health of its node's parts, and holds the latest of every resource that it hears of.

use crate::service::{Component, ComponentHealth, Condition, Input, Level, Outbox, Service};
use aldis_envelope::umaa::{self, ErrorCode, ErrorCondition, HealthReport, LongDescription, Topic};
use aldis_envelope::{
    Change, ContentType, EntityId, Envelope, Guid, Guids, KeyHash, Label, Monotonic, Name, Now, Prefix,
    ServiceId, Source, aldis,
};
use bytes::Bytes;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// How many resources are held. Beyond it, new ones are not held and the log says so.
const RESOURCES_MAX: usize = 10_000;

/// The health service of a node.
pub struct Health {
    source: Source,
    guid: Guid,
    guids: Guids,
    label: Option<Arc<Label>>,
    period: Duration,
    own: BTreeMap<Component, HealthReport>,
    heard: BTreeMap<KeyHash, HealthReport>,
    next: Option<Monotonic>,
}

impl Health {
    /// The health service of an entity; what it reports is repeated each `period`.
    pub fn new(entity: EntityId, guids: Guids, period: Duration) -> Self {
        let source = Source::new(entity, ServiceId::HEALTH);
        let (guid, label) = (guids.of_service(source), umaa::label::<HealthReport>(source).ok());
        let (own, heard) = (BTreeMap::new(), BTreeMap::new());
        Self { source, guid, guids, label, period, own, heard, next: None }
    }

    fn component(&mut self, now: Now, health: &ComponentHealth, out: &mut Outbox) {
        if health.condition == Condition::Gone {
            if let (Some(last), Some(label)) = (self.own.remove(&health.component), &self.label) {
                out.send(umaa::dispose(label.clone(), &last));
            }
            return;
        }
        if self.own.len() >= RESOURCES_MAX && !self.own.contains_key(&health.component) {
            let text =
                format!("{RESOURCES_MAX} parts report their health: {:?} is one too many", health.component);
            return out.note(Level::Warning, text);
        }
        let (resource_id, code) = match &health.component {
            Component::Service(source) => (self.guids.of_service(*source), ErrorCode::Software),
            Component::Resource("disk") => {
                (self.guids.of_resource(self.source.entity, "disk"), ErrorCode::Filesys)
            }
            Component::Resource(name) => {
                (self.guids.of_resource(self.source.entity, name), ErrorCode::Software)
            }
        };
        let (severity, code) = match health.condition {
            Condition::Well => (ErrorCondition::None, ErrorCode::None),
            Condition::Degraded => (ErrorCondition::Warn, code),
            Condition::Failed | Condition::Gone => (ErrorCondition::Fail, code),
        };
        let what = match &health.component {
            Component::Service(source) => source.to_string(),
            Component::Resource(name) => (*name).to_owned(),
        };
        let report = HealthReport {
            code,
            log_time: now.wall.into(),
            severity,
            status: LongDescription::shortened(&format!("{what}: {}", health.status)),
            time_stamp: now.wall.into(),
            source: self.guid,
            resource_id,
        };
        self.publish(&report, out);
        self.own.insert(health.component.clone(), report);
        self.next.get_or_insert(now.monotonic + self.period);
    }

    fn publish(&self, report: &HealthReport, out: &mut Outbox) {
        if let Some(label) = &self.label {
            out.send(umaa::put(label.clone(), report));
        }
    }

    fn repeat(&mut self, now: Now, out: &mut Outbox) {
        for report in self.own.values_mut() {
            report.time_stamp = now.wall.into();
        }
        for report in self.own.values() {
            self.publish(report, out);
        }
        self.next = Some(now.monotonic + self.period);
    }

    fn heard(&mut self, envelope: &Envelope, out: &mut Outbox) {
        let Some(instance) = &envelope.message.instance else { return };
        if envelope.message.change == Change::Dispose {
            self.heard.remove(&instance.hash);
            return;
        }
        if envelope.message.change != Change::Put {
            return;
        }
        match umaa::decode::<HealthReport>(&envelope.message.content) {
            Ok(report) if self.heard.len() < RESOURCES_MAX || self.heard.contains_key(&instance.hash) => {
                self.heard.insert(instance.hash, report);
            }
            Ok(report) => out.note(
                Level::Warning,
                format!("{RESOURCES_MAX} resources are held: the health of {} is not", report.resource_id),
            ),
            Err(why) => {
                out.note(
                    Level::Warning,
                    format!("health report of {} unread: {why}", envelope.message.label.source()),
                );
            }
        }
    }

    fn answer(&self, request: &Envelope, out: &mut Outbox) {
        let Ok(name) = Name::new(HealthReport::NAME) else { return };
        for report in self.own.values().chain(self.heard.values()) {
            out.reply(request, ContentType::Umaa, name.clone(), umaa::encode(report), false);
        }
        out.reply(request, ContentType::Umaa, name, Bytes::new(), true);
    }
}

impl Service for Health {
    fn subscriptions(&self) -> Vec<Prefix> {
        Prefix::new(HealthReport::NAME).into_iter().collect()
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Component(health) => self.component(now, health, out),
            Input::Message(envelope) if envelope.message.label.descriptor() == aldis::HEALTH_QUERY => {
                self.answer(envelope, out);
            }
            Input::Message(envelope) if envelope.message.call.is_some() => {
                let what = envelope.message.label.descriptor().to_owned();
                out.refuse(envelope, aldis_envelope::Refusal::NotUnderstood(what));
            }
            Input::Message(envelope) => self.heard(envelope, out),
            Input::Deadline => self.repeat(now, out),
            Input::Shutdown => {
                if let Some(label) = &self.label {
                    self.own.values().for_each(|report| out.send(umaa::dispose(label.clone(), report)));
                }
                self.own.clear();
                self.next = None;
            }
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.next
    }
}
