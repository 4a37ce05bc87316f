//! PlanBuilder: from an assignment to missions, task by task.
//!
//! | state | what comes | what it does | next |
//! | --- | --- | --- | --- |
//! | idle | `UniqueAutomationRequest` | remembers it | idle |
//! | idle | `TaskAssignmentSummary` of it | asks the first task for its waypoints | busy |
//! | idle | one without a request, without tasks, or with a vehicle that has no state | an error with the cause | idle |
//! | busy | `TaskImplementationResponse` | the vehicle goes on from its end; asks the next task | busy |
//! | busy | the last one | `UniqueAutomationResponse` | idle |
//! | busy | one without waypoints | an error with the cause, an empty `UniqueAutomationResponse` | idle |
//! | any | an error that names the request | an empty `UniqueAutomationResponse` with the cause | idle |
//!
//! Waypoints of a vehicle have new numbers in each plan. Configuration: `assignment_start_point_lead_m` (50),
//! `add_loiter_to_end_of_mission` (false), `default_loiter_radius_m` (300), `turn_type` (none: as routes have it).

mod failing;

use super::aggregator::led;
use super::machine::{Heard, Machine, Post};
use super::task::stay;
use super::vehicle::Vehicle;
use super::world::World;
use aldis_envelope::lmcp::cmasi::{
    AutomationResponse, EntityConfiguration, EntityState, GimbalAngleAction, GimbalState, Location3D,
    LoiterAction, MissionCommand, RemoveEntities, ServiceStatus, ServiceStatusType, TurnType, Waypoint,
};
use aldis_envelope::lmcp::impact::{ImpactAutomationRequest, SpeedAltPair};
use aldis_envelope::lmcp::uxtask::{
    PlanningState, TaskAssignment, TaskAssignmentSummary, TaskImplementationRequest,
    TaskImplementationResponse, UniqueAutomationRequest, UniqueAutomationResponse,
};
use aldis_envelope::lmcp::{Ref, Struct, TypeInfo};
use std::collections::{BTreeMap, VecDeque};

/// How many requests may be under way; the oldest is dropped for a newer one.
const REQUESTS_MAX: usize = 64;

/// Where gimbals point at the start of a mission, in degrees.
const GIMBAL_ELEVATION_DEG: f32 = -60.0;

/// How it is configured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BuilderConfig {
    /// How far ahead of where a vehicle is its plan begins, in metres.
    pub assignment_start_point_lead_m: f64,
    /// Whether vehicles stay at the end of their missions.
    pub add_loiter_to_end_of_mission: bool,
    /// By which radius they do, in metres; aircraft alone.
    pub default_loiter_radius_m: f32,
    /// How all waypoints are turned at.
    pub turn_type: Option<TurnType>,
    /// Whether it measures as the reference does.
    pub compat_cost: bool,
}

impl Default for BuilderConfig {
    fn default() -> Self {
        Self {
            assignment_start_point_lead_m: 50.0,
            add_loiter_to_end_of_mission: false,
            default_loiter_radius_m: 300.0,
            turn_type: None,
            compat_cost: false,
        }
    }
}

/// Where a vehicle will be.
#[derive(Debug, Clone)]
struct Projected {
    at: Location3D,
    heading: f32,
    time_ms: i64,
}

/// A plan that is being built.
struct Building {
    region: i64,
    /// When the plan begins, by each vehicle's clock.
    begin_ms: BTreeMap<i64, i64>,
    left: VecDeque<TaskAssignment>,
    /// The number of the request for waypoints that is open.
    open: i64,
    projected: BTreeMap<i64, Projected>,
    missions: BTreeMap<i64, MissionCommand>,
}

/// The machine.
pub struct Builder {
    config: BuilderConfig,
    world: World,
    requests: BTreeMap<i64, UniqueAutomationRequest>,
    speeds: BTreeMap<i64, Vec<SpeedAltPair>>,
    building: BTreeMap<i64, Building>,
    last_request: i64,
    last_command: i64,
    /// The last number of a waypoint of each vehicle.
    last_waypoint: BTreeMap<i64, i64>,
}

impl Builder {
    /// A builder that builds nothing.
    pub fn new(config: BuilderConfig) -> Self {
        Self {
            config,
            world: World::default(),
            requests: BTreeMap::new(),
            speeds: BTreeMap::new(),
            building: BTreeMap::new(),
            last_request: 0,
            last_command: 0,
            last_waypoint: BTreeMap::new(),
        }
    }

    fn summary(&mut self, summary: &TaskAssignmentSummary, post: &mut Post<'_>) {
        let number = summary.corresponding_automation_request_id;
        if self.building.contains_key(&number) {
            return;
        }
        let Some(request) = self.requests.remove(&number) else {
            let why = format!(
                "ERROR::processTaskAssignmentSummary: Corresponding Unique Automation Request ID [{number}] not found!"
            );
            return self.fail(number, &why, post);
        };
        let mut left: Vec<_> = summary.task_list.iter().filter_map(|one| one.get().cloned()).collect();
        if left.is_empty() {
            return self.fail(number, &format!("No assignments found for request {number}"), post);
        }
        // A stable sort: tasks that take no time stay in their vehicle's order.
        left.sort_by_key(|one| (one.time_task_completed, one.assigned_vehicle));
        let asked = request.original_request.get().map_or(&[][..], |asked| &asked.entity_list);
        let mut projected = BTreeMap::new();
        for vehicle in asked.iter().copied().chain(left.iter().map(|one| one.assigned_vehicle)) {
            match self.project(vehicle, &request, post) {
                Some(state) => drop(projected.insert(vehicle, state)),
                None => {
                    let why = format!(
                        "ERROR::processTaskAssignmentSummary: Corresponding Unique Automation Request included \
                         vehicle ID [{vehicle}] which does not have a corresponding current state!"
                    );
                    return self.fail(number, &why, post);
                }
            }
        }
        while self.building.len() >= REQUESTS_MAX {
            self.building.pop_first();
        }
        let begin_ms = projected.iter().map(|(&vehicle, state)| (vehicle, state.time_ms)).collect();
        let region = summary.operating_region;
        let building =
            Building { region, begin_ms, left: left.into(), open: 0, projected, missions: BTreeMap::new() };
        self.building.insert(number, building);
        self.ask(number, post);
    }

    /// Where a vehicle's plan begins.
    fn project(&self, vehicle: i64, request: &UniqueAutomationRequest, post: &Post<'_>) -> Option<Projected> {
        let state = self.world.state(vehicle);
        let time_ms =
            state.map(|state| state.time).filter(|&time| time > 0).unwrap_or_else(|| post.wall_ms());
        let planned = request.planning_states.iter().filter_map(|state| state.get());
        if let Some(planned) = planned.into_iter().find(|state| state.entity_id == vehicle) {
            let at = planned.planning_position.get()?.clone();
            return Some(Projected { at, heading: planned.planning_heading, time_ms });
        }
        let state = state?;
        let lead = self.config.assignment_start_point_lead_m;
        let at = led(state.location.get()?, state.heading, lead, self.config.compat_cost);
        Some(Projected { at, heading: state.heading, time_ms })
    }

    /// Asks the next task for its waypoints, or is done.
    fn ask(&mut self, number: i64, post: &mut Post<'_>) {
        let Some(building) = self.building.get_mut(&number) else { return };
        let Some(next) = building.left.front() else { return self.finish(number, post) };
        let vehicle = next.assigned_vehicle;
        let Some(state) = building.projected.get(&vehicle) else { return };
        self.last_request += 1;
        building.open = self.last_request;
        let neighbours = building.projected.iter().filter(|(id, _)| **id != vehicle);
        let begin = building.begin_ms.get(&vehicle).copied().unwrap_or(0);
        let asked = TaskImplementationRequest {
            request_id: self.last_request,
            corresponding_automation_request_id: number,
            starting_waypoint_id: self.last_waypoint.get(&vehicle).copied().unwrap_or(0) + 1,
            vehicle_id: vehicle,
            start_position: Ref::new(state.at.clone()),
            start_heading: state.heading,
            start_time: state.time_ms,
            region_id: building.region,
            task_id: next.task_id,
            option_id: next.option_id,
            time_threshold: if next.time_threshold > 0 { begin + next.time_threshold } else { 0 },
            neighbor_locations: neighbours.map(|(&id, state)| Ref::new(state.planning(id))).collect(),
        };
        post.broadcast(&asked);
    }

    fn implemented(&mut self, response: &TaskImplementationResponse, post: &mut Post<'_>) {
        let number = response.corresponding_automation_request_id;
        let Some(building) = self.building.get_mut(&number) else { return };
        if building.open != response.response_id {
            return;
        }
        let (task, option, vehicle) = (response.task_id, response.option_id, response.vehicle_id);
        building.left.pop_front();
        if response.task_waypoints.is_empty() {
            self.building.remove(&number);
            let why = format!(
                "Task [{task}] option [{option}] assigned to vehicle [{vehicle}] reported an empty waypoint list for implementation!"
            );
            return self.fail(number, &why, post);
        }
        let mut waypoints: Vec<Waypoint> =
            response.task_waypoints.iter().filter_map(|at| at.get().cloned()).collect();
        self.override_speed(number, vehicle, task, &mut waypoints);
        if let Some(turn_type) = self.config.turn_type {
            waypoints.iter_mut().for_each(|waypoint| waypoint.turn_type = turn_type);
        }
        let Some(building) = self.building.get_mut(&number) else { return };
        let last = waypoints.iter().map(|waypoint| waypoint.number).max().unwrap_or(0);
        self.last_waypoint.insert(vehicle, last);
        let first = waypoints.first().map_or(0, |waypoint| waypoint.number);
        match building.missions.get_mut(&vehicle) {
            Some(mission) => {
                if let Some(before) = mission.waypoint_list.last_mut().and_then(Ref::get_mut) {
                    before.next_waypoint = first;
                }
                mission.waypoint_list.extend(waypoints.into_iter().map(Ref::new));
            }
            None => {
                self.last_command += 1;
                let mut mission = MissionCommand { first_waypoint: first, ..MissionCommand::default() };
                (mission.command_id, mission.vehicle_id) = (self.last_command, vehicle);
                mission.vehicle_action_list = gimbals(&self.world, vehicle);
                mission.waypoint_list = waypoints.into_iter().map(Ref::new).collect();
                building.missions.insert(vehicle, mission);
            }
        }
        if let (Some(state), Some(at)) = (building.projected.get_mut(&vehicle), response.final_location.get())
        {
            *state =
                Projected { at: at.clone(), heading: response.final_heading, time_ms: response.final_time };
        }
        self.ask(number, post);
    }

    /// Speeds and altitudes that an operator wants for a vehicle at a task.
    fn override_speed(&self, number: i64, vehicle: i64, task: i64, waypoints: &mut [Waypoint]) {
        let pairs = self.speeds.get(&number).into_iter().flatten();
        let fits =
            |pair: &&SpeedAltPair| pair.vehicle_id == vehicle && (pair.task_id == 0 || pair.task_id == task);
        let Some(pair) = pairs.into_iter().find(fits) else { return };
        for waypoint in waypoints {
            if pair.speed > 0.0 {
                waypoint.speed = pair.speed;
            }
            (waypoint.altitude, waypoint.altitude_type) = (pair.altitude, pair.altitude_type);
        }
    }

    fn finish(&mut self, number: i64, post: &mut Post<'_>) {
        let Some(mut building) = self.building.remove(&number) else { return };
        self.speeds.remove(&number);
        if self.config.add_loiter_to_end_of_mission {
            for (&vehicle, mission) in &mut building.missions {
                self.add_loiter(vehicle, mission);
            }
        }
        let original = AutomationResponse {
            mission_command_list: building.missions.into_values().map(Ref::new).collect(),
            ..AutomationResponse::default()
        };
        let states = building.projected.iter().map(|(&id, state)| Ref::new(state.planning(id)));
        post.broadcast(&UniqueAutomationResponse {
            response_id: number,
            original_response: Ref::new(original),
            final_states: states.collect(),
        });
        let times: Vec<_> = building
            .projected
            .iter()
            .map(|(id, state)| {
                let begin = building.begin_ms.get(id).copied().unwrap_or(state.time_ms);
                (format!("FinalTime[{id}]"), (state.time_ms - begin).to_string())
            })
            .collect();
        let key = format!("UniqueAutomationResponse[{number}] - sent");
        let mut pairs = vec![(key.as_str(), "")];
        pairs.extend(times.iter().map(|(key, value)| (key.as_str(), value.as_str())));
        post.status(ServiceStatusType::Information, &pairs);
    }

    /// Has a vehicle stay at the end of its mission, unless something in it stays already.
    fn add_loiter(&self, vehicle: i64, mission: &mut MissionCommand) {
        let Some(vehicle) =
            self.world.configurations.get(&vehicle).and_then(|found| Vehicle::of(found.as_ref()))
        else {
            return;
        };
        let stays = |at: &Ref<Waypoint>| {
            let actions = at.get().map(|at| at.vehicle_action_list.as_slice()).unwrap_or_default();
            actions
                .iter()
                .any(|action| action.object().is_some_and(|action| action.get::<LoiterAction>().is_some()))
        };
        if mission.waypoint_list.iter().any(stays) {
            return;
        }
        if let Some(last) = mission.waypoint_list.last_mut().and_then(Ref::get_mut) {
            let mut action = stay(&vehicle, &last.base.clone(), -1);
            if action.radius > 0.0 {
                action.radius = self.config.default_loiter_radius_m;
            }
            last.vehicle_action_list.push(Ref::new(action));
        }
    }
}

impl Projected {
    fn planning(&self, entity_id: i64) -> PlanningState {
        PlanningState {
            entity_id,
            planning_position: Ref::new(self.at.clone()),
            planning_heading: self.heading,
        }
    }
}

/// Points all gimbals of a vehicle down.
fn gimbals(world: &World, vehicle: i64) -> Vec<Ref<aldis_envelope::lmcp::cmasi::VehicleAction>> {
    let payloads = world.state(vehicle).map(|state| state.payload_state_list.as_slice()).unwrap_or_default();
    let gimbals = payloads.iter().filter_map(|payload| payload.object()?.get::<GimbalState>());
    let point = |gimbal: &GimbalState| {
        let mut action =
            GimbalAngleAction { elevation: GIMBAL_ELEVATION_DEG, ..GimbalAngleAction::default() };
        action.payload_id = gimbal.payload_id;
        Ref::new(action)
    };
    gimbals.map(point).collect()
}

impl Machine for Builder {
    fn hears(&self) -> Vec<&'static TypeInfo> {
        vec![
            EntityConfiguration::TYPE,
            EntityState::TYPE,
            RemoveEntities::TYPE,
            UniqueAutomationRequest::TYPE,
            TaskAssignmentSummary::TYPE,
            TaskImplementationResponse::TYPE,
            ImpactAutomationRequest::TYPE,
            ServiceStatus::TYPE,
        ]
    }

    fn take(&mut self, heard: &Heard<'_>, post: &mut Post<'_>) {
        let object = heard.object;
        if self.world.take(object) {
            return;
        }
        if let Some(request) = object.get::<UniqueAutomationRequest>() {
            self.requests.insert(request.request_id, request.clone());
            while self.requests.len() > REQUESTS_MAX {
                self.requests.pop_first();
            }
        } else if let Some(summary) = object.get::<TaskAssignmentSummary>() {
            self.summary(summary, post);
        } else if let Some(response) = object.get::<TaskImplementationResponse>() {
            self.implemented(response, post);
        } else if let Some(request) = object.get::<ImpactAutomationRequest>() {
            let pairs = request.override_planning_conditions.iter().filter_map(|pair| pair.get().cloned());
            self.speeds.insert(request.request_id, pairs.collect());
            while self.speeds.len() > REQUESTS_MAX {
                self.speeds.pop_first();
            }
        } else if let Some(status) = object.get::<ServiceStatus>() {
            self.status(status, post);
        }
    }
}
