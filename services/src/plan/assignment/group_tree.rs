//! General process algebra where vehicles do not wait for each other: depth-first branch and bound over the groups that may come
//! next, each with all its options at once.
//!
//! A state is what was done, in which order by whom, and for each option of what a vehicle did last the earliest end by it. So
//! options are not branched over: which are taken is settled for each vehicle alone, when its order is known.

use super::problem::{NEVER, Problem};
use super::relax::Relaxation;
use super::schedule::Routes;
use super::tree::Search;
use crate::plan::algebra::{Algebra, Expression, Operator};
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// The most groups that a state holds, and of which a search is of use.
const GROUPS_MAX: usize = 40;

/// The most states remembered for dominance; what is beyond is searched without.
const REMEMBERED_MAX: usize = 100_000;

#[derive(Debug, Clone)]
struct State {
    bound: (i64, i64),
    done: u128,
    /// The groups of each vehicle, in its order.
    orders: Vec<Vec<u8>>,
    /// For each vehicle, the earliest end by each option of its last group.
    ends: Vec<Vec<i64>>,
    /// What was added last.
    last: (u8, u8),
}

/// What was done, and the last group of each vehicle.
type Known = (u128, Vec<Option<u8>>);

/// A search that can be stopped after any number of nodes and go on later.
pub(super) struct GroupTree {
    algebra: Algebra<u128>,
    relaxation: Relaxation,
    stack: Vec<State>,
    seen: BTreeMap<Known, Vec<Vec<i64>>>,
    remembered: usize,
}

impl GroupTree {
    /// A search, or none where a problem is not for it.
    pub(super) fn new(problem: &Problem, relaxation: Relaxation) -> Option<Self> {
        let waits = problem.temporal && problem.has_order();
        if waits || !problem.is_once() || problem.groups.len() > GROUPS_MAX {
            return None;
        }
        let vehicles = problem.vehicles.len();
        let root = State {
            bound: (0, 0),
            done: 0,
            orders: vec![Vec::new(); vehicles],
            ends: vec![vec![0]; vehicles],
            last: (0, 0),
        };
        let algebra = Algebra::new(&grouped(problem, &problem.expression), problem.groups.len());
        Some(Self { algebra, relaxation, stack: vec![root], seen: BTreeMap::new(), remembered: 0 })
    }

    fn child(&self, problem: &Problem, state: &State, vehicle: usize, group: usize) -> Option<State> {
        let before = state.orders[vehicle].last().map(|&group| usize::from(group));
        let ends = reached(problem, vehicle, (before, &state.ends[vehicle]), group);
        if ends.iter().all(|&end| end >= NEVER) {
            return None;
        }
        let mut child = state.clone();
        child.done |= 1 << group;
        child.orders[vehicle].push(group as u8);
        child.ends[vehicle] = ends;
        child.last = (vehicle as u8, group as u8);
        let done = |group: usize| child.done >> group & 1 == 1;
        let (makespan, total) = self.relaxation.bound(&problem.parts, &earliest(&child), &done);
        child.bound = problem.value(makespan, total).max(state.bound);
        (child.bound.0 < NEVER).then_some(child)
    }

    /// Whether another state is at least as good; if not, this one is remembered.
    fn is_dominated(&mut self, state: &State) -> bool {
        let times = || state.ends.iter().flatten();
        let at_least = |known: &Vec<i64>| known.iter().zip(times()).all(|(known, time)| known <= time);
        let at_most = |known: &Vec<i64>| known.iter().zip(times()).all(|(known, time)| known >= time);
        let key = (state.done, state.orders.iter().map(|order| order.last().copied()).collect());
        if let Some(front) = self.seen.get_mut(&key) {
            if front.iter().any(at_least) {
                return true;
            }
            let before = front.len();
            front.retain(|known| !at_most(known));
            self.remembered -= before - front.len();
            front.push(times().copied().collect());
            self.remembered += 1;
        } else if self.remembered < REMEMBERED_MAX {
            self.seen.insert(key, vec![times().copied().collect()]);
            self.remembered += 1;
        }
        false
    }
}

impl Search for GroupTree {
    fn is_done(&self) -> bool {
        self.stack.is_empty()
    }

    fn open_bound(&self) -> Option<(i64, i64)> {
        self.stack.iter().map(|state| state.bound).min()
    }

    fn search(
        &mut self,
        problem: &Problem,
        nodes: u64,
        best: &mut (i64, i64),
        found: &mut dyn FnMut(Routes),
    ) -> u64 {
        let mut used = 0;
        while used < nodes {
            let Some(state) = self.stack.pop() else { break };
            used += 1;
            if state.bound >= *best || self.is_dominated(&state) {
                continue;
            }
            let mut children = Vec::new();
            let open = self.algebra.next(&state.done, &mut |group| {
                for vehicle in 0..problem.vehicles.len() {
                    children.extend(self.child(problem, &state, vehicle, group));
                }
            });
            if open {
                used += children.len() as u64;
                children.retain(|child| child.bound < *best);
                // The best is searched first: it is taken from the end.
                children.sort_by_key(|child| Reverse((child.bound, child.last)));
                self.stack.append(&mut children);
            } else {
                let ends = earliest(&state);
                *best = problem.value(ends.iter().copied().max().unwrap_or(0), ends.iter().sum());
                let route = |(vehicle, order): (usize, &Vec<u8>)| options(problem, vehicle, order);
                found(state.orders.iter().enumerate().map(route).collect());
            }
        }
        used
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

/// When each vehicle can have ended at the earliest.
fn earliest(state: &State) -> Vec<i64> {
    state.ends.iter().map(|ends| ends.iter().copied().min().unwrap_or(0)).collect()
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
