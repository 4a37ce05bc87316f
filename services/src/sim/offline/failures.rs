//! Each class of failure: the cause, in an answer of the request's kind, within 100 ms of what shows it.

use super::tests::{all, node, point, request, sea};
use super::{Offline, Played};
use crate::uxas::validator::failure;
use aldis_envelope::Monotonic;
use aldis_envelope::lmcp::cmasi::{AutomationRequest, AutomationResponse, PointSearchTask};
use aldis_envelope::lmcp::impact::{AngledAreaSearchTask, ImpactAutomationRequest, ImpactAutomationResponse};
use aldis_envelope::lmcp::uxtask::{
    TaskAutomationRequest, TaskAutomationResponse, UniqueAutomationRequest, UniqueAutomationResponse,
};
use aldis_envelope::lmcp::{Object, Ref};
use std::time::Duration;

/// What shows a failure is answered within this.
const AT_ONCE: Duration = Duration::from_millis(100);

/// The number of a request whose kind has one.
const NUMBER: i64 = 7;

/// The kinds of requests.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Asked {
    Plain,
    Impact,
    Task,
    /// Without a validator.
    Unique,
}

const KINDS: [Asked; 4] = [Asked::Plain, Asked::Impact, Asked::Task, Asked::Unique];

impl Asked {
    fn wrap(self, request: &AutomationRequest) -> Box<dyn Object> {
        let original_request = Ref::new(request.clone());
        match self {
            Self::Plain => Box::new(request.clone()),
            Self::Impact => Box::new(ImpactAutomationRequest {
                request_id: NUMBER,
                trial_request: original_request,
                play_id: 5,
                ..ImpactAutomationRequest::default()
            }),
            Self::Task => Box::new(TaskAutomationRequest {
                request_id: NUMBER,
                original_request,
                ..TaskAutomationRequest::default()
            }),
            Self::Unique => Box::new(UniqueAutomationRequest {
                request_id: NUMBER,
                original_request,
                ..UniqueAutomationRequest::default()
            }),
        }
    }

    /// The answers of this kind, each with its number and when it came.
    fn answers(self, heard: &[super::Overheard]) -> Vec<(AutomationResponse, i64, Monotonic)> {
        let inner = |one: &Ref<AutomationResponse>| one.get().cloned().unwrap_or_default();
        match self {
            Self::Plain => {
                all::<AutomationResponse>(heard).into_iter().map(|(one, at)| (one, NUMBER, at)).collect()
            }
            Self::Impact => all::<ImpactAutomationResponse>(heard)
                .into_iter()
                .map(|(one, at)| (inner(&one.trial_response), one.response_id, at))
                .collect(),
            Self::Task => all::<TaskAutomationResponse>(heard)
                .into_iter()
                .map(|(one, at)| (inner(&one.original_response), one.response_id, at))
                .collect(),
            Self::Unique => all::<UniqueAutomationResponse>(heard)
                .into_iter()
                .map(|(one, at)| (inner(&one.original_response), one.response_id, at))
                .collect(),
        }
    }
}

/// A node that knows these messages.
fn told(mut node: Offline, messages: Vec<Box<dyn Object>>) -> Offline {
    node.play(messages.into_iter().map(|object| Played { at: Duration::ZERO, object }).collect());
    node
}

/// Asks in a kind; the cause that the only answer of that kind tells, and how long it took.
fn refused(node: &mut Offline, kind: Asked, asked: &AutomationRequest) -> (String, Duration) {
    node.heard();
    let begin = node.now();
    node.play(vec![Played { at: begin.elapsed(), object: kind.wrap(asked) }]);
    let until = begin + Duration::from_secs(10);
    while node.step(until) {}
    let heard = node.heard();
    let answers = kind.answers(&heard);
    assert_eq!(answers.len(), 1, "{kind:?}: {:?}", node.notes);
    let (answer, number, at) = &answers[0];
    assert_eq!(*number, NUMBER, "{kind:?}");
    assert!(answer.mission_command_list.is_empty() && answer.vehicle_command_list.is_empty());
    for other in [Asked::Plain, Asked::Impact, Asked::Task].into_iter().filter(|other| *other != kind) {
        assert!(other.answers(&heard).is_empty(), "{kind:?} is answered as {other:?} too");
    }
    (failure(answer).expect("an answer without a plan says why"), *at - begin)
}

/// A request of the sea's.
fn asked(entities: &[i64], tasks: &[i64], relationships: &str, region: i64) -> AutomationRequest {
    request(entities, tasks, relationships, region).get::<AutomationRequest>().unwrap().clone()
}

/// Two boats, an island, points; a task for boat 2 alone, and one whose area nobody told.
fn world() -> Vec<Box<dyn Object>> {
    let mut told = sea();
    let mut private = point(200, 60.04, 20.0).get::<PointSearchTask>().unwrap().clone();
    private.eligible_entities = vec![2];
    told.push(Box::new(private));
    let mut angled = AngledAreaSearchTask { search_area_id: 77, ..AngledAreaSearchTask::default() };
    angled.task_id = 201;
    told.push(Box::new(angled));
    told
}

#[test]
fn each_failure_is_answered_at_once_with_its_cause_in_the_kind_of_the_request() {
    // What a validator finds, and what those behind it do.
    let checked = [
        (asked(&[1, 7], &[100], "", 9), "EntityConfiguration for Entity Id[7] not available"),
        (asked(&[1], &[100, 33], "", 9), "Task with the Id[33] is unknown"),
        (asked(&[1], &[100], "", 4), "OperatingRegion Id[4] not available"),
        (asked(&[1], &[100], "", 8), "KeepOutArea Id[55] not available"),
        (asked(&[1], &[], "", 9), "names no task"),
        (asked(&[1], &[201], "", 9), "AreaOfInterest Id[77] not available"),
    ];
    let planned = [
        (asked(&[1], &[100, 101], "|(p100 p101", 9), "character 8: the id after `p`"),
        (asked(&[1], &[100, 101], "|(p100 )", 9), "task 101 is in the request, but"),
        (asked(&[1], &[102], "", 9), "keep-out zone 5: the nearest way out is at latitude 60.02"),
        (asked(&[1], &[200], "", 9), "task 200: no eligible vehicle"),
    ];
    for kind in KINDS {
        let mut node = told(node(None, false), world());
        let checked = checked.iter().filter(|_| kind != Asked::Unique);
        for (request, cause) in checked.chain(&planned) {
            let (why, at) = refused(&mut node, kind, request);
            assert!(why.contains(cause), "{kind:?}: {why}\n  should tell\n{cause}");
            assert!(at <= AT_ONCE, "{kind:?}: {at:?} until {cause}");
        }
    }
}

#[test]
fn who_is_silent_is_named_when_the_time_is_over_in_the_kind_of_the_request() {
    let request = asked(&[1], &[100], "", 9);
    for (missing, cause) in [
        ("RoutePlannerVisibility", "no AssignmentCostMatrix"),
        ("RouteAggregator", "no AssignmentCostMatrix"),
        ("AssignmentTreeBranchBound", "no TaskAssignmentSummary"),
        ("PlanBuilder", "no UniqueAutomationResponse"),
        ("TaskManager", "not initialized: [100]"),
    ] {
        let mut node = told(node(Some(missing), false), sea());
        for kind in KINDS.into_iter().filter(|kind| *kind != Asked::Unique) {
            let (why, took) = refused(&mut node, kind, &request);
            assert!(why.contains(cause), "{kind:?}: {why}");
            let late = took.checked_sub(Duration::from_secs(5));
            assert!(late.is_some_and(|late| late <= AT_ONCE), "{kind:?} without {missing}: {took:?}");
        }
    }
}
