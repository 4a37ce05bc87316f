//! A run as the ICD asks for, with something of everything.

use super::scene::*;
use crate::conform::*;
use serde_json::json;

/// Everything in its order. Every clause applies at least once.
fn everything() -> Scene {
    let mut scene = Scene::new();
    scene.config(&[PILOT, NESTED]);
    scene.control(None);
    let own = json!({ "priorities": [id(ALICE), id(BOB)], "resourceID": id(AUTOPILOT) });
    scene.command(PRIORITY, ALICE, ARBITER, 20, own);
    scene.execute(PRIORITY, ARBITER, 20);
    scene.priorities(&[ALICE, BOB]);
    scene.status(PRIORITY, ARBITER, 20, "COMPLETED", "SUCCEEDED");
    scene.clean_up(PRIORITY, ARBITER, 20);

    // Alice takes control and commands the pilot, which has a nested pilot to command.
    scene.give(ALICE, 21, None);
    scene.vector(ALICE, PILOT, 30);
    scene.execute(VECTOR, PILOT, 30);
    scene.vector(PILOT, NESTED, 31);
    scene.execute(VECTOR, NESTED, 31);
    scene.command_change(VECTOR, 31, Observed::Dispose);
    scene.status(VECTOR, NESTED, 31, "CANCELED", "CANCELED");
    scene.clear(VECTOR, NESTED, 31);
    scene.vector(ALICE, PILOT, 30);
    scene.status(VECTOR, PILOT, 30, "ISSUED", "UPDATED");
    scene.ack(VECTOR, PILOT, 30);
    scene.status(VECTOR, PILOT, 30, "COMMANDED", "SUCCEEDED");
    scene.status(VECTOR, PILOT, 30, "EXECUTING", "SUCCEEDED");
    scene.execution_status(PILOT, 30);

    // Bob takes over, and his time runs out.
    scene.allocate(BOB, 22, Some(5.0));
    scene.accept(ALLOCATION, ARBITER, 22);
    scene.status(ALLOCATION, ARBITER, 21, "FAILED", "INTERRUPTED");
    scene.control(Some(BOB));
    scene.status(ALLOCATION, ARBITER, 22, "EXECUTING", "SUCCEEDED");
    scene.status(VECTOR, PILOT, 30, "FAILED", "INTERRUPTED");
    scene.clean_up(ALLOCATION, ARBITER, 21);
    scene.clean_up(VECTOR, PILOT, 30);
    scene.wait(5);
    scene.status(ALLOCATION, ARBITER, 22, "COMPLETED", "SUCCEEDED");
    scene.control(None);
    scene.clean_up(ALLOCATION, ARBITER, 22);
    collections(&mut scene);
    shutdown(&mut scene);
    scene
}

fn collections(scene: &mut Scene) {
    scene.set(NIL, json!(null), 0);
    scene.area(50, 51);
    let last = scene.area(50, 52);
    scene.set(&id(52), last, 2);
    scene.set(&id(51), json!(null), 1);
    let key = json!({ "elementID": id(51) });
    scene.observe(AREAS, &key, Observed::Dispose);
    scene.point(62, None);
    let last = scene.point(61, Some(62));
    scene.list(61, last, 61, 2);
}

fn shutdown(scene: &mut Scene) {
    let health = scene.health_value();
    scene.put(HEALTH, health.clone());
    scene.put(HEALTH, health.clone());
    scene.observe(HEALTH, &health, Observed::Dispose);
    scene.observe(HEALTH, &health, Observed::Unregister);
    let key = json!({ "source": id(ARBITER), "sessionID": id(22) });
    scene.command_change(ALLOCATION, 22, Observed::Unregister);
    scene.observe(&format!("{ALLOCATION}CommandStatus"), &key, Observed::Unregister);
    scene.wait(100);
}

#[test]
fn a_run_as_the_icd_asks_for_holds_every_clause() {
    let report = everything().finish();
    assert_eq!(report.count(Verdict::Broken), 0, "{report}");
    let unseen: Vec<_> = report.clauses.iter().filter(|found| found.verdict() == Verdict::NotSeen).collect();
    assert!(unseen.is_empty(), "{unseen:?}");
    assert_eq!((report.open, report.clauses.len()), (0, Clause::ALL.len()));
}

#[test]
fn the_report_says_the_same_in_every_form() {
    let report = everything().finish();
    let held = Clause::ALL.len();
    assert!(report.to_string().contains(&format!("{held} clauses held, 0 broken, 0 not seen")), "{report}");
    assert_eq!(report.json()["clauses_held"], held);
    assert!(report.junit().contains(&format!("tests=\"{held}\" failures=\"0\"")), "{}", report.junit());
}

#[test]
fn recovery_and_renewal_are_no_breach() {
    let mut scene = Scene::with_priorities();
    scene.give(ALICE, 21, Some(8.0));
    for _ in 0..3 {
        scene.wait(6);
        scene.allocate(ALICE, 21, Some(8.0));
        scene.status(ALLOCATION, ARBITER, 21, "ISSUED", "UPDATED");
        scene.ack(ALLOCATION, ARBITER, 21);
        scene.status(ALLOCATION, ARBITER, 21, "COMMANDED", "SUCCEEDED");
        scene.status(ALLOCATION, ARBITER, 21, "EXECUTING", "SUCCEEDED");
    }
    assert_eq!(finished(scene), []);

    // The pilot crashes: contact is lost, it owes nothing; it comes back and goes on from EXECUTING.
    let mut scene = Scene::with_priorities();
    scene.give(ALICE, 21, None);
    scene.vector(ALICE, PILOT, 30);
    scene.execute(VECTOR, PILOT, 30);
    scene.vector(ALICE, PILOT, 30);
    let key = json!({ "source": id(PILOT), "sessionID": id(30) });
    scene.observe(&format!("{VECTOR}CommandStatus"), &key, Observed::NoWriters);
    scene.wait(60);
    scene.status_again(VECTOR);
    scene.status(VECTOR, PILOT, 30, "ISSUED", "UPDATED");
    scene.ack(VECTOR, PILOT, 30);
    scene.status(VECTOR, PILOT, 30, "COMMANDED", "SUCCEEDED");
    // It shuts down in order, and its next life finds the command without a status.
    scene.status(VECTOR, PILOT, 30, "FAILED", "SERVICE_FAILED");
    scene.observe(&format!("{VECTOR}CommandStatus"), &key, Observed::Unregister);
    scene.execute(VECTOR, PILOT, 30);
    assert_eq!(finished(scene), []);
}

#[test]
fn a_second_session_of_the_holder_takes_over_from_the_first() {
    let mut scene = Scene::with_priorities();
    scene.give(ALICE, 21, None);
    scene.allocate(ALICE, 22, None);
    scene.accept(ALLOCATION, ARBITER, 22);
    scene.status(ALLOCATION, ARBITER, 21, "COMPLETED", "SUCCEEDED");
    scene.status(ALLOCATION, ARBITER, 22, "EXECUTING", "SUCCEEDED");
    scene.clean_up(ALLOCATION, ARBITER, 21);
    scene.wait(100);
    assert_eq!(finished(scene), []);
}

#[test]
fn control_that_goes_on_with_a_newer_session_was_not_taken() {
    let mut scene = Scene::with_priorities();
    scene.give(BOB, 21, None);
    scene.allocate(BOB, 21, None);
    scene.status(ALLOCATION, ARBITER, 21, "ISSUED", "UPDATED");
    scene.ack(ALLOCATION, ARBITER, 21);
    scene.status(ALLOCATION, ARBITER, 21, "COMMANDED", "SUCCEEDED");
    // Bob's newer session goes before his renewal.
    scene.allocate(BOB, 22, None);
    scene.accept(ALLOCATION, ARBITER, 22);
    scene.status(ALLOCATION, ARBITER, 21, "FAILED", "INTERRUPTED");
    scene.control(Some(BOB));
    scene.clean_up(ALLOCATION, ARBITER, 21);
    scene.command_change(ALLOCATION, 22, Observed::Dispose);
    scene.status(ALLOCATION, ARBITER, 22, "CANCELED", "CANCELED");
    scene.clear(ALLOCATION, ARBITER, 22);
    // Nobody is in control now, and Alice may be.
    scene.give(ALICE, 23, None);
    assert_eq!(finished(scene), []);
}

#[test]
fn an_arbiter_that_starts_again_clears_up_without_a_last_word() {
    let mut scene = Scene::with_priorities();
    scene.give(ALICE, 21, Some(3.0));
    let key = json!({ "source": id(ARBITER), "sessionID": id(21) });
    scene.observe(&format!("{ALLOCATION}CommandStatus"), &key, Observed::NoWriters);
    scene.command_change(ALLOCATION, 21, Observed::Dispose);
    scene.clear(ALLOCATION, ARBITER, 21);
    scene.control(None);
    scene.give(BOB, 22, None);
    scene.wait(100);
    assert_eq!(finished(scene), []);
}

#[test]
fn two_updates_may_come_before_the_answer_to_the_first() {
    let mut scene = Scene::new();
    scene.vector(ALICE, PILOT, 30);
    scene.execute(VECTOR, PILOT, 30);
    scene.vector(ALICE, PILOT, 30);
    let first = scene.command_now(VECTOR, 30);
    scene.vector(ALICE, PILOT, 30);
    scene.status(VECTOR, PILOT, 30, "ISSUED", "UPDATED");
    scene.ack_of(VECTOR, PILOT, 30, first);
    scene.status(VECTOR, PILOT, 30, "ISSUED", "UPDATED");
    scene.ack(VECTOR, PILOT, 30);
    scene.status(VECTOR, PILOT, 30, "COMMANDED", "SUCCEEDED");
    assert_eq!(finished(scene), []);
}

#[test]
fn a_cancel_may_cross_the_first_answer() {
    let mut scene = Scene::new();
    scene.vector(ALICE, PILOT, 30);
    scene.command_change(VECTOR, 30, Observed::Dispose);
    scene.status(VECTOR, PILOT, 30, "ISSUED", "SUCCEEDED");
    scene.ack(VECTOR, PILOT, 30);
    scene.status(VECTOR, PILOT, 30, "COMMANDED", "SUCCEEDED");
    scene.status(VECTOR, PILOT, 30, "CANCELED", "CANCELED");
    scene.clear(VECTOR, PILOT, 30);
    // Or nobody ever takes it up.
    scene.vector(ALICE, PILOT, 31);
    scene.command_change(VECTOR, 31, Observed::Dispose);
    scene.wait(100);
    assert_eq!(finished(scene), []);
}

#[test]
fn history_is_taken_in_without_judging_it() {
    let mut scene = Scene::with_priorities();
    scene.retained = true;
    scene.control(Some(ALICE));
    scene.vector(ALICE, PILOT, 30);
    scene.status(VECTOR, PILOT, 30, "EXECUTING", "SUCCEEDED");
    scene.ack(VECTOR, PILOT, 30);
    scene.status(VECTOR, MALLORY, 40, "COMMANDED", "SUCCEEDED");
    scene.area(50, 52);
    scene.set(&id(51), json!({ "seconds": 1, "nanoseconds": 0 }), 7);
    scene.retained = false;
    scene.status(VECTOR, PILOT, 30, "COMPLETED", "SUCCEEDED");
    scene.clean_up(VECTOR, PILOT, 30);
    assert_eq!(finished(scene), []);
}

#[test]
fn what_is_not_yet_due_is_left_open() {
    let mut scene = Scene::new();
    scene.vector(ALICE, PILOT, 30);
    scene.wait(4);
    let report = scene.finish();
    assert_eq!((report.open, report.count(Verdict::Broken)), (1, 0));
}

#[test]
fn with_slack_writers_may_be_seen_out_of_order() {
    let run = |slack: u64| {
        let bounds = Bounds { slack: std::time::Duration::from_secs(slack), ..Bounds::default() };
        let mut scene = Scene::new().bounded(bounds);
        scene.vector(ALICE, PILOT, 30);
        scene.execute(VECTOR, PILOT, 30);
        scene.status(VECTOR, PILOT, 30, "COMPLETED", "SUCCEEDED");
        scene.clear(VECTOR, PILOT, 30);
        scene.command_change(VECTOR, 30, Observed::Dispose);
        finished(scene)
    };
    assert_eq!(run(1), []);
    assert_eq!(run(0), [Clause::CleanUpOrder]);
}

#[test]
fn an_update_may_cross_the_first_answer() {
    let mut scene = Scene::new();
    scene.vector(ALICE, PILOT, 30);
    let first = scene.command_now(VECTOR, 30);
    scene.vector(ALICE, PILOT, 30);
    // The provider has not heard of the update yet.
    scene.status(VECTOR, PILOT, 30, "ISSUED", "SUCCEEDED");
    scene.ack_of(VECTOR, PILOT, 30, first);
    scene.status(VECTOR, PILOT, 30, "COMMANDED", "SUCCEEDED");
    scene.status(VECTOR, PILOT, 30, "ISSUED", "UPDATED");
    scene.ack(VECTOR, PILOT, 30);
    scene.status(VECTOR, PILOT, 30, "COMMANDED", "SUCCEEDED");
    // Or it hears of the command as updated first.
    scene.vector(ALICE, PILOT, 31);
    scene.vector(ALICE, PILOT, 31);
    scene.accept(VECTOR, PILOT, 31);
    scene.wait(6);
    assert_eq!(finished(scene), []);
}

#[test]
fn the_former_holder_is_let_through_until_another_has_control() {
    let run = |is_given: bool| {
        let mut scene = Scene::with_priorities();
        scene.give(ALICE, 21, None);
        scene.allocate(BOB, 22, None);
        scene.accept(ALLOCATION, ARBITER, 22);
        scene.status(ALLOCATION, ARBITER, 21, "FAILED", "INTERRUPTED");
        scene.clean_up(ALLOCATION, ARBITER, 21);
        scene.control(Some(BOB));
        if is_given {
            scene.status(ALLOCATION, ARBITER, 22, "EXECUTING", "SUCCEEDED");
        }
        // The pilot goes by the report before.
        scene.vector(ALICE, PILOT, 30);
        scene.execute(VECTOR, PILOT, 30);
        finished(scene)
    };
    assert_eq!(run(false), []);
    assert_eq!(run(true), [Clause::Guard]);

    // Control that is given back to nobody is not confirmed; a provider that has not heard of it for long is at fault.
    let after = |seconds: u64| {
        let mut scene = Scene::with_priorities();
        scene.give(ALICE, 21, None);
        scene.command_change(ALLOCATION, 21, Observed::Dispose);
        scene.status(ALLOCATION, ARBITER, 21, "CANCELED", "CANCELED");
        scene.control(None);
        scene.clear(ALLOCATION, ARBITER, 21);
        scene.wait(seconds);
        scene.vector(ALICE, PILOT, 30);
        scene.execute(VECTOR, PILOT, 30);
        finished(scene)
    };
    assert_eq!(after(5), []);
    assert_eq!(after(11), [Clause::Guard]);
}
