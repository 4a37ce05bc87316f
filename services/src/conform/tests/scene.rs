//! A bus on which things happen: an arbiter, two consumers, a pilot and a nested pilot, a set and a list.

use crate::conform::*;
use aldis_envelope::{EntityId, Guid, Instance, KeyHash, KeyWidth, Monotonic, ServiceId, Source};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::time::Duration;

pub(super) const ARBITER: u8 = 1;
pub(super) const ALICE: u8 = 2;
pub(super) const BOB: u8 = 3;
pub(super) const PILOT: u8 = 4;
pub(super) const NESTED: u8 = 5;
pub(super) const MALLORY: u8 = 6;
pub(super) const AUTOPILOT: u8 = 10;

pub(super) const ALLOCATION: &str = "UMAA::SO::ResourceAllocation::ResourceAllocation";
pub(super) const PRIORITY: &str = "UMAA::SO::ResourceAllocation::ResourceAllocationPriority";
pub(super) const VECTOR: &str = "UMAA::MO::GlobalVectorControl::GlobalVector";
pub(super) const HEALTH: &str = "UMAA::SO::HealthReport::HealthReport";
pub(super) const ROUTE: &str = "UMAA::MM::RouteReport::RouteReport";
pub(super) const AREAS: &str = "UMAA::MM::RouteReport::RouteReportTypeAreasSetElement";
pub(super) const POINTS: &str = "UMAA::MM::RouteReport::RouteReportTypePointsListElement";

/// A GUID of RFC 4122's variant.
pub(super) fn id(number: u8) -> String {
    format!("{number:02x}000000-0000-4000-8000-000000000000")
}

pub(super) const NIL: &str = "00000000-0000-0000-0000-000000000000";

pub(super) struct Scene {
    monitor: Monitor,
    now: Duration,
    /// The latest timestamp given.
    seconds: i64,
    commands: BTreeMap<(String, u8), Value>,
    last_status: Value,
    pub(super) retained: bool,
}

/// The names of the clauses that a report has broken.
pub(super) fn finished(scene: Scene) -> Vec<Clause> {
    scene.finish().broken().map(|found| found.clause).collect()
}

impl Scene {
    pub(super) fn new() -> Self {
        let monitor = Monitor::new(Bounds::default(), [format!("{VECTOR}ExecutionStatusReport")]);
        Self {
            monitor,
            now: Duration::ZERO,
            seconds: 0,
            commands: BTreeMap::new(),
            last_status: Value::Null,
            retained: false,
        }
    }

    /// The same scene with other bounds.
    pub(super) fn bounded(self, bounds: Bounds) -> Self {
        let monitor = Monitor::new(bounds, [format!("{VECTOR}ExecutionStatusReport")]);
        Self { monitor, ..self }
    }

    /// A scene in which Alice may control the autopilot and Bob goes before her.
    pub(super) fn with_priorities() -> Self {
        let mut scene = Self::new();
        scene.config(&[PILOT, NESTED]);
        scene.priorities(&[ALICE, BOB]);
        scene.control(None);
        scene
    }

    pub(super) fn finish(self) -> Report {
        self.monitor.finish(Monotonic::since_start(self.now))
    }

    pub(super) fn wait(&mut self, seconds: u64) {
        self.now += Duration::from_secs(seconds);
    }

    pub(super) fn time(&mut self) -> Value {
        self.seconds += 1;
        json!({ "seconds": self.seconds, "nanoseconds": 0 })
    }

    pub(super) fn observe(&mut self, topic: &str, value: &Value, observed: Observed) {
        let type_name = if collection::is_element(topic) { topic.to_owned() } else { format!("{topic}Type") };
        self.observe_as(topic, &type_name, hash(topic, value), value, observed);
    }

    pub(super) fn observe_as(
        &mut self,
        topic: &str,
        type_name: &str,
        instance: KeyHash,
        key: &Value,
        observed: Observed,
    ) {
        self.now += Duration::from_millis(10);
        let (at, retained) = (Monotonic::since_start(self.now), self.retained);
        let writer = Source::new(EntityId::new(1).unwrap(), ServiceId::NODE);
        let (topic, type_name) = (topic.to_owned(), Some(type_name.to_owned()));
        let key = Some(key.clone()).filter(|key| !key.is_null());
        self.monitor.observe(&Observation {
            at,
            writer,
            topic,
            type_name,
            instance,
            key,
            retained,
            observed,
        });
    }

    pub(super) fn put(&mut self, topic: &str, value: Value) {
        self.observe(topic, &value, Observed::Put(Content::Sample(value.clone())));
    }

    pub(super) fn command_value(&mut self, consumer: u8, provider: u8, session: u8, own: &Value) -> Value {
        let mut value = own.clone();
        value["timeStamp"] = self.time();
        value["source"] = id(consumer).into();
        value["sessionID"] = id(session).into();
        value["destination"] = id(provider).into();
        value
    }

    pub(super) fn command(&mut self, family: &str, consumer: u8, provider: u8, session: u8, own: Value) {
        let value = self.command_value(consumer, provider, session, &own);
        self.commands.insert((family.to_owned(), session), value.clone());
        self.put(&format!("{family}Command"), value);
    }

    pub(super) fn command_now(&self, family: &str, session: u8) -> Value {
        self.commands[&(family.to_owned(), session)].clone()
    }

    pub(super) fn allocate(&mut self, consumer: u8, session: u8, duration: Option<f64>) {
        let own = json!({ "duration": duration, "resourceID": id(AUTOPILOT) });
        self.command(ALLOCATION, consumer, ARBITER, session, own);
    }

    pub(super) fn vector(&mut self, consumer: u8, provider: u8, session: u8) {
        self.command(VECTOR, consumer, provider, session, json!({ "heading": 1.5 }));
    }

    pub(super) fn command_change(&mut self, family: &str, session: u8, change: Observed) {
        let value = self.commands[&(family.to_owned(), session)].clone();
        self.observe(&format!("{family}Command"), &value, change);
    }

    pub(super) fn status(&mut self, family: &str, provider: u8, session: u8, state: &str, reason: &str) {
        let time = self.time();
        let value = json!({
            "timeStamp": time, "source": id(provider), "sessionID": id(session),
            "commandStatus": state, "commandStatusReason": reason, "logMessage": "",
        });
        self.last_status = value.clone();
        self.put(&format!("{family}CommandStatus"), value);
    }

    /// The latest status comes once more, as it was.
    pub(super) fn status_again(&mut self, family: &str) {
        self.put(&format!("{family}CommandStatus"), self.last_status.clone());
    }

    pub(super) fn ack(&mut self, family: &str, provider: u8, session: u8) {
        let command = self.commands[&(family.to_owned(), session)].clone();
        self.ack_of(family, provider, session, command);
    }

    pub(super) fn ack_of(&mut self, family: &str, provider: u8, session: u8, command: Value) {
        let time = self.time();
        let value = json!({ "command": command, "timeStamp": time, "source": id(provider), "sessionID": id(session) });
        self.put(&format!("{family}CommandAckReport"), value);
    }

    pub(super) fn execution_status(&mut self, provider: u8, session: u8) {
        let time = self.time();
        let value = json!({ "timeStamp": time, "source": id(provider), "sessionID": id(session) });
        self.put(&format!("{VECTOR}ExecutionStatusReport"), value);
    }

    /// From the start to COMMANDED.
    pub(super) fn accept(&mut self, family: &str, provider: u8, session: u8) {
        self.status(family, provider, session, "ISSUED", "SUCCEEDED");
        self.ack(family, provider, session);
        self.status(family, provider, session, "COMMANDED", "SUCCEEDED");
    }

    /// From the start to EXECUTING.
    pub(super) fn execute(&mut self, family: &str, provider: u8, session: u8) {
        self.accept(family, provider, session);
        self.status(family, provider, session, "EXECUTING", "SUCCEEDED");
        if family == VECTOR {
            self.execution_status(provider, session);
        }
    }

    /// Gives control as the ICD asks.
    pub(super) fn give(&mut self, consumer: u8, session: u8, duration: Option<f64>) {
        self.allocate(consumer, session, duration);
        self.accept(ALLOCATION, ARBITER, session);
        self.control(Some(consumer));
        self.status(ALLOCATION, ARBITER, session, "EXECUTING", "SUCCEEDED");
    }

    /// What a provider said of a command is disposed.
    pub(super) fn clear(&mut self, family: &str, provider: u8, session: u8) {
        let key = json!({ "source": id(provider), "sessionID": id(session) });
        self.observe(&format!("{family}CommandStatus"), &key, Observed::Dispose);
        self.observe(&format!("{family}CommandAckReport"), &key, Observed::Dispose);
        if family == VECTOR {
            self.observe(&format!("{VECTOR}ExecutionStatusReport"), &key, Observed::Dispose);
        }
    }

    /// A command that is over is cleared up.
    pub(super) fn clean_up(&mut self, family: &str, provider: u8, session: u8) {
        self.command_change(family, session, Observed::Dispose);
        self.clear(family, provider, session);
    }

    pub(super) fn config(&mut self, sources: &[u8]) {
        let sources: Vec<_> = sources.iter().map(|source| id(*source)).collect();
        let resources = json!([{ "relatedSources": sources, "resourceID": id(AUTOPILOT) }]);
        let time = self.time();
        let value = json!({ "resources": resources, "timeStamp": time, "source": id(ARBITER) });
        self.put(&format!("{ALLOCATION}ConfigReport"), value);
    }

    pub(super) fn priorities(&mut self, consumers: &[u8]) {
        let consumers: Vec<_> = consumers.iter().map(|consumer| id(*consumer)).collect();
        let priorities = json!([{ "priorities": consumers, "resourceID": id(AUTOPILOT) }]);
        let time = self.time();
        let value = json!({ "priorities": priorities, "timeStamp": time, "source": id(ARBITER) });
        self.put(&format!("{ALLOCATION}PriorityReport"), value);
    }

    pub(super) fn control(&mut self, holder: Option<u8>) {
        self.control_by(ARBITER, holder);
    }

    pub(super) fn control_by(&mut self, arbiter: u8, holder: Option<u8>) {
        let session = holder.map(|holder| json!({ "controllingConsumer": id(holder), "endTime": null }));
        let info = json!([{ "controlSession": session, "resourceID": id(AUTOPILOT) }]);
        let time = self.time();
        let value = json!({ "controlInfo": info, "timeStamp": time, "source": id(arbiter) });
        self.put(&format!("{ALLOCATION}Report"), value);
    }

    pub(super) fn health_value(&mut self) -> Value {
        let (log_time, time) = (self.time(), self.time());
        json!({
            "code": "NONE", "logTime": log_time, "severity": "NONE", "status": "", "timeStamp": time,
            "source": id(PILOT), "resourceID": id(AUTOPILOT),
        })
    }

    /// A set that ends with that element, or with its disposal.
    pub(super) fn set(&mut self, last: &str, timestamp: Value, size: usize) {
        let metadata = json!({
            "setID": id(50), "updateElementID": last, "updateElementTimestamp": timestamp, "size": size,
        });
        self.route("areas", metadata);
    }

    pub(super) fn list(&mut self, last: u8, timestamp: Value, start: u8, size: usize) {
        let metadata = json!({
            "listID": id(60), "updateElementID": id(last), "updateElementTimestamp": timestamp,
            "startingElementID": id(start), "size": size,
        });
        self.route("points", metadata);
    }

    fn route(&mut self, member: &str, metadata: Value) {
        let time = self.time();
        self.put(ROUTE, json!({ member: metadata, "timeStamp": time, "source": id(PILOT) }));
    }

    /// An element of the set; its timestamp.
    pub(super) fn area(&mut self, set: u8, element: u8) -> Value {
        let time = self.time();
        let value =
            json!({ "element": 1, "setID": id(set), "elementID": id(element), "elementTimestamp": time });
        self.put(AREAS, value);
        time
    }

    /// An element of the list; its timestamp.
    pub(super) fn point(&mut self, element: u8, next: Option<u8>) -> Value {
        let time = self.time();
        let value = json!({
            "element": 1, "listID": id(60), "elementID": id(element), "elementTimestamp": time,
            "nextElementID": next.map(id),
        });
        self.put(POINTS, value);
        time
    }
}

/// The key hash, worked out from what the topic's name says of its key.
fn hash(topic: &str, value: &Value) -> KeyHash {
    let members: &[&str] = match topic {
        HEALTH => &["source", "resourceID"],
        AREAS | POINTS => &["elementID"],
        _ if topic.ends_with("Command") => &["source", "sessionID", "destination"],
        _ if topic.contains("Command") || topic.contains("ExecutionStatus") => &["source", "sessionID"],
        _ => &["source"],
    };
    let guid =
        |name: &&str| value[*name].as_str().and_then(|text| text.parse::<Guid>().ok()).unwrap_or_default();
    let key: Vec<u8> = members.iter().flat_map(|name| guid(name).0).collect();
    let width = if members.len() == 1 { KeyWidth::Fits16 } else { KeyWidth::Wider };
    Instance::of_key(key.into(), width).hash
}
