//! Against the reference's results, and against every plan there is.

use super::instance::{Related, line_searches, random_request};
use super::*;
use crate::plan::algebra::Unnamed;
use std::collections::BTreeMap;

fn planned(request: &Request) -> Plan {
    assign(request, Effort::default()).unwrap_or_else(|error| panic!("{error}\n{request:?}"))
}

/// A case of the reference, by name.
fn cases() -> BTreeMap<String, Request> {
    let Some(text) = crate::plan::tests::golden("assignment_semantics.json") else { return BTreeMap::new() };
    let cases: Vec<serde_json::Value> = serde_json::from_str(&text).unwrap();
    assert_eq!(cases.len(), 16);
    let request = |case: serde_json::Value| {
        let name = case["name"].as_str().unwrap().to_owned();
        let file: RequestFile = serde_json::from_value(case).unwrap();
        (name, file.request(Objective::MinMax, Precedence::Choice, Unnamed::Refuse))
    };
    cases.into_iter().map(request).collect()
}

/// Vehicle, task, option and completion, in the reference's order: by vehicle.
fn told(plan: &Plan) -> Vec<(i64, i64, i64, i64)> {
    let row = |a: &Assignment| (a.vehicle, a.task, a.option, a.completed_ms);
    let mut rows: Vec<_> = plan.assignments.iter().map(row).collect();
    rows.sort_by_key(|row| row.0);
    rows
}

#[test]
fn plans_are_those_of_the_reference_or_repaired() {
    let cases = cases();
    if cases.is_empty() {
        return;
    }
    let both = || vec![(1, 1, 10, 6000), (2, 2, 10, 4000)];
    let plans: [(&str, Vec<_>); 7] = [
        ("parallel default", both()),
        ("sequential .(p1 p2) across vehicles", both()),
        ("alternative +(p1 p2)", vec![(2, 2, 10, 4000)]),
        ("relationship \"p1 \"", vec![]),
        ("tie", vec![(1, 1, 10, 6000), (2, 2, 10, 6000)]),
        // Repaired: an empty list means all, at the full cost.
        ("empty eligible list", both()),
        // Repaired: ids are not mixed up, so both tasks are done.
        ("option id >=100000", vec![(1, 1, 100_010, 6000), (2, 2, 10, 4000)]),
    ];
    for (name, expected) in plans.into_iter().filter(|(_, expected)| !expected.is_empty()) {
        let plan = planned(&cases[name]);
        assert_eq!(told(&plan), expected, "{name}");
        assert!(plan.certificate.proven && plan.certificate.gap == 0.0, "{name}");
        evaluate(&cases[name], &plan.assignments).unwrap();
    }
    // Repaired: who is not eligible does not do it.
    let plan = planned(&cases["vehicle 2 not eligible but rows exist"]);
    assert_eq!(told(&plan), [(1, 1, 10, 6000), (1, 2, 10, 107_000)]);
    // A task that the relationships leave out is a mistake, unless that is asked for.
    for name in ["relationship \"p1 \"", "relationship misses task 2"] {
        let refused = assign(&cases[name], Effort::default()).unwrap_err().to_string();
        assert!(refused.contains("task 2 is in the request"), "{name}: {refused}");
        let mut request = cases[name].clone();
        request.unnamed = Unnamed::LeaveOut;
        assert_eq!(told(&planned(&request)), [(1, 1, 10, 6000)], "{name}");
    }
    for (name, part) in [
        ("relationship p1 only (no delimiter)", "followed by a blank or `)`"),
        ("unknown task 9", "task 9 is not among the tasks"),
        ("unbalanced |(p1 p2", "followed by a blank or `)`"),
        ("composition without delimiter", "the composition of task 1, character 1"),
        ("empty composition", "the composition of task 1, character 1: there is no operator"),
        ("negative TimeToGo everywhere for task2", "task 2: no route from anywhere"),
        ("no rows for task2", "task 2: no route from anywhere"),
    ] {
        let refused = assign(&cases[name], Effort::default()).unwrap_err().to_string();
        assert!(refused.contains(part), "{name}: {refused}");
    }
}

#[test]
fn what_comes_later_waits_where_that_is_asked() {
    let Some(mut request) = cases().remove("sequential .(p1 p2) across vehicles") else { return };
    request.precedence = Precedence::Temporal;
    let plan = planned(&request);
    // Vehicle 2 is there at 3 000 ms and waits until task 1 is complete.
    assert_eq!(told(&plan), [(1, 1, 10, 6000), (2, 2, 10, 7000)]);
    assert_eq!(plan.assignments[1].threshold_ms, 6000);
    assert_eq!(evaluate(&request, &plan.assignments).unwrap().makespan_ms, 7000);
}

/// Compares with every plan there is; whether there is one.
fn compare(request: &Request) -> bool {
    let expected = exhaustive(request).unwrap();
    match (assign(request, Effort::default()), expected) {
        (Ok(plan), Some(expected)) => {
            assert!(plan.certificate.proven, "{request:?}");
            assert_eq!((plan.makespan_ms, plan.total_ms), expected, "{request:?}\n{plan:?}");
            let checked =
                evaluate(request, &plan.assignments).unwrap_or_else(|why| panic!("{why}\n{request:?}"));
            assert_eq!((checked.makespan_ms, checked.total_ms), expected);
            true
        }
        (Err(AssignError::Infeasible(_)), None) => false,
        (found, expected) => panic!("{found:?} but {expected:?}\n{request:?}"),
    }
}

#[test]
fn no_plan_is_better_than_ours() {
    let (mut feasible, mut general) = (0, 0);
    for seed in 0..60 {
        let objective = [Objective::MinMax, Objective::Cumulative][seed as usize % 2];
        let (vehicles, tasks) = (1 + seed as i64 % 3, 1 + seed as i64 % 5);
        let parallel = random_request(seed, vehicles, tasks, 2, Related::Parallel, objective);
        feasible += usize::from(compare(&parallel));
        let related = random_request(seed, vehicles, tasks.min(4), 3, Related::General, objective);
        general += usize::from(compare(&related));
    }
    assert!(feasible > 40 && general > 40, "{feasible} and {general} of 60 have a plan");
}

#[test]
fn the_order_of_a_request_does_not_matter() {
    for (seed, related) in [(1, Related::Parallel), (2, Related::General)] {
        let mut request = random_request(seed, 3, 5, 2, related, Objective::MinMax);
        if related == Related::General {
            request.relationships = "|(.(p1 p2) +(p3 p4) p5)".to_owned();
        }
        let plan = planned(&request);
        request.vehicles.reverse();
        request.travel.reverse();
        if related == Related::General {
            request.relationships = "|(p5 |(+(p4 p3) .(p1 p2)))".to_owned();
        }
        assert_eq!(planned(&request), plan);
    }
}

#[test]
fn slices_end_at_the_same_plan() {
    let request = line_searches(3, 2, 30, 10_000.0, 1_000.0);
    let effort = Effort { nodes: 6_000, seed: 5 };
    let whole = assign(&request, effort).unwrap();
    let mut sliced = Assigner::new(&request, effort).unwrap();
    let mut last = sliced.plan().unwrap().makespan_ms;
    while sliced.work(500) {
        let now = sliced.plan().unwrap().makespan_ms;
        assert!(now <= last, "a slice made the plan worse");
        last = now;
    }
    assert_eq!(sliced.plan().unwrap(), whole);
    assert!(!whole.certificate.proven && whole.certificate.gap < 0.3, "{:?}", whole.certificate);
    assert_eq!(evaluate(&request, &whole.assignments).unwrap().makespan_ms, whole.makespan_ms);
}

#[test]
fn bounds_never_lie() {
    for seed in 0..20 {
        let objective = [Objective::MinMax, Objective::Cumulative][seed as usize % 2];
        let request = random_request(seed, 2, 5, 2, Related::Parallel, objective);
        let Ok(Some((makespan, total))) = exhaustive(&request) else { continue };
        let problem = Problem::new(&request).unwrap();
        let value = problem.value(makespan, total).0;
        let bound = bound::bound(&problem, value).unwrap();
        assert!(bound <= value, "{bound} > {value}: {request:?}");
    }
}

#[test]
fn who_cannot_is_told() {
    let mut request = random_request(4, 2, 3, 1, Related::Parallel, Objective::MinMax);
    request.tasks.get_mut(&2).unwrap().options.get_mut(&1).unwrap().eligible = vec![77];
    let refused = assign(&request, Effort::default()).unwrap_err().to_string();
    assert!(refused.contains("task 2: no eligible vehicle"), "{refused}");
    request.vehicles.clear();
    assert_eq!(assign(&request, Effort::default()).unwrap_err(), RequestError::NoVehicle.into());
}
