//! The topics of Support Operations (ICD 5.1, tables 9 to 32 and 38), typed in from there: names, members, ranges.

use super::ledger::Ledger;
use super::sample::{Sample, guid, time};
use super::{Clause, Observation, collection};
use aldis_envelope::{Guid, Instance, KeyHash, KeyWidth};
use serde_json::Value;

/// What a member may hold.
#[derive(Debug, Clone, Copy)]
enum Kind {
    Guid,
    DateTime,
    /// Seconds, 0 to 37 817 280.
    Duration,
    /// At most 4095 bytes.
    Text,
    Enumeration(&'static [&'static str]),
    Sequence(&'static Kind, usize),
    Structure(&'static [Member]),
}

/// A member: its name, what it holds, whether it may be absent.
type Member = (&'static str, Kind, bool);

const fn must(name: &'static str, kind: Kind) -> Member {
    (name, kind, false)
}

const fn may(name: &'static str, kind: Kind) -> Member {
    (name, kind, true)
}

const STATES: Kind =
    Kind::Enumeration(&["ISSUED", "COMMANDED", "EXECUTING", "COMPLETED", "FAILED", "CANCELED"]);
const REASONS: Kind = Kind::Enumeration(&[
    "SUCCEEDED",
    "UPDATED",
    "CANCELED",
    "VALIDATION_FAILED",
    "OBJECTIVE_FAILED",
    "RESOURCE_FAILED",
    "RESOURCE_REJECTED",
    "SERVICE_FAILED",
    "INTERRUPTED",
    "TIMEOUT",
]);
const CODES: Kind = Kind::Enumeration(&[
    "ACTUATOR",
    "FILESYS",
    "NONE",
    "POWER",
    "PROCESSOR",
    "RAM",
    "ROM",
    "SENSOR",
    "SOFTWARE",
]);
const CONDITIONS: Kind = Kind::Enumeration(&["ERROR", "FAIL", "INFO", "NONE", "WARN"]);
const LEVELS: Kind = Kind::Enumeration(&["ERROR", "INFORMATION", "WARNING"]);

const TIME_STAMP: Member = must("timeStamp", Kind::DateTime);
const SOURCE: Member = must("source", Kind::Guid);
const SESSION: Member = must("sessionID", Kind::Guid);
const DESTINATION: Member = must("destination", Kind::Guid);
const RESOURCE: Member = must("resourceID", Kind::Guid);
const IDS: Kind = Kind::Sequence(&Kind::Guid, 100);

const ALLOCATION: &[Member] =
    &[may("duration", Kind::Duration), RESOURCE, TIME_STAMP, SOURCE, SESSION, DESTINATION];
const PRIORITY: &[Member] = &[must("priorities", IDS), RESOURCE, TIME_STAMP, SOURCE, SESSION, DESTINATION];
const STATUS: &[Member] = &[
    TIME_STAMP,
    SOURCE,
    SESSION,
    must("commandStatus", STATES),
    must("commandStatusReason", REASONS),
    must("logMessage", Kind::Text),
];
const CONTROL_SESSION: Kind =
    Kind::Structure(&[must("controllingConsumer", Kind::Guid), may("endTime", Kind::DateTime)]);
const CONTROL_INFO: Kind = Kind::Structure(&[may("controlSession", CONTROL_SESSION), RESOURCE]);
const DEFINITION: Kind = Kind::Structure(&[must("relatedSources", IDS), RESOURCE]);
const PRIORITY_INFO: Kind = Kind::Structure(&[must("priorities", IDS), RESOURCE]);

/// A service, a topic of it, its members, and those that are its key.
type Topic = (&'static str, &'static str, &'static [Member], &'static [&'static str]);

const COMMAND_KEY: &[&str] = &["source", "sessionID", "destination"];
const SESSION_KEY: &[&str] = &["source", "sessionID"];
const SOURCE_KEY: &[&str] = &["source"];

const TOPICS: [Topic; 11] = [
    (
        "HealthReport",
        "HealthReport",
        &[
            must("code", CODES),
            must("logTime", Kind::DateTime),
            must("severity", CONDITIONS),
            must("status", Kind::Text),
            TIME_STAMP,
            SOURCE,
            RESOURCE,
        ],
        &["source", "resourceID"],
    ),
    (
        "LogReport",
        "LogReport",
        &[must("entry", Kind::Text), must("level", LEVELS), TIME_STAMP, SOURCE],
        SOURCE_KEY,
    ),
    ("ResourceAllocation", "ResourceAllocationCommand", ALLOCATION, COMMAND_KEY),
    ("ResourceAllocation", "ResourceAllocationCommandStatus", STATUS, SESSION_KEY),
    (
        "ResourceAllocation",
        "ResourceAllocationCommandAckReport",
        &[must("command", Kind::Structure(ALLOCATION)), TIME_STAMP, SOURCE, SESSION],
        SESSION_KEY,
    ),
    (
        "ResourceAllocation",
        "ResourceAllocationReport",
        &[must("controlInfo", Kind::Sequence(&CONTROL_INFO, 256)), TIME_STAMP, SOURCE],
        SOURCE_KEY,
    ),
    (
        "ResourceAllocation",
        "ResourceAllocationConfigReport",
        &[must("resources", Kind::Sequence(&DEFINITION, 256)), TIME_STAMP, SOURCE],
        SOURCE_KEY,
    ),
    ("ResourceAllocation", "ResourceAllocationPriorityCommand", PRIORITY, COMMAND_KEY),
    ("ResourceAllocation", "ResourceAllocationPriorityCommandStatus", STATUS, SESSION_KEY),
    (
        "ResourceAllocation",
        "ResourceAllocationPriorityCommandAckReport",
        &[must("command", Kind::Structure(PRIORITY)), TIME_STAMP, SOURCE, SESSION],
        SESSION_KEY,
    ),
    (
        "ResourceAllocation",
        "ResourceAllocationPriorityReport",
        // The scanned table has lost the bound; the public IDL of this version says 32.
        &[must("priorities", Kind::Sequence(&PRIORITY_INFO, 32)), TIME_STAMP, SOURCE],
        SOURCE_KEY,
    ),
];

fn topic(name: &str) -> Option<&'static Topic> {
    let (service, topic) = name.strip_prefix("UMAA::SO::")?.split_once("::")?;
    TOPICS.iter().find(|known| (known.0, known.1) == (service, topic))
}

/// Looks at the names of topic and type. In other functional areas only the form of a name can be looked at.
pub(super) fn check_names(observation: &Observation, ledger: &mut Ledger) {
    let name = observation.topic.as_str();
    let chunks: Vec<_> = name.split("::").collect();
    let well_formed = chunks.len() == 4 && chunks.iter().all(|chunk| !chunk.is_empty());
    let known = topic(name).is_some() || !name.starts_with("UMAA::SO::") || collection::is_element(name);
    ledger.judge(Clause::TopicName, well_formed && known, || format!("there is no topic {name}"));
    if let Some(told) = &observation.type_name {
        let wanted = if collection::is_element(name) { name.to_owned() } else { format!("{name}Type") };
        ledger.judge(Clause::TypeName, *told == wanted, || {
            format!("the type is {told}, it should be {wanted}")
        });
    }
}

/// Looks at the members of a sample and at its instance.
pub(super) fn check_sample(observation: &Observation, sample: &Sample, ledger: &mut Ledger) {
    let Some((_, _, members, key)) = topic(&observation.topic) else { return };
    structure(members, sample.value(), "", ledger);
    let guids: Option<Vec<_>> = key.iter().map(|member| sample.guid(member)).collect();
    if let Some(guids) = guids {
        let hash = hash_of(&guids);
        ledger.judge(Clause::Key, hash == observation.instance, || {
            format!("the key hash is {}, that of the key members is {hash}", observation.instance)
        });
    }
}

/// The key hash of GUIDs: one is its own, more are digested.
fn hash_of(guids: &[Guid]) -> KeyHash {
    let key: Vec<_> = guids.iter().flat_map(|guid| guid.0).collect();
    let width = if guids.len() == 1 { KeyWidth::Fits16 } else { KeyWidth::Wider };
    Instance::of_key(key.into(), width).hash
}

fn structure(members: &[Member], value: &Value, at: &str, ledger: &mut Ledger) {
    let Some(object) = value.as_object() else {
        ledger.broken(Clause::Members, format!("{at} is no structure: {value}"));
        return;
    };
    let unknown = object.keys().find(|name| members.iter().all(|(known, ..)| known != name));
    ledger.judge(Clause::Members, unknown.is_none(), || {
        format!("unknown member {at}{}", unknown.map_or("", |u| u))
    });
    for (name, kind, optional) in members {
        let at = format!("{at}{name}");
        match object.get(*name) {
            None | Some(Value::Null) => {
                ledger.judge(Clause::Members, *optional, || format!("{at} is missing"));
            }
            Some(value) => member(kind, value, &at, ledger),
        }
    }
}

fn member(kind: &Kind, value: &Value, at: &str, ledger: &mut Ledger) {
    let told = || format!("{at} is {value}");
    match kind {
        Kind::Guid => match guid(value) {
            Some(guid) => ledger.judge(Clause::GuidVariant, guid.is_rfc4122(), told),
            None => ledger.broken(Clause::Range, told()),
        },
        Kind::DateTime => {
            let good = time(value).is_some_and(|(_, nanoseconds)| (0..1_000_000_000).contains(&nanoseconds));
            ledger.judge(Clause::Range, good, told);
        }
        Kind::Duration => {
            let good = value.as_f64().is_some_and(|seconds| (0.0..=37_817_280.0).contains(&seconds));
            ledger.judge(Clause::Range, good, told);
        }
        Kind::Text => {
            let length = value.as_str().map(str::len);
            let good = length.is_some_and(|bytes| bytes <= 4095);
            ledger.judge(Clause::Range, good, || format!("{at} has {} bytes", length.unwrap_or_default()));
        }
        Kind::Enumeration(values) => {
            let good = value.as_str().is_some_and(|value| values.contains(&value));
            ledger.judge(Clause::Enumeration, good, told);
        }
        Kind::Sequence(kind, max) => {
            let Some(elements) = value.as_array() else { return ledger.broken(Clause::Members, told()) };
            let (length, good) = (elements.len(), elements.len() <= *max);
            ledger.judge(Clause::SequenceBound, good, || {
                format!("{at} has {length} elements, {max} are allowed")
            });
            for (index, element) in elements.iter().enumerate() {
                member(kind, element, &format!("{at}[{index}]"), ledger);
            }
        }
        Kind::Structure(members) => structure(members, value, &format!("{at}."), ledger),
    }
}
