//! General process algebra: branching over the options that may come next.
//!
//! A state is what was executed, and where and when each vehicle is.

use super::depth_first::{DepthFirst, State};
use super::problem::{NEVER, Problem};
use super::relax::Relaxation;
use super::schedule::Routes;
use crate::plan::algebra::Algebra;

/// The most atoms that a state holds.
const ATOMS_MAX: usize = 128;

/// The most groups of which a search is of use: of more, no budget sees enough.
const GROUPS_MAX: usize = 40;

#[derive(Debug, Clone)]
pub(super) struct Options {
    bound: (i64, i64),
    executed: u128,
    last: Vec<u16>,
    ends: Vec<i64>,
    /// When each group was complete: kept where vehicles wait for each other.
    completed: Vec<i64>,
    order: Vec<(u16, u16)>,
}

/// A search over options, or none where a problem is too large for it.
pub(super) fn search(problem: &Problem, relaxation: Relaxation) -> Option<DepthFirst<Options>> {
    if problem.atoms.len() > ATOMS_MAX || problem.groups.len() > GROUPS_MAX {
        return None;
    }
    let vehicles = problem.vehicles.len();
    let groups = if problem.temporal { problem.groups.len() } else { 0 };
    let root = Options {
        bound: (0, 0),
        executed: 0,
        last: vec![problem.start() as u16; vehicles],
        ends: vec![0; vehicles],
        completed: vec![0; groups],
        order: Vec::new(),
    };
    let algebra = Algebra::new(&problem.expression, problem.atoms.len());
    Some(DepthFirst::new(root, algebra, relaxation))
}

impl State for Options {
    type Places = Vec<u16>;
    type Last = Option<(u16, u16)>;

    const REMEMBERED_MAX: usize = 400_000;

    fn bound(&self) -> (i64, i64) {
        self.bound
    }

    fn done(&self) -> u128 {
        self.executed
    }

    fn places(&self) -> Vec<u16> {
        self.last.clone()
    }

    fn last(&self) -> Option<(u16, u16)> {
        self.order.last().copied()
    }

    fn times(&self) -> impl Iterator<Item = &i64> {
        self.ends.iter().chain(&self.completed)
    }

    fn child(&self, problem: &Problem, relaxation: &Relaxation, vehicle: usize, atom: usize) -> Option<Self> {
        let travel = problem.travel(vehicle, usize::from(self.last[vehicle]), atom);
        if travel >= NEVER {
            return None;
        }
        let group = problem.group_of[atom];
        let ready = |before: &usize| self.completed[*before];
        let ready = if problem.temporal { problem.before[group].iter().map(ready).max() } else { None };
        let end = (self.ends[vehicle] + travel).max(ready.unwrap_or(0)) + problem.service[atom];
        let mut child = self.clone();
        child.executed |= 1 << atom;
        child.last[vehicle] = atom as u16;
        child.ends[vehicle] = end;
        if problem.temporal {
            child.completed[group] = end;
        }
        child.order.push((vehicle as u16, atom as u16));
        let done = |group: usize| problem.groups[group].iter().any(|&atom| child.executed >> atom & 1 == 1);
        let (makespan, total) = relaxation.bound(&problem.parts, &child.ends, &done);
        child.bound = problem.value(makespan, total).max(self.bound);
        (child.bound.0 < NEVER).then_some(child)
    }

    fn ends(&self) -> Vec<i64> {
        self.ends.clone()
    }

    fn routes(&self, problem: &Problem) -> Routes {
        let mut routes = vec![Vec::new(); problem.vehicles.len()];
        for &(vehicle, atom) in &self.order {
            routes[usize::from(vehicle)].push(usize::from(atom));
        }
        routes
    }
}
