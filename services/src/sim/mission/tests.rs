//! A mission under control, two shores and a take-over, on one bus and behind links.

use super::{Member, Missions, TakeOver};
use crate::registry::Kind;
use crate::sim::link::Profile;
use crate::sim::offline::{Overheard, Played};
use crate::uxas::Core;
use crate::uxas::control::Control;
use crate::uxas::kinematic::KinematicConfig;
use crate::uxas::waypoint_manager::WaypointConfig;
use aldis_envelope::EntityId;
use aldis_envelope::lmcp::cmasi::{EntityState, Location3D, MissionCommand, ServiceStatus, Waypoint};
use aldis_envelope::lmcp::vehicles::{SurfaceVehicleConfiguration, SurfaceVehicleState};
use aldis_envelope::lmcp::{Object, Ref, decode};
use std::time::Duration;

pub(super) const BOAT: i64 = 400;

pub(super) fn id(number: u64) -> EntityId {
    EntityId::new(number).unwrap()
}

pub(super) fn at(latitude: f64) -> Location3D {
    Location3D { latitude, longitude: 20.0, ..Location3D::default() }
}

pub(super) fn boat() -> Vec<Box<dyn Object>> {
    let mut boat = SurfaceVehicleConfiguration::default();
    (boat.id, boat.nominal_speed) = (BOAT, 5.0);
    let mut state = SurfaceVehicleState::default();
    (state.id, state.location) = (BOAT, Ref::new(at(60.0)));
    vec![Box::new(boat), Box::new(state)]
}

/// To two places, a kilometre apart.
pub(super) fn mission(number: i64, latitudes: [f64; 2]) -> Box<dyn Object> {
    let mut mission = MissionCommand { first_waypoint: 1, ..MissionCommand::default() };
    (mission.vehicle_id, mission.command_id) = (BOAT, number);
    mission.waypoint_list = (1..=2)
        .zip(latitudes)
        .map(|(number, latitude)| {
            Ref::new(Waypoint {
                number,
                next_waypoint: 2,
                speed: 5.0,
                base: at(latitude),
                ..Waypoint::default()
            })
        })
        .collect();
    Box::new(mission)
}

pub(super) fn shore(number: u64) -> Member {
    let control = Control::of(id(400), "autopilot");
    let core = Core::ControlledWaypoints(WaypointConfig::of(BOAT), control);
    Member::new(id(number), vec![("missions".to_owned(), Kind::Core(core))])
}

pub(super) fn vehicle(may: Vec<aldis_envelope::Source>) -> Member {
    let config = KinematicConfig::of(BOAT, Duration::from_millis(500));
    let core = Core::GuardedKinematic(config, Control::of(id(400), "autopilot"));
    let services = vec![("boat".to_owned(), Kind::Core(core))];
    Member { resource: Some(("autopilot".to_owned(), may)), ..Member::new(id(400), services) }
}

pub(super) fn fleet(
    profile: Option<&Profile>,
    shores: Vec<Member>,
    may: Vec<aldis_envelope::Source>,
) -> Missions {
    let count = shores.len();
    let members = shores.into_iter().chain([vehicle(may)]).collect();
    let mut fleet = Missions::new(7, profile, count, members).unwrap();
    for member in 0..=count {
        let objects = boat().into_iter();
        fleet.play(member, objects.map(|object| Played { at: Duration::ZERO, object }).collect());
    }
    fleet.run_for(Duration::from_secs(20));
    fleet
}

pub(super) fn play(fleet: &mut Missions, member: usize, object: Box<dyn Object>) {
    fleet.play(member, vec![Played { at: Duration::ZERO, object }]);
}

pub(super) fn statuses(heard: &[Overheard]) -> Vec<String> {
    let decoded = heard.iter().filter_map(|one| decode(&one.content).ok());
    let of = decoded.filter_map(|object| object.get::<ServiceStatus>().cloned());
    let said = of.filter_map(|status| Some(status.info.first()?.get()?.value.to_string()));
    // On one bus the vehicle hears the mission of the test's player itself, which is in control of nothing.
    said.filter(|text| !text.contains("sid9000 is refused")).collect()
}

/// Latitude, speed and the number of the mission, state by state.
pub(super) fn states(heard: &[Overheard]) -> Vec<(f64, f32, i64)> {
    let decoded = heard.iter().filter_map(|one| decode(&one.content).ok());
    let of = decoded.filter_map(|object| object.get::<EntityState>().cloned());
    of.map(|state| (state.location.get().unwrap().latitude, state.groundspeed, state.current_command >> 16))
        .collect()
}

fn a_take_over(profile: Option<&Profile>) {
    let (one, two) = (shore(1), shore(2));
    let may = vec![one.source(0), two.source(0)];
    let mut fleet = fleet(profile, vec![one, two], may);
    fleet.heard(2);
    play(&mut fleet, 0, mission(1, [60.01, 60.02]));
    fleet.run_for(Duration::from_secs(40));
    let north = *states(&fleet.heard(2)).last().unwrap();
    assert!(north.0 > 60.0005 && north.1 > 4.0 && north.2 == 1, "{north:?}");
    assert_eq!(statuses(&fleet.heard(0)), Vec::<String>::new());
    play(&mut fleet, 1, mission(2, [59.99, 59.98]));
    fleet.run_for(Duration::from_secs(60));
    let heard = fleet.heard(2);
    let told = states(&heard);
    assert!(told.iter().any(|(_, speed, mission)| *speed == 0.0 && *mission == 1), "it stops");
    let south = *told.last().unwrap();
    assert!(south.0 < told[0].0 && south.1 > 4.0 && south.2 == 2, "{south:?}");
    let stopped = statuses(&heard);
    assert!(
        stopped.iter().any(|text| text.contains("vehicle 400: stops in mission 65537 of eid1sid100")),
        "{stopped:?}"
    );
    let lost = statuses(&fleet.heard(0));
    let why = "mission 1 of vehicle 400 ends: control is lost of `autopilot`";
    assert!(
        lost.iter()
            .any(|text| text.contains(why) && text.contains("eid2sid100, which goes before, took over")),
        "{lost:?}"
    );
    // Who goes before keeps control: the first is refused, and nothing of its new mission goes out.
    play(&mut fleet, 0, mission(3, [60.01, 60.02]));
    fleet.run_for(Duration::from_secs(40));
    let refused = statuses(&fleet.heard(0));
    assert!(
        refused.iter().any(|text| text.contains("mission 3") && text.contains("not given")),
        "{refused:?}"
    );
    assert!(states(&fleet.heard(2)).iter().all(|(_, _, mission)| *mission == 2));
}

#[test]
fn who_goes_before_takes_a_mission_over_on_one_bus() {
    a_take_over(None);
}

#[test]
fn who_goes_before_takes_a_mission_over_behind_a_link() {
    a_take_over(Some(&Profile::WIFI));
}

#[test]
fn at_its_end_a_mission_gives_control_back_and_another_shore_gets_it() {
    let (one, two) = (shore(1), shore(2));
    // The first goes before the second, which gets control only because it is given back.
    let may = vec![two.source(0), one.source(0)];
    let mut fleet = fleet(None, vec![one, two], may);
    play(&mut fleet, 0, mission(1, [60.0005, 60.001]));
    fleet.run_for(Duration::from_secs(60));
    fleet.heard(2);
    play(&mut fleet, 1, mission(2, [60.0, 59.999]));
    fleet.run_for(Duration::from_secs(20));
    assert_eq!(states(&fleet.heard(2)).last().unwrap().2, 2);
    assert_eq!(statuses(&fleet.heard(0)), Vec::<String>::new());
}

#[test]
fn a_boat_whose_control_is_taken_holds_its_place() {
    let (one, mut two) = (shore(1), Member::new(id(2), Vec::new()));
    let (at, resource) = (Duration::from_secs(50), "autopilot".to_owned());
    two.takes_over = vec![TakeOver { at, vehicle: id(400), resource }];
    let may = vec![one.source(0), two.operator()];
    let mut fleet = fleet(None, vec![one, two], may);
    play(&mut fleet, 0, mission(1, [60.01, 60.02]));
    fleet.run_for(Duration::from_secs(100));
    let told = states(&fleet.heard(2));
    let (last, before) = (told[told.len() - 1], told[told.len() - 60]);
    assert!(last.0 > 60.001 && last.1 == 0.0 && last.0 == before.0, "{last:?} {before:?}");
}
