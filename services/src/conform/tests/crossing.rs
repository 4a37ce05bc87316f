//! Commands that are heard later than the answers to them.

use super::scene::*;
use crate::conform::*;
use serde_json::{Value, json};
use std::time::Duration;

fn scene() -> Scene {
    Scene::new().bounded(Bounds { slack: Duration::from_secs(1), ..Bounds::default() })
}

/// A status, an acknowledgement and COMMANDED, before the command comes that they speak of.
fn answer(scene: &mut Scene, reason: &str, heading: f64) -> Value {
    let command = scene.command_value(ALICE, PILOT, 30, &json!({ "heading": heading }));
    scene.status(VECTOR, PILOT, 30, "ISSUED", reason);
    scene.ack_of(VECTOR, PILOT, 30, command.clone());
    scene.status(VECTOR, PILOT, 30, "COMMANDED", "SUCCEEDED");
    command
}

#[test]
fn a_command_and_its_update_may_come_after_their_answers() {
    let mut scene = scene();
    let command = answer(&mut scene, "SUCCEEDED", 1.0);
    scene.put(&format!("{VECTOR}Command"), command);
    let update = answer(&mut scene, "UPDATED", 2.0);
    scene.put(&format!("{VECTOR}Command"), update);
    scene.wait(6);
    assert_eq!(finished(scene), []);
}

#[test]
fn what_no_command_excuses_in_time_is_found() {
    let mut scene = scene();
    answer(&mut scene, "SUCCEEDED", 1.0);
    scene.wait(2);
    assert_eq!(finished(scene), [Clause::Correlated, Clause::AckFirst]);
}

#[test]
fn an_update_that_never_comes_is_found() {
    let mut scene = scene();
    let command = answer(&mut scene, "SUCCEEDED", 1.0);
    scene.put(&format!("{VECTOR}Command"), command);
    answer(&mut scene, "UPDATED", 2.0);
    scene.wait(2);
    assert_eq!(finished(scene), [Clause::AckMatches, Clause::UpdatedOnly]);
}

#[test]
fn an_acknowledgement_that_comes_late_is_found_at_once() {
    let mut scene = scene();
    scene.vector(ALICE, PILOT, 30);
    scene.status(VECTOR, PILOT, 30, "ISSUED", "SUCCEEDED");
    scene.status(VECTOR, PILOT, 30, "COMMANDED", "SUCCEEDED");
    scene.ack(VECTOR, PILOT, 30);
    assert_eq!(finished(scene), [Clause::AckFirst]);
}
