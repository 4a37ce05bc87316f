use super::*;
use aldis_envelope::codec::cdr::{KeySchema, Representation, Schema};
use aldis_envelope::description::Extensibility;
use serde_json::json;

const HEALTH: &str = "UMAA::SO::HealthReport::HealthReport";
const RA: &str = "UMAA::SO::ResourceAllocation::ResourceAllocation";

/// A sample of 5.2.1 from its JSON.
fn older(translator: &Translator, topic: &str, members: serde_json::Value) -> Sample {
    let info = umaa::topic(topic).unwrap();
    let (content, _) = info.sample(&members.to_string()).unwrap();
    let schema = Schema::new(translator.older(), info.type_name).unwrap();
    let bytes = schema.of_postcard(&content, Representation::xcdr2(Extensibility::Appendable)).unwrap();
    Sample { topic: topic.to_owned(), change: Change::Put, value: schema.read(&bytes).unwrap().value }
}

/// The end of a sample's instance, as a key alone tells of it.
fn ends(library: &Library, type_name: &str, sample: &Sample, change: Change) -> Sample {
    let schema = Schema::new(library, type_name).unwrap();
    let keys = KeySchema::new(&schema).unwrap();
    let key = keys.of_value(&schema, &sample.value).unwrap().key.unwrap();
    Sample { topic: sample.topic.clone(), change, value: keys.partial(&schema, &key).unwrap() }
}

fn shown(library: &Library, type_name: &str, sample: &Sample) -> serde_json::Value {
    let schema = Schema::new(library, type_name).unwrap();
    if sample.change == Change::Put {
        // What is shown can be written.
        schema.write(&sample.value, Representation::XCDR1).unwrap();
    }
    schema.json(&sample.value)
}

fn guid(number: u128) -> String {
    Guid(number.to_be_bytes()).to_string()
}

fn stamp(seconds: i64) -> serde_json::Value {
    json!({ "seconds": seconds, "nanoseconds": 0 })
}

fn command() -> serde_json::Value {
    json!({
        "duration": 1.5, "resourceID": guid(1), "timeStamp": stamp(3), "source": guid(2), "sessionID": guid(3),
        "destination": guid(4),
    })
}

#[test]
fn every_plain_topic_comes_back_from_the_other_version() {
    let mut translator = Translator::new().unwrap();
    let status = json!({
        "timeStamp": stamp(1), "source": guid(1), "sessionID": guid(2), "commandStatus": "FAILED",
        "commandStatusReason": "TIMEOUT", "logMessage": "late",
    });
    let priorities = json!({
        "priorities": [guid(5), guid(6)], "resourceID": guid(1), "timeStamp": stamp(3), "source": guid(2),
        "sessionID": guid(3), "destination": guid(4),
    });
    let ack = |command| json!({ "command": command, "timeStamp": stamp(9), "source": guid(7), "sessionID": guid(8) });
    let session = json!({ "controllingConsumer": guid(2), "endTime": null });
    let info = json!([{ "controlSession": session, "resourceID": guid(1) }, { "controlSession": null, "resourceID": guid(9) }]);
    let reports = json!([{ "priorities": [guid(5)], "resourceID": guid(1) }]);
    let topics = [
        ("Command", command()),
        ("CommandStatus", status.clone()),
        ("CommandAckReport", ack(command())),
        ("PriorityCommand", priorities.clone()),
        ("PriorityCommandStatus", status),
        ("PriorityCommandAckReport", ack(priorities)),
        ("Report", json!({ "controlInfo": info, "timeStamp": stamp(1), "source": guid(1) })),
        ("PriorityReport", json!({ "priorities": reports, "timeStamp": stamp(1), "source": guid(1) })),
    ];
    let topics = topics.map(|(end, members)| (format!("{RA}{end}"), members));
    let log = json!({ "entry": "é", "level": "WARNING", "timeStamp": stamp(1), "source": guid(1) });
    for (topic, members) in topics.into_iter().chain([("UMAA::SO::LogReport::LogReport".to_owned(), log)]) {
        let type_name = umaa::topic(&topic).unwrap().type_name;
        let sample = older(&translator, &topic, members);
        for sample in [sample.clone(), ends(translator.older(), type_name, &sample, Change::Dispose)] {
            let newer = translator.to_newer(&sample);
            assert_eq!((newer.samples.len(), newer.lost.len()), (1, 0), "{topic}");
            assert_eq!(
                (newer.samples[0].topic.as_str(), newer.samples[0].change),
                (type_name, sample.change)
            );
            let source = &shown(translator.newer(), type_name, &newer.samples[0])["source"];
            assert!(source["id"].is_string() && source["parentID"] == guid(0), "{source}");
            let again = translator.to_older(&newer.samples[0]);
            assert_eq!((again.samples, again.lost), (vec![sample], vec![]), "{topic}");
        }
    }
}

#[test]
fn a_parent_is_lost_once_and_put_back_where_its_identifier_returns() {
    let mut translator = Translator::new().unwrap();
    let topic = format!("{RA}Command");
    let type_name = umaa::topic(&topic).unwrap().type_name;
    let sample = older(&translator, &topic, command());
    let mut newer = translator.to_newer(&sample).samples.remove(0);
    let identifier = |id: u128, parent: u128| {
        let part = |number: u128| Some(Value::Octets(number.to_be_bytes().to_vec()));
        Value::Structure(vec![part(id), part(parent)])
    };
    convert::set(&translator.newer, type_name, &mut newer.value, "source", Some(identifier(2, 77)));
    let lost = Lost::Parents { topic: type_name.to_owned() };
    assert_eq!(translator.to_older(&newer), Outcome { samples: vec![sample.clone()], lost: vec![lost] });
    assert_eq!(translator.to_older(&newer).lost, [], "it is said once");
    assert_eq!(translator.to_newer(&sample).samples, [newer]);
}

fn health(code: &str, time: i64) -> serde_json::Value {
    json!({
        "code": code, "logTime": stamp(1), "severity": "WARN", "status": "", "timeStamp": stamp(time),
        "source": guid(1), "resourceID": guid(2),
    })
}

#[test]
fn health_has_one_instance_a_code_in_the_one_and_one_altogether_in_the_other() {
    let mut translator = Translator::new().unwrap();
    let type_name = umaa::topic(HEALTH).unwrap().type_name;
    let (ram, rom) =
        (older(&translator, HEALTH, health("RAM", 1)), older(&translator, HEALTH, health("ROM", 2)));
    let told = |translator: &mut Translator, sample: &Sample| {
        let outcome = translator.to_newer(sample);
        let tell = |sample: &Sample| {
            let shown = shown(translator.newer(), type_name, sample);
            (sample.change, shown["code"].as_str().unwrap().to_owned())
        };
        (outcome.samples.iter().map(tell).collect::<Vec<_>>(), outcome.lost)
    };
    let code = |change, code: &str| (change, code.to_owned());
    assert_eq!(told(&mut translator, &ram), (vec![code(Change::Put, "RAM")], vec![]));
    assert_eq!(
        told(&mut translator, &rom),
        (vec![code(Change::Dispose, "RAM"), code(Change::Put, "ROM")], vec![]),
        "the new code ends the one before"
    );
    let end = ends(translator.older(), type_name, &rom, Change::Dispose);
    assert_eq!(told(&mut translator, &end), (vec![code(Change::Dispose, "ROM")], vec![]));
    assert_eq!(told(&mut translator, &end), (vec![], vec![Lost::UnknownCode { topic: HEALTH.to_owned() }]));

    // The other way two codes live, and the resource's health ends with the last of them.
    let [ram6, rom6] = [&ram, &rom].map(|sample| {
        let mut newer = translator.to_newer(sample).samples.pop().unwrap();
        convert::set(&translator.newer, type_name, &mut newer.value, "status", None);
        newer
    });
    let mut other = Translator::new().unwrap();
    for (newer, sample) in [(&ram6, &ram), (&rom6, &rom)] {
        let came = other.to_older(newer).samples;
        assert_eq!(came, std::slice::from_ref(sample), "a status that is left out is empty");
    }
    let [ram_ends, rom_ends] =
        [&ram6, &rom6].map(|newer| ends(other.newer(), type_name, newer, Change::Dispose));
    let first = other.to_older(&ram_ends);
    assert_eq!((first.samples, first.lost.len()), (vec![], 1));
    assert_eq!(other.to_older(&rom_ends).samples, [end]);
}

fn config(resources: &[(u128, u128)], time: i64) -> serde_json::Value {
    let definition = |(resource, related): &(u128, u128)| json!({ "relatedSources": [guid(*related)], "resourceID": guid(*resource) });
    let resources: Vec<_> = resources.iter().map(definition).collect();
    json!({ "resources": resources, "timeStamp": stamp(time), "source": guid(1) })
}

#[test]
fn resources_become_a_large_set_and_come_back_when_it_is_stable() {
    let (mut there, mut back) = (Translator::new().unwrap(), Translator::new().unwrap());
    let topic = resources::CONFIG;
    let versions: [&[(u128, u128)]; 6] =
        [&[], &[(5, 1)], &[(5, 1), (6, 2)], &[(5, 3), (7, 2)], &[(7, 2)], &[(7, 2)]];
    let mut operations = Vec::new();
    for (time, resources) in (1..).zip(versions) {
        let mut sample = older(&there, topic, config(resources, time));
        let newer = there.to_newer(&sample);
        assert_eq!(newer.lost, []);
        operations.push(newer.samples.len());
        let mut came: Vec<Sample> =
            newer.samples.iter().flat_map(|newer| back.to_older(newer).samples).collect();
        assert_eq!(came.len(), 1, "each state is told once: {resources:?}");
        // Elements come in the order of their ids.
        let sorted = |sample: &mut Sample| {
            let Value::Structure(members) = &mut sample.value else { panic!() };
            let Some(Value::List(list)) = &mut members[0] else { panic!() };
            list.sort_by_key(|held| format!("{held:?}"));
        };
        sorted(&mut came[0]);
        sorted(&mut sample);
        assert_eq!(came[0], sample);
        // Told in any order, it is stable in the end.
        let mut turned = Translator::new().unwrap();
        let all_there = newer.samples.iter().all(|sample| sample.change == Change::Put);
        if all_there && resources.len() == newer.samples.len() - 1 {
            let last = newer.samples.iter().rev().flat_map(|newer| turned.to_older(newer).samples).count();
            assert_eq!(last, 1);
        }
    }
    assert_eq!(operations, [1, 2, 2, 4, 2, 1]);
    let type_name = umaa::topic(topic).unwrap().type_name;
    let sample = older(&there, topic, config(&[(7, 2)], 9));
    let end = ends(there.older(), type_name, &sample, Change::Dispose);
    let newer = there.to_newer(&end).samples;
    assert_eq!(newer.len(), 2, "the report ends and its element: {newer:?}");
    assert_eq!(back.to_older(&newer[0]).samples, [end]);
    assert_eq!(back.to_older(&newer[1]).samples, []);
}

#[test]
fn what_does_not_fit_is_told_and_not_cut() {
    let mut translator = Translator::new().unwrap();
    let topic = format!("{RA}PriorityReport");
    let reports: Vec<_> = (1..=25).map(|id| json!({ "priorities": [], "resourceID": guid(id) })).collect();
    let members = json!({ "priorities": reports, "timeStamp": stamp(1), "source": guid(1) });
    let sample = older(&translator, &topic, members);
    let lost = Lost::TooLong { topic: topic.clone(), member: "priorities".to_owned(), length: 25, bound: 24 };
    assert_eq!(translator.to_newer(&sample), Outcome { samples: vec![], lost: vec![lost] });
    let other = Sample { topic: "UMAA::MM::X".to_owned(), ..sample };
    assert_eq!(translator.to_newer(&other).lost, [Lost::Topic("UMAA::MM::X".to_owned())]);
    assert_eq!(translator.to_older(&other).lost.len(), 0, "it has been told");
}
