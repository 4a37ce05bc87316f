//! A task and the vehicles that do it: who is assigned, who is at it, when it is complete; and tasks that move.

use super::super::state::{State, Trigger};
use super::super::{View, waypoints};
use super::{Context, Life, Sent};
use crate::uxas::vehicle::Vehicle;
use aldis_envelope::lmcp::Ref;
use aldis_envelope::lmcp::cmasi::{AutomationResponse, EntityState, Location3D, MissionCommand, Waypoint};
use aldis_envelope::lmcp::route::{RouteConstraints, RoutePlanResponse};
use aldis_envelope::lmcp::uxtask::{TaskActive, TaskComplete};
use std::collections::BTreeSet;

/// How long a vehicle stays where something that moves was, before its task is complete, in milliseconds.
const LINGER_MS: i64 = 30_000;

/// How often a vehicle is sent after what moves at the most, in milliseconds, unless `Throttle_ms` says otherwise.
const THROTTLE_MS: f64 = 3000.0;

/// How far that must have moved, in metres, unless `TargetMovementRecalculateThreshold_m` says otherwise.
const MOVED_M: f64 = 400.0;

/// What follows a task in the mission of a vehicle.
pub(super) struct Passed {
    command: i64,
    /// The waypoints after the last one of the task.
    after: BTreeSet<i64>,
}

impl Passed {
    fn of(task: i64, mission: &MissionCommand) -> Self {
        let list: Vec<&Waypoint> = mission.waypoint_list.iter().filter_map(|at| at.get()).collect();
        let last = list.iter().rposition(|at| at.associated_tasks.contains(&task));
        let after = last.map_or(&[][..], |last| &list[last + 1..]).iter().map(|at| at.number).collect();
        Self { command: mission.command_id, after }
    }

    /// Whether a state is one of a vehicle that has left the task behind it in this mission, as it was sent or as a
    /// `WaypointPlanManager` serves it.
    fn is_behind(&self, state: &EntityState) -> bool {
        let is_same = [state.current_command, state.current_command >> 16].contains(&self.command);
        is_same && self.after.contains(&state.current_waypoint)
    }
}

impl Life {
    /// A request is answered: who is assigned now.
    pub fn answered(&mut self, request: i64, response: &AutomationResponse) {
        let Some(work) = self.works.remove(&request) else { return };
        if work.request.sand_box_request {
            return;
        }
        for mission in response.mission_command_list.iter().filter_map(|mission| mission.get()) {
            self.assigned.remove(&mission.vehicle_id);
            let mut waypoints = mission.waypoint_list.iter().filter_map(|at| at.get());
            if waypoints.any(|at| at.associated_tasks.contains(&self.id)) {
                self.passed.insert(mission.vehicle_id, Passed::of(self.id, mission));
                self.assigned.insert(mission.vehicle_id);
                self.state = State::OptionSelected;
            }
        }
        if self.assigned.is_empty() && self.state == State::OptionSelected {
            self.state.step(Trigger::Dropped);
        }
        self.sent.retain(|vehicle, _| self.assigned.contains(vehicle));
        self.passed.retain(|vehicle, _| self.assigned.contains(vehicle));
        self.active.retain(|vehicle| self.assigned.contains(vehicle));
    }

    /// A vehicle does not do its mission any more: where nobody else is assigned, the task is free and not complete.
    pub fn lost(&mut self, vehicle: i64) {
        self.sent.remove(&vehicle);
        self.active.remove(&vehicle);
        let is_done_with = matches!(self.state, State::OptionSelected | State::Active);
        if self.assigned.remove(&vehicle) && self.assigned.is_empty() && is_done_with {
            self.state.step(Trigger::Dropped);
        }
    }

    /// A new request takes the task from who is at it: that is complete.
    pub(super) fn interrupt(&mut self, context: &mut Context<'_, '_>) {
        if self.state == State::Active {
            self.state.step(Trigger::Requested);
            self.complete(context);
        }
    }

    /// A vehicle tells its state.
    pub fn state_of(&mut self, state: &EntityState, context: &mut Context<'_, '_>) {
        if !self.assigned.contains(&state.id) {
            return;
        }
        let is_at_it = state.associated_tasks.contains(&self.id);
        // Of the states of a vehicle behind a bad link the newest come: a short task may begin and end between two of them.
        let has_been = self.passed.get(&state.id).is_some_and(|passed| passed.is_behind(state));
        if (is_at_it || has_been) && self.active.insert(state.id) {
            self.state.step(Trigger::Taken);
            let time_task_activated = time_of(state, context);
            context.post.broadcast(&TaskActive {
                task_id: self.id,
                entity_id: state.id,
                time_task_activated,
            });
        }
        if is_at_it {
            self.steer(state, context);
        } else if self.active.remove(&state.id) {
            self.sent.remove(&state.id);
            self.assigned.remove(&state.id);
            if self.active.is_empty() && self.state.step(Trigger::Left) {
                self.assigned.insert(state.id);
                self.complete(context);
            }
        }
    }

    fn complete(&mut self, context: &mut Context<'_, '_>) {
        let entities_involved = self.assigned.iter().copied().collect();
        let time_task_completed = context.post.wall_ms();
        context.post.broadcast(&TaskComplete { task_id: self.id, entities_involved, time_task_completed });
        self.assigned.clear();
        self.active.clear();
        self.sent.clear();
        self.state.step(Trigger::Told);
    }

    /// Has a vehicle stay a while at the end of a task that moves: who stands still is reached then.
    pub(super) fn linger(&self, view: &View<'_>, vehicle: &Vehicle, waypoints: &mut [Waypoint]) {
        let Some(last) = waypoints.last_mut() else { return };
        if self.kind.follows(view, vehicle).is_some() {
            let mut action = waypoints::stay(vehicle, &last.base.clone(), LINGER_MS);
            action.associated_task_list = vec![self.id];
            last.vehicle_action_list.push(Ref::new(action));
        }
    }

    /// Sends a vehicle after a task that has moved.
    fn steer(&mut self, state: &EntityState, context: &mut Context<'_, '_>) {
        let configuration = context.world.configurations.get(&state.id);
        let Some(vehicle) = configuration.and_then(|found| Vehicle::of(found.as_ref())) else { return };
        let everyone: Vec<i64> = self.assigned.iter().copied().collect();
        let view = self.view(context, &everyone);
        for order in self.kind.steer(&view, &vehicle, state) {
            context.post.broadcast(order.as_ref());
        }
        let Some(target) = self.kind.follows(&view, &vehicle) else { return };
        let now_ms = context.post.wall_ms();
        let throttle = view.number("Throttle_ms").unwrap_or(THROTTLE_MS) as i64;
        let moved = view.number("TargetMovementRecalculateThreshold_m").unwrap_or(MOVED_M);
        let distance = |from: &Location3D, to: &Location3D| view.ground(from).distance_m(from, to);
        let here = state.location.get();
        let is_far = here.is_some_and(|here| distance(here, &target) > moved);
        let sent = self.sent.get(&state.id);
        let is_due = sent.is_none_or(|sent| {
            sent.asked.is_none() && now_ms - sent.at_ms >= throttle && distance(&sent.to, &target) >= moved
        });
        if !is_far || !is_due {
            if sent.is_none() {
                self.sent.insert(state.id, Sent { to: target, at_ms: now_ms, asked: None });
            }
            return;
        }
        let route = RouteConstraints {
            route_id: 1,
            start_location: state.location.clone(),
            use_start_heading: false,
            end_location: Ref::new(target.clone()),
            use_end_heading: false,
            ..RouteConstraints::default()
        };
        let request = aldis_envelope::lmcp::route::RoutePlanRequest {
            request_id: context.numbers.next(self.id),
            vehicle_id: vehicle.id,
            route_requests: vec![Ref::new(route)],
            is_cost_only_request: false,
            ..Default::default()
        };
        let sent = Sent { to: target, at_ms: now_ms, asked: Some(request.request_id) };
        self.sent.insert(state.id, sent);
        context.ask_planner(vehicle.medium.mailbox(), &request);
    }

    /// The route after a task that moves has come: it becomes the vehicle's mission. Whether it was one.
    pub(super) fn steered(&mut self, response: &RoutePlanResponse, context: &mut Context<'_, '_>) -> bool {
        let found = self.sent.iter_mut().find(|(_, sent)| sent.asked == Some(response.response_id));
        let Some((&id, sent)) = found else { return false };
        sent.asked = None;
        let configuration = context.world.configurations.get(&id);
        let vehicle = configuration.and_then(|found| Vehicle::of(found.as_ref()));
        let plan =
            response.route_responses.iter().find_map(|plan| plan.get()).filter(|plan| plan.route_cost >= 0);
        let (Some(vehicle), Some(plan)) = (vehicle, plan) else { return true };
        let last = context.world.missions.get(&id).and_then(|mission| {
            mission.waypoint_list.iter().filter_map(|at| at.get()).map(|at| at.number).max()
        });
        let on_task = plan.waypoints.iter().filter_map(|at| at.get().cloned()).collect();
        let first = last.unwrap_or(0) + 1;
        let legs = waypoints::Legs {
            task: self.id,
            vehicle: &vehicle,
            first,
            transition: Vec::new(),
            hold_ms: 0,
            on_task,
        };
        let mut list = legs.waypoints();
        let view = self.view(context, &[id]);
        self.linger(&view, &vehicle, &mut list);
        waypoints::close(self.id, &mut list);
        let mut mission = MissionCommand { first_waypoint: first, ..MissionCommand::default() };
        mission.vehicle_id = id;
        mission.command_id = response.response_id;
        mission.waypoint_list = list.into_iter().map(Ref::new).collect();
        context.post.broadcast(&mission);
        true
    }
}

fn time_of(state: &EntityState, context: &Context<'_, '_>) -> i64 {
    if state.time > 0 { state.time } else { context.post.wall_ms() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_task_is_behind_a_vehicle_that_heads_for_what_comes_after_it_in_the_same_mission() {
        let at = |number: i64, tasks: &[i64]| {
            Ref::new(Waypoint { number, associated_tasks: tasks.to_vec(), ..Waypoint::default() })
        };
        let waypoint_list = vec![at(1, &[]), at(2, &[5]), at(3, &[]), at(4, &[5]), at(5, &[6]), at(6, &[])];
        let mut mission = MissionCommand::default();
        (mission.command_id, mission.waypoint_list) = (7, waypoint_list);
        let passed = Passed::of(5, &mission);
        let state = |current_command, current_waypoint| EntityState {
            current_command,
            current_waypoint,
            ..EntityState::default()
        };
        let behind =
            |command| (1..=6).filter(|&at| passed.is_behind(&state(command, at))).collect::<Vec<_>>();
        assert_eq!(behind(7), [5, 6]);
        assert_eq!(behind(7 << 16 | 3), [5, 6], "served in segments");
        assert_eq!(behind(8), Vec::<i64>::new(), "another mission has the same numbers");
        assert_eq!(Passed::of(9, &mission).after.len(), 0);
    }
}
