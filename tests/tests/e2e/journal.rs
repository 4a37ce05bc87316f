//! What outlives a process: nodes that are killed, with their journals on real disks.

use aldis_tests::{Node, Site, delimited, frame, until};

const TABLES: &str = "\
[journal]
path = \"kept\"

[[topic]]
prefix = \"UMAA::SO\"
durability = \"persistent\"

[[resource]]
name = \"autopilot\"
priorities = [\"eid9001sid100\"]
";

fn start_vehicle(site: &Site) -> Node {
    let vehicle = Node::start(&site.vehicle_config(TABLES));
    site.wait_for(400);
    vehicle
}

#[test]
fn retained_instances_are_there_for_who_comes_after_a_kill() {
    let site = Site::new();
    let _shore = site.start_shore();
    let mut vehicle = start_vehicle(&site);
    for life in 1..=2 {
        let mut on_board = site.peer(&vehicle, site.vehicle_uxas);
        let before = site.counter(400, "kept");
        for (number, topic) in
            ["UMAA::SO::One::OneReport", "UMAA::SO::Two::TwoReport"].iter().cycle().take(6).enumerate()
        {
            let content = format!("{life} {number}");
            on_board.send(&frame(&delimited(topic, 100, 61, content.as_bytes())));
        }
        until("all is on disk", || (site.counter(400, "kept") >= before + 6).then_some(()));
        vehicle.crash();
        vehicle = start_vehicle(&site);
        assert!(site.counter(400, "recovered") >= 2);
        let joined = site.aldis(&["sub", "UMAA::SO::One", "UMAA::SO::Two", "--count", "2", "--json"]);
        assert_eq!(joined.code, Some(0), "{joined:?}");
        let lines = joined.json();
        let mut contents: Vec<_> =
            lines.iter().map(|line| hexadecimal(line["content"]["hex"].as_str().unwrap())).collect();
        contents.sort();
        assert_eq!(contents, [format!("{life} 4"), format!("{life} 5")]);
    }
    let health = site.aldis(&["health", "--json"]);
    let said = |line: &serde_json::Value| line.to_string().contains("journal: start 3");
    assert!(health.json().iter().any(said), "{}", health.stdout);
}

fn hexadecimal(text: &str) -> String {
    let digit = |at: usize| u8::from_str_radix(&text[at..at + 2], 16).unwrap();
    String::from_utf8((0..text.len()).step_by(2).map(digit).collect()).unwrap()
}

#[test]
fn an_arbiter_that_is_killed_keeps_who_is_in_control_and_the_lists_that_were_set() {
    let site = Site::new();
    let _shore = site.start_shore();
    let vehicle = start_vehicle(&site);
    let set = site.aldis(&["priority", "400:autopilot", "eid9001sid100", "eid9000sid105", "--json"]);
    assert_eq!(set.code, Some(0), "{set:?}");
    let state = || site.aldis(&["priority", "--json"]).json().first().cloned().unwrap_or_default();
    std::thread::scope(|scope| {
        let holding = scope.spawn(|| site.aldis(&["allocate", "400:autopilot", "--as", "9001", "--json"]));
        until("the autopilot is held", || (state()["holder"] == "eid9001sid100").then_some(()));
        vehicle.crash();
        let _vehicle = start_vehicle(&site);
        until("the autopilot is held again", || (state()["holder"] == "eid9001sid100").then_some(()));
        assert_eq!(state()["priorities"].as_array().unwrap().len(), 2, "{}", state());
        let released = site.aldis(&["release", "--as", "9001"]);
        assert_eq!(released.code, Some(0), "{released:?}");
        let holding = holding.join().unwrap();
        let states: Vec<_> =
            holding.json().iter().filter_map(|line| line["state"].as_str().map(str::to_owned)).collect();
        // Who stayed hears once more where the command stands, at the most; the command itself went on.
        assert_eq!(states[..3], ["ISSUED", "COMMANDED", "EXECUTING"], "{holding:?}");
        assert!(states.len() <= 4 && states.last().is_some_and(|last| last == "EXECUTING"), "{holding:?}");
        assert_eq!(holding.json().last().unwrap()["outcome"], "CANCELED", "{holding:?}");
        until("nobody holds it", || state()["holder"].is_null().then_some(()));
    });
}

#[test]
fn a_second_node_on_one_journal_is_refused() {
    let site = Site::new();
    let _shore = site.start_shore();
    let _vehicle = start_vehicle(&site);
    let mut second = Node::start(&site.vehicle_config(TABLES));
    assert_eq!(second.wait().code(), Some(1), "{}", second.log().text());
    assert!(second.log().text().contains("kept"), "{}", second.log().text());
}
