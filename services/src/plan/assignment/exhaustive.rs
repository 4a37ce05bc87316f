//! Every plan of a small request, one after the other: the measure for the searches.

use super::problem::{NEVER, Problem};
use super::request::{Objective, Request, RequestError};
use crate::plan::algebra::Algebra;

/// The least value of any plan: makespan and total, the objective's first made least. None where there is no plan.
///
/// It uses neither bounds nor dominance, and gives up a branch only where what is done already costs too much. The time
/// grows with the factorial of the tasks.
///
/// # Errors
/// What is wrong with the request.
///
/// # Panics
/// Where the request has more than 128 options.
pub fn exhaustive(request: &Request) -> Result<Option<(i64, i64)>, RequestError> {
    let problem = Problem::new(request)?;
    assert!(problem.atoms.len() <= 128, "this is for small requests");
    let algebra = Algebra::new(&problem.expression, problem.atoms.len());
    let vehicles = problem.vehicles.len();
    let mut walk = Walk {
        algebra,
        last: vec![problem.start(); vehicles],
        ends: vec![0; vehicles],
        completed: vec![0; problem.groups.len()],
        best: (NEVER, NEVER),
        problem: &problem,
    };
    if problem.is_parallel() {
        walk.vehicle_by_vehicle(0, 0);
    } else {
        walk.step_by_step(0);
    }
    let (first, second) = walk.best;
    Ok((first < NEVER).then_some(match request.objective {
        Objective::MinMax => (first, second),
        Objective::Cumulative => (second, first),
    }))
}

struct Walk<'a> {
    problem: &'a Problem,
    algebra: Algebra<u128>,
    last: Vec<usize>,
    ends: Vec<i64>,
    completed: Vec<i64>,
    best: (i64, i64),
}

impl Walk<'_> {
    fn value(&self) -> (i64, i64) {
        let makespan = self.ends.iter().copied().max().unwrap_or(0);
        self.problem.value(makespan, self.ends.iter().sum())
    }

    /// Each vehicle in turn takes any sequence of what is left: every plan of independent tasks once.
    fn vehicle_by_vehicle(&mut self, vehicle: usize, executed: u128) {
        let mut open = Vec::new();
        self.algebra.next(&executed, &mut |atom| open.push(atom));
        if open.is_empty() {
            self.best = self.best.min(self.value());
            return;
        }
        if vehicle + 1 < self.ends.len() {
            self.vehicle_by_vehicle(vehicle + 1, executed);
        }
        for atom in open {
            self.take(vehicle, atom, executed, &mut |walk, executed| {
                walk.vehicle_by_vehicle(vehicle, executed)
            });
        }
    }

    /// Any vehicle does anything that may come next: every plan, in every interleaving.
    fn step_by_step(&mut self, executed: u128) {
        let mut open = Vec::new();
        self.algebra.next(&executed, &mut |atom| open.push(atom));
        if open.is_empty() {
            self.best = self.best.min(self.value());
        }
        for atom in open {
            for vehicle in 0..self.ends.len() {
                self.take(vehicle, atom, executed, &mut |walk, executed| walk.step_by_step(executed));
            }
        }
    }

    fn take(&mut self, vehicle: usize, atom: usize, executed: u128, go_on: &mut dyn FnMut(&mut Self, u128)) {
        let (last, end) = (self.last[vehicle], self.ends[vehicle]);
        let travel = self.problem.travel(vehicle, last, atom);
        if travel >= NEVER {
            return;
        }
        let group = self.problem.group_of[atom];
        let ready =
            self.problem.before[group].iter().map(|&before| self.completed[before]).max().unwrap_or(0);
        let arrival = (end + travel).max(if self.problem.temporal { ready } else { 0 });
        self.ends[vehicle] = arrival + self.problem.service[atom];
        self.last[vehicle] = atom;
        self.completed[group] = self.ends[vehicle];
        if self.value() < self.best {
            go_on(self, executed | 1 << atom);
        }
        self.completed[group] = 0;
        (self.last[vehicle], self.ends[vehicle]) = (last, end);
    }
}
