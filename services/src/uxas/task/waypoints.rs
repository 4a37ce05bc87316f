//! The waypoints of an option: the way to it, the option itself, and one more so that its end can be seen.

use crate::uxas::vehicle::{Medium, Vehicle};
use aldis_envelope::lmcp::Ref;
use aldis_envelope::lmcp::cmasi::{Location3D, LoiterAction, LoiterType, Waypoint};

/// Places nearer than this, in degrees, are one.
const SAME_DEG: f64 = 1e-6;

/// What is to become waypoints.
pub(super) struct Legs<'a> {
    /// The task.
    pub task: i64,
    /// The vehicle.
    pub vehicle: &'a Vehicle,
    /// The number of the first waypoint.
    pub first: i64,
    /// The way to the option.
    pub transition: Vec<Waypoint>,
    /// How long the vehicle waits before it begins, in milliseconds.
    pub hold_ms: i64,
    /// The way within the option.
    pub on_task: Vec<Waypoint>,
}

/// A waypoint at a place.
pub(super) fn at(place: &Location3D) -> Waypoint {
    Waypoint { base: place.clone(), ..Waypoint::default() }
}

/// An action that keeps a vehicle where a waypoint is; for ever with a duration of -1.
pub fn stay(vehicle: &Vehicle, place: &Location3D, duration_ms: i64) -> LoiterAction {
    let flies = vehicle.medium == Medium::Air;
    LoiterAction {
        loiter_type: if flies { LoiterType::Circular } else { LoiterType::Hover },
        radius: if flies { vehicle.loiter_radius_m() as f32 } else { 0.0 },
        duration: duration_ms,
        airspeed: vehicle.speed_m_per_s as f32,
        location: Ref::new(place.clone()),
        ..LoiterAction::default()
    }
}

fn is_same(a: &Waypoint, b: &Waypoint) -> bool {
    (a.latitude - b.latitude).abs() < SAME_DEG && (a.longitude - b.longitude).abs() < SAME_DEG
}

impl Legs<'_> {
    /// The numbered and linked waypoints, without the one more.
    pub(super) fn waypoints(self) -> Vec<Waypoint> {
        let Self { task, vehicle, first, mut transition, hold_ms, on_task } = self;
        if hold_ms > 0
            && let Some(last) = transition.last_mut()
        {
            let action = stay(vehicle, &last.base.clone(), hold_ms);
            last.vehicle_action_list.push(Ref::new(action));
        }
        let arrived = transition.len();
        let mut waypoints: Vec<Waypoint> = Vec::new();
        for (place, mut waypoint) in transition.into_iter().chain(on_task).enumerate() {
            (waypoint.altitude, waypoint.altitude_type) = (vehicle.altitude_m, vehicle.altitude_type);
            waypoint.speed = vehicle.speed_m_per_s as f32;
            if place >= arrived {
                waypoint.associated_tasks = vec![task];
            }
            match waypoints
                .last_mut()
                .filter(|last| is_same(last, &waypoint) && last.vehicle_action_list.is_empty())
            {
                Some(last) => *last = waypoint,
                None => waypoints.push(waypoint),
            }
        }
        for (waypoint, number) in waypoints.iter_mut().zip(first..) {
            (waypoint.number, waypoint.next_waypoint) = (number, number + 1);
        }
        waypoints
    }
}

/// Closes the waypoints: a last one without the task, so that who is there is done.
pub(super) fn close(task: i64, waypoints: &mut Vec<Waypoint>) {
    let Some(last) = waypoints.last_mut() else { return };
    if !last.associated_tasks.contains(&task) {
        last.associated_tasks.push(task);
    }
    last.next_waypoint = last.number + 1;
    let mut end = at(&last.base.clone());
    (end.number, end.next_waypoint) = (last.number + 1, last.number + 1);
    (end.speed, end.speed_type, end.turn_type) = (last.speed, last.speed_type, last.turn_type);
    waypoints.push(end);
}
