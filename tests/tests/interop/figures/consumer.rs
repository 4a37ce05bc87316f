//! A consumer in Python, entity 300, and Aldis' arbiter, entity 400.

use super::{Foreign, start_arbiter};
use crate::harness::Fleet;
use aldis_tests::{Node, until};
use serde_json::{Value, json};
use std::path::Path;

/// The states of a command that is executed.
const EXECUTED: &str = "ISSUED COMMANDED EXECUTING";

fn start(fleet: &Fleet, python: &Path, recovery: &str) -> Foreign {
    let journal = fleet.file("consumer.json");
    let args = ["--as", "300", "--journal", &journal, "consumer", "--recovery", recovery];
    Foreign(fleet.start_umaa(python, &args))
}

/// Asks for the autopilot for so many seconds, or without end.
fn allocate(consumer: &mut Foreign, name: &str, seconds: Option<f64>) {
    consumer.order(json!({
        "do": "start", "name": name, "kind": "allocation", "to": "eid400sid10",
        "resource": "400:autopilot", "duration": seconds,
    }));
}

fn allocate_and_hold(consumer: &mut Foreign, name: &str) {
    allocate(consumer, name, None);
    assert_eq!(consumer.way("status", "EXECUTING"), EXECUTED);
}

/// Waits until the arbiter reports who controls the autopilot.
fn wait_for_holder(fleet: &Fleet, holder: &Value) {
    until(&format!("{holder} holds the autopilot"), || {
        let told = fleet.aldis(&["priority", "400:autopilot", "--json"]).json();
        told.first().filter(|resource| resource["holder"] == *holder).map(drop)
    });
}

pub(super) fn all_figures(fleet: &Fleet, python: &Path) {
    let mut consumer = start(fleet, python, "cancel");
    let arbiter = start_up(fleet, &mut consumer);
    executions(fleet, &mut consumer);
    let (consumer, arbiter) = crashes(fleet, python, consumer, arbiter);
    shutdowns(fleet, consumer, arbiter);
}

/// Figures 7 to 13 and 17: the consumer starts first, and its command waits for the provider.
fn start_up(fleet: &Fleet, consumer: &mut Foreign) -> Node {
    assert_eq!(consumer.next("ready")["recovered"], json!([]));
    allocate(consumer, "first", Some(60.0));
    let arbiter = start_arbiter(fleet);
    assert_eq!(consumer.way("status", "EXECUTING"), EXECUTED);
    consumer.order(json!({ "do": "update", "name": "first", "duration": 0.5 }));
    assert_eq!(consumer.way("status", "COMPLETED"), "ISSUED/UPDATED COMMANDED EXECUTING COMPLETED");
    consumer.next("clean");
    arbiter
}

/// Figures 10 and 11, 13 to 17: ways that an execution goes.
fn executions(fleet: &Fleet, consumer: &mut Foreign) {
    allocate_and_hold(consumer, "cancelled");
    consumer.order(json!({ "do": "cancel", "name": "cancelled" }));
    assert_eq!(consumer.way("status", "CANCELED"), "CANCELED");
    consumer.next("clean");

    allocate_and_hold(consumer, "taken over");
    let higher =
        fleet.start_aldis(&["allocate", "400:autopilot", "--as", "9010", "--for", "300ms", "--json"]);
    assert_eq!(consumer.way("status", "FAILED"), "FAILED/INTERRUPTED");
    consumer.next("clean");
    let (_, code) = higher.end();
    assert_eq!(code, Some(0));

    let stand_in = fleet.start_aldis(&[
        "command",
        "stand-in",
        "--as",
        "410",
        "--fails",
        "resource-failed",
        "--after",
        "100ms",
        "--json",
    ]);
    assert_eq!(stand_in.next(), Some(json!({ "event": "serving", "service": "eid410sid110" })));
    consumer.order(json!({
        "do": "start", "name": "fails", "kind": "priority", "to": "eid410sid110",
        "resource": "400:autopilot", "priorities": ["eid300sid100"],
    }));
    assert_eq!(consumer.way("status", "FAILED"), "ISSUED COMMANDED EXECUTING FAILED/RESOURCE_FAILED");
    consumer.next("clean");
    stand_in.signal("TERM");
    assert_eq!(stand_in.end().1, Some(0));

    consumer.order(json!({ "do": "deaf", "deaf": true }));
    allocate(consumer, "not confirmed", None);
    assert_eq!(consumer.way("status", "FAILED"), "ISSUED COMMANDED FAILED/TIMEOUT");
    consumer.next("clean");
    consumer.order(json!({ "do": "deaf", "deaf": false }));
}

/// Figures 8 and 9 with commands of a former life: of the provider, then of the consumer.
fn crashes(fleet: &Fleet, python: &Path, mut consumer: Foreign, arbiter: Node) -> (Foreign, Node) {
    allocate_and_hold(&mut consumer, "survives its provider");
    arbiter.crash();
    let arbiter = start_arbiter(fleet);
    // It takes the command up anew, or goes on with it where it has kept what it said.
    wait_for_holder(fleet, &json!("eid300sid100"));

    drop(consumer);
    let mut consumer = start(fleet, python, "resume");
    let recovered = consumer.next("ready")["recovered"].clone();
    let session = recovered[0].as_str().expect("a session");
    assert_eq!(recovered, json!([session]));
    consumer.order(json!({ "do": "update", "session": session, "duration": 0.3 }));
    assert!(consumer.way("status", "COMPLETED").ends_with("ISSUED/UPDATED COMMANDED EXECUTING COMPLETED"));
    consumer.next("clean");

    allocate_and_hold(&mut consumer, "is cancelled by the next life");
    drop(consumer);
    let consumer = start(fleet, python, "cancel");
    assert_eq!(consumer.next("ready")["recovered"].as_array().map(Vec::len), Some(1));
    assert!(consumer.way("status", "CANCELED").ends_with("CANCELED"));
    consumer.next("clean");
    (consumer, arbiter)
}

/// Figures 18 to 20: the provider ends before the consumer, then the consumer before the provider.
fn shutdowns(fleet: &Fleet, mut consumer: Foreign, mut arbiter: Node) {
    allocate_and_hold(&mut consumer, "fails with its provider");
    arbiter.signal("TERM");
    assert_eq!(consumer.way("status", "FAILED"), "FAILED/SERVICE_FAILED");
    assert!(arbiter.wait().success());
    consumer.next("unregistered");

    let mut arbiter = start_arbiter(fleet);
    allocate_and_hold(&mut consumer, "ends with its consumer");
    consumer.order(json!({ "do": "shutdown" }));
    consumer.next("shut-down");
    consumer.leave();
    wait_for_holder(fleet, &Value::Null);
    arbiter.signal("TERM");
    assert!(arbiter.wait().success());
}
