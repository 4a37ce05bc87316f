//! One breach after the other: each is found, and nothing else.

use super::scene::*;
use crate::conform::*;
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// A clause, and a run that breaks it and no other.
type Planted = (Clause, fn(&mut Scene));

/// Puts a health report with one member changed.
fn health(scene: &mut Scene, member: &str, value: Value) {
    let mut report = scene.health_value();
    report[member] = value;
    scene.put(HEALTH, report);
}

/// Alice commands the pilot without a resource.
fn commanded(scene: &mut Scene) {
    scene.vector(ALICE, PILOT, 30);
    scene.execute(VECTOR, PILOT, 30);
}

fn completed(scene: &mut Scene) {
    commanded(scene);
    scene.status(VECTOR, PILOT, 30, "COMPLETED", "SUCCEEDED");
}

fn session(provider: u8, session: u8) -> Value {
    json!({ "source": id(provider), "sessionID": id(session) })
}

const NAMES: [Planted; 12] = [
    (Clause::TopicName, |scene| {
        let health = scene.health_value();
        scene.put("UMAA::SO::HealthReport::Health", health);
    }),
    (Clause::TypeName, |scene| {
        let health = scene.health_value();
        let hash = aldis_envelope::KeyHash::md5(&[&guid_bytes(PILOT), &guid_bytes(AUTOPILOT)]);
        let observed = Observed::Put(Content::Sample(health.clone()));
        scene.observe_as(HEALTH, HEALTH, hash, &health, observed);
    }),
    (Clause::GuidVariant, |scene| health(scene, "source", json!("04000000-0000-4000-c000-000000000000"))),
    (Clause::Members, |scene| health(scene, "status", Value::Null)),
    (Clause::Members, |scene| health(scene, "colour", json!("red"))),
    (Clause::Key, |scene| {
        let health = scene.health_value();
        let hash = aldis_envelope::KeyHash::md5(&[&guid_bytes(PILOT)]);
        let observed = Observed::Put(Content::Sample(health.clone()));
        scene.observe_as(HEALTH, &format!("{HEALTH}Type"), hash, &health, observed);
    }),
    (Clause::Enumeration, |scene| health(scene, "severity", json!("BAD"))),
    (Clause::Range, |scene| health(scene, "logTime", json!({ "seconds": 1, "nanoseconds": 1_000_000_000 }))),
    (Clause::Range, |scene| health(scene, "status", json!("x".repeat(4096)))),
    (Clause::Range, |scene| {
        let health = scene.health_value();
        scene.observe(HEALTH, &health, Observed::Put(Content::Unreadable("it ends early".to_owned())));
    }),
    (Clause::SequenceBound, |scene| {
        let entry = |number: u8| json!({ "priorities": [], "resourceID": id(number) });
        let entries: Vec<_> = (100..133).map(entry).collect();
        let time = scene.time();
        let report = json!({ "priorities": entries, "timeStamp": time, "source": id(ARBITER) });
        scene.put(&format!("{ALLOCATION}PriorityReport"), report);
    }),
    (Clause::ResourceOnce, |scene| {
        let info = json!({ "controlSession": null, "resourceID": id(AUTOPILOT) });
        let time = scene.time();
        let report = json!({ "controlInfo": [info, info], "timeStamp": time, "source": id(ARBITER) });
        scene.put(&format!("{ALLOCATION}Report"), report);
    }),
];

const COMMANDS: [Planted; 32] = [
    (Clause::SessionUnique, |scene| {
        commanded(scene);
        scene.vector(BOB, PILOT, 30);
    }),
    (Clause::SessionUnique, |scene| {
        commanded(scene);
        scene.vector(ALICE, NESTED, 30);
    }),
    (Clause::Destination, |scene| {
        scene.vector(ALICE, PILOT, 30);
        scene.status(VECTOR, NESTED, 30, "ISSUED", "SUCCEEDED");
    }),
    (Clause::Correlated, |scene| {
        scene.status(VECTOR, PILOT, 30, "ISSUED", "SUCCEEDED");
        scene.wait(1);
    }),
    (Clause::Answered, |scene| {
        scene.vector(ALICE, PILOT, 30);
        scene.wait(6);
    }),
    (Clause::FirstStatus, |scene| {
        scene.vector(ALICE, PILOT, 30);
        scene.ack(VECTOR, PILOT, 30);
        scene.status(VECTOR, PILOT, 30, "COMMANDED", "SUCCEEDED");
    }),
    // A state is skipped.
    (Clause::Transition, |scene| {
        scene.vector(ALICE, PILOT, 30);
        scene.status(VECTOR, PILOT, 30, "ISSUED", "SUCCEEDED");
        scene.ack(VECTOR, PILOT, 30);
        scene.status(VECTOR, PILOT, 30, "EXECUTING", "SUCCEEDED");
    }),
    // A state is published twice.
    (Clause::Transition, |scene| {
        commanded(scene);
        scene.status(VECTOR, PILOT, 30, "EXECUTING", "SUCCEEDED");
    }),
    // A command that is over goes on.
    (Clause::Transition, |scene| {
        completed(scene);
        scene.status(VECTOR, PILOT, 30, "FAILED", "SERVICE_FAILED");
    }),
    (Clause::Reason, |scene| {
        commanded(scene);
        scene.status(VECTOR, PILOT, 30, "FAILED", "RESOURCE_REJECTED");
    }),
    // A rejection that takes a short cut.
    (Clause::Reason, |scene| {
        scene.vector(ALICE, PILOT, 30);
        scene.status(VECTOR, PILOT, 30, "ISSUED", "SUCCEEDED");
        scene.status(VECTOR, PILOT, 30, "FAILED", "RESOURCE_REJECTED");
    }),
    (Clause::Reason, |scene| {
        scene.vector(ALICE, PILOT, 30);
        scene.status(VECTOR, PILOT, 30, "ISSUED", "UPDATED");
    }),
    (Clause::AckFirst, |scene| {
        scene.vector(ALICE, PILOT, 30);
        scene.status(VECTOR, PILOT, 30, "ISSUED", "SUCCEEDED");
        scene.status(VECTOR, PILOT, 30, "COMMANDED", "SUCCEEDED");
        scene.ack(VECTOR, PILOT, 30);
    }),
    // The acknowledgement of the command before its update does not do.
    (Clause::AckFirst, |scene| {
        commanded(scene);
        scene.vector(ALICE, PILOT, 30);
        scene.status(VECTOR, PILOT, 30, "ISSUED", "UPDATED");
        scene.status(VECTOR, PILOT, 30, "COMMANDED", "SUCCEEDED");
    }),
    (Clause::AckMatches, |scene| {
        scene.vector(ALICE, PILOT, 30);
        scene.status(VECTOR, PILOT, 30, "ISSUED", "SUCCEEDED");
        let other = scene.command_value(ALICE, PILOT, 30, &json!({ "heading": 2.5 }));
        scene.ack_of(VECTOR, PILOT, 30, other);
    }),
    (Clause::ExecutionStatus, |scene| {
        scene.vector(ALICE, PILOT, 30);
        scene.accept(VECTOR, PILOT, 30);
        scene.status(VECTOR, PILOT, 30, "EXECUTING", "SUCCEEDED");
        scene.wait(11);
    }),
    (Clause::ExecutionStatus, |scene| {
        scene.vector(ALICE, PILOT, 30);
        scene.accept(VECTOR, PILOT, 30);
        scene.execution_status(PILOT, 30);
    }),
    (Clause::UpdateNewer, |scene| {
        let mut early = scene.command_value(ALICE, PILOT, 30, &json!({ "heading": 1.0 }));
        commanded(scene);
        early["heading"] = json!(2.0);
        scene.put(&format!("{VECTOR}Command"), early);
    }),
    (Clause::UpdateInTime, |scene| {
        completed(scene);
        scene.vector(ALICE, PILOT, 30);
    }),
    (Clause::UpdateAnswered, |scene| {
        commanded(scene);
        scene.vector(ALICE, PILOT, 30);
        scene.wait(6);
    }),
    (Clause::UpdatedOnly, |scene| {
        commanded(scene);
        scene.status(VECTOR, PILOT, 30, "ISSUED", "UPDATED");
    }),
    (Clause::CancelAsked, |scene| {
        commanded(scene);
        scene.status(VECTOR, PILOT, 30, "CANCELED", "CANCELED");
        scene.wait(1);
    }),
    (Clause::CancelAnswered, |scene| {
        commanded(scene);
        scene.command_change(VECTOR, 30, Observed::Dispose);
        scene.wait(6);
    }),
    // What was said is gone, but it was never said how it ended.
    (Clause::CancelAnswered, |scene| {
        commanded(scene);
        scene.clean_up(VECTOR, PILOT, 30);
        scene.wait(6);
    }),
    (Clause::ConsumerCleanUp, |scene| {
        completed(scene);
        scene.wait(11);
    }),
    (Clause::CleanUpOrder, |scene| {
        completed(scene);
        scene.clear(VECTOR, PILOT, 30);
        scene.wait(1);
        scene.command_change(VECTOR, 30, Observed::Dispose);
    }),
    (Clause::ProviderCleanUp, |scene| {
        completed(scene);
        scene.command_change(VECTOR, 30, Observed::Dispose);
        scene.wait(11);
    }),
    // The execution status is forgotten.
    (Clause::ProviderCleanUp, |scene| {
        completed(scene);
        scene.command_change(VECTOR, 30, Observed::Dispose);
        scene.observe(&format!("{VECTOR}CommandStatus"), &session(PILOT, 30), Observed::Dispose);
        scene.observe(&format!("{VECTOR}CommandAckReport"), &session(PILOT, 30), Observed::Dispose);
        scene.wait(11);
    }),
    (Clause::ProviderShutdown, |scene| {
        commanded(scene);
        scene.observe(&format!("{VECTOR}CommandStatus"), &session(PILOT, 30), Observed::Unregister);
    }),
    (Clause::ConsumerShutdown, |scene| {
        commanded(scene);
        scene.command_change(VECTOR, 30, Observed::Unregister);
    }),
    (Clause::ReportShutdown, |scene| {
        let health = scene.health_value();
        scene.put(HEALTH, health.clone());
        scene.observe(HEALTH, &health, Observed::Unregister);
    }),
    // A disposal that tells a hash alone is understood by the sample before it.
    (Clause::ReportShutdown, |scene| {
        let health = scene.health_value();
        scene.put(HEALTH, health.clone());
        let hash = aldis_envelope::KeyHash::md5(&[&guid_bytes(PILOT), &guid_bytes(AUTOPILOT)]);
        scene.observe_as(HEALTH, &format!("{HEALTH}Type"), hash, &Value::Null, Observed::Unregister);
    }),
];

const COLLECTIONS: [Planted; 9] = [
    (Clause::UpdateEnd, |scene| {
        scene.area(50, 51);
        scene.set(&id(52), json!({ "seconds": 1, "nanoseconds": 0 }), 1);
        scene.wait(11);
    }),
    (Clause::EmptyCollection, |scene| scene.set(NIL, Value::Null, 3)),
    (Clause::ElementId, |scene| {
        scene.area(50, 51);
        scene.area(59, 51);
    }),
    (Clause::CollectionSize, |scene| {
        scene.area(50, 51);
        let last = scene.area(50, 52);
        scene.set(&id(52), last, 3);
    }),
    // The element comes after its metadata, and one is missing.
    (Clause::CollectionSize, |scene| {
        let soon = json!({ "seconds": 3, "nanoseconds": 0 });
        scene.set(&id(52), soon.clone(), 3);
        scene.area(50, 51);
        assert_eq!(scene.area(50, 52), soon);
    }),
    (Clause::ListOrder, |scene| {
        scene.point(61, Some(62));
        let last = scene.point(62, Some(61));
        scene.list(62, last, 61, 2);
    }),
    (Clause::ListOrder, |scene| {
        scene.point(61, None);
        let last = scene.point(62, None);
        scene.list(62, last, 61, 2);
    }),
    (Clause::ListOrder, |scene| {
        scene.point(61, Some(62));
        let last = scene.point(62, Some(63));
        scene.list(62, last, 61, 2);
    }),
    (Clause::ListOrder, |scene| {
        scene.point(61, Some(62));
        let last = scene.point(62, None);
        scene.list(62, last, 69, 2);
    }),
];

const ALLOCATIONS: [Planted; 11] = [
    (Clause::OneHolder, |scene| {
        scene.give(ALICE, 21, None);
        scene.give(BOB, 22, None);
    }),
    // Two arbiters, each with a holder of its own.
    (Clause::OneHolder, |scene| {
        scene.give(ALICE, 21, None);
        scene.control_by(MALLORY, Some(BOB));
    }),
    (Clause::Listed, |scene| scene.give(MALLORY, 21, None)),
    // No list was ever set.
    (Clause::Listed, |scene| {
        scene.priorities(&[]);
        scene.give(ALICE, 21, None);
    }),
    (Clause::TakeOver, |scene| {
        scene.give(BOB, 21, None);
        scene.allocate(ALICE, 22, None);
        scene.accept(ALLOCATION, ARBITER, 22);
        scene.status(ALLOCATION, ARBITER, 21, "FAILED", "INTERRUPTED");
        scene.control(Some(ALICE));
        scene.status(ALLOCATION, ARBITER, 22, "EXECUTING", "SUCCEEDED");
    }),
    (Clause::ReportFirst, |scene| {
        scene.allocate(ALICE, 21, None);
        scene.execute(ALLOCATION, ARBITER, 21);
        scene.control(Some(ALICE));
    }),
    (Clause::ReportCleared, |scene| {
        scene.give(ALICE, 21, None);
        scene.status(ALLOCATION, ARBITER, 21, "COMPLETED", "SUCCEEDED");
        scene.clean_up(ALLOCATION, ARBITER, 21);
        scene.wait(11);
    }),
    (Clause::Expiry, |scene| {
        scene.give(ALICE, 21, Some(3.0));
        scene.wait(9);
    }),
    (Clause::Guard, |scene| {
        scene.give(ALICE, 21, None);
        scene.vector(BOB, PILOT, 30);
        scene.execute(VECTOR, PILOT, 30);
    }),
    // Nobody holds the resource.
    (Clause::Guard, |scene| {
        scene.vector(ALICE, NESTED, 30);
        scene.execute(VECTOR, NESTED, 30);
    }),
    (Clause::PriorityReport, |scene| {
        let own = json!({ "priorities": [id(BOB), id(ALICE)], "resourceID": id(AUTOPILOT) });
        scene.command(PRIORITY, ALICE, ARBITER, 20, own);
        scene.execute(PRIORITY, ARBITER, 20);
        scene.status(PRIORITY, ARBITER, 20, "COMPLETED", "SUCCEEDED");
        scene.clean_up(PRIORITY, ARBITER, 20);
        scene.wait(11);
    }),
];

fn guid_bytes(number: u8) -> [u8; 16] {
    id(number).parse::<aldis_envelope::Guid>().unwrap().0
}

fn check(planted: &[Planted], scene: fn() -> Scene) {
    for (number, (clause, breach)) in planted.iter().enumerate() {
        let mut scene = scene();
        breach(&mut scene);
        let report = scene.finish();
        let broken: Vec<_> = report.broken().map(|found| found.clause).collect();
        assert_eq!(broken, [*clause], "breach {number}: {report}");
        let evidence = report.broken().next().and_then(|found| found.first.as_ref()).unwrap();
        assert!(evidence.topic.starts_with("UMAA::") && !evidence.text.is_empty(), "{evidence:?}");
    }
}

#[test]
fn breaches_of_names_and_types_are_found() {
    check(&NAMES, Scene::new);
}

#[test]
fn breaches_of_the_command_flow_are_found() {
    check(&COMMANDS, Scene::new);
}

#[test]
fn breaches_of_large_collections_are_found() {
    check(&COLLECTIONS, Scene::new);
}

#[test]
fn breaches_of_resource_allocation_are_found() {
    check(&ALLOCATIONS, Scene::with_priorities);
}

#[test]
fn every_clause_is_broken_once() {
    let planted = [&NAMES[..], &COMMANDS, &COLLECTIONS, &ALLOCATIONS].concat();
    let broken: BTreeSet<_> = planted.iter().map(|(clause, _)| *clause).collect();
    assert_eq!(broken, Clause::ALL.iter().copied().collect());
}

#[test]
fn several_breaches_in_one_run_are_told_apart() {
    let mut scene = Scene::with_priorities();
    health(&mut scene, "severity", json!("BAD"));
    scene.set(NIL, Value::Null, 3);
    scene.vector(BOB, PILOT, 30);
    scene.status(VECTOR, PILOT, 30, "ISSUED", "SUCCEEDED");
    scene.status(VECTOR, PILOT, 30, "COMMANDED", "SUCCEEDED");
    scene.status(VECTOR, PILOT, 30, "EXECUTING", "SUCCEEDED");
    let wanted = [Clause::EmptyCollection, Clause::AckFirst, Clause::Guard, Clause::Enumeration];
    assert_eq!(finished(scene), wanted);
}
