//! The collector: from the options of all tasks to the matrix of costs.

use super::needed::Needed;
use super::{Aggregator, REQUESTS_MAX, Waits};
use crate::uxas::ground::{Ground, ahead};
use crate::uxas::machine::Post;
use crate::uxas::task::life::route_error;
use aldis_envelope::lmcp::cmasi::{Location3D, ServiceStatusType};
use aldis_envelope::lmcp::route::{RouteConstraints, RoutePlanRequest, RoutePlanResponse};
use aldis_envelope::lmcp::uxtask::{
    AssignmentCostMatrix, TaskOption, TaskOptionCost, TaskPlanOptions, UniqueAutomationRequest,
};
use aldis_envelope::lmcp::{Ref, Text};
use std::collections::{BTreeMap, BTreeSet};

/// The most rows of a matrix that one message carries: its count takes 16 bits.
const ROWS_MAX: usize = 60_000;

/// How many failures a status tells.
const FAILURES_MAX: usize = 7;

/// The first number of routes, as in the reference.
const FIRST_ROUTE: i64 = 1_000_000;

/// Task and option; none is where the vehicle is.
pub(super) type Place = Option<(i64, i64)>;

/// A way that is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Way {
    vehicle: i64,
    from: Place,
    to: (i64, i64),
}

/// A request whose costs are collected.
pub(super) struct Collection {
    request: UniqueAutomationRequest,
    options: BTreeMap<i64, TaskPlanOptions>,
    /// The ways, in the order of their numbers; empty until all options are there.
    ways: Vec<Way>,
    open: BTreeSet<i64>,
    costs: BTreeMap<Way, i64>,
    failures: Vec<String>,
}

impl Aggregator {
    pub(super) fn begin(&mut self, request: &UniqueAutomationRequest, post: &mut Post<'_>) {
        let number = request.request_id;
        if self.collections.contains_key(&number) {
            return;
        }
        while self.collections.len() >= REQUESTS_MAX {
            if let Some(&old) = self.collections.keys().next() {
                self.forget(old);
            }
        }
        let collection = Collection {
            request: request.clone(),
            options: BTreeMap::new(),
            ways: Vec::new(),
            open: BTreeSet::new(),
            costs: BTreeMap::new(),
            failures: Vec::new(),
        };
        self.collections.insert(number, collection);
        self.ask_all(number, post);
    }

    pub(super) fn options(&mut self, options: &TaskPlanOptions, post: &mut Post<'_>) {
        let number = options.corresponding_automation_request_id;
        let Some(collection) = self.collections.get_mut(&number) else { return };
        let asked = collection.request.original_request.get().map_or(&[][..], |asked| &asked.task_list);
        if collection.ways.is_empty() && asked.contains(&options.task_id) {
            collection.options.entry(options.task_id).or_insert_with(|| options.clone());
            self.ask_all(number, post);
        }
    }

    /// Once the options of all tasks are there, asks for all ways that a plan can use.
    fn ask_all(&mut self, number: i64, post: &mut Post<'_>) {
        let Some(collection) = self.collections.get(&number) else { return };
        let Some(asked) = collection.request.original_request.get() else { return };
        if asked.task_list.iter().any(|task| !collection.options.contains_key(task))
            || !collection.ways.is_empty()
        {
            return;
        }
        let request = collection.request.clone();
        let all: Vec<TaskOption> = collection
            .options
            .values()
            .flat_map(|task| task.options.iter().filter_map(|option| option.get().cloned()))
            .collect();
        let needed = Needed::new(asked.task_relationships.as_str(), &asked.task_list);
        let region = asked.operating_region;
        let vehicles: Vec<i64> = match asked.entity_list.as_slice() {
            [] => self.world.states.keys().copied().filter(|&id| self.vehicle(id).is_some()).collect(),
            some => some.to_vec(),
        };
        let (mut ways, mut open, mut answered) = (Vec::new(), BTreeSet::new(), Vec::new());
        for vehicle in vehicles {
            let Some((start, heading)) = self.start(vehicle, &request) else { continue };
            let mine: Vec<_> = all
                .iter()
                .filter(|option| {
                    option.eligible_entities.is_empty() || option.eligible_entities.contains(&vehicle)
                })
                .collect();
            let mut routes = Vec::new();
            let mut add = |from: Place, place: &Location3D, heading: f32, to: &TaskOption| {
                let route_id = FIRST_ROUTE + ways.len() as i64;
                ways.push(Way { vehicle, from, to: (to.task_id, to.option_id) });
                routes.push(Ref::new(RouteConstraints {
                    route_id,
                    start_location: Ref::new(place.clone()),
                    start_heading: heading,
                    end_location: to.start_location.clone(),
                    end_heading: to.start_heading,
                    ..RouteConstraints::default()
                }));
            };
            for to in &mine {
                add(None, &start, heading, to);
                for from in mine.iter().filter(|from| needed.may_follow(from.task_id, to.task_id)) {
                    let Some(end) = from.end_location.get() else { continue };
                    add(Some((from.task_id, from.option_id)), end, from.end_heading, to);
                }
            }
            let plan = RoutePlanRequest {
                vehicle_id: vehicle,
                operating_region: region,
                route_requests: routes,
                is_cost_only_request: true,
                ..RoutePlanRequest::default()
            };
            match self.ask(Waits::Collection(number), plan, post) {
                (_, Some(response)) => answered.push(response),
                (number, None) => drop(open.insert(number)),
            }
        }
        if let Some(collection) = self.collections.get_mut(&number) {
            (collection.ways, collection.open) = (ways, open);
        }
        for response in answered {
            self.collected(number, &response, post);
        }
        self.finish(number, post);
    }

    /// Where a vehicle's plan begins.
    fn start(&self, vehicle: i64, request: &UniqueAutomationRequest) -> Option<(Location3D, f32)> {
        let planned = request.planning_states.iter().filter_map(|state| state.get());
        if let Some(state) = planned.into_iter().find(|state| state.entity_id == vehicle) {
            return Some((state.planning_position.get()?.clone(), state.planning_heading));
        }
        let state = self.world.state(vehicle)?;
        Some((
            led(state.location.get()?, state.heading, self.config.lead_m, self.config.compat_cost),
            state.heading,
        ))
    }

    pub(super) fn collected(&mut self, number: i64, response: &RoutePlanResponse, post: &mut Post<'_>) {
        let Some(collection) = self.collections.get_mut(&number) else { return };
        collection.open.remove(&response.response_id);
        for plan in response.route_responses.iter().filter_map(|plan| plan.get()) {
            let place = usize::try_from(plan.route_id - FIRST_ROUTE).ok();
            let Some(&way) = place.and_then(|place| collection.ways.get(place)) else { continue };
            if plan.route_cost >= 0 {
                collection.costs.insert(way, plan.route_cost);
            } else if collection.failures.len() < FAILURES_MAX {
                let (from, to) = (way.from.unwrap_or_default(), way.to);
                collection.failures.push(format!(
                    "V[{}]({},{})-({},{}): {}",
                    way.vehicle,
                    from.0,
                    from.1,
                    to.0,
                    to.1,
                    route_error(plan)
                ));
            }
        }
        self.finish(number, post);
    }

    /// Once all ways are known, tells the matrix.
    fn finish(&mut self, number: i64, post: &mut Post<'_>) {
        let is_whole = |one: &Collection| {
            let asked = one.request.original_request.get().map_or(&[][..], |asked| &asked.task_list);
            one.open.is_empty() && asked.iter().all(|task| one.options.contains_key(task))
        };
        if !self.collections.get(&number).is_some_and(is_whole) {
            return;
        }
        let Some(collection) = self.collections.remove(&number) else { return };
        let Some(asked) = collection.request.original_request.get() else { return };
        if collection.costs.is_empty() {
            let why = match collection.failures.first() {
                Some(first) => format!("no route to any task: {first}"),
                None => "no vehicle of the request has a state and an option of a task".to_owned(),
            };
            return post.failed(number, &why);
        }
        let row = |(way, &time_to_go): (&Way, &i64)| {
            let (intial_task_id, intial_task_option) = way.from.unwrap_or_default();
            Ref::new(TaskOptionCost {
                vehicle_id: way.vehicle,
                intial_task_id,
                intial_task_option,
                destination_task_id: way.to.0,
                destination_task_option: way.to.1,
                time_to_go,
            })
        };
        let rows: Vec<_> = collection.costs.iter().map(row).collect();
        let parts = rows.len().div_ceil(ROWS_MAX).max(1);
        for (part, rows) in rows.chunks(ROWS_MAX).enumerate() {
            let is_last = part + 1 == parts;
            post.broadcast(&AssignmentCostMatrix {
                corresponding_automation_request_id: number,
                task_level_relationship: Text::new(asked.task_relationships.as_str()),
                task_list: if is_last { asked.task_list.clone() } else { Vec::new() },
                operating_region: asked.operating_region,
                cost_matrix: rows.to_vec(),
            });
        }
        if collection.failures.is_empty() {
            return post.information("AssignmentMatrix - full", "");
        }
        let pairs: Vec<_> = collection
            .failures
            .iter()
            .map(|text| {
                (
                    "RoutesNotFound - [VehicleId](StartTaskId,StartOptionId)-(EndTaskId,EndOptionId)",
                    text.as_str(),
                )
            })
            .collect();
        post.status(ServiceStatusType::Information, &pairs);
    }
}

/// The place so far ahead of another.
pub(crate) fn led(at: &Location3D, heading: f32, lead_m: f64, compat: bool) -> Location3D {
    if lead_m <= 0.0 {
        return at.clone();
    }
    let ground = Ground::new(at, compat);
    let point = ahead(ground.point(at), f64::from(heading), lead_m);
    Location3D { altitude: at.altitude, altitude_type: at.altitude_type, ..ground.location(point) }
}
