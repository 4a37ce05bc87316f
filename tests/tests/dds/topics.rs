//! Every topic of Support Operations, in every form that peers have.

use crate::id;
use crate::peer::{Peer, Stage};
use serde_json::{Map, Value, json};

const FORMS: [&str; 2] = ["final", "appendable"];
/// The sources of these samples, by which they are told from what the nodes themselves say: of full ones and of sparse ones, for
/// each way.
const SOURCES: [[u8; 2]; 2] = [[0xa1, 0xa2], [0xb1, 0xb2]];

fn time(seconds: i64) -> Value {
    json!({"seconds": seconds, "nanoseconds": 7})
}

/// A topic, with one sample that has all that it may have and one that has nothing of it.
struct Case {
    topic: String,
    full: Value,
    sparse: Value,
    keys: &'static [&'static str],
}

fn case(
    [all, few]: [u8; 2],
    topic: &str,
    keys: &'static [&'static str],
    full: Value,
    absent: &Value,
) -> Case {
    let with = |source: u8, more: &Value| {
        let mut sample = full.as_object().expect("a sample is an object").clone();
        sample.extend(more.as_object().expect("what differs is an object").clone());
        sample.insert("source".into(), id(source).into());
        Value::Object(sample)
    };
    let topic = format!("UMAA::SO::{topic}");
    Case { topic, full: with(all, &json!({})), sparse: with(few, absent), keys }
}

/// The topics of 5.2.1, but the configuration's, which is another in each version.
fn cases(sources: [u8; 2]) -> Vec<Case> {
    const SESSION: &[&str] = &["source", "sessionID"];
    const COMMAND: &[&str] = &["source", "sessionID", "destination"];
    let resources = |name: &str| format!("ResourceAllocation::ResourceAllocation{name}");
    let command = json!({"duration": 2.5, "resourceID": id(3), "timeStamp": time(1), "source": id(sources[0]),
                         "sessionID": id(4), "destination": id(5)});
    let no_duration = json!({"duration": null, "resourceID": id(3), "timeStamp": time(1), "source": id(sources[1]),
                             "sessionID": id(4), "destination": id(5)});
    let priority = json!({"priorities": [id(6), id(7)], "resourceID": id(3), "timeStamp": time(1),
                          "source": id(sources[0]), "sessionID": id(4), "destination": id(5)});
    let status = json!({"timeStamp": time(2), "sessionID": id(4), "commandStatus": "EXECUTING",
                        "commandStatusReason": "SUCCEEDED", "logMessage": "it goes on"});
    let ack = |command: &Value| json!({"command": command, "timeStamp": time(3), "sessionID": id(4)});
    let held =
        json!({"controlSession": {"controllingConsumer": id(8), "endTime": time(9)}, "resourceID": id(3)});
    let endless =
        json!({"controlSession": {"controllingConsumer": id(8), "endTime": null}, "resourceID": id(2)});
    let free = json!({"controlSession": null, "resourceID": id(1)});
    let infos =
        json!([{"priorities": [id(6), id(7)], "resourceID": id(3)}, {"priorities": [], "resourceID": id(2)}]);
    vec![
        case(
            sources,
            "HealthReport::HealthReport",
            &["source", "resourceID"],
            json!({"code": "SENSOR", "logTime": time(1), "severity": "FAIL", "status": "blind", "timeStamp": time(2),
                   "resourceID": id(3)}),
            &json!({"status": ""}),
        ),
        case(
            sources,
            "LogReport::LogReport",
            &["source"],
            json!({"entry": "Grüße", "level": "WARNING", "timeStamp": time(2)}),
            &json!({"entry": ""}),
        ),
        case(sources, &resources("Command"), COMMAND, command.clone(), &no_duration),
        case(sources, &resources("CommandStatus"), SESSION, status.clone(), &json!({"logMessage": ""})),
        case(sources, &resources("CommandAckReport"), SESSION, ack(&command), &ack(&no_duration)),
        case(
            sources,
            &resources("Report"),
            &["source"],
            json!({"controlInfo": [held, endless, free], "timeStamp": time(4)}),
            &json!({"controlInfo": []}),
        ),
        case(sources, &resources("PriorityCommand"), COMMAND, priority.clone(), &json!({"priorities": []})),
        case(sources, &resources("PriorityCommandStatus"), SESSION, status, &json!({"logMessage": ""})),
        case(
            sources,
            &resources("PriorityCommandAckReport"),
            SESSION,
            ack(&priority),
            &json!({"timeStamp": time(0)}),
        ),
        case(
            sources,
            &resources("PriorityReport"),
            &["source"],
            json!({"priorities": infos, "timeStamp": time(5)}),
            &json!({"priorities": []}),
        ),
    ]
}

/// The resources of a provider, inline.
fn configuration(sources: [u8; 2]) -> Case {
    let resources = json!([{"relatedSources": [id(8)], "resourceID": id(3)}, {"relatedSources": [], "resourceID": id(2)}]);
    case(
        sources,
        "ResourceAllocation::ResourceAllocationConfigReport",
        &["source"],
        json!({"resources": resources, "timeStamp": time(6)}),
        &json!({"resources": []}),
    )
}

/// What 6.0 has for GUIDs of 5.2.1: `parent` is that of each.
fn newer(value: &Value, parent: u8) -> Value {
    let identifier = |guid: &Value| json!({"id": guid, "parentID": id(parent)});
    let member = |(name, value): (&String, &Value)| {
        let value = match name.as_str() {
            "source" | "destination" | "resourceID" | "controllingConsumer" => identifier(value),
            "relatedSources" | "priorities" if value[0].is_string() => {
                value.as_array().expect("a list").iter().map(identifier).collect()
            }
            _ => newer(value, parent),
        };
        (name.clone(), value)
    };
    match value {
        Value::Object(members) => Value::Object(members.iter().map(member).collect()),
        Value::Array(elements) => elements.iter().map(|element| newer(element, parent)).collect(),
        other => other.clone(),
    }
}

impl Case {
    fn newer(&self, parent: u8) -> Self {
        let is_health = self.topic.ends_with("HealthReport");
        let mut sparse = newer(&self.sparse, parent);
        if is_health && parent != 0 {
            sparse["status"] = Value::Null;
        }
        let keys = if is_health { &["source", "code", "resourceID"] } else { self.keys };
        Self { topic: format!("{}Type", self.topic), full: newer(&self.full, parent), sparse, keys }
    }

    fn key(&self, sample: &Value) -> Value {
        self.keys.iter().map(|name| ((*name).to_owned(), sample[name].clone())).collect::<Map<_, _>>().into()
    }
}

/// As text, the same for the same members in whatever order.
fn text(value: &Value) -> String {
    match value {
        Value::Object(members) => {
            let members: std::collections::BTreeMap<_, _> =
                members.iter().map(|(name, value)| (name, text(value))).collect();
            format!("{members:?}")
        }
        Value::Array(elements) => format!("{:?}", elements.iter().map(text).collect::<Vec<_>>()),
        other => other.to_string(),
    }
}

/// The next lines of samples of one way, in an order of their own: each topic has a thread in the peer.
fn hears(peer: &Peer, sources: [u8; 2], count: usize) -> Vec<String> {
    let is_ours = |line: &Value| {
        let source = &line[2]["source"];
        let found = if source.is_object() { &source["id"] } else { source };
        sources.iter().any(|own| *found == id(*own))
    };
    let lines = std::iter::repeat_with(|| peer.any()).filter(is_ours).take(count);
    let mut heard: Vec<_> = lines.map(|line| text(&json!([line[0], line[1], line[2]]))).collect();
    heard.sort();
    heard
}

/// Everything that crosses from one peer to those on the other side, whatever their types may grow like.
fn crosses(
    (writer, from): (&mut Peer, &[Case]),
    (readers, to): (&[Peer], &[Case]),
    sources: [u8; 2],
    at: i64,
) {
    let sorted = |mut lines: Vec<String>| {
        lines.sort();
        lines
    };
    for case in from {
        for sample in [&case.full, &case.sparse] {
            writer.tell(&json!(["write", case.topic, sample, at + 1]));
        }
    }
    let put = |case: &Case, sample: &Value| text(&json!([case.topic, "alive", sample]));
    let expected = to.iter().flat_map(|case| [put(case, &case.full), put(case, &case.sparse)]);
    let expected = sorted(expected.collect());
    for reader in readers {
        assert_eq!(hears(reader, sources, expected.len()), expected);
    }
    for case in from {
        writer.tell(&json!(["dispose", case.topic, case.full, at + 2]));
        writer.tell(&json!(["unregister", case.topic, case.sparse, at + 2]));
    }
    let ends = to.iter().flat_map(|case| {
        [("disposed", &case.full), ("no_writers", &case.sparse)]
            .map(|(state, sample)| text(&json!([case.topic, state, case.key(sample)])))
    });
    let expected = sorted(ends.collect());
    for reader in readers {
        assert_eq!(hears(reader, sources, expected.len()), expected);
    }
}

/// One way and the other, from each form to both.
fn both_ways(stage: &Stage, versions: [&str; 2], cases: impl Fn(usize, [u8; 2]) -> Vec<Case>) {
    for (from, sources) in SOURCES.into_iter().enumerate() {
        let (sent, heard) = (cases(from, sources), cases(1 - from, sources));
        let qos = json!({"keep_all": true});
        let mut readers = FORMS.map(|_| stage.peer(1 - from));
        for (reader, form) in readers.iter_mut().zip(FORMS) {
            let kind = format!("{} {form}", versions[1 - from]);
            heard.iter().for_each(|case| reader.reader(&case.topic, &kind, qos.clone()));
            heard.iter().for_each(|case| reader.matched(&case.topic, 1));
        }
        for (turn, form) in (0..).zip(FORMS) {
            let mut writer = stage.peer(from);
            let kind = format!("{} {form}", versions[from]);
            sent.iter().for_each(|case| writer.writer(&case.topic, &kind, qos.clone()));
            sent.iter().for_each(|case| writer.matched(&case.topic, 1));
            crosses((&mut writer, &sent), (&readers, &heard), sources, 10 * turn);
        }
    }
}

#[test]
fn all_topics_of_the_older_version_cross_both_ways_in_both_forms() {
    let Some(stage) = Stage::new("") else { return };
    both_ways(&stage, ["5.2.1", "5.2.1"], |_, sources| {
        cases(sources).into_iter().chain([configuration(sources)]).collect()
    });
}

#[test]
fn all_topics_of_the_newer_version_cross_as_they_are_between_buses_of_it() {
    let Some(stage) = Stage::new("version = \"6.0\"\ntranslate = false") else { return };
    both_ways(&stage, ["6.0", "6.0"], |_, sources| cases(sources).iter().map(|case| case.newer(9)).collect());
}

#[test]
fn a_vehicle_of_the_older_version_and_a_shore_of_the_newer_understand_each_other() {
    let Some(stage) = Stage::of_versions(["version = \"6.0\"", ""]) else { return };
    both_ways(&stage, ["6.0", "5.2.1"], |place, sources| {
        let cases = cases(sources);
        if place == 0 { cases.iter().map(|case| case.newer(0)).collect() } else { cases }
    });
}
