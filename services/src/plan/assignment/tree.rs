//! General process algebra: depth-first branch and bound over the options that may come next.
//!
//! A state is what was executed, and where and when each vehicle is. States are pruned that cannot beat the best plan, and those
//! that another dominates: same executed, same places, no time later.

use super::problem::{NEVER, Problem};
use super::relax::Relaxation;
use super::schedule::Routes;
use crate::plan::algebra::Algebra;
use std::collections::BTreeMap;

/// The most atoms that a state holds.
const ATOMS_MAX: usize = 128;

/// The most groups of which a search is of use: of more, no budget sees enough.
const GROUPS_MAX: usize = 40;

/// The most states remembered for dominance; what is beyond is searched without.
const REMEMBERED_MAX: usize = 400_000;

/// A search for the best plan, which can be stopped after any number of nodes and go on later.
pub(super) trait Search: Send {
    /// Whether everything was searched.
    fn is_done(&self) -> bool;

    /// The least value that what is still open could have.
    fn open_bound(&self) -> Option<(i64, i64)>;

    /// Looks at about `nodes` states for plans of less than `best`, which each one found becomes. Gives the nodes used.
    fn search(
        &mut self,
        problem: &Problem,
        nodes: u64,
        best: &mut (i64, i64),
        found: &mut dyn FnMut(Routes),
    ) -> u64;
}

#[derive(Debug, Clone)]
struct State {
    bound: (i64, i64),
    executed: u128,
    last: Vec<u16>,
    ends: Vec<i64>,
    /// When each group was complete: kept where vehicles wait for each other.
    completed: Vec<i64>,
    order: Vec<(u16, u16)>,
}

/// A search that can be stopped after any number of nodes and go on later.
#[derive(Debug, Clone)]
pub(super) struct Tree {
    algebra: Algebra<u128>,
    relaxation: Relaxation,
    stack: Vec<State>,
    seen: BTreeMap<(u128, Vec<u16>), Vec<Vec<i64>>>,
    remembered: usize,
}

impl Tree {
    /// A search, or none where a problem is too large for it.
    pub(super) fn new(problem: &Problem, relaxation: Relaxation) -> Option<Self> {
        if problem.atoms.len() > ATOMS_MAX || problem.groups.len() > GROUPS_MAX {
            return None;
        }
        let vehicles = problem.vehicles.len();
        let groups = if problem.temporal { problem.groups.len() } else { 0 };
        let root = State {
            bound: (0, 0),
            executed: 0,
            last: vec![problem.start() as u16; vehicles],
            ends: vec![0; vehicles],
            completed: vec![0; groups],
            order: Vec::new(),
        };
        let algebra = Algebra::new(&problem.expression, problem.atoms.len());
        Some(Self { algebra, relaxation, stack: vec![root], seen: BTreeMap::new(), remembered: 0 })
    }

    fn child(&self, problem: &Problem, state: &State, vehicle: usize, atom: usize) -> Option<State> {
        let travel = problem.travel(vehicle, usize::from(state.last[vehicle]), atom);
        if travel >= NEVER {
            return None;
        }
        let group = problem.group_of[atom];
        let ready = |before: &usize| state.completed[*before];
        let ready = if problem.temporal { problem.before[group].iter().map(ready).max() } else { None };
        let end = (state.ends[vehicle] + travel).max(ready.unwrap_or(0)) + problem.service[atom];
        let mut child = state.clone();
        child.executed |= 1 << atom;
        child.last[vehicle] = atom as u16;
        child.ends[vehicle] = end;
        if problem.temporal {
            child.completed[group] = end;
        }
        child.order.push((vehicle as u16, atom as u16));
        let done = |group: usize| problem.groups[group].iter().any(|&atom| child.executed >> atom & 1 == 1);
        let (makespan, total) = self.relaxation.bound(&problem.parts, &child.ends, &done);
        child.bound = problem.value(makespan, total).max(state.bound);
        (child.bound.0 < NEVER).then_some(child)
    }

    /// Whether another state is at least as good; if not, this one is remembered.
    fn is_dominated(&mut self, state: &State) -> bool {
        let times = || state.ends.iter().chain(&state.completed);
        let at_least = |known: &Vec<i64>| known.iter().zip(times()).all(|(known, time)| known <= time);
        let at_most = |known: &Vec<i64>| known.iter().zip(times()).all(|(known, time)| known >= time);
        let key = (state.executed, state.last.clone());
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

impl Search for Tree {
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
            let open = self.algebra.next(&state.executed, &mut |atom| {
                for vehicle in 0..problem.vehicles.len() {
                    children.extend(self.child(problem, &state, vehicle, atom));
                }
            });
            if open {
                used += children.len() as u64;
                children.retain(|child| child.bound < *best);
                // The best is searched first: it is taken from the end.
                children.sort_by(|a, b| (b.bound, b.order.last()).cmp(&(a.bound, a.order.last())));
                self.stack.append(&mut children);
            } else {
                let total = state.ends.iter().sum();
                *best = problem.value(state.ends.iter().copied().max().unwrap_or(0), total);
                found(routes(problem, &state));
            }
        }
        used
    }
}

fn routes(problem: &Problem, state: &State) -> Routes {
    let mut routes = vec![Vec::new(); problem.vehicles.len()];
    for &(vehicle, atom) in &state.order {
        routes[usize::from(vehicle)].push(usize::from(atom));
    }
    routes
}
