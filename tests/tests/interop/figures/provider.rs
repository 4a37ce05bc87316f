//! A provider in Python, entity 500, and Aldis' consumers on the command line.

use super::Foreign;
use crate::harness::{Fleet, Running};
use serde_json::{Value, json};
use std::path::Path;

const EXECUTED: &str = "ISSUED COMMANDED EXECUTING";

fn start(fleet: &Fleet, python: &Path, more: &[&str]) -> Foreign {
    let journal = fleet.file("provider.json");
    let known = ["--priority", "eid9000sid100", "--priority", "eid9001sid100"];
    let args = [&["--as", "500", "--journal", &journal, "provider"], &known[..], more].concat();
    Foreign(fleet.start_umaa(python, &args))
}

/// Starts `aldis allocate` for the resource in Python's hands.
fn allocate(fleet: &Fleet, more: &[&str]) -> Running {
    fleet.start_aldis(&[&["allocate", "500:autopilot", "--json"], more].concat())
}

/// The states that an Aldis consumer hears until this one.
fn way(consumer: &Running, last: &str) -> String {
    let mut way = Vec::new();
    loop {
        let told = consumer.next().unwrap_or_else(|| panic!("it ended without {last} after {way:?}"));
        let state = told["state"].as_str().unwrap_or_else(|| panic!("no state: {told}")).to_owned();
        way.push(state);
        if way.last().is_some_and(|state| state == last) {
            return way.join(" ");
        }
    }
}

/// How an Aldis consumer ends: its last line and its exit code.
fn outcome(consumer: Running) -> (String, Option<i32>) {
    let (said, code) = consumer.end();
    let last = said.last().map(|line| line["outcome"].clone()).unwrap_or(Value::Null);
    (last.as_str().unwrap_or_default().to_owned(), code)
}

fn allocate_and_hold(fleet: &Fleet, provider: &Foreign) -> Running {
    let consumer = allocate(fleet, &[]);
    assert_eq!(way(&consumer, "EXECUTING"), EXECUTED);
    assert_eq!(provider.way("published", "EXECUTING"), EXECUTED);
    consumer
}

/// Has the running `aldis allocate` give the resource back.
fn release(fleet: &Fleet) {
    let released = fleet.aldis(&["release", "--json"]);
    assert_eq!(released.code, Some(0), "{released:?}");
}

pub(super) fn all_figures(fleet: &Fleet, python: &Path) {
    let mut provider = start_up(fleet, python);
    executions(fleet, &provider);
    failures(fleet, &mut provider);
    let provider = crashes(fleet, python, provider);
    shutdowns(fleet, provider);
}

/// Figures 7 to 11, 13 and 17: the consumer starts first, and the provider takes its command up.
fn start_up(fleet: &Fleet, python: &Path) -> Foreign {
    let consumer = allocate(fleet, &["--for", "300ms"]);
    let provider = start(fleet, python, &[]);
    provider.next("ready");
    assert_eq!(provider.way("published", "COMPLETED"), format!("{EXECUTED} COMPLETED"));
    provider.next("cleared");
    assert_eq!(outcome(consumer), ("COMPLETED".into(), Some(0)));
    provider
}

/// Figures 10 to 13, 16 and 17, with commands of both kinds.
fn executions(fleet: &Fleet, provider: &Foreign) {
    let consumer = allocate(fleet, &["--for", "1s", "--renew"]);
    assert_eq!(way(&consumer, "EXECUTING"), EXECUTED);
    assert_eq!(way(&consumer, "EXECUTING"), EXECUTED);
    assert_eq!(provider.way("published", "EXECUTING"), EXECUTED);
    assert_eq!(provider.way("published", "EXECUTING"), "ISSUED/UPDATED COMMANDED EXECUTING");
    release(fleet);
    assert!(provider.way("published", "CANCELED").ends_with("CANCELED"));
    provider.next("cleared");
    assert_eq!(outcome(consumer), ("CANCELED".into(), Some(0)));

    let set = fleet.aldis(&["priority", "500:autopilot", "eid9001sid100", "eid9000sid100", "--json"]);
    assert_eq!(set.code, Some(0), "{set:?}");
    assert_eq!(provider.way("published", "COMPLETED"), format!("{EXECUTED} COMPLETED"));
    provider.next("cleared");
}

/// Figures 14, 15 and 17.
fn failures(fleet: &Fleet, provider: &mut Foreign) {
    let consumer = allocate_and_hold(fleet, provider);
    provider.order(json!({ "do": "fail" }));
    let (outcome_of_failure, code) = outcome(consumer);
    assert!(outcome_of_failure.starts_with("FAILED, RESOURCE_FAILED"), "{outcome_of_failure}");
    assert_eq!(code, Some(1));
    provider.next("cleared");

    provider.order(json!({ "do": "slow", "slow": true, "within": 0.3 }));
    let (timed_out, code) = outcome(allocate(fleet, &[]));
    assert!(timed_out.starts_with("FAILED, TIMEOUT"), "{timed_out}");
    assert_eq!(code, Some(1));
    assert_eq!(provider.way("published", "FAILED"), "ISSUED COMMANDED FAILED/TIMEOUT");
    provider.next("cleared");
    provider.order(json!({ "do": "slow", "slow": false, "within": 10 }));
}

/// Figure 8 with a command of a former life: it goes on, and it is given up.
fn crashes(fleet: &Fleet, python: &Path, provider: Foreign) -> Foreign {
    let consumer = allocate_and_hold(fleet, &provider);
    drop(provider);
    let provider = start(fleet, python, &[]);
    provider.next("ready");
    release(fleet);
    assert_eq!(provider.way("published", "CANCELED"), "CANCELED");
    provider.next("cleared");
    assert_eq!(outcome(consumer), ("CANCELED".into(), Some(0)));

    let consumer = allocate_and_hold(fleet, &provider);
    drop(provider);
    let provider = start(fleet, python, &["--gives-up"]);
    let (given_up, code) = outcome(consumer);
    assert!(given_up.starts_with("FAILED, SERVICE_FAILED"), "{given_up}");
    assert_eq!(code, Some(1));
    provider.next("cleared");
    provider
}

/// Figures 18 to 20: the consumer ends before the provider, then the provider before the consumer.
fn shutdowns(fleet: &Fleet, mut provider: Foreign) {
    let consumer = allocate_and_hold(fleet, &provider);
    consumer.signal("TERM");
    assert_eq!(provider.way("published", "CANCELED"), "CANCELED");
    provider.next("cleared");
    provider.next("consumer-unregistered");
    assert_eq!(outcome(consumer).1, Some(0));

    let consumer = allocate_and_hold(fleet, &provider);
    provider.order(json!({ "do": "shutdown" }));
    let (failed, code) = outcome(consumer);
    assert!(failed.starts_with("FAILED, SERVICE_FAILED"), "{failed}");
    assert_eq!(code, Some(1));
    provider.next("shut-down");
    provider.leave();
}
