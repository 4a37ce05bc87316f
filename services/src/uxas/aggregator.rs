//! RouteAggregator: asks the planners for many routes at once, and collects the costs between tasks.
//!
//! | role | what comes | what it does |
//! | --- | --- | --- |
//! | aggregator | `RouteRequest` | asks the planner of each vehicle; idle to pending |
//! | aggregator | `RoutePlanResponse`, the last that is awaited | `RouteResponse`; pending to idle |
//! | collector | `UniqueAutomationRequest` | waits for the options of its tasks |
//! | collector | `TaskPlanOptions`, the last that is awaited | asks for all ways, once; options wait to routes pending |
//! | collector | `RoutePlanResponse`, the last that is awaited | `AssignmentCostMatrix`; done |
//! | both | an error that names the request, or its answer | forgets it |
//! | both | the planner that a mailbox led to is gone | fails what waits for it, with the cause |
//!
//! Options are kept by request and task. Ways that no plan can use are not asked for: within one task, and against the
//! order that the relationships demand. A matrix of more rows than a message holds goes out in parts, all but the last
//! without `TaskList`. Configuration: `lead_m` (50; as `assignment_start_point_lead_m` of the plan builder),
//! `fast_plan` (false: ground vehicles go straight, without a planner).

mod collect;
mod needed;
#[cfg(test)]
mod tests;

use super::ground::Ground;
use super::machine::{FAILED_KEY, Heard, Machine, Post, REQUEST_KEY, pair};
use super::planners::{self, Planners};
use super::vehicle::{Medium, Vehicle};
use super::world::World;
use aldis_envelope::lmcp::cmasi::{
    EntityConfiguration, EntityState, Location3D, RemoveEntities, ServiceStatus, ServiceStatusType,
};
use aldis_envelope::lmcp::route::{
    RouteConstraints, RoutePlan, RoutePlanRequest, RoutePlanResponse, RouteRequest, RouteResponse,
};
use aldis_envelope::lmcp::uxtask::{TaskPlanOptions, UniqueAutomationRequest, UniqueAutomationResponse};
use aldis_envelope::lmcp::{Ref, Struct, TypeInfo};
use aldis_envelope::{Monotonic, Source};
use collect::Collection;
pub(super) use collect::led;
use std::collections::BTreeMap;

/// How many requests may be under way; the oldest is dropped for a newer one.
const REQUESTS_MAX: usize = 256;

/// How it is configured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AggregatorConfig {
    /// How far ahead of where a vehicle is its plan begins, in metres.
    pub lead_m: f64,
    /// Whether ground vehicles go straight, without a planner.
    pub fast_plan: bool,
    /// Whether it measures as the reference does.
    pub compat_cost: bool,
}

impl Default for AggregatorConfig {
    fn default() -> Self {
        Self { lead_m: 50.0, fast_plan: false, compat_cost: false }
    }
}

/// Who waits for a planner's answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Waits {
    /// A `RouteRequest`, by our number of it.
    Routes(i64),
    /// A request's collection.
    Collection(i64),
}

/// A `RouteRequest` that is pending.
struct Gathering {
    request: RouteRequest,
    /// What is asked: the vehicle of each number.
    open: BTreeMap<i64, i64>,
    routes: BTreeMap<i64, RoutePlanResponse>,
}

/// The machine.
pub struct Aggregator {
    config: AggregatorConfig,
    world: World,
    last: i64,
    /// What each number that was given to a planner is for, and the mailbox.
    asked: BTreeMap<i64, (Waits, &'static str)>,
    gatherings: BTreeMap<i64, Gathering>,
    collections: BTreeMap<i64, Collection>,
    planners: Planners,
}

impl Aggregator {
    /// An aggregator that waits for nothing.
    pub fn new(config: AggregatorConfig) -> Self {
        Self {
            config,
            world: World::default(),
            last: 0,
            asked: BTreeMap::new(),
            gatherings: BTreeMap::new(),
            collections: BTreeMap::new(),
            planners: Planners::default(),
        }
    }

    /// Whether it waits for nothing and has kept nothing of what is over.
    pub fn is_idle(&self) -> bool {
        self.asked.is_empty() && self.gatherings.is_empty() && self.collections.is_empty()
    }

    fn vehicle(&self, id: i64) -> Option<Vehicle> {
        Vehicle::of(self.world.configurations.get(&id)?.as_ref())
    }

    /// Asks a vehicle's planner, or answers itself where that is allowed.
    fn ask(
        &mut self,
        waits: Waits,
        mut request: RoutePlanRequest,
        post: &mut Post<'_>,
    ) -> (i64, Option<RoutePlanResponse>) {
        self.last += 1;
        request.request_id = self.last;
        let vehicle = self.vehicle(request.vehicle_id);
        let medium = vehicle.map_or(Medium::Air, |vehicle| vehicle.medium);
        if let Some(vehicle) = vehicle.filter(|_| self.config.fast_plan && medium == Medium::Ground) {
            return (self.last, Some(straight(&request, &vehicle, self.config.compat_cost)));
        }
        self.planners.asked(medium.mailbox(), post.now().monotonic);
        self.asked.insert(self.last, (waits, medium.mailbox()));
        post.mail(medium.mailbox(), &request);
        (self.last, None)
    }

    fn routes(&mut self, request: &RouteRequest, post: &mut Post<'_>) {
        let vehicles = match request.vehicle_id.as_slice() {
            [] => self.world.states.keys().copied().filter(|&id| self.vehicle(id).is_some()).collect(),
            some => some.to_vec(),
        };
        self.last += 1;
        let own = self.last;
        let mut gathering =
            Gathering { request: request.clone(), open: BTreeMap::new(), routes: BTreeMap::new() };
        for vehicle_id in vehicles {
            let asked = RoutePlanRequest {
                request_id: 0,
                associated_task_id: request.associated_task_id,
                vehicle_id,
                operating_region: request.operating_region,
                route_requests: request.route_requests.clone(),
                is_cost_only_request: request.is_cost_only_request,
            };
            match self.ask(Waits::Routes(own), asked, post) {
                (number, Some(response)) => drop(gathering.routes.insert(number, response)),
                (number, None) => drop(gathering.open.insert(number, vehicle_id)),
            }
        }
        while self.gatherings.len() >= REQUESTS_MAX {
            if let Some((_, old)) = self.gatherings.pop_first() {
                self.asked.retain(|number, _| !old.open.contains_key(number));
            }
        }
        self.gatherings.insert(own, gathering);
        self.gathered(own, post);
    }

    fn gathered(&mut self, own: i64, post: &mut Post<'_>) {
        if self.gatherings.get(&own).is_some_and(|gathering| gathering.open.is_empty())
            && let Some(gathering) = self.gatherings.remove(&own)
        {
            let routes = gathering.routes.into_values().map(Ref::new).collect();
            post.broadcast(&RouteResponse { response_id: gathering.request.request_id, routes });
        }
    }

    fn response(&mut self, response: &RoutePlanResponse, from: Source, post: &mut Post<'_>) {
        let Some((waits, mailbox)) = self.asked.remove(&response.response_id) else { return };
        self.planners.answered(mailbox, from);
        match waits {
            Waits::Routes(own) => {
                if let Some(gathering) = self.gatherings.get_mut(&own)
                    && gathering.open.remove(&response.response_id).is_some()
                {
                    gathering.routes.insert(response.response_id, response.clone());
                }
                self.gathered(own, post);
            }
            Waits::Collection(request) => self.collected(request, response, post),
        }
    }

    /// Nobody answers a mailbox: what waits for it ends, with the cause.
    fn unanswered(&mut self, mailbox: &'static str, planner: Source, post: &mut Post<'_>) {
        let why = planners::cause(mailbox, planner);
        let waiting = self.asked.iter().filter(|(_, (_, to))| *to == mailbox);
        let waiting: Vec<_> = waiting.map(|(&number, (waits, _))| (number, *waits)).collect();
        for (number, waits) in waiting {
            match waits {
                // One that has several vehicles fails once.
                Waits::Collection(request) if self.asked.contains_key(&number) => {
                    self.forget(request);
                    post.failed(request, &why);
                }
                Waits::Collection(_) => {}
                Waits::Routes(own) => {
                    self.asked.remove(&number);
                    if let Some(gathering) = self.gatherings.get_mut(&own)
                        && let Some(vehicle) = gathering.open.remove(&number)
                    {
                        let none = unrouted(&gathering.request, vehicle, &why);
                        gathering.routes.insert(number, none);
                    }
                    self.gathered(own, post);
                }
            }
        }
    }

    /// A request is over: nothing of it is kept.
    fn forget(&mut self, request: i64) {
        self.collections.remove(&request);
        self.asked.retain(|_, (waits, _)| *waits != Waits::Collection(request));
    }

    fn status(&mut self, status: &ServiceStatus) {
        let pairs: Vec<_> = status.info.iter().filter_map(|one| one.get()).collect();
        let failed =
            status.status_type == ServiceStatusType::Error && pairs.iter().any(|pair| pair.key == FAILED_KEY);
        let number =
            pairs.iter().find(|pair| pair.key == REQUEST_KEY).and_then(|pair| pair.value.parse().ok());
        if let Some(number) = number.filter(|_| failed) {
            self.forget(number);
        }
    }
}

/// What is told of a vehicle's routes where nobody finds any.
fn unrouted(request: &RouteRequest, vehicle_id: i64, why: &str) -> RoutePlanResponse {
    let route = |asked: &RouteConstraints| {
        let route_error = vec![pair("RouteAggregator", why)];
        Ref::new(RoutePlan { route_id: asked.route_id, waypoints: Vec::new(), route_cost: -1, route_error })
    };
    RoutePlanResponse {
        response_id: request.request_id,
        associated_task_id: request.associated_task_id,
        vehicle_id,
        operating_region: request.operating_region,
        route_responses: request.route_requests.iter().filter_map(|asked| asked.get()).map(route).collect(),
    }
}

/// Straight ways of a vehicle, without any zone.
fn straight(request: &RoutePlanRequest, vehicle: &Vehicle, compat: bool) -> RoutePlanResponse {
    let route = |asked: &RouteConstraints| {
        let nowhere = Location3D::default();
        let (from, to) =
            (asked.start_location.get().unwrap_or(&nowhere), asked.end_location.get().unwrap_or(&nowhere));
        let metres = Ground::new(from, compat).distance_m(from, to);
        let waypoint = aldis_envelope::lmcp::cmasi::Waypoint {
            base: to.clone(),
            number: 1,
            next_waypoint: 1,
            ..Default::default()
        };
        let waypoints = if request.is_cost_only_request { Vec::new() } else { vec![Ref::new(waypoint)] };
        let route_cost = vehicle.time_ms(metres).unwrap_or(-1);
        Ref::new(RoutePlan { route_id: asked.route_id, waypoints, route_cost, route_error: Vec::new() })
    };
    RoutePlanResponse {
        response_id: request.request_id,
        associated_task_id: request.associated_task_id,
        vehicle_id: request.vehicle_id,
        operating_region: request.operating_region,
        route_responses: request.route_requests.iter().filter_map(|asked| asked.get()).map(route).collect(),
    }
}

impl Machine for Aggregator {
    fn hears(&self) -> Vec<&'static TypeInfo> {
        vec![
            EntityConfiguration::TYPE,
            EntityState::TYPE,
            RemoveEntities::TYPE,
            RouteRequest::TYPE,
            RoutePlanResponse::TYPE,
            UniqueAutomationRequest::TYPE,
            UniqueAutomationResponse::TYPE,
            TaskPlanOptions::TYPE,
            ServiceStatus::TYPE,
        ]
    }

    fn take(&mut self, heard: &Heard<'_>, post: &mut Post<'_>) {
        let object = heard.object;
        if self.world.take(object) {
            return;
        }
        if let Some(request) = object.get::<RouteRequest>() {
            self.routes(request, post);
        } else if let Some(response) = object.get::<RoutePlanResponse>() {
            self.response(response, heard.source, post);
        } else if let Some(request) = object.get::<UniqueAutomationRequest>() {
            self.begin(request, post);
        } else if let Some(options) = object.get::<TaskPlanOptions>() {
            self.options(options, post);
        } else if let Some(response) = object.get::<UniqueAutomationResponse>() {
            self.forget(response.response_id);
        } else if let Some(status) = object.get::<ServiceStatus>() {
            self.status(status);
        }
    }

    fn gone(&mut self, source: Source, post: &mut Post<'_>) {
        for mailbox in self.planners.lost(source) {
            self.unanswered(mailbox, source, post);
        }
    }

    fn wake(&mut self, post: &mut Post<'_>) {
        for (mailbox, planner) in self.planners.overdue(post.now().monotonic) {
            self.unanswered(mailbox, planner, post);
        }
    }

    fn deadline(&self) -> Option<Monotonic> {
        self.planners.deadline()
    }
}
