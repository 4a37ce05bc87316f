//! A gateway that dies cancels nothing, and where it is back the two buses agree again.

use crate::peer::{Peer, Stage};
use crate::{APPENDABLE, HEALTH, health, id};
use serde_json::{Value, json};

/// What a reader hears of the writer's instances, by their source: nodes tell their own health on the same topic.
fn hears(reader: &Peer, count: usize) -> Vec<(String, Value)> {
    let is_ours = |line: &Value| (1..=5).any(|source| line[2]["source"] == id(source));
    let lines = std::iter::repeat_with(|| reader.any()).filter(is_ours).take(count);
    let mut heard: Vec<_> = lines
        .map(|line| (line[1].as_str().unwrap_or_default().to_owned(), json!([line[2]["source"], line[3]])))
        .collect();
    heard.sort_by_key(|(_, what)| what.to_string());
    heard
}

#[test]
fn a_gateway_that_is_killed_disposes_of_nothing_and_agrees_again_when_it_is_back() {
    let Some(mut stage) = Stage::new("") else { return };
    let (mut writer, mut reader) = (stage.peer(1), stage.peer(0));
    writer.writer(HEALTH, APPENDABLE, json!({}));
    reader.reader(HEALTH, APPENDABLE, json!({"keep_all": true}));
    reader.matched(HEALTH, 1);
    for (source, at) in [(1, 10), (2, 20), (3, 30)] {
        writer.change("write", HEALTH, health(source, "lives"), at);
    }
    assert_eq!(hears(&reader, 3).len(), 3);
    writer.change("dispose", HEALTH, health(3, ""), 40);
    assert_eq!(hears(&reader, 1)[0].0, "disposed");
    // The gateway of the writer's side: its instances have lost contact, and are not cancelled.
    stage.vehicle.take().expect("it runs").crash();
    let left: Vec<_> = hears(&reader, 2).into_iter().map(|(state, _)| state).collect();
    assert_eq!(left, ["no_writers", "no_writers"]);
    writer.change("dispose", HEALTH, health(2, ""), 50);
    writer.change("write", HEALTH, health(4, "born meanwhile"), 60);
    stage.start_vehicle("");
    let again = reader.until(|line| line[2]["status"] == "born meanwhile");
    writer.change("write", HEALTH, health(5, "last"), 70);
    let more = reader.until(|line| line[2]["status"] == "last");
    let mut alive: Vec<_> = again.iter().chain(&more).filter(|line| line[1] == "alive").collect();
    alive.sort_by_key(|line| line[3].as_i64());
    let alive: Vec<_> = alive.iter().map(|line| (line[2]["status"].clone(), line[3].clone())).collect();
    let expected = [("lives", 10), ("born meanwhile", 60), ("last", 70)];
    assert_eq!(
        alive,
        expected.map(|(status, at)| (json!(status), json!(at))),
        "once, unchanged, and nothing disposed"
    );
    // The gateway of the reader's side.
    stage.shore.take().expect("it runs").crash();
    let left: Vec<_> = hears(&reader, 3).into_iter().map(|(state, _)| state).collect();
    assert_eq!(left, ["no_writers"; 3]);
    stage.start_shore("");
    // Who comes late also hears of what has been disposed of: that it is.
    let alive = std::iter::repeat_with(|| hears(&reader, 1).remove(0)).filter(|(state, _)| state == "alive");
    let mut back: Vec<_> = alive.take(3).map(|(_, what)| what[1].clone()).collect();
    back.sort_by_key(Value::as_i64);
    assert_eq!(back, [10, 60, 70].map(|at| json!(at)));
}
