//! The order of a topic across its instances, as a participant sees it that takes each change as it comes: other bindings give what they
//! take by instance.

use crate::peer::Stage;
use crate::{APPENDABLE, STATUS, id};
use serde_json::{Value, json};

#[test]
fn interleaved_instances_arrive_in_the_order_in_which_they_were_written() {
    const COUNT: i64 = 600;
    const AT: i64 = 1_000_000_000;
    let Some(stage) = Stage::new("") else { return };
    let (mut writer, mut reader) = (stage.peer(0), stage.peer(1));
    let qos = json!({"keep_all": true, "topic_access": true});
    writer.writer(STATUS, APPENDABLE, qos.clone());
    reader.reader(STATUS, APPENDABLE, qos);
    let spy = stage.spy(1, &[]);
    writer.matched(STATUS, 1);
    reader.matched(STATUS, 1);
    let sample = |number: i64| {
        json!({"source": id(7), "sessionID": id((number * 7 % 5) as u8), "logMessage": number.to_string(),
               "commandStatus": "EXECUTING", "commandStatusReason": "UPDATED"})
    };
    let of = |line: &Value| {
        (line["topic"] == STATUS).then(|| line["sample"]["logMessage"].as_str()?.parse::<i64>().ok())?
    };
    // From the first that it shows the participant is there.
    writer.change("write", STATUS, sample(0), AT);
    spy.until(|line| of(line) == Some(0));
    for number in 1..COUNT {
        writer.change("write", STATUS, sample(number), AT + number);
    }
    let seen: Vec<i64> = spy.until(|line| of(line) == Some(COUNT - 1)).iter().filter_map(of).collect();
    assert_eq!(seen, (1..COUNT).collect::<Vec<_>>());
}

#[test]
fn a_large_set_is_stable_once_for_each_of_its_batches() {
    const BATCHES: i64 = 50;
    const EACH: i64 = 100;
    const REPORT: &str = "UMAA::SO::ResourceAllocation::ResourceAllocationConfigReportType";
    const ELEMENT: &str =
        "UMAA::SO::ResourceAllocation::ResourceAllocationConfigReportTypeResourcesSetElement";
    let Some(stage) = Stage::new("version = \"6.0\"\ntranslate = false") else { return };
    let (mut writer, mut reader) = (stage.peer(0), stage.peer(1));
    let qos = json!({"keep_all": true, "topic_access": true});
    for topic in [ELEMENT, REPORT] {
        writer.writer(topic, "6.0 appendable", qos.clone());
        reader.reader(topic, "6.0 appendable", qos.clone());
    }
    let spy = stage.spy(1, &["--umaa", "6.0"]);
    for topic in [ELEMENT, REPORT] {
        writer.matched(topic, 1);
        reader.matched(topic, 1);
    }
    let identifier = |id: &str| json!({"id": id, "parentID": crate::id(0)});
    let time = |number: i64| json!({"seconds": number, "nanoseconds": 0});
    let name = |number: i64| format!("{number:032x}");
    let report = |batch: i64| {
        json!({"timeStamp": time(batch), "source": identifier(&id(1)),
               "resourcesSetMetadata": {"setID": id(2), "updateElementID": name(batch * EACH),
                                        "updateElementTimestamp": time(batch), "size": batch * EACH}})
    };
    let element = |number: i64, batch: i64| {
        json!({"element": {"resourceID": identifier(&name(number)), "relatedSources": []}, "setID": id(2),
               "elementID": name(number), "elementTimestamp": time(batch)})
    };
    let size = |line: &Value| line["sample"]["resourcesSetMetadata"]["size"].as_i64();
    // From the first that it shows of each topic the participant is there.
    writer.change("write", REPORT, report(0), 1);
    writer.change("write", ELEMENT, element(0, 0), 1);
    let mut shown = [false; 2];
    spy.until(|line| {
        shown[0] |= size(line) == Some(0);
        shown[1] |= line["topic"] == ELEMENT && line.get("sample").is_some();
        shown == [true; 2]
    });
    for batch in 1..=BATCHES {
        for number in 1..=EACH {
            writer.change(
                "write",
                ELEMENT,
                element((batch - 1) * EACH + number, batch),
                batch * 1_000 + number,
            );
        }
        writer.change("write", REPORT, report(batch), batch * 1_000);
    }
    let (mut elements, mut sizes) = (Vec::new(), Vec::new());
    spy.until(|line| {
        sizes.extend(size(line));
        let held = &line["sample"]["elementTimestamp"]["seconds"];
        let of_set = (line["topic"] == ELEMENT).then(|| held.as_i64()).flatten();
        elements.extend(of_set.map(|batch| (line["sample"]["elementID"].to_string(), batch)));
        sizes.len() as i64 == BATCHES && elements.len() as i64 == BATCHES * EACH
    });
    // A reader that takes elements up to the one that the metadata names holds the whole set there, and nowhere else.
    assert_eq!(sizes, (1..=BATCHES).map(|batch| batch * EACH).collect::<Vec<_>>());
    let stable = (1..=BATCHES).filter(|batch| {
        let end = (batch * EACH) as usize;
        let before = elements[..end].iter().all(|(_, of)| of <= batch);
        before && elements[end - 1].0.contains(&hex_of(batch * EACH))
    });
    assert_eq!(stable.count() as i64, BATCHES);
}

/// A GUID of a number as the participant shows it ends so.
fn hex_of(number: i64) -> String {
    format!("{number:012x}")
}
