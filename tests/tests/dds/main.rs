//! Two DDS domains, two gateways, the fleet's bus between them: peers of another implementation's binding know nothing of it.

mod apart;
mod order;
mod peer;
mod restart;
mod topics;

use peer::Stage;
use serde_json::{Value, json};

const HEALTH: &str = "UMAA::SO::HealthReport::HealthReport";
const STATUS: &str = "UMAA::SO::ResourceAllocation::ResourceAllocationCommandStatus";
const APPENDABLE: &str = "5.2.1 appendable";

fn id(number: u8) -> String {
    format!("{number:02x}").repeat(16)
}

fn health(source: u8, status: &str) -> Value {
    json!({"source": id(source), "resourceID": id(0xee), "status": status, "severity": "WARN",
           "timeStamp": {"seconds": 1_700_000_000, "nanoseconds": 5}})
}

#[test]
fn samples_disposes_and_unregisters_cross_both_ways_with_their_times() {
    let Some(stage) = Stage::new("") else { return };
    for (from, to) in [(0, 1), (1, 0)] {
        let (mut writer, mut reader) = (stage.peer(from), stage.peer(to));
        writer.writer(HEALTH, APPENDABLE, json!({}));
        reader.reader(HEALTH, APPENDABLE, json!({"keep_all": true}));
        let at = 1_700_000_000_000_000_123_i64;
        writer.change("write", HEALTH, health(1, "one"), at);
        let first = reader.next();
        assert_eq!((&first[1], &first[2]["status"], &first[3]), (&json!("alive"), &json!("one"), &json!(at)));
        assert_eq!(first[2]["severity"], "WARN");
        assert_eq!(first[2]["source"], id(1));
        assert_eq!(first[2]["timeStamp"], json!({"seconds": 1_700_000_000, "nanoseconds": 5}));
        writer.change("write", HEALTH, health(2, "two"), at + 1_000);
        assert_eq!(reader.next()[2]["status"], "two");
        writer.change("dispose", HEALTH, health(1, ""), at + 2_000);
        let gone = reader.next();
        assert_eq!((&gone[1], &gone[3]), (&json!("disposed"), &json!(at + 2_000)));
        writer.change("unregister", HEALTH, health(2, ""), at + 3_000);
        assert_eq!(reader.next()[1], "no_writers");
    }
}

#[test]
fn who_comes_late_sees_what_a_native_reader_sees() {
    let Some(stage) = Stage::new("") else { return };
    let mut writer = stage.peer(0);
    writer.writer(HEALTH, APPENDABLE, json!({}));
    writer.matched(HEALTH, 1);
    let at = 1_700_000_000_000_000_000_i64;
    writer.change("write", HEALTH, health(0, "cancelled"), at);
    writer.change("write", HEALTH, health(1, "first"), at + 10);
    writer.change("dispose", HEALTH, health(0, ""), at + 20);
    for (more, status) in [(30, "second"), (40, "third"), (50, "last")] {
        writer.change("write", HEALTH, health(1, status), at + more);
    }
    let late = |place: usize| {
        let mut reader = stage.peer(place);
        reader.reader(HEALTH, APPENDABLE, json!({"keep_all": true}));
        reader.until(|line| line[2]["status"] == "last")
    };
    let (native, bridged) = (late(0), late(1));
    let alive = |seen: &[Value]| {
        seen.iter()
            .filter(|line| line[1] == "alive")
            .map(|line| (line[2]["status"].clone(), line[3].clone()))
            .collect::<Vec<_>>()
    };
    assert_eq!(alive(&native), [(json!("last"), json!(at + 50))]);
    assert_eq!(alive(&bridged), alive(&native), "{bridged:?} {native:?}");
}
