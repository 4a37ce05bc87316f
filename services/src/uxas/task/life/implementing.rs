//! The option that was chosen becomes waypoints.

use super::super::Within;
use super::super::state::Trigger;
use super::super::waypoints::{self, Legs};
use super::planning::{constraints, find, route_error};
use super::{Asked, Context, Life};
use crate::uxas::vehicle::Vehicle;
use aldis_envelope::lmcp::Ref;
use aldis_envelope::lmcp::cmasi::{AltitudeType, Waypoint};
use aldis_envelope::lmcp::route::{RouteConstraints, RoutePlan, RoutePlanResponse};
use aldis_envelope::lmcp::uxtask::{TaskImplementationRequest, TaskImplementationResponse};

/// The number of the way to an option among the routes of its implementation.
const TRANSITION: i64 = 1;

impl Life {
    /// An option was chosen: asks for the way to it and within it.
    pub fn chosen(&mut self, asked: &TaskImplementationRequest, context: &mut Context<'_, '_>) {
        let number = asked.corresponding_automation_request_id;
        let work = self.works.get(&number);
        let choice = work.and_then(|work| work.offer.as_ref()).and_then(|offer| find(offer, asked.option_id));
        let vehicle =
            context.world.configurations.get(&asked.vehicle_id).and_then(|found| Vehicle::of(found.as_ref()));
        let (Some(choice), Some(vehicle)) = (choice, vehicle) else {
            let (option, who) = (asked.option_id, asked.vehicle_id);
            let why = match choice {
                Some(_) => format!("task {}: vehicle {who} is not known", self.id),
                None => format!("task {}: it has told no option {option} for request {number}", self.id),
            };
            return refuse(asked, &why, context);
        };
        let to_it = RouteConstraints {
            route_id: TRANSITION,
            start_location: asked.start_position.clone(),
            start_heading: asked.start_heading,
            end_location: Ref::new(choice.start.clone()),
            end_heading: choice.start_heading,
            ..RouteConstraints::default()
        };
        let mut routes = vec![to_it];
        if let Within::Stretches(stretches) = &choice.within {
            routes
                .extend(stretches.iter().zip(TRANSITION + 1..).map(|(stretch, id)| constraints(id, stretch)));
        }
        let request = self.route_request(vehicle.id, asked.region_id, routes, context);
        if let Some(work) = self.works.get_mut(&number) {
            work.state.step(Trigger::Chosen);
            work.routes.insert(request.request_id, Asked::Final(Box::new(asked.clone())));
        }
        context.ask_planner(vehicle.medium.mailbox(), &request);
    }

    /// Makes the waypoints of the chosen option from its routes.
    pub(super) fn implement(
        &mut self,
        number: i64,
        asked: &TaskImplementationRequest,
        response: &RoutePlanResponse,
        context: &mut Context<'_, '_>,
    ) {
        let mut plans: Vec<&RoutePlan> =
            response.route_responses.iter().filter_map(|plan| plan.get()).collect();
        plans.sort_by_key(|plan| plan.route_id);
        if let Some(plan) = plans.iter().find(|plan| plan.route_cost < 0) {
            return refuse(asked, &format!("task {}: no route: {}", self.id, route_error(plan)), context);
        }
        let Some(work) = self.works.get(&number) else { return };
        let choice = work.offer.as_ref().and_then(|offer| find(offer, asked.option_id)).cloned();
        let vehicle =
            context.world.configurations.get(&asked.vehicle_id).and_then(|found| Vehicle::of(found.as_ref()));
        let (Some(choice), Some(vehicle)) = (choice, vehicle) else { return };
        let of =
            |plan: &&RoutePlan| plan.waypoints.iter().filter_map(|at| at.get().cloned()).collect::<Vec<_>>();
        let transition = plans.iter().filter(|plan| plan.route_id == TRANSITION).flat_map(of).collect();
        let within = plans.iter().filter(|plan| plan.route_id != TRANSITION).flat_map(of);
        let on_task: Vec<Waypoint> = match &choice.within {
            Within::Places(places, _) => places.iter().map(waypoints::at).collect(),
            Within::Stretches(_) => [waypoints::at(&choice.start)].into_iter().chain(within).collect(),
        };
        let costs: i64 = plans.iter().map(|plan| plan.route_cost).sum();
        let work_ms = if let Within::Places(_, time_ms) = choice.within { time_ms } else { 0 };
        let transition_ms =
            plans.iter().find(|plan| plan.route_id == TRANSITION).map_or(0, |plan| plan.route_cost);
        let arrival = asked.start_time + transition_ms;
        let hold_ms = (self.begin_ms(asked, context).max(asked.time_threshold) - arrival).max(0);
        let legs = Legs {
            task: self.id,
            vehicle: &vehicle,
            first: asked.starting_waypoint_id,
            transition,
            hold_ms,
            on_task,
        };
        let mut list = legs.waypoints();
        let entities = work.request.original_request.get().map_or(&[][..], |asked| &asked.entity_list);
        let view = self.view(context, entities);
        let first = list.iter().position(|at| at.associated_tasks.contains(&self.id)).unwrap_or(0);
        let mut own = list.split_off(first);
        self.kind.finish(&view, &vehicle, &choice, &mut own);
        self.linger(&view, &vehicle, &mut own);
        list.extend(own);
        waypoints::close(self.id, &mut list);
        let mut end = choice.end.clone();
        (end.altitude, end.altitude_type) = (vehicle.altitude_m, vehicle.altitude_type);
        let told = TaskImplementationResponse {
            response_id: asked.request_id,
            corresponding_automation_request_id: number,
            task_id: self.id,
            option_id: asked.option_id,
            vehicle_id: asked.vehicle_id,
            task_waypoints: list.into_iter().map(Ref::new).collect(),
            final_location: Ref::new(end),
            final_heading: choice.end_heading,
            final_time: asked.start_time + costs + work_ms + hold_ms,
        };
        if let Some(work) = self.works.get_mut(&number) {
            work.state.step(Trigger::Implemented);
        }
        context.post.broadcast(&told);
    }

    /// When all that do it are to begin, by the wall clock; 0 where each begins when it is there.
    fn begin_ms(&self, asked: &TaskImplementationRequest, context: &Context<'_, '_>) -> i64 {
        let summary = context.summaries.get(&asked.corresponding_automation_request_id);
        let Some(summary) = summary.filter(|_| self.kind.begins_together()) else { return 0 };
        let own =
            || summary.task_list.iter().filter_map(|one| one.get()).filter(|one| one.task_id == self.id);
        let latest = own().map(|one| one.time_task_completed).max().unwrap_or(0);
        let mine = own().find(|one| one.assigned_vehicle == asked.vehicle_id);
        // The summary counts from the mission's start, the request by the wall clock.
        let wait = mine.map_or(0, |mine| latest - mine.time_task_completed);
        if wait > 0 { asked.start_time + self.own_travel_ms(asked, context) + wait } else { 0 }
    }

    /// How long the vehicle's way to the task takes as the summary has it.
    fn own_travel_ms(&self, asked: &TaskImplementationRequest, context: &Context<'_, '_>) -> i64 {
        let Some(summary) = context.summaries.get(&asked.corresponding_automation_request_id) else {
            return 0;
        };
        let of_vehicle = summary.task_list.iter().filter_map(|one| one.get());
        let of_vehicle = of_vehicle.filter(|one| one.assigned_vehicle == asked.vehicle_id);
        let mut before = 0;
        for one in of_vehicle {
            if one.task_id == self.id {
                return one.time_task_completed - before;
            }
            before = one.time_task_completed;
        }
        0
    }
}

/// Answers that an option cannot be implemented: at once, and with the cause.
fn refuse(asked: &TaskImplementationRequest, why: &str, context: &mut Context<'_, '_>) {
    let mut at = asked.start_position.get().cloned().unwrap_or_default();
    at.altitude_type = AltitudeType::MSL;
    context.post.failed(asked.corresponding_automation_request_id, why);
    context.post.broadcast(&TaskImplementationResponse {
        response_id: asked.request_id,
        corresponding_automation_request_id: asked.corresponding_automation_request_id,
        task_id: asked.task_id,
        option_id: asked.option_id,
        vehicle_id: asked.vehicle_id,
        final_location: Ref::new(at),
        final_heading: asked.start_heading,
        final_time: asked.start_time,
        ..TaskImplementationResponse::default()
    });
}
