//! Who controls a vehicle's autopilot, from the command line: an arbiter on the vehicle, consumers in processes of their own.

use aldis_tests::{Done, Node, Site, until};
use serde_json::Value;
use std::thread;

const RESOURCE: &str =
    "[[resource]]\nname = \"autopilot\"\npriorities = [\"eid9000sid100\", \"eid9001sid100\"]\n";

fn start(site: &Site) -> (Node, Node) {
    let nodes = (site.start_shore(), Node::start(&site.vehicle_config(RESOURCE)));
    site.wait_for(1);
    site.wait_for(400);
    nodes
}

/// The states that a command went through, and how it ended.
fn way(done: &Done) -> String {
    let event = |line: &Value| match line["event"].as_str() {
        Some("state") => line["state"].as_str().unwrap().to_owned(),
        _ => format!("- {}", line["outcome"].as_str().unwrap()),
    };
    done.json().iter().map(event).collect::<Vec<_>>().join(" ")
}

fn holder(site: &Site) -> Value {
    let done = site.aldis(&["priority", "--json"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    done.json()[0]["holder"].clone()
}

fn wait_for_holder(site: &Site, wanted: &str) {
    until(&format!("{wanted} holds the autopilot"), || (holder(site) == wanted).then_some(()));
}

#[test]
fn control_is_given_for_a_time_and_ends_with_it() {
    let site = Site::new();
    let _nodes = start(&site);
    let done = site.aldis(&["allocate", "400:autopilot", "--for", "1s", "--json"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    assert_eq!(way(&done), "ISSUED COMMANDED EXECUTING - COMPLETED");
    assert_eq!(holder(&site), Value::Null);
}

#[test]
fn who_is_not_in_the_priorities_is_rejected_until_they_are_set() {
    let site = Site::new();
    let _nodes = start(&site);
    let rejected = site.aldis(&["allocate", "400:autopilot", "--sid", "102", "--for", "1s", "--json"]);
    assert_eq!(rejected.code, Some(1), "{rejected:?}");
    assert!(way(&rejected).starts_with("ISSUED COMMANDED - FAILED, RESOURCE_REJECTED"), "{}", way(&rejected));
    let set = site.aldis(&["priority", "400:autopilot", "eid9000sid102", "--json"]);
    assert_eq!(set.code, Some(0), "{set:?}");
    assert_eq!(way(&set), "ISSUED COMMANDED EXECUTING - COMPLETED");
    let given = site.aldis(&["allocate", "400:autopilot", "--sid", "102", "--for", "1s", "--json"]);
    assert_eq!(given.code, Some(0), "{given:?}");
    let absent = site.aldis(&["allocate", "500:autopilot", "--for", "1s"]);
    assert_eq!(absent.code, Some(4), "{absent:?}");
}

#[test]
fn a_higher_priority_takes_over_and_a_lower_one_does_not() {
    let site = Site::new();
    let _nodes = start(&site);
    until("the arbiter reports its resource", || {
        let done = site.aldis(&["priority", "--json"]);
        done.json().first().filter(|line| line["priorities"].as_array().unwrap().len() == 2).map(drop)
    });
    thread::scope(|scope| {
        let watching = scope.spawn(|| site.aldis(&["conform", "--for", "25s", "--json"]));
        let lower = scope.spawn(|| site.aldis(&["allocate", "400:autopilot", "--json"]));
        wait_for_holder(&site, "eid9000sid100");
        let higher = scope
            .spawn(|| site.aldis(&["allocate", "400:autopilot", "--as", "9001", "--for", "20s", "--json"]));
        let lower = lower.join().unwrap();
        assert_eq!(lower.code, Some(1), "{lower:?}");
        assert!(
            way(&lower).starts_with("ISSUED COMMANDED EXECUTING - FAILED, INTERRUPTED"),
            "{}",
            way(&lower)
        );
        wait_for_holder(&site, "eid9001sid100");
        let again = site.aldis(&["allocate", "400:autopilot", "--json"]);
        assert!(way(&again).starts_with("ISSUED COMMANDED - FAILED, RESOURCE_REJECTED"), "{}", way(&again));
        let released = site.aldis(&["release", "--as", "9001"]);
        assert_eq!(released.code, Some(0), "{released:?}");
        assert_eq!(way(&higher.join().unwrap()), "ISSUED COMMANDED EXECUTING - CANCELED");
        let watched = watching.join().unwrap();
        assert_eq!(watched.code, Some(0), "{watched:?}");
        let report = &watched.json()[0];
        assert!(report["observations"].as_u64().unwrap() > 20, "{report}");
        assert!(report["clauses_held"].as_u64().unwrap() > 10, "{report}");
    });
    assert_eq!(holder(&site), Value::Null);
}
