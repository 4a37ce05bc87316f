//! Whole plans by the core services on a node alone, and what happens where there is none.

use super::{Offline, Played};
use crate::plan::roads::OneWay;
use crate::registry::Kind;
use crate::uxas::Core;
use crate::uxas::osm::OsmConfig;
use crate::uxas::validator::failure;
use aldis_envelope::lmcp::cmasi::{
    AutomationRequest, AutomationResponse, Circle, KeepOutZone, Location3D, MissionCommand, OperatingRegion,
    PointSearchTask,
};
use aldis_envelope::lmcp::impact::CordonTask;
use aldis_envelope::lmcp::uxtask::{TaskAssignmentSummary, TaskPlanOptions};
use aldis_envelope::lmcp::vehicles::{
    GroundVehicleConfiguration, GroundVehicleState, SurfaceVehicleConfiguration, SurfaceVehicleState,
};
use aldis_envelope::lmcp::{Object, Ref, Text, decode, read_xml};
use aldis_envelope::{EntityId, Monotonic};
use bytes::Bytes;
use std::path::Path;
use std::time::Duration;

pub(super) fn at(latitude: f64, longitude: f64) -> Ref<Location3D> {
    Ref::new(Location3D { latitude, longitude, ..Location3D::default() })
}

pub(super) fn boat(id: i64, latitude: f64) -> Vec<Box<dyn Object>> {
    let mut boat = SurfaceVehicleConfiguration::default();
    (boat.id, boat.nominal_speed) = (id, 5.0);
    let mut state = SurfaceVehicleState::default();
    (state.id, state.location) = (id, at(latitude, 20.0));
    vec![Box::new(boat), Box::new(state)]
}

pub(super) fn point(id: i64, latitude: f64, longitude: f64) -> Box<dyn Object> {
    let mut task = PointSearchTask { search_location: at(latitude, longitude), ..PointSearchTask::default() };
    task.task_id = id;
    Box::new(task)
}

pub(super) fn request(entities: &[i64], tasks: &[i64], relationships: &str, region: i64) -> Box<dyn Object> {
    Box::new(AutomationRequest {
        entity_list: entities.to_vec(),
        task_list: tasks.to_vec(),
        task_relationships: Text::new(relationships),
        operating_region: region,
        ..AutomationRequest::default()
    })
}

/// Two boats, an island that is kept out of, and two points.
pub(super) fn sea() -> Vec<Box<dyn Object>> {
    let mut island = KeepOutZone::default();
    (island.zone_id, island.padding) = (5, 20.0);
    island.boundary = Ref::new(Circle { center_point: at(60.02, 20.0), radius: 500.0, ..Circle::default() });
    let region = OperatingRegion { id: 9, keep_out_areas: vec![5], ..OperatingRegion::default() };
    let hole = OperatingRegion { id: 8, keep_out_areas: vec![55], ..OperatingRegion::default() };
    let mut sea = boat(1, 60.0);
    sea.extend(boat(2, 60.001));
    sea.extend([Box::new(island) as Box<dyn Object>, Box::new(region), Box::new(hole)]);
    sea.extend([point(100, 60.04, 20.0), point(101, 60.03, 20.02), point(102, 60.02, 20.001)]);
    sea
}

pub(super) fn node(without: Option<&str>, compat: bool) -> Offline {
    let cores = Core::pipeline(compat, 0.0).into_iter().filter(|core| Some(core.name()) != without);
    let services = cores.map(|core| (core.name().to_owned(), Kind::Core(core))).collect();
    Offline::new(EntityId::new(100).unwrap(), services).unwrap()
}

/// What a node heard of one type.
pub(super) fn all<T: aldis_envelope::lmcp::Struct>(heard: &[super::Overheard]) -> Vec<(T, Monotonic)> {
    let of_type = heard.iter().filter(|one| one.descriptor == T::TYPE.full_name);
    of_type.map(|one| (decode(&one.content).unwrap().get::<T>().unwrap().clone(), one.at)).collect()
}

/// Plays messages and then a request; the answer, how long it took, and all that was heard.
fn ask(
    node: &mut Offline,
    told: Vec<Box<dyn Object>>,
    request: Box<dyn Object>,
) -> (AutomationResponse, Duration, Vec<super::Overheard>) {
    node.play(told.into_iter().map(|object| Played { at: Duration::ZERO, object }).collect());
    let begin = node.now();
    node.play(vec![Played { at: begin.elapsed(), object: request }]);
    let mut heard = Vec::new();
    loop {
        heard.extend(node.heard());
        if let Some((answer, at)) = all::<AutomationResponse>(&heard).pop() {
            return (answer, at - begin, heard);
        }
        assert!(node.step(Monotonic::since_start(Duration::from_secs(60))), "no answer: {:?}", node.notes);
    }
}

#[test]
fn boats_go_around_an_island_to_both_points() {
    let (answer, took, heard) = ask(&mut node(None, false), sea(), request(&[1, 2], &[100, 101], "", 9));
    assert_eq!(took, Duration::ZERO);
    assert_eq!(failure(&answer), None);
    let missions: Vec<&MissionCommand> =
        answer.mission_command_list.iter().filter_map(|one| one.get()).collect();
    assert!(!missions.is_empty());
    let summary = &all::<TaskAssignmentSummary>(&heard)[0].0;
    let mut tasks: Vec<_> = summary.task_list.iter().map(|one| one.get().unwrap().task_id).collect();
    tasks.sort_unstable();
    assert_eq!(tasks, [100, 101]);
    for mission in missions {
        let list: Vec<_> = mission.waypoint_list.iter().map(|at| at.get().unwrap()).collect();
        for pair in list.windows(2) {
            assert_eq!(pair[0].next_waypoint, pair[1].number);
        }
        let last = list.last().unwrap();
        assert_eq!((last.next_waypoint, last.associated_tasks.as_slice()), (last.number, &[][..]));
    }
    // Straight north leads through the island: the boat that goes to 100 must turn somewhere.
    let options = all::<TaskPlanOptions>(&heard);
    assert_eq!(options.len(), 2);
    assert!(
        options
            .iter()
            .all(|(told, _)| told.options.len() == 16 && told.composition.starts_with("+(p10 p11 "))
    );
}

#[test]
fn the_same_messages_make_the_same_plan_to_the_byte() {
    let plan = || {
        let (_, _, heard) = ask(&mut node(None, false), sea(), request(&[1, 2], &[100, 101], "", 9));
        heard.into_iter().map(|one| (one.descriptor, one.content)).collect::<Vec<_>>()
    };
    assert!(plan() == plan());
}

#[test]
fn a_cordon_closes_the_roads_that_lead_out_of_a_town() {
    let town = Bytes::from_static(include_bytes!("../../uxas/osm/town.osm"));
    let mut cores = Core::pipeline(false, 0.0);
    cores.push(Core::Roads(OsmConfig::new(town, OneWay::Respect).unwrap()));
    let services = cores.into_iter().map(|core| (core.name().to_owned(), Kind::Core(core))).collect();
    let mut node = Offline::new(EntityId::new(100).unwrap(), services).unwrap();
    let mut told = Vec::new();
    for (id, longitude) in (1..=4).zip([19.99, 19.995, 20.005, 20.01]) {
        let mut car = GroundVehicleConfiguration::default();
        (car.id, car.nominal_speed) = (id, 10.0);
        let mut state = GroundVehicleState::default();
        (state.id, state.location) = (id, at(60.0, longitude));
        told.extend([Box::new(car) as Box<dyn Object>, Box::new(state)]);
    }
    let mut cordon = CordonTask { cordon_location: at(60.0, 20.0), ..CordonTask::default() };
    (cordon.task_id, cordon.standoff_distance) = (300, 300.0);
    told.push(Box::new(cordon));
    let (answer, _, _) = ask(&mut node, told, request(&[1, 2, 3, 4], &[300], "", 0));
    assert_eq!(failure(&answer), None);
    let ends = answer.mission_command_list.iter().map(|mission| {
        let last = mission.get().unwrap().waypoint_list.last().unwrap().get().unwrap().clone();
        (((last.latitude - 60.0) * 1e4).round() as i64, ((last.longitude - 20.0) * 1e4).round() as i64)
    });
    let ends: std::collections::BTreeSet<_> = ends.collect();
    // 300 m are 0.0027 degrees to the north, and twice as many to the east.
    assert_eq!(ends, [(-27, 0), (0, -54), (0, 54), (27, 0)].into_iter().collect());
}

/// The messages of a folder beside the project, requests last; none where it is not there.
fn shared(folder: &str) -> Option<Vec<Box<dyn Object>>> {
    use std::io::Write;
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../shared/uxas/scenarios")
        .join(folder)
        .join("MessagesToSend");
    if !root.exists() {
        let _ = writeln!(std::io::stderr(), "SKIPPED: {} is not there", root.display());
        return None;
    }
    let mut files: Vec<_> = std::fs::read_dir(&root).unwrap().map(|entry| entry.unwrap().path()).collect();
    let tasks = root.join("tasks");
    if tasks.exists() {
        files.extend(std::fs::read_dir(tasks).unwrap().map(|entry| entry.unwrap().path()));
    }
    files.retain(|path| path.extension().is_some_and(|end| end == "xml"));
    files.sort();
    let mut objects: Vec<Box<dyn Object>> = Vec::new();
    for file in files {
        let document = read_xml(std::fs::read_to_string(file).unwrap().as_bytes()).unwrap();
        objects.extend(document.objects.into_iter().map(|placed| placed.object));
    }
    // Zones before their region, tasks before the request.
    let rank = |object: &dyn Object| {
        let name = object.type_info().name;
        ["Configuration", "State", "Zone", "Region", "Task", "Request"]
            .iter()
            .position(|end| name.ends_with(end))
    };
    objects.sort_by_key(|object| rank(object.as_ref()));
    Some(objects)
}

#[test]
fn the_waterway_is_the_reference_s_to_the_millisecond() {
    let Some(mut told) = shared("02_Example_WaterwaySearch") else { return };
    let request = told.pop().unwrap();
    let (answer, _, heard) = ask(&mut node(None, true), told, request);
    assert_eq!(failure(&answer), None);
    let options = &all::<TaskPlanOptions>(&heard)[0].0;
    let costs: Vec<_> = options.options.iter().map(|one| one.get().unwrap().cost).collect();
    assert_eq!(costs, [644_411, 598_921, 664_054, 598_804]);
    let summary = &all::<TaskAssignmentSummary>(&heard)[0].0;
    let only = summary.task_list[0].get().unwrap();
    assert_eq!((only.assigned_vehicle, only.time_task_completed), (400, 729_820));
    let mission = answer.mission_command_list[0].get().unwrap();
    let on_task = mission.waypoint_list.iter().filter(|at| at.get().unwrap().associated_tasks == [1000]);
    assert_eq!(on_task.count(), 60);
}

#[test]
fn assign_tasks_is_no_worse_than_the_reference() {
    let Some(mut told) = shared("05_AssignTasks") else { return };
    let request = told.pop().unwrap();
    let (answer, _, heard) = ask(&mut node(None, true), told, request);
    assert_eq!(failure(&answer), None);
    let summary = &all::<TaskAssignmentSummary>(&heard)[0].0;
    let last = summary.task_list.iter().map(|one| one.get().unwrap().time_task_completed).max().unwrap();
    assert!(last <= 8_423_203, "{last}");
}
