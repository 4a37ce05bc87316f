//! Segments of a mission, and when they are served.

use super::{Machine, WaypointConfig, WaypointManager, order, segments};
use crate::service::{Action, Outbox};
use crate::uxas::machine::{Heard, Post};
use aldis_envelope::lmcp::cmasi::{MissionCommand, ServiceStatus, Waypoint};
use aldis_envelope::lmcp::vehicles::SurfaceVehicleState;
use aldis_envelope::lmcp::{Object, Ref, decode};
use aldis_envelope::{EntityId, Monotonic, Now, ServiceId, Source, Wall};
use std::time::Duration;

fn plan(count: i64) -> Vec<Waypoint> {
    let at = |number: i64| Waypoint { number, next_waypoint: (number + 1).min(count), ..Waypoint::default() };
    (1..=count).map(at).collect()
}

fn numbers(list: &[Waypoint]) -> (i64, i64) {
    (list[0].number, list[list.len() - 1].number)
}

fn source() -> Source {
    Source::new(EntityId::new(100).unwrap(), ServiceId::new(110).unwrap())
}

/// What a manager sends when it hears a message after so many seconds; none: its deadline.
fn hear(manager: &mut WaypointManager, seconds: f64, object: Option<&dyn Object>) -> Vec<Box<dyn Object>> {
    let mut out = Outbox::new(source());
    let now = Now { monotonic: Monotonic::since_start(Duration::from_secs_f64(seconds)), wall: Wall(0) };
    let mut post = Post::new(now, &mut out);
    match object {
        Some(object) => manager.take(&Heard { object, source: source() }, &mut post),
        None => manager.wake(&mut post),
    }
    let sent = out.drain().filter_map(|action| match action {
        Action::Send(message) => decode(&message.content).ok(),
        _ => None,
    });
    sent.collect()
}

fn mission(list: Vec<Waypoint>) -> MissionCommand {
    let mut mission = MissionCommand { first_waypoint: 1, ..MissionCommand::default() };
    (mission.vehicle_id, mission.command_id) = (400, 7);
    mission.waypoint_list = list.into_iter().map(Ref::new).collect();
    mission
}

#[test]
fn segments_overlap_as_in_the_waterway() {
    let all = segments(&plan(73), 15, 5);
    let ends: Vec<_> = all.iter().map(|segment| numbers(segment)).collect();
    assert_eq!(ends, [(1, 15), (11, 25), (21, 35), (31, 45), (41, 55), (51, 65), (61, 73)]);
    assert_eq!(segments(&plan(3), 0, 0).len(), 1, "a segment goes on where its overlap ends");
    assert_eq!(
        segments(&plan(4), 0, 0).iter().map(|segment| numbers(segment)).collect::<Vec<_>>(),
        [(1, 3), (2, 4)]
    );
}

#[test]
fn links_are_followed_loops_end_and_holes_are_told() {
    let mut list = plan(4);
    list.reverse();
    assert_eq!(numbers(&order(&list, 2).unwrap()), (1, 4), "the one before the first is kept");
    list[0].next_waypoint = 1;
    assert_eq!(order(&list, 3).unwrap().len(), 4);
    list[0].next_waypoint = 9;
    assert!(order(&list, 1).unwrap_err().contains("4 leads to 9"));
    assert!(order(&[], 1).is_err() && order(&plan(2), 5).is_err());
}

#[test]
fn a_boat_is_served_its_next_segment_when_it_is_in_it_and_not_twice_a_second() {
    let config = WaypointConfig {
        number_waypoints_to_serve: 5,
        number_waypoints_overlap: 2,
        ..WaypointConfig::of(400)
    };
    let mut manager = WaypointManager::new(config);
    let served = |sent: Vec<Box<dyn Object>>| {
        let commands = sent.iter().filter_map(|object| object.get::<MissionCommand>());
        let of = |command: &MissionCommand| {
            let list: Vec<_> = command.waypoint_list.iter().map(|at| at.get().unwrap().clone()).collect();
            let last = list.last().unwrap();
            assert_eq!(last.number, last.next_waypoint);
            (command.first_waypoint, numbers(&list))
        };
        commands.map(of).collect::<Vec<_>>()
    };
    assert_eq!(served(hear(&mut manager, 0.0, Some(&mission(plan(9))))), [(1, (1, 5))]);
    let mut state = SurfaceVehicleState::default();
    (state.id, state.current_waypoint) = (400, 4);
    assert_eq!(served(hear(&mut manager, 0.3, Some(&state))), []);
    assert_eq!(manager.deadline(), None, "the segment that it has goes on from there");
    state.current_waypoint = 5;
    assert_eq!(served(hear(&mut manager, 0.5, Some(&state))), [], "too soon");
    assert_eq!(manager.deadline(), Some(Monotonic::since_start(Duration::from_secs(1))));
    state.current_waypoint = 6;
    assert_eq!(served(hear(&mut manager, 0.9, Some(&state))), []);
    assert_eq!(served(hear(&mut manager, 1.0, None)), [(6, (4, 8))], "the newest counts");
    assert_eq!(served(hear(&mut manager, 3.0, Some(&state))), [], "it has been served");
    let mut broken = plan(3);
    broken[1].next_waypoint = 77;
    let sent = hear(&mut manager, 9.0, Some(&mission(broken)));
    assert!(sent[0].get::<ServiceStatus>().unwrap().info[0].get().unwrap().value.contains("leads to 77"));
}
