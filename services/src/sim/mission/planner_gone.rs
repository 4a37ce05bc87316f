//! A route planner on a node of its own that ends while it is waited for, or before it is asked.

use super::tests::{at, boat, id};
use super::{Member, Missions};
use crate::registry::Kind;
use crate::sim::offline::{Overheard, Played};
use crate::uxas::Core;
use crate::uxas::validator::failure;
use aldis_envelope::Monotonic;
use aldis_envelope::lmcp::cmasi::{
    AreaSearchTask, AutomationRequest, AutomationResponse, Circle, PointSearchTask,
};
use aldis_envelope::lmcp::cmasi::{KeyValuePair, PayloadConfiguration};
use aldis_envelope::lmcp::vehicles::SurfaceVehicleConfiguration;
use aldis_envelope::lmcp::{Object, Ref, Text, decode};
use std::time::Duration;

const PLANNER: &str = "RoutePlannerVisibility";

/// How long the end of a node stays unnoticed.
const NOTICE: Duration = Duration::from_millis(10);

const POINT: i64 = 10;
const AREA: i64 = 11;

fn named(of: impl Fn(&Core) -> bool) -> Vec<(String, Kind)> {
    let cores = Core::pipeline(false, 0.0).into_iter().filter(|core| of(core));
    cores.map(|core| (core.name().to_owned(), Kind::Core(core))).collect()
}

fn play(fleet: &mut Missions, member: usize, object: Box<dyn Object>) {
    fleet.play(member, vec![Played { at: Duration::ZERO, object }]);
}

/// A shore that plans with the planner of another node; both know a boat and two tasks.
fn fleet() -> Missions {
    let shore = Member::new(id(1), named(|core| core.name() != PLANNER));
    let planner = Member::new(id(2), named(|core| core.name() == PLANNER));
    let mut fleet = Missions::new(3, None, 2, vec![shore, planner]).unwrap();
    let mut told = boat();
    let mut seeing = told[0].get::<SurfaceVehicleConfiguration>().unwrap().clone();
    let width = KeyValuePair { key: Text::new("SwathWidth_m"), value: Text::new("200") };
    let mut sonar = PayloadConfiguration { payload_id: 1, ..PayloadConfiguration::default() };
    sonar.parameters.push(Ref::new(width));
    seeing.payload_configuration_list.push(Ref::new(sonar));
    told[0] = Box::new(seeing);
    let mut point = PointSearchTask { search_location: Ref::new(at(60.01)), ..PointSearchTask::default() };
    point.task_id = POINT;
    let middle = Circle { center_point: Ref::new(at(60.02)), radius: 400.0, ..Circle::default() };
    let mut area = AreaSearchTask { search_area: Ref::new(middle), ..AreaSearchTask::default() };
    area.task_id = AREA;
    told.extend([Box::new(point) as Box<dyn Object>, Box::new(area)]);
    // On one bus the other node hears it too.
    told.into_iter().for_each(|object| play(&mut fleet, 0, object));
    fleet.run_for(Duration::from_secs(2));
    fleet.heard(0);
    fleet
}

fn ask(fleet: &mut Missions, task: i64) {
    let request = AutomationRequest { task_list: vec![task], ..AutomationRequest::default() };
    play(fleet, 0, Box::new(request));
}

/// The first answer within a time: why it has no plan, and when it came.
fn answered(fleet: &mut Missions, within: Duration) -> Option<(Option<String>, Monotonic)> {
    let until = fleet.now() + within;
    while fleet.now() < until {
        fleet.run_for(Duration::from_millis(1));
        let is_answer = |one: &Overheard| one.descriptor == "afrl.cmasi.AutomationResponse";
        if let Some(answer) = fleet.heard(0).into_iter().find(is_answer) {
            let object = decode(&answer.content).unwrap();
            return Some((failure(object.get::<AutomationResponse>().unwrap()), answer.at));
        }
    }
    None
}

/// Lets the planner, which has answered once, end while it is asked for something.
fn ends_while(task: i64, heard_first: &str) {
    let mut fleet = fleet();
    ask(&mut fleet, task);
    assert_eq!(answered(&mut fleet, Duration::from_secs(1)).expect("a plan").0, None);
    let planner = fleet.running[1].node;
    ask(&mut fleet, task);
    // The planner stands still from the moment at which shore has said this.
    for _ in 0..2000 {
        fleet.run_for(Duration::from_micros(50));
        if fleet.heard(0).iter().any(|one| one.descriptor.ends_with(heard_first)) {
            break;
        }
    }
    fleet.world.stall(planner);
    assert!(answered(&mut fleet, Duration::from_millis(300)).is_none(), "it waits");
    let ended = fleet.now();
    fleet.world.crash(planner, false, NOTICE);
    let (why, at) = answered(&mut fleet, Duration::from_secs(1)).expect("an answer");
    let why = why.expect("no plan");
    assert!(why.contains("the route planner eid2sid100 of SurfacePathPlanner is gone"), "{why}");
    assert!(at - ended <= NOTICE + Duration::from_millis(100), "{:?}", at - ended);
}

#[test]
fn it_ends_while_the_ways_within_a_task_are_awaited() {
    ends_while(AREA, "UniqueAutomationRequest");
}

#[test]
fn it_ends_while_the_ways_between_tasks_are_awaited() {
    ends_while(POINT, "UniqueAutomationRequest");
}

#[test]
fn it_ends_while_the_ways_to_be_flown_are_awaited() {
    ends_while(POINT, "AssignmentCostMatrix");
}

#[test]
fn it_has_ended_before_it_is_asked_and_comes_back() {
    let mut fleet = fleet();
    ask(&mut fleet, POINT);
    assert_eq!(answered(&mut fleet, Duration::from_secs(1)).expect("a plan").0, None);
    let planner = fleet.running[1].node;
    fleet.world.crash(planner, false, NOTICE);
    fleet.run_for(Duration::from_secs(1));
    for task in [POINT, AREA] {
        let begin = fleet.now();
        ask(&mut fleet, task);
        let (why, at) = answered(&mut fleet, Duration::from_secs(1)).expect("an answer");
        assert!(why.expect("no plan").contains("is gone"));
        assert!(at - begin <= Duration::from_millis(100), "{:?}", at - begin);
    }
    fleet.world.restart(planner);
    fleet.run_for(Duration::from_secs(2));
    for object in boat() {
        play(&mut fleet, 0, object);
    }
    fleet.run_for(Duration::from_secs(1));
    ask(&mut fleet, POINT);
    assert_eq!(answered(&mut fleet, Duration::from_secs(1)).expect("a plan").0, None);
}
