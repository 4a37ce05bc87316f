//! Control that ends in the middle of a mission: its time is over, or who gave it is dead.

use super::tests::{BOAT, at, boat, fleet, id, mission, play, shore, states, statuses};
use super::{Member, Missions};
use crate::registry::Kind;
use crate::sim::offline::Played;
use crate::uxas::Core;
use crate::uxas::control::Control;
use crate::uxas::kinematic::KinematicConfig;
use crate::uxas::waypoint_manager::WaypointConfig;
use std::time::Duration;

fn seconds(seconds: u64) -> Duration {
    Duration::from_secs(seconds)
}

/// Whether the boat was under way and holds its place now; what was said of it there.
fn holds_its_place(fleet: &mut Missions, member: usize) -> Vec<String> {
    let heard = fleet.heard(member);
    let told = states(&heard);
    let (last, before) = (told[told.len() - 1], told[told.len() - 20]);
    assert!(last.0 > at(60.0005).latitude, "it was under way: {last:?}");
    assert!(last.1 == 0.0 && last.0 == before.0, "{last:?} {before:?}");
    statuses(&heard)
}

#[test]
fn the_time_of_control_is_over_where_nobody_can_renew_it() {
    let one = shore(1);
    let may = vec![one.source(0)];
    let mut fleet = fleet(None, vec![one], may);
    fleet.heard(1);
    play(&mut fleet, 0, mission(1, [60.02, 60.04]));
    fleet.run_for(seconds(40));
    assert!(states(&fleet.heard(1)).last().unwrap().1 > 4.0);
    // Shore is cut off: the boat's arbiter is beside the boat, and hears of no renewal.
    fleet.world.partition(&[0, 1], Duration::ZERO);
    fleet.run_for(seconds(20));
    assert!(states(&fleet.heard(1)).last().unwrap().1 > 4.0, "control that was given holds for its time");
    fleet.run_for(seconds(70));
    let said = holds_its_place(&mut fleet, 1);
    assert!(
        said.iter().any(|text| text.contains("vehicle 400: stops in mission 65537 of eid1sid100")),
        "{said:?}"
    );
    let lost = statuses(&fleet.heard(0));
    let why = "mission 1 of vehicle 400 ends: control is lost of `autopilot`";
    assert!(lost.iter().any(|text| text.contains(why)), "{lost:?}");
    // Back together, a new mission is a new start.
    fleet.world.partition(&[0, 0], Duration::ZERO);
    fleet.run_for(seconds(20));
    play(&mut fleet, 0, mission(2, [60.03, 60.04]));
    fleet.run_for(seconds(20));
    let last = *states(&fleet.heard(1)).last().unwrap();
    assert!(last.1 > 4.0 && last.2 == 2, "{last:?}");
}

#[test]
fn an_arbiter_that_dies_ends_the_mission_on_both_sides() {
    // The boat's resource is given by a node of its own.
    let control = || Control::of(id(2), "autopilot");
    let served = Core::ControlledWaypoints(WaypointConfig::of(BOAT), control());
    let shore = Member::new(id(1), vec![("missions".to_owned(), Kind::Core(served))]);
    let resource = Some(("autopilot".to_owned(), vec![shore.source(0)]));
    let arbiter = Member { resource, ..Member::new(id(2), Vec::new()) };
    let moves = Core::GuardedKinematic(KinematicConfig::of(BOAT, Duration::from_millis(500)), control());
    let vehicle = Member::new(id(400), vec![("boat".to_owned(), Kind::Core(moves))]);
    let mut fleet = Missions::new(7, None, 1, vec![shore, arbiter, vehicle]).unwrap();
    for object in boat() {
        fleet.play(2, vec![Played { at: Duration::ZERO, object }]);
    }
    fleet.run_for(seconds(20));
    play(&mut fleet, 0, mission(1, [60.02, 60.04]));
    fleet.run_for(seconds(40));
    assert!(states(&fleet.heard(2)).last().unwrap().1 > 4.0);
    fleet.heard(0);
    let node = fleet.running[1].node;
    fleet.world.crash(node, false, Duration::from_millis(10));
    fleet.run_for(seconds(90));
    let said = holds_its_place(&mut fleet, 2);
    assert!(said.iter().any(|text| text.contains("stops in mission 65537 of eid1sid100")), "{said:?}");
    let lost = statuses(&fleet.heard(0));
    let why = "mission 1 of vehicle 400 ends: control is lost of `autopilot`: the arbiter eid2sid10";
    assert!(lost.iter().any(|text| text.contains(why)), "{lost:?}");
}
