//! The contract of a valid request, and what becomes of requests.

use super::{Validator, ValidatorConfig, check, failure};
use crate::service::{Action, Outbox};
use crate::uxas::machine::{Heard, Machine, Post};
use crate::uxas::world::World;
use aldis_envelope::lmcp::cmasi::{
    AbstractZone, AirVehicleConfiguration, AirVehicleState, AutomationRequest, AutomationResponse,
    EntityConfiguration, EntityState, KeepInZone, KeepOutZone, MissionCommand, OperatingRegion,
    PointSearchTask,
};
use aldis_envelope::lmcp::impact::{ImpactAutomationRequest, ImpactAutomationResponse};
use aldis_envelope::lmcp::uxtask::{
    PlanningState, TaskAutomationRequest, TaskAutomationResponse, TaskInitialized, UniqueAutomationRequest,
    UniqueAutomationResponse,
};
use aldis_envelope::lmcp::{Object, Ref, decode};
use aldis_envelope::{EntityId, Monotonic, Now, ServiceId, Source, Wall};
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

fn source() -> Source {
    Source::new(EntityId::new(100).unwrap(), ServiceId::new(100).unwrap())
}

/// What a validator sends when it hears a message at a millisecond; none: its deadline.
fn hear(validator: &mut Validator, ms: u64, object: Option<&dyn Object>) -> Vec<Box<dyn Object>> {
    let mut out = Outbox::new(source());
    let now = Now { monotonic: Monotonic::since_start(Duration::from_millis(ms)), wall: Wall(0) };
    let mut post = Post::new(now, &mut out);
    match object {
        Some(object) => validator.take(&Heard { object, source: source() }, &mut post),
        None => validator.wake(&mut post),
    }
    let sent = out.drain().filter_map(|action| match action {
        Action::Send(message) => decode(&message.content).ok(),
        _ => None,
    });
    sent.collect()
}

fn point(id: i64) -> PointSearchTask {
    let mut task = PointSearchTask::default();
    task.base.base.task_id = id;
    task
}

fn known() -> Vec<Box<dyn Object>> {
    let mut known: Vec<Box<dyn Object>> = Vec::new();
    for id in [400, 500] {
        let (mut entity, mut state) = (AirVehicleConfiguration::default(), AirVehicleState::default());
        (entity.id, state.id) = (id, id);
        known.push(Box::new(entity));
        known.push(Box::new(state));
    }
    let (mut keep_in, mut keep_out) = (KeepInZone::default(), KeepOutZone::default());
    (keep_in.zone_id, keep_out.zone_id) = (1, 2);
    known.push(Box::new(keep_in));
    known.push(Box::new(keep_out));
    known.push(Box::new(OperatingRegion { id: 3, keep_in_areas: vec![1], keep_out_areas: vec![2] }));
    for id in [1000, 1001] {
        known.push(Box::new(point(id)));
    }
    known
}

fn validator() -> Validator {
    let mut validator = Validator::new(ValidatorConfig::default());
    for object in known() {
        assert!(hear(&mut validator, 0, Some(object.as_ref())).is_empty());
    }
    hear(&mut validator, 0, Some(&TaskInitialized { task_id: 1000 }));
    validator
}

fn request(tasks: &[i64]) -> AutomationRequest {
    AutomationRequest {
        entity_list: vec![400, 500],
        task_list: tasks.to_vec(),
        operating_region: 3,
        ..AutomationRequest::default()
    }
}

fn unique(sent: &[Box<dyn Object>]) -> Option<UniqueAutomationRequest> {
    sent.iter().find_map(|object| object.get::<UniqueAutomationRequest>().cloned())
}

#[test]
fn a_valid_request_goes_on_unchanged_and_its_answer_comes_back_in_its_kind() {
    let mut validator = validator();
    let asked = request(&[1000]);
    let sent = hear(&mut validator, 1, Some(&asked));
    let going = unique(&sent).unwrap();
    assert_eq!(going.original_request.get(), Some(&asked));
    assert!(!going.sand_box_request);
    let mut plan = AutomationResponse::default();
    plan.mission_command_list.push(Ref::new(MissionCommand::default()));
    let mut answer = UniqueAutomationResponse {
        response_id: 12_345,
        original_response: Ref::new(plan.clone()),
        ..Default::default()
    };
    assert!(hear(&mut validator, 2, Some(&answer)).is_empty(), "it is of another request");
    answer.response_id = going.request_id;
    let sent = hear(&mut validator, 3, Some(&answer));
    assert_eq!(sent[0].get::<AutomationResponse>(), Some(&plan));
    assert_eq!(validator.deadline(), None);

    let task = TaskAutomationRequest {
        request_id: 77,
        original_request: Ref::new(asked.clone()),
        ..Default::default()
    };
    assert_eq!(unique(&hear(&mut validator, 4, Some(&task))).unwrap().request_id, 77);
    answer.response_id = 77;
    let sent = hear(&mut validator, 5, Some(&answer));
    assert_eq!(sent[0].get::<TaskAutomationResponse>().unwrap().response_id, 77);

    let impact = ImpactAutomationRequest {
        request_id: 88,
        trial_request: Ref::new(asked),
        play_id: 5,
        ..Default::default()
    };
    assert!(unique(&hear(&mut validator, 6, Some(&impact))).unwrap().sand_box_request);
    answer.response_id = 88;
    let sent = hear(&mut validator, 7, Some(&answer));
    let told = sent[0].get::<ImpactAutomationResponse>().unwrap();
    assert_eq!((told.response_id, told.play_id, told.sandbox), (88, 5, true));
}

#[test]
fn requests_go_one_at_a_time_and_one_that_waits_for_its_tasks_holds_up_no_other() {
    let mut validator = validator();
    assert!(unique(&hear(&mut validator, 0, Some(&request(&[1001])))).is_none(), "1001 is not initialized");
    let first = unique(&hear(&mut validator, 10, Some(&request(&[1000])))).unwrap();
    assert!(unique(&hear(&mut validator, 20, Some(&request(&[1000])))).is_none());
    let answer = UniqueAutomationResponse { response_id: first.request_id, ..Default::default() };
    let second = unique(&hear(&mut validator, 30, Some(&answer))).unwrap();
    assert!(second.request_id > first.request_id);
    // The first, whose task never came to be.
    let sent = hear(&mut validator, 5000, None);
    let told = sent.iter().find_map(|object| object.get::<AutomationResponse>()).unwrap();
    assert!(failure(told).unwrap().contains("not initialized: [1001]"));
    // And the one in flight, which nobody answers.
    assert_eq!(validator.deadline(), Some(Monotonic::since_start(Duration::from_millis(5030))));
    let sent = hear(&mut validator, 5030, None);
    let told = sent.iter().find_map(|object| object.get::<AutomationResponse>()).unwrap();
    assert!(failure(told).unwrap().contains("no TaskPlanOptions of task [1000]"));
    // A task that is told again must be initialized again.
    hear(&mut validator, 6000, Some(&point(1000)));
    assert!(unique(&hear(&mut validator, 6001, Some(&request(&[1000])))).is_none());
    assert!(unique(&hear(&mut validator, 6002, Some(&TaskInitialized { task_id: 1000 }))).is_some());
}

#[test]
fn an_error_of_the_request_ends_it_and_another_error_is_told_with_its_end() {
    let mut validator = validator();
    let number = unique(&hear(&mut validator, 0, Some(&request(&[1000])))).unwrap().request_id;
    let status = |request: i64, why: &str| {
        let mut out = Outbox::new(source());
        Post::new(Now { monotonic: Monotonic::START, wall: Wall(0) }, &mut out).failed(request, why);
        let Some(Action::Send(message)) = out.drain().next() else { panic!("a status is sent") };
        decode(&message.content).unwrap()
    };
    assert!(hear(&mut validator, 1, Some(status(number + 1, "of another").as_ref())).is_empty());
    let sent = hear(&mut validator, 2, Some(status(number, "no route").as_ref()));
    let why = failure(sent[0].get::<AutomationResponse>().unwrap()).unwrap();
    assert!(why.contains("no route") && why.contains("of another"), "{why}");
    assert_eq!(validator.deadline(), None);
}

fn some_ids() -> impl Strategy<Value = BTreeSet<i64>> {
    prop::collection::btree_set(1..5_i64, 0..4)
}

proptest! {
    /// A request is valid exactly where its entities, its region and its tasks are known.
    #[test]
    fn the_contract_of_a_valid_request(
        configured in some_ids(), stated in some_ids(), planned in some_ids(), asked in some_ids(),
        zones in some_ids(), wanted in some_ids(), region in 0..3_i64, tasks in some_ids(), named in some_ids(),
    ) {
        let mut world = World::default();
        for &id in &configured {
            world.take(&EntityConfiguration { id, ..EntityConfiguration::default() });
        }
        for &id in &stated {
            world.take(&EntityState { id, ..EntityState::default() });
        }
        for &id in &zones {
            world.take(&AbstractZone { zone_id: id, ..AbstractZone::default() });
        }
        world.take(&OperatingRegion { id: 1, keep_in_areas: Vec::new(), keep_out_areas: wanted.iter().copied().collect() });
        let tasks: BTreeMap<i64, Box<dyn Object>> =
            tasks.iter().map(|&id| (id, Box::new(PointSearchTask::default()) as Box<dyn Object>)).collect();
        let original = AutomationRequest {
            entity_list: asked.iter().copied().collect(),
            task_list: named.iter().copied().collect(),
            operating_region: region,
            ..AutomationRequest::default()
        };
        let states = planned.iter().map(|&entity_id| Ref::new(PlanningState { entity_id, ..PlanningState::default() }));
        let request = UniqueAutomationRequest {
            original_request: Ref::new(original),
            planning_states: states.collect(),
            ..UniqueAutomationRequest::default()
        };
        let has_state = |id: &i64| stated.contains(id) || planned.contains(id);
        let entities = match asked.is_empty() {
            true => configured.iter().any(has_state),
            false => asked.iter().all(|id| configured.contains(id) && has_state(id)),
        };
        let in_region = region == 0 || region == 1 && wanted.is_subset(&zones);
        let all_tasks = !named.is_empty() && named.iter().all(|id| tasks.contains_key(id));
        let before = request.clone();
        prop_assert_eq!(check(&world, &tasks, &request).is_ok(), entities && in_region && all_tasks);
        prop_assert_eq!(before, request);
    }
}
