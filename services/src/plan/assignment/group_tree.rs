//! General process algebra where vehicles do not wait for each other: branching over the groups that may come next, each with all
//! its options at once.
//!
//! A state is what was done, in which order by whom, and for each option of what a vehicle did last the earliest end by it. So
//! options are not branched over: which are taken is settled for each vehicle alone, when its order is known.

use super::depth_first::{DepthFirst, State};
use super::problem::{NEVER, Problem};
use super::relax::Relaxation;
use super::schedule::Routes;
use crate::plan::algebra::{Algebra, Expression, Operator};

/// The most groups that a state holds, and of which a search is of use.
const GROUPS_MAX: usize = 40;

#[derive(Debug, Clone)]
pub(super) struct Groups {
    bound: (i64, i64),
    done: u128,
    /// The groups of each vehicle, in its order.
    orders: Vec<Vec<u8>>,
    /// For each vehicle, the earliest end by each option of its last group.
    ends: Vec<Vec<i64>>,
    /// What was added last.
    last: (u8, u8),
}

/// A search over groups, or none where a problem is not for it.
pub(super) fn search(problem: &Problem, relaxation: Relaxation) -> Option<DepthFirst<Groups>> {
    let waits = problem.temporal && problem.has_order();
    if waits || !problem.is_once() || problem.groups.len() > GROUPS_MAX {
        return None;
    }
    let vehicles = problem.vehicles.len();
    let root = Groups {
        bound: (0, 0),
        done: 0,
        orders: vec![Vec::new(); vehicles],
        ends: vec![vec![0]; vehicles],
        last: (0, 0),
    };
    let algebra = Algebra::new(&grouped(problem, &problem.expression), problem.groups.len());
    Some(DepthFirst::new(root, algebra, relaxation))
}

impl State for Groups {
    type Places = Vec<Option<u8>>;
    type Last = (u8, u8);

    const REMEMBERED_MAX: usize = 100_000;

    fn bound(&self) -> (i64, i64) {
        self.bound
    }

    fn done(&self) -> u128 {
        self.done
    }

    fn places(&self) -> Vec<Option<u8>> {
        self.orders.iter().map(|order| order.last().copied()).collect()
    }

    fn last(&self) -> (u8, u8) {
        self.last
    }

    fn times(&self) -> impl Iterator<Item = &i64> {
        self.ends.iter().flatten()
    }

    fn child(
        &self,
        problem: &Problem,
        relaxation: &Relaxation,
        vehicle: usize,
        group: usize,
    ) -> Option<Self> {
        let before = self.orders[vehicle].last().map(|&group| usize::from(group));
        let ends = reached(problem, vehicle, (before, &self.ends[vehicle]), group);
        if ends.iter().all(|&end| end >= NEVER) {
            return None;
        }
        let mut child = self.clone();
        child.done |= 1 << group;
        child.orders[vehicle].push(group as u8);
        child.ends[vehicle] = ends;
        child.last = (vehicle as u8, group as u8);
        let done = |group: usize| child.done >> group & 1 == 1;
        let (makespan, total) = relaxation.bound(&problem.parts, &child.ends(), &done);
        child.bound = problem.value(makespan, total).max(self.bound);
        (child.bound.0 < NEVER).then_some(child)
    }

    /// At the earliest, by whichever option.
    fn ends(&self) -> Vec<i64> {
        self.ends.iter().map(|ends| ends.iter().copied().min().unwrap_or(0)).collect()
    }

    fn routes(&self, problem: &Problem) -> Routes {
        let route = |(vehicle, order): (usize, &Vec<u8>)| options(problem, vehicle, order);
        self.orders.iter().enumerate().map(route).collect()
    }
}

/// The process over groups in place of their options.
fn grouped(problem: &Problem, expression: &Expression<usize>) -> Expression<usize> {
    let atom = |part: &Expression<usize>| match part {
        Expression::Atom(atom) => Some(problem.group_of[*atom]),
        Expression::Node(..) => None,
    };
    match expression {
        Expression::Atom(atom) => Expression::Atom(problem.group_of[*atom]),
        Expression::Node(operator, parts) => {
            let groups: Option<Vec<usize>> = parts.iter().map(atom).collect();
            match (operator, groups.as_deref()) {
                (Operator::Alternative, Some([first, ..])) => Expression::Atom(*first),
                _ => Expression::Node(*operator, parts.iter().map(|part| grouped(problem, part)).collect()),
            }
        }
    }
}

/// The earliest end by each option of a group, after the options of another or from the start.
fn reached(
    problem: &Problem,
    vehicle: usize,
    (before, ends): (Option<usize>, &[i64]),
    group: usize,
) -> Vec<i64> {
    let start = [problem.start()];
    let from = before.map_or(&start[..], |before| &problem.groups[before]);
    let end = |&to: &usize| {
        let arrivals = from.iter().zip(ends).map(|(&from, end)| end + problem.travel(vehicle, from, to));
        (arrivals.min().unwrap_or(NEVER).min(NEVER) + problem.service[to]).min(NEVER)
    };
    problem.groups[group].iter().map(end).collect()
}

/// The options by which a vehicle has done groups in this order at the earliest.
fn options(problem: &Problem, vehicle: usize, order: &[u8]) -> Vec<usize> {
    let mut stages: Vec<Vec<i64>> = vec![vec![0]];
    let mut before = None;
    for &group in order {
        let ends = &stages[stages.len() - 1];
        let next = reached(problem, vehicle, (before, ends), usize::from(group));
        stages.push(next);
        before = Some(usize::from(group));
    }
    let mut route = Vec::with_capacity(order.len());
    let mut next: Option<usize> = None;
    for (&group, ends) in order.iter().zip(&stages[1..]).rev() {
        let onwards = |at: usize| match next {
            Some(next) => ends[at] + problem.travel(vehicle, problem.groups[usize::from(group)][at], next),
            None => ends[at],
        };
        let Some(at) = (0..ends.len()).min_by_key(|&at| onwards(at)) else { continue };
        let atom = problem.groups[usize::from(group)][at];
        route.push(atom);
        next = Some(atom);
    }
    route.reverse();
    route
}
