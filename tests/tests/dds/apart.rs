//! Topics that are not UMAA's; what does not come together, and what must not.

use crate::peer::{Peer, Stage};
use crate::{APPENDABLE, HEALTH, health};
use serde_json::{Value, json};

const IDL: &str = "module plant {
  union Value switch (long) { case 1: double number; case 2: string<64> text; };
  struct Place { @key long row; string<32> label; };
  struct Reading { @key Place place; Value value; @optional double error; long count; };
};
";
const READINGS: &str = "plant/readings";

#[test]
fn a_topic_of_an_idl_folder_crosses_both_ways_with_its_ends() {
    let Some(stage) = Stage::with_idl(IDL) else { return };
    let turns = [(0, 1, "final"), (1, 0, "final"), (0, 1, "appendable"), (1, 0, "appendable")];
    for (turn, (from, to, form)) in (0..).zip(turns) {
        let kind = format!("plant {form}");
        let (mut writer, mut reader) = (stage.peer(from), stage.peer(to));
        writer.writer(READINGS, &kind, json!({}));
        reader.reader(READINGS, &kind, json!({"keep_all": true}));
        reader.matched(READINGS, 1);
        let place = |row: i64| json!({"row": 10 * turn + row, "label": "hall"});
        let first = json!({"place": place(1), "value": {"text": "wet"}, "error": null, "count": 7});
        let second = json!({"place": place(2), "value": {"number": 1.5}, "error": 0.25, "count": 8});
        writer.change("write", READINGS, first.clone(), 10);
        writer.change("write", READINGS, second.clone(), 20);
        // Who comes late hears of what has ended before, too.
        let two = |reader: &Peer| {
            let is_of_turn =
                |line: &Value| line[2]["place"]["row"].as_i64().is_some_and(|row| row / 10 == turn);
            std::iter::repeat_with(|| reader.next()).filter(is_of_turn).take(2).collect::<Vec<_>>()
        };
        let said =
            |line: &Value, what: &Value| (line[1].as_str().unwrap_or_default().to_owned(), what.clone());
        let mut heard: Vec<_> = two(&reader).iter().map(|line| said(line, &line[2])).collect();
        heard.sort_by_key(|(_, sample)| sample["count"].as_i64());
        assert_eq!(heard, [("alive".to_owned(), first), ("alive".to_owned(), second)]);
        writer.change("dispose", READINGS, json!({"place": place(1)}), 30);
        writer.change("unregister", READINGS, json!({"place": place(2)}), 40);
        let mut ends: Vec<_> = two(&reader).iter().map(|line| said(line, &line[2]["place"]["row"])).collect();
        ends.sort_by_key(|(state, _)| state.clone());
        assert_eq!(
            ends,
            [("disposed".to_owned(), json!(10 * turn + 1)), ("no_writers".to_owned(), json!(10 * turn + 2))]
        );
    }
}

#[test]
fn what_does_not_come_together_is_told_with_both_sides_and_a_form_of_its_own_is_no_trouble() {
    let Some(stage) = Stage::new("") else { return };
    let mut peers = ["5.2.1 final", APPENDABLE].map(|kind| {
        let mut peer = stage.peer(0);
        peer.reader(HEALTH, kind, json!({}));
        peer.matched(HEALTH, 1);
        peer
    });
    let mut strict = stage.peer(0);
    strict.reader(HEALTH, APPENDABLE, json!({"durability": "Persistent"}));
    let shore = stage.shore.as_ref().expect("it runs");
    let told = shore.log().wait_for("DURABILITY");
    assert!(told.contains("DURABILITY: TRANSIENT_LOCAL is offered, PERSISTENT requested"), "{told}");
    assert!(!shore.log().text().contains("TYPE_CONSISTENCY"), "{}", shore.log().text());
    let listed = stage.site.aldis(&["dds", "ls", "--node", "1", "--service", "30", "--json"]);
    let routes = listed.json()[0]["routes"].as_array().expect("a list").clone();
    let route = routes.iter().find(|route| route["troubles"] != json!([])).expect("a route in trouble");
    assert!(route["own"].as_str().is_some_and(|own| own.contains("TRANSIENT_LOCAL")), "{route}");
    assert!(route["others"].to_string().contains("PERSISTENT"), "{route}");
    peers[0].tell(&json!(["close", HEALTH]));
}

#[test]
fn partitions_stay_apart() {
    let Some(stage) = Stage::in_partitions(["", "red"]) else { return };
    let peers = |place: usize, partition: &str| {
        let mut peer = stage.peer(place);
        let qos = json!({"keep_all": true, "partition": partition});
        if place == 0 {
            peer.writer(HEALTH, APPENDABLE, qos)
        } else {
            peer.reader(HEALTH, APPENDABLE, qos)
        };
        peer
    };
    let (mut plain, mut red, mut blue) = (peers(0, ""), peers(0, "red"), peers(0, "blue"));
    let mut readers = [peers(1, ""), peers(1, "red")];
    readers.iter_mut().for_each(|reader| reader.matched(HEALTH, 1));
    blue.change("write", HEALTH, health(3, "blue"), 10);
    red.change("write", HEALTH, health(2, "red"), 20);
    plain.change("write", HEALTH, health(1, "plain"), 30);
    red.change("write", HEALTH, health(2, "red again"), 40);
    plain.change("write", HEALTH, health(1, "plain again"), 50);
    for (reader, own) in readers.iter().zip([["plain", "plain again"], ["red", "red again"]]) {
        let heard = reader.changes(2, |line| line[2]["status"].clone());
        assert_eq!(heard.iter().map(|(_, status)| status.clone()).collect::<Vec<_>>(), own);
    }
}
