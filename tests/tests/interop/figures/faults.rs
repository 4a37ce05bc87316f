//! The same peers with a rule of the ICD broken on purpose: the watch must find it, and nothing else.

use super::{Foreign, clauses, start_arbiter};
use crate::harness::Fleet;
use crate::zenoh;
use serde_json::json;
use std::collections::BTreeSet;
use std::path::Path;
use std::thread;

/// A rule that a provider breaks, and the clause that speaks of it.
const OF_PROVIDERS: [(&str, &str); 4] = [
    ("skip-commanded", "transition"),
    ("late-ack", "ack-first"),
    ("wrong-reason", "reason"),
    ("silent-shutdown", "provider-shutdown"),
];
/// The same of consumers.
const OF_CONSUMERS: [(&str, &str); 2] =
    [("old-update", "update-newer"), ("keep-at-shutdown", "consumer-shutdown")];

fn provider(fleet: &Fleet, python: &Path, entity: &str, fault: &str) {
    // Each has a consumer of its own: of one service's programs, the last to start is the one that is heard.
    let (by, resource) = (format!("9{entity}"), format!("{entity}:autopilot"));
    let known = format!("eid{by}sid100");
    let args = ["--as", entity, "provider", "--priority", &known, "--fault", fault];
    let mut provider = Foreign(fleet.start_umaa(python, &args));
    provider.next("ready");
    if fault == "silent-shutdown" {
        let consumer = fleet.start_aldis(&["allocate", &resource, "--as", &by, "--json"]);
        provider.way("published", "EXECUTING");
        provider.order(json!({ "do": "shutdown" }));
        provider.next("shut-down");
        provider.leave();
        drop(consumer);
        return;
    }
    fleet.start_aldis(&["allocate", &resource, "--as", &by, "--for", "100ms", "--json"]).end();
    provider.next("cleared");
    provider.leave();
}

fn consumer(fleet: &Fleet, python: &Path, fault: &str) {
    let mut consumer = Foreign(fleet.start_umaa(python, &["--as", "300", "consumer", "--fault", fault]));
    consumer.next("ready");
    consumer.order(json!({
        "do": "start", "name": "one", "kind": "allocation", "to": "eid400sid10",
        "resource": "400:autopilot", "duration": null,
    }));
    consumer.way("status", "EXECUTING");
    if fault == "old-update" {
        consumer.order(json!({ "do": "update", "name": "one", "duration": 1.0 }));
        consumer.order(json!({ "do": "cancel", "name": "one" }));
        consumer.next("clean");
    }
    consumer.order(json!({ "do": "shutdown" }));
    consumer.next("shut-down");
    consumer.leave();
}

#[test]
fn a_rule_that_a_peer_breaks_is_found() {
    let Some(python) = zenoh() else { return };
    let fleet = Fleet::start_as(1);
    let watch = fleet.watch();
    thread::scope(|scope| {
        for (number, (fault, _)) in OF_PROVIDERS.iter().enumerate() {
            let (fleet, python) = (&fleet, &python);
            scope.spawn(move || provider(fleet, python, &(501 + number).to_string(), fault));
        }
    });
    // Afterwards: these are readers of the reports above, and those who vanish are waited for.
    let _arbiter = start_arbiter(&fleet);
    for (fault, _) in OF_CONSUMERS {
        consumer(&fleet, &python, fault);
    }
    let report = watch.report();
    let planted: BTreeSet<_> = OF_PROVIDERS.iter().chain(&OF_CONSUMERS).map(|(_, clause)| *clause).collect();
    let broken = clauses(&report, "broken");
    let found: BTreeSet<_> = broken.iter().filter_map(|clause| clause["clause"].as_str()).collect();
    assert_eq!(found, planted, "{broken:#?}");
}
