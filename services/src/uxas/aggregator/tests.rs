//! What the aggregator promises, with messages in any order, lost and doubled.
//!
//! (a) every number that is open belongs to one request; (b) an answer goes out only when all its plans are in; (c) no request
//! is lost: each is pending or answered; (d) no plan is lost; (e) nothing of what is over is kept.

use super::{Aggregator, AggregatorConfig, Waits};
use crate::service::{Action, Outbox};
use crate::uxas::machine::{Heard, Machine, Post};
use aldis_envelope::lmcp::cmasi::{
    AirVehicleConfiguration, AirVehicleState, AutomationRequest, Location3D, ServiceStatus,
};
use aldis_envelope::lmcp::route::{
    RouteConstraints, RoutePlan, RoutePlanRequest, RoutePlanResponse, RouteRequest, RouteResponse,
};
use aldis_envelope::lmcp::uxtask::{
    AssignmentCostMatrix, TaskOption, TaskPlanOptions, UniqueAutomationRequest,
};
use aldis_envelope::lmcp::{Object, Ref, decode};
use aldis_envelope::{EntityId, Monotonic, Now, ServiceId, Source, Wall};
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

fn source(service: u64) -> Source {
    Source::new(EntityId::new(100).unwrap(), ServiceId::new(service).unwrap())
}

fn hear(aggregator: &mut Aggregator, object: &dyn Object) -> Vec<Box<dyn Object>> {
    let mut out = Outbox::new(source(105));
    let now = Now { monotonic: Monotonic::START, wall: Wall(0) };
    aggregator.take(&Heard { object, source: source(104) }, &mut Post::new(now, &mut out));
    sent(&mut out)
}

fn sent(out: &mut Outbox) -> Vec<Box<dyn Object>> {
    let messages = out.drain().filter_map(|action| match action {
        Action::Send(message) => decode(&message.content).ok(),
        _ => None,
    });
    messages.collect()
}

fn fleet(vehicles: i64) -> Aggregator {
    let mut aggregator = Aggregator::new(AggregatorConfig::default());
    for id in 1..=vehicles {
        let mut entity = AirVehicleConfiguration::default();
        (entity.id, entity.nominal_speed) = (id, 20.0);
        let mut state = AirVehicleState::default();
        (state.id, state.location) = (id, Ref::new(Location3D::default()));
        hear(&mut aggregator, &entity);
        hear(&mut aggregator, &state);
    }
    aggregator
}

fn request(number: i64, tasks: i64) -> UniqueAutomationRequest {
    let original = AutomationRequest { task_list: (1..=tasks).collect(), ..AutomationRequest::default() };
    UniqueAutomationRequest { request_id: number, original_request: Ref::new(original), ..Default::default() }
}

fn options(number: i64, task: i64, count: i64) -> TaskPlanOptions {
    let option = |option_id| Ref::new(TaskOption { task_id: task, option_id, ..TaskOption::default() });
    TaskPlanOptions {
        corresponding_automation_request_id: number,
        task_id: task,
        options: (1..=count).map(option).collect(),
        ..TaskPlanOptions::default()
    }
}

/// A planner's answer; every `fails`th route cannot be.
fn plan(asked: &RoutePlanRequest, fails: i64) -> RoutePlanResponse {
    let route = |asked: &RouteConstraints| {
        let route_cost = if fails > 0 && asked.route_id % fails == 0 { -1 } else { asked.route_id % 1000 };
        Ref::new(RoutePlan { route_id: asked.route_id, route_cost, ..RoutePlan::default() })
    };
    RoutePlanResponse {
        response_id: asked.request_id,
        vehicle_id: asked.vehicle_id,
        route_responses: asked.route_requests.iter().map(|one| route(one.get().unwrap())).collect(),
        ..RoutePlanResponse::default()
    }
}

fn holds_a(aggregator: &Aggregator) {
    for (number, (waits, _)) in &aggregator.asked {
        let in_gatherings =
            aggregator.gatherings.values().filter(|one| one.open.contains_key(number)).count();
        match waits {
            Waits::Routes(own) => {
                assert!(aggregator.gatherings[own].open.contains_key(number));
                assert_eq!(in_gatherings, 1);
            }
            Waits::Collection(request) => {
                assert!(aggregator.collections.contains_key(request));
                assert_eq!(in_gatherings, 0);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn promises_hold_in_any_order(seed in any::<u64>(), loss in 0..4_u32, vehicles in 1..4_i64) {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut aggregator = fleet(vehicles);
        // What is on its way to the aggregator, in any order; and what each request still waits for.
        let mut road: Vec<Box<dyn Object>> = Vec::new();
        let mut lost: BTreeMap<i64, bool> = BTreeMap::new();
        let mut matrices: BTreeMap<i64, usize> = BTreeMap::new();
        let mut answers: BTreeMap<i64, Vec<usize>> = BTreeMap::new();
        for number in 1..=3 {
            road.push(Box::new(request(number, 2)));
            road.push(Box::new(options(number, 1, 2)));
            road.push(Box::new(options(number, 2, 1)));
            let routes = vec![Ref::new(RouteConstraints { route_id: 1, ..RouteConstraints::default() })];
            road.push(Box::new(RouteRequest { request_id: 50 + number, route_requests: routes, ..RouteRequest::default() }));
        }
        // Requests come before what they are about; all else in any order.
        random.shuffle(&mut road);
        road.sort_by_key(|object| object.get::<UniqueAutomationRequest>().is_none());
        road.reverse();
        let mut gone: BTreeSet<i64> = BTreeSet::new();
        while let Some(object) = road.pop() {
            let times = if random.u32(..4) == 0 { 2 } else { 1 };
            for _ in 0..times {
                for told in hear(&mut aggregator, object.as_ref()) {
                    if let Some(asked) = told.get::<RoutePlanRequest>() {
                        let is_lost = loss > 0 && random.u32(..10) < loss;
                        lost.insert(asked.request_id, is_lost);
                        if is_lost {
                            gone.insert(asked.request_id);
                        } else {
                            let place = random.usize(..=road.len());
                            road.insert(place, Box::new(plan(asked, 3)));
                        }
                    } else if let Some(matrix) = told.get::<AssignmentCostMatrix>() {
                        *matrices.entry(matrix.corresponding_automation_request_id).or_default() += 1;
                        // Each vehicle: three options from its place, two and two between the tasks; a third of them cannot be.
                        let all = 7 * vehicles as usize;
                        prop_assert!(matrix.cost_matrix.len() < all && matrix.cost_matrix.len() >= all / 2);
                    } else if let Some(answer) = told.get::<RouteResponse>() {
                        answers.entry(answer.response_id).or_default().push(answer.routes.len());
                    }
                }
                holds_a(&aggregator);
            }
        }
        // (b), (d): a matrix is whole, an answer has all vehicles.
        prop_assert!(answers.values().flatten().all(|&routes| routes == vehicles as usize));
        prop_assert!(matrices.values().all(|&count| count == 1));
        // (c): what is not answered waits for a plan that is lost, and for nothing else.
        let open: BTreeSet<i64> = aggregator.asked.keys().copied().collect();
        prop_assert_eq!(&open, &gone);
        if gone.is_empty() {
            prop_assert_eq!(matrices.len(), 3);
            prop_assert_eq!(answers.len(), 3);
            // (e)
            prop_assert!(aggregator.is_idle());
        }
    }
}

#[test]
fn options_of_another_request_are_not_used_and_an_error_ends_all() {
    let mut aggregator = fleet(1);
    assert!(hear(&mut aggregator, &options(6, 1, 1)).is_empty(), "nobody asked");
    hear(&mut aggregator, &request(7, 1));
    assert!(hear(&mut aggregator, &options(6, 1, 1)).is_empty(), "they are of request 6");
    let asked = hear(&mut aggregator, &options(7, 1, 1));
    assert_eq!(asked.len(), 1);
    let mut out = Outbox::new(source(107));
    Post::new(Now { monotonic: Monotonic::START, wall: Wall(0) }, &mut out).failed(7, "no more");
    let told = sent(&mut out);
    assert!(told[0].get::<ServiceStatus>().is_some());
    hear(&mut aggregator, told[0].as_ref());
    assert!(aggregator.is_idle());
}

#[test]
fn a_planner_that_is_gone_fails_what_waits_for_it() {
    let mut aggregator = fleet(1);
    for number in [7, 8] {
        hear(&mut aggregator, &request(number, 1));
        let asked = hear(&mut aggregator, &options(number, 1, 1));
        if number == 7 {
            hear(&mut aggregator, &plan(asked[0].get::<RoutePlanRequest>().unwrap(), 0));
        }
    }
    let mut out = Outbox::new(source(105));
    aggregator
        .gone(source(104), &mut Post::new(Now { monotonic: Monotonic::START, wall: Wall(0) }, &mut out));
    let told = sent(&mut out);
    let status = told[0].get::<ServiceStatus>().unwrap();
    assert!(status.info[0].get().unwrap().value.contains("is gone"), "{status:?}");
    assert_eq!(status.info[1].get().unwrap().value, "8");
    assert!(aggregator.is_idle());
}
