//! A vehicle that follows its missions, for demonstrations and tests: it turns as tightly as it may, and tells its state.
//!
//! | state | what comes | what it does | next |
//! | --- | --- | --- | --- |
//! | nowhere | its configuration and a state of its own | begins there | waiting |
//! | any | a `MissionCommand` that is not pending | heads for its first waypoint | under way |
//! | under way | a waypoint is passed | heads for the next; stays as long as a `LoiterAction` there says | under way |
//! | under way | a waypoint that leads to itself is passed | stays: aircraft circle, all others hold their place | waiting |
//!
//! `CurrentWaypoint` and `AssociatedTasks` of its states are those of the waypoint that it heads for. Configuration:
//! `vehicle`, `period_ms` (1000), `pace` (1: it moves by the clock).

mod motion;

use super::ground::Ground;
use super::machine::{Heard, Machine, Post};
use super::vehicle::{Medium, Vehicle};
use aldis_envelope::Monotonic;
use aldis_envelope::lmcp::cmasi::{
    AirVehicleState, CommandStatusType, EntityConfiguration, EntityState, LoiterAction, LoiterType,
    MissionCommand, NavigationMode, Waypoint,
};
use aldis_envelope::lmcp::vehicles::SurfaceVehicleState;
use aldis_envelope::lmcp::{Object, Ref, Struct, TypeInfo};
use motion::Motion;
use std::collections::BTreeMap;
use std::time::Duration;

/// The longest step of the motion, in seconds.
const STEP_S: f64 = 0.1;

/// The most seconds that it moves in one of the clock.
const PACE_MAX: f64 = 1000.0;

/// How it is configured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KinematicConfig {
    /// The vehicle.
    pub vehicle: i64,
    /// How often it tells its state.
    pub period: Duration,
    /// How many seconds it moves in one of the clock.
    pub pace: f64,
}

impl KinematicConfig {
    /// A vehicle that tells its state this often, and moves by the clock.
    pub fn of(vehicle: i64, period: Duration) -> Self {
        Self { vehicle, period, pace: 1.0 }
    }
}

/// How long a vehicle stays.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Hold {
    /// Seconds left; none: for ever.
    left_s: Option<f64>,
    /// Whether it circles.
    circles: bool,
    radius_m: f64,
}

impl Hold {
    /// Until the next mission.
    fn for_good(vehicle: &Vehicle) -> Self {
        let radius_m = vehicle.loiter_radius_m().max(vehicle.turn_radius_m);
        Self { left_s: None, circles: vehicle.medium == Medium::Air, radius_m }
    }
}

/// The machine.
pub struct Kinematic {
    config: KinematicConfig,
    vehicle: Option<Vehicle>,
    /// The last state told, and what it moves by.
    state: Option<Box<dyn Object>>,
    motion: Option<Motion>,
    waypoints: BTreeMap<i64, Waypoint>,
    target: Option<i64>,
    hold: Option<Hold>,
    command: i64,
    last: Option<Monotonic>,
}

impl Kinematic {
    /// A vehicle that is nowhere yet.
    pub fn new(config: KinematicConfig) -> Self {
        let period = config.period.max(Duration::from_millis(10));
        let pace = if config.pace.is_finite() { config.pace.clamp(0.0, PACE_MAX) } else { 1.0 };
        Self {
            config: KinematicConfig { period, pace, ..config },
            vehicle: None,
            state: None,
            motion: None,
            waypoints: BTreeMap::new(),
            target: None,
            hold: None,
            command: 0,
            last: None,
        }
    }

    fn begin(&mut self, object: &dyn Object, post: &mut Post<'_>) {
        let Some(state) = object.get::<EntityState>().filter(|_| self.motion.is_none()) else { return };
        let Some(at) = state.location.get() else { return };
        let ground = Ground::new(at, false);
        self.motion = Some(Motion::new(ground, at.clone(), f64::from(state.heading)));
        self.state = Some(object.clone_box());
        self.last = Some(post.now().monotonic);
    }

    fn mission(&mut self, mission: &MissionCommand) {
        let list = mission.waypoint_list.iter().filter_map(|at| at.get());
        self.waypoints = list.map(|at| (at.number, at.clone())).collect();
        self.command = mission.command_id;
        self.hold = None;
        if let Some(motion) = &mut self.motion {
            motion.leave_line();
        }
        self.head_for(mission.first_waypoint);
    }

    /// Goes no further: aircraft circle, all others hold their place. The tasks that it was at stay those of its state, because
    /// they are not done. The number of the mission, where the vehicle was not waiting already.
    pub(super) fn halt(&mut self, post: &mut Post<'_>) -> Option<i64> {
        let waits = self.hold.is_some_and(|hold| hold.left_s.is_none());
        let vehicle = self.vehicle.filter(|_| self.target.is_some() && !waits)?;
        let hold = Hold::for_good(&vehicle);
        if let Some(motion) = self.motion.as_mut().filter(|_| !hold.circles) {
            motion.rest();
        }
        self.hold = Some(hold);
        self.tell(post);
        Some(self.command)
    }

    fn head_for(&mut self, number: i64) {
        let (Some(motion), Some(next)) = (&mut self.motion, self.waypoints.get(&number)) else { return };
        let after = self.waypoints.get(&next.next_waypoint).filter(|after| after.number != number);
        let stops = next
            .vehicle_action_list
            .iter()
            .any(|action| action.object().is_some_and(|action| action.get::<LoiterAction>().is_some()));
        motion.head_for(&next.base, after.filter(|_| !stops).map(|after| &after.base));
        self.target = Some(number);
    }

    /// The waypoint is passed: stays, or goes on.
    fn passed(&mut self) {
        let Some(waypoint) = self.target.and_then(|number| self.waypoints.get(&number)).cloned() else {
            return;
        };
        let Some(vehicle) = self.vehicle else { return };
        let actions = waypoint.vehicle_action_list.iter().filter_map(|action| action.object());
        let loiter = actions.filter_map(|action| action.get::<LoiterAction>()).next_back().cloned();
        if let (None, Some(loiter)) = (self.hold, loiter) {
            let circles = vehicle.medium == Medium::Air && loiter.loiter_type != LoiterType::Hover;
            let radius_m = f64::from(loiter.radius).max(vehicle.turn_radius_m);
            let left_s = (loiter.duration >= 0).then_some(loiter.duration as f64 / 1000.0);
            self.hold = Some(Hold { left_s, circles, radius_m });
            return;
        }
        self.hold = None;
        if waypoint.next_waypoint == waypoint.number || !self.waypoints.contains_key(&waypoint.next_waypoint)
        {
            self.hold = Some(Hold::for_good(&vehicle));
        } else {
            self.head_for(waypoint.next_waypoint);
        }
    }

    fn advance(&mut self, mut seconds: f64, post: &mut Post<'_>) {
        let Some(vehicle) = self.vehicle else { return };
        while seconds > 0.0 {
            let step = seconds.min(STEP_S);
            seconds -= step;
            let Some(motion) = &mut self.motion else { return };
            let named =
                self.target.and_then(|number| self.waypoints.get(&number)).map(|at| f64::from(at.speed));
            let speed = named.filter(|&speed| speed > 0.0).unwrap_or(vehicle.speed_m_per_s);
            match &mut self.hold {
                Some(hold) => {
                    if hold.circles {
                        motion.circle(speed, hold.radius_m, step);
                    } else {
                        motion.rest();
                    }
                    let is_over = hold.left_s.as_mut().is_some_and(|left| {
                        *left -= step;
                        *left <= 0.0
                    });
                    if is_over {
                        self.passed();
                        self.tell(post);
                    }
                }
                None if self.target.is_some() => {
                    if motion.step(speed, vehicle.turn_radius_m, step) {
                        self.passed();
                        // However short the way to the next waypoint is: whoever follows tasks must see each.
                        self.tell(post);
                    }
                }
                None => motion.rest(),
            }
        }
    }

    fn tell(&mut self, post: &mut Post<'_>) {
        let (Some(object), Some(motion), Some(vehicle)) = (&mut self.state, &self.motion, self.vehicle)
        else {
            return;
        };
        let waypoint = self.target.and_then(|number| self.waypoints.get(&number));
        let (speed, heading) = (motion.speed_m_per_s() as f32, motion.heading_deg() as f32);
        if let Some(state) = object.get_mut::<EntityState>() {
            let mut at = motion.location();
            (at.altitude, at.altitude_type) = (vehicle.altitude_m, vehicle.altitude_type);
            state.location = Ref::new(at);
            (state.heading, state.course, state.groundspeed, state.u) = (heading, heading, speed, speed);
            state.current_waypoint = waypoint.map_or(0, |at| at.number);
            state.associated_tasks = waypoint.map(|at| at.associated_tasks.clone()).unwrap_or_default();
            state.current_command = self.command;
            state.mode = if self.hold.is_some() { NavigationMode::Loiter } else { NavigationMode::Waypoint };
            state.time = post.wall_ms();
        }
        if let Some(state) = object.get_mut::<AirVehicleState>() {
            state.airspeed = speed;
        }
        if let Some(state) = object.get_mut::<SurfaceVehicleState>() {
            state.speed = speed;
        }
        post.broadcast(object.as_ref());
    }
}

impl Machine for Kinematic {
    fn hears(&self) -> Vec<&'static TypeInfo> {
        vec![EntityConfiguration::TYPE, EntityState::TYPE, MissionCommand::TYPE]
    }

    fn take(&mut self, heard: &Heard<'_>, post: &mut Post<'_>) {
        let (object, own) = (heard.object, self.config.vehicle);
        if let Some(state) = object.get::<EntityState>() {
            if state.id == own {
                self.begin(object, post);
            }
        } else if let Some(entity) = object.get::<EntityConfiguration>() {
            if entity.id == own {
                self.vehicle = Vehicle::of(object);
            }
        } else if let Some(mission) = object.get::<MissionCommand>() {
            // A mission that is pending waits for its approval.
            if mission.vehicle_id == own && mission.status != CommandStatusType::Pending {
                self.mission(mission);
            }
        }
    }

    fn wake(&mut self, post: &mut Post<'_>) {
        let now = post.now().monotonic;
        let elapsed = self.last.map_or(0.0, |last| (now - last).as_secs_f64());
        self.last = Some(now);
        self.advance(elapsed * self.config.pace, post);
        self.tell(post);
    }

    fn deadline(&self) -> Option<Monotonic> {
        self.motion.as_ref().and(self.last).map(|last| last + self.config.period)
    }
}
