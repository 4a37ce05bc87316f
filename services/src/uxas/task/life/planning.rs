//! A task answers requests: options first, waypoints of the chosen one then.

use super::super::state::{State, Trigger};
use super::super::{Choice, Offer, Seen, Stretch, Within, composition};
use super::{Asked, Context, Life, WORKS_MAX, Work};
use crate::uxas::vehicle::Vehicle;
use aldis_envelope::lmcp::route::{
    EgressRouteRequest, EgressRouteResponse, RouteConstraints, RoutePlan, RoutePlanRequest, RoutePlanResponse,
};
use aldis_envelope::lmcp::uxtask::{
    FootprintRequest, SensorFootprintRequests, SensorFootprintResponse, TaskOption, TaskPlanOptions,
    UniqueAutomationRequest,
};
use aldis_envelope::lmcp::{Ref, Text};
use std::collections::BTreeMap;
use std::time::Duration;

/// How long roads are waited for: nobody may know any.
const EGRESS_WITHIN: Duration = Duration::from_secs(1);

impl Life {
    /// A request has come: where the task is part of it, its options are made.
    pub fn requested(&mut self, request: &UniqueAutomationRequest, context: &mut Context<'_, '_>) {
        let number = request.request_id;
        let asked = request.original_request.get().is_some_and(|asked| asked.task_list.contains(&self.id));
        if !asked || self.state == State::Init || self.works.contains_key(&number) {
            return;
        }
        if !request.sand_box_request {
            self.interrupt(context);
        }
        if self.works.len() >= WORKS_MAX {
            self.works.pop_first();
        }
        let mut work = Work {
            state: State::Idle,
            request: request.clone(),
            seen: Seen::default(),
            footprints: None,
            egress: None,
            offer: None,
            costs: Vec::new(),
            routes: BTreeMap::new(),
        };
        work.state.step(Trigger::Requested);
        let entities = request.original_request.get().map_or(&[][..], |asked| &asked.entity_list);
        let view = self.view(context, entities);
        if view.vehicles.is_empty() {
            let why = format!(
                "task {}: no eligible vehicle: add one of {:?} to the request",
                self.id, self.eligible
            );
            return self.fail(number, &why, context);
        }
        let looks = self.kind.looks(&view);
        if !looks.is_empty() {
            let footprints = looks.into_iter().zip(1..).map(|(look, id)| {
                let gsd =
                    if look.ground_sample_distance_m < 0.01 { 1000.0 } else { look.ground_sample_distance_m };
                Ref::new(FootprintRequest {
                    footprint_request_id: id,
                    vehicle_id: look.vehicle,
                    eligible_wavelengths: look.bands,
                    ground_sample_distances: vec![gsd],
                    // In radians, as all senders and receivers of the reference have it, whatever the model says.
                    elevation_angles: vec![look.elevation_rad as f32],
                    ..FootprintRequest::default()
                })
            });
            let request_id = context.numbers.next(self.id);
            work.footprints = Some(request_id);
            context.post.broadcast(&SensorFootprintRequests { request_id, footprints: footprints.collect() });
        }
        if let Some((place, radius)) = self.kind.egress() {
            let request_id = context.numbers.next(self.id);
            work.egress = Some((request_id, context.post.now().monotonic + EGRESS_WITHIN));
            context.post.broadcast(&EgressRouteRequest {
                request_id,
                start_location: Ref::new(place),
                radius,
            });
        }
        self.works.insert(number, work);
        self.sensed(number, context);
    }

    /// What sensors see has come.
    pub fn footprints(&mut self, response: &SensorFootprintResponse, context: &mut Context<'_, '_>) {
        let found = self.works.iter_mut().find(|(_, work)| work.footprints == Some(response.response_id));
        let Some((&number, work)) = found else { return };
        work.footprints = None;
        work.seen.footprints = response.footprints.iter().filter_map(|one| one.get().cloned()).collect();
        self.sensed(number, context);
    }

    /// The roads out of a place have come.
    pub fn egress(&mut self, response: &EgressRouteResponse, context: &mut Context<'_, '_>) {
        let is_it = |work: &Work| work.egress.is_some_and(|(number, _)| number == response.response_id);
        let Some((&number, work)) = self.works.iter_mut().find(|(_, work)| is_it(work)) else { return };
        work.egress = None;
        work.seen.egress = response.node_locations.iter().filter_map(|one| one.get().cloned()).collect();
        self.sensed(number, context);
    }

    /// Gives up waiting for roads.
    pub fn wake(&mut self, context: &mut Context<'_, '_>) {
        let now = context.post.now().monotonic;
        let late = self.works.iter().filter(|(_, work)| work.egress.is_some_and(|(_, at)| at <= now));
        for number in late.map(|(&number, _)| number).collect::<Vec<_>>() {
            let why = format!(
                "task {}: nobody answers EgressRouteRequest: run a planner of roads (OsmPlanner)",
                self.id
            );
            self.fail(number, &why, context);
        }
    }

    /// Ends a request of the task with a cause, which goes to whoever waits.
    fn fail(&mut self, number: i64, why: &str, context: &mut Context<'_, '_>) {
        self.works.remove(&number);
        context.post.failed(number, why);
    }

    /// Once nothing is awaited any more: makes the offer and asks for the ways within.
    fn sensed(&mut self, number: i64, context: &mut Context<'_, '_>) {
        let Some(work) = self.works.get(&number) else { return };
        if work.footprints.is_some() || work.egress.is_some() {
            return;
        }
        let asked = work.request.original_request.get();
        let (entities, region) =
            asked.map_or((&[][..], 0), |asked| (&asked.entity_list, asked.operating_region));
        let view = self.view(context, entities);
        let offer = match self.kind.offer(&view, &work.seen) {
            Ok(offer) => offer,
            Err(why) => {
                let why = format!("task {}: {why}", self.id);
                return self.fail(number, &why, context);
            }
        };
        let mut by_vehicle: BTreeMap<i64, (Vec<usize>, Vec<RouteConstraints>)> = BTreeMap::new();
        for (place, choice) in offer.choices.iter().enumerate() {
            let (Within::Stretches(stretches), Some(&vehicle)) = (&choice.within, choice.eligible.first())
            else {
                continue;
            };
            let (choices, routes) = by_vehicle.entry(vehicle).or_default();
            for stretch in stretches {
                routes.push(constraints(choices.len() as i64, stretch));
                choices.push(place);
            }
        }
        let mut requests = Vec::new();
        for (vehicle, (choices, routes)) in by_vehicle {
            let mut request = self.route_request(vehicle, region, routes, context);
            request.is_cost_only_request = true;
            requests.push((request, choices, view_medium(&view.vehicles, vehicle)));
        }
        let Some(work) = self.works.get_mut(&number) else { return };
        work.state.step(Trigger::Sensed);
        let cost = |choice: &Choice| match choice.within {
            Within::Places(_, time_ms) => Ok(time_ms),
            Within::Stretches(_) => Ok(0),
        };
        work.costs = offer.choices.iter().map(cost).collect();
        work.offer = Some(offer);
        for (request, choices, mailbox) in requests {
            work.routes.insert(request.request_id, Asked::Options(choices));
            context.ask_planner(mailbox, &request);
        }
        self.routed(number, context);
    }

    pub(super) fn route_request(
        &self,
        vehicle_id: i64,
        operating_region: i64,
        routes: Vec<RouteConstraints>,
        context: &mut Context<'_, '_>,
    ) -> RoutePlanRequest {
        RoutePlanRequest {
            request_id: context.numbers.next(self.id),
            associated_task_id: self.id,
            vehicle_id,
            operating_region,
            route_requests: routes.into_iter().map(Ref::new).collect(),
            is_cost_only_request: false,
        }
    }

    /// Routes have come. Whether they were its own.
    pub fn routes(&mut self, response: &RoutePlanResponse, context: &mut Context<'_, '_>) {
        let number = response.response_id;
        if self.steered(response, context) {
            return;
        }
        let Some((&request, work)) =
            self.works.iter_mut().find(|(_, work)| work.routes.contains_key(&number))
        else {
            return;
        };
        match work.routes.remove(&number) {
            Some(Asked::Options(choices)) => {
                for plan in response.route_responses.iter().filter_map(|plan| plan.get()) {
                    let place = usize::try_from(plan.route_id).ok().and_then(|route| choices.get(route));
                    let Some(cost) = place.and_then(|&place| work.costs.get_mut(place)) else { continue };
                    match (&cost, plan.route_cost) {
                        (Ok(sum), time @ 0..) => *cost = Ok(sum.saturating_add(time)),
                        (Ok(_), _) => *cost = Err(route_error(plan)),
                        (Err(_), _) => {}
                    }
                }
                self.routed(request, context);
            }
            Some(Asked::Final(asked)) => self.implement(request, &asked, response, context),
            None => {}
        }
    }

    /// Nobody answers a request for routes any more.
    pub fn unrouted(&mut self, number: i64, why: &str, context: &mut Context<'_, '_>) {
        if let Some(sent) = self.sent.values_mut().find(|sent| sent.asked == Some(number)) {
            sent.asked = None;
            return;
        }
        let found = self.works.iter().find(|(_, work)| work.routes.contains_key(&number));
        if let Some(request) = found.map(|(&request, _)| request) {
            self.fail(request, &format!("task {}: {why}", self.id), context);
        }
    }

    /// Once all ways within options are known: tells the options that can be done.
    fn routed(&mut self, number: i64, context: &mut Context<'_, '_>) {
        let Some(work) = self.works.get_mut(&number) else { return };
        if !work.routes.is_empty() || work.state != State::OptionRoutes {
            return;
        }
        let Some(offer) = &mut work.offer else { return };
        let cost_of: BTreeMap<i64, &Result<i64, String>> =
            offer.choices.iter().map(|choice| choice.id).zip(&work.costs).collect();
        let is_dead = |id: i64| cost_of.get(&id).is_none_or(|cost| cost.is_err());
        let Some(left) = composition::without(&offer.composition, &is_dead) else {
            let first = work.costs.iter().find_map(|cost| cost.as_ref().err().cloned()).unwrap_or_default();
            let why = format!("task {}: no route within any of its options: {first}", self.id);
            return self.fail(number, &why, context);
        };
        let alive: Vec<i64> = left.atoms().into_iter().copied().collect();
        let option = |choice: &Choice| TaskOption {
            task_id: self.id,
            option_id: choice.id,
            eligible_entities: choice.eligible.clone(),
            cost: cost_of.get(&choice.id).and_then(|cost| cost.as_ref().ok()).copied().unwrap_or(0),
            start_location: Ref::new(choice.start.clone()),
            start_heading: choice.start_heading,
            end_location: Ref::new(choice.end.clone()),
            end_heading: choice.end_heading,
        };
        let options = offer.choices.iter().filter(|choice| alive.contains(&choice.id)).map(option);
        let told = TaskPlanOptions {
            corresponding_automation_request_id: number,
            task_id: self.id,
            composition: Text::new(composition::text(&left)),
            options: options.map(Ref::new).collect(),
        };
        offer.composition = left;
        work.state.step(Trigger::Routed);
        context.post.broadcast(&told);
    }
}

pub(super) fn find(offer: &Offer, option: i64) -> Option<&Choice> {
    offer.choices.iter().find(|choice| choice.id == option)
}

fn view_medium(vehicles: &[Vehicle], id: i64) -> &'static str {
    let found = vehicles.iter().find(|vehicle| vehicle.id == id);
    found.map_or("AircraftPathPlanner", |vehicle| vehicle.medium.mailbox())
}

pub(super) fn constraints(route_id: i64, stretch: &Stretch) -> RouteConstraints {
    let (start_heading, end_heading) = stretch.headings.unwrap_or_default();
    let is_headed = stretch.headings.is_some();
    RouteConstraints {
        route_id,
        start_location: Ref::new(stretch.from.clone()),
        start_heading,
        use_start_heading: is_headed,
        end_location: Ref::new(stretch.to.clone()),
        end_heading,
        use_end_heading: is_headed,
    }
}

/// Why a planner found no route.
pub(crate) fn route_error(plan: &RoutePlan) -> String {
    let texts: Vec<_> =
        plan.route_error.iter().filter_map(|pair| pair.get()).map(|pair| pair.value.as_str()).collect();
    if texts.is_empty() { "its planner does not say why".to_owned() } else { texts.join("; ") }
}
