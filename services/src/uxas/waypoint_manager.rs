//! WaypointPlanManager: serves a vehicle its mission in segments that overlap.
//!
//! | state | what comes | what it does | next |
//! | --- | --- | --- | --- |
//! | any | a mission of the vehicle, in an `AutomationResponse` or by itself | serves the first segment | serving |
//! | serving | a state of the vehicle whose `CurrentWaypoint` lies in a later segment | serves that one | serving |
//! | serving | a mission whose waypoints are not linked | an error with the cause | the same |
//!
//! Two segments are a second apart at least; of several that are due the newest goes out. What it serves never comes back to
//! it. Configuration: `vehicle` (the entity), `number_waypoints_to_serve` (100000), `number_waypoints_overlap` (3; at least
//! 2), `default_loiter_radius_m` (200), `add_loiter_to_end_of_segments`, `add_loiter_to_end_of_mission`,
//! `loop_back_to_first_task`, `set_last_waypoint_speed_to_0` (all false), `turn_type` (TurnShort), `gimbal_payload` (none).

mod segments;
#[cfg(test)]
mod tests;

use super::machine::{Heard, Machine, Post};
use super::task::stay;
use super::vehicle::Vehicle;
use aldis_envelope::Monotonic;
use aldis_envelope::lmcp::cmasi::{
    AutomationResponse, CommandStatusType, EntityConfiguration, EntityState, GimbalAngleAction,
    MissionCommand, NavigationMode, ServiceStatusType, TurnType, Waypoint,
};
use aldis_envelope::lmcp::{Object, Ref, Struct, TypeInfo};
pub use segments::{order, segments};
use std::time::Duration;

/// How far apart two commands are at least.
const COMMANDS_APART: Duration = Duration::from_secs(1);

/// Where the gimbal points at the end, in degrees.
const GIMBAL_ELEVATION_DEG: f32 = -60.0;

/// How it is configured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaypointConfig {
    /// The vehicle.
    pub vehicle: i64,
    /// The most waypoints of a segment.
    pub number_waypoints_to_serve: usize,
    /// How many of them the next segment begins with.
    pub number_waypoints_overlap: usize,
    /// By which radius aircraft stay at the end, in metres.
    pub default_loiter_radius_m: f32,
    /// Whether the vehicle stays at the end of each segment.
    pub add_loiter_to_end_of_segments: bool,
    /// Whether it stays at the end of the mission.
    pub add_loiter_to_end_of_mission: bool,
    /// Whether it begins again at the first task.
    pub loop_back_to_first_task: bool,
    /// Whether it stops at the end.
    pub set_last_waypoint_speed_to_0: bool,
    /// How all waypoints are turned at.
    pub turn_type: TurnType,
    /// The gimbal that is pointed down at the end of a segment.
    pub gimbal_payload: Option<i64>,
}

impl WaypointConfig {
    /// How a vehicle is served where nothing else is said.
    pub fn of(vehicle: i64) -> Self {
        Self {
            vehicle,
            number_waypoints_to_serve: 100_000,
            number_waypoints_overlap: 3,
            default_loiter_radius_m: 200.0,
            add_loiter_to_end_of_segments: false,
            add_loiter_to_end_of_mission: false,
            loop_back_to_first_task: false,
            set_last_waypoint_speed_to_0: false,
            turn_type: TurnType::TurnShort,
            gimbal_payload: None,
        }
    }
}

/// The machine.
pub struct WaypointManager {
    config: WaypointConfig,
    vehicle: Option<Vehicle>,
    segments: Vec<Vec<Waypoint>>,
    mission: MissionCommand,
    served: Option<usize>,
    /// The segment that is due, and from which of its waypoints on.
    due: Option<(usize, i64)>,
    last_command: i64,
    sent_at: Option<Monotonic>,
}

impl WaypointManager {
    /// A manager without a mission.
    pub fn new(config: WaypointConfig) -> Self {
        Self {
            config,
            vehicle: None,
            segments: Vec::new(),
            mission: MissionCommand::default(),
            served: None,
            due: None,
            last_command: 0,
            sent_at: None,
        }
    }

    fn mission(&mut self, mission: &MissionCommand, post: &mut Post<'_>) {
        let list: Vec<Waypoint> = mission.waypoint_list.iter().filter_map(|at| at.get().cloned()).collect();
        let mut plan = match order(&list, mission.first_waypoint) {
            Ok(plan) => plan,
            Err(why) => {
                let text =
                    format!("mission {} of vehicle {}: {why}", mission.command_id, self.config.vehicle);
                return post.status(ServiceStatusType::Error, &[("WaypointPlanManager", text.as_str())]);
            }
        };
        plan.iter_mut().for_each(|waypoint| waypoint.turn_type = self.config.turn_type);
        self.finish(&mut plan);
        let (serve, overlap) = (self.config.number_waypoints_to_serve, self.config.number_waypoints_overlap);
        self.segments = segments(&plan, serve, overlap);
        self.mission = mission.clone();
        self.served = None;
        // The reference begins with the second waypoint, and so may miss a task or a turn.
        self.due = Some((0, mission.first_waypoint));
        self.serve(post);
    }

    /// Serves nothing more of the mission; its number, where there was one.
    pub(super) fn drop_mission(&mut self) -> Option<i64> {
        let had = !self.segments.is_empty();
        (self.segments, self.served, self.due) = (Vec::new(), None, None);
        had.then_some(self.mission.command_id)
    }

    /// Whether a state says that the vehicle stays at the end of the mission.
    pub(super) fn is_done(&self, state: &EntityState) -> bool {
        let last = self.segments.last().and_then(|segment| segment.last());
        state.id == self.config.vehicle
            && state.mode == NavigationMode::Loiter
            && state.current_command == self.command_id(self.last_command)
            && last.is_some_and(|last| {
                state.current_waypoint == last.number && last.next_waypoint == last.number
            })
    }

    /// The number of a command that serves the mission.
    fn command_id(&self, number: i64) -> i64 {
        (self.mission.command_id << 16) | number
    }

    /// What happens at the end of the mission.
    fn finish(&self, plan: &mut [Waypoint]) {
        let first_task = plan.iter().find(|at| !at.associated_tasks.is_empty()).map(|at| at.number);
        let Some(last) = plan.last_mut() else { return };
        if self.config.loop_back_to_first_task {
            last.next_waypoint = first_task.unwrap_or(last.next_waypoint);
        }
        if self.config.set_last_waypoint_speed_to_0 {
            last.speed = 0.0;
        }
        if self.config.add_loiter_to_end_of_mission {
            self.loiter(last);
        }
    }

    fn loiter(&self, last: &mut Waypoint) {
        let Some(vehicle) = self.vehicle else { return };
        let mut action = stay(&vehicle, &last.base.clone(), -1);
        if action.radius > 0.0 {
            action.radius = self.config.default_loiter_radius_m;
        }
        action.airspeed = last.speed;
        last.vehicle_action_list.push(Ref::new(action));
    }

    fn state(&mut self, state: &EntityState, post: &mut Post<'_>) {
        let current = state.current_waypoint;
        let holds = |segment: &[Waypoint]| segment.iter().position(|at| at.number == current);
        // The last that holds it, one in which it is not the first before all others.
        let inner = self.segments.iter().rposition(|segment| holds(segment).is_some_and(|at| at > 0));
        let found = inner.or_else(|| self.segments.iter().rposition(|segment| holds(segment).is_some()));
        if let Some(segment) = found
            && self.served.is_some_and(|served| segment > served)
        {
            self.due = Some((segment, current));
            self.serve(post);
        }
    }

    /// Serves the segment that is due, unless the last was served just now.
    fn serve(&mut self, post: &mut Post<'_>) {
        let now = post.now().monotonic;
        if self.sent_at.is_some_and(|at| now - at < COMMANDS_APART) {
            return;
        }
        let Some((segment, first)) = self.due.take() else { return };
        let Some(list) = self.segments.get(segment) else { return };
        let mut list = list.clone();
        if let Some(last) = list.last_mut() {
            if segment + 1 < self.segments.len() {
                last.next_waypoint = last.number;
                if self.config.add_loiter_to_end_of_segments {
                    self.loiter(last);
                }
            }
            if let Some(payload) = self.config.gimbal_payload {
                let mut action =
                    GimbalAngleAction { elevation: GIMBAL_ELEVATION_DEG, ..GimbalAngleAction::default() };
                action.payload_id = payload;
                last.vehicle_action_list.push(Ref::new(action));
            }
        }
        self.last_command += 1;
        let mut command = MissionCommand { first_waypoint: first, ..MissionCommand::default() };
        command.vehicle_id = self.config.vehicle;
        command.command_id = self.command_id(self.last_command);
        command.status = CommandStatusType::Approved;
        command.vehicle_action_list.clone_from(&self.mission.vehicle_action_list);
        command.waypoint_list = list.into_iter().map(Ref::new).collect();
        post.broadcast(&command);
        (self.served, self.sent_at) = (Some(segment), Some(now));
    }
}

impl Machine for WaypointManager {
    fn hears(&self) -> Vec<&'static TypeInfo> {
        vec![EntityConfiguration::TYPE, EntityState::TYPE, MissionCommand::TYPE, AutomationResponse::TYPE]
    }

    fn take(&mut self, heard: &Heard<'_>, post: &mut Post<'_>) {
        let object: &dyn Object = heard.object;
        let own = self.config.vehicle;
        if let Some(state) = object.get::<EntityState>() {
            if state.id == own {
                self.state(state, post);
            }
        } else if let Some(entity) = object.get::<EntityConfiguration>() {
            if entity.id == own {
                self.vehicle = Vehicle::of(object);
            }
        } else if let Some(mission) = object.get::<MissionCommand>() {
            if mission.vehicle_id == own {
                self.mission(mission, post);
            }
        } else if let Some(response) = object.get::<AutomationResponse>() {
            let missions = response.mission_command_list.iter().filter_map(|mission| mission.get());
            if let Some(mission) = missions.into_iter().find(|mission| mission.vehicle_id == own) {
                self.mission(mission, post);
            }
        }
    }

    fn wake(&mut self, post: &mut Post<'_>) {
        self.serve(post);
    }

    fn deadline(&self) -> Option<Monotonic> {
        self.due.and(self.sent_at).map(|at| at + COMMANDS_APART)
    }
}
