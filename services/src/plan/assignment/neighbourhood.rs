//! Adaptive large neighbourhood search: take tasks out of the best plans and put them in elsewhere.
//!
//! Four ways to take out and three to put in, chosen by how they did so far; acceptance as in simulated annealing. All
//! chance comes from the seed, so a number of nodes always ends at the same plan.

mod insert;
mod remove;
mod select;

use super::problem::{NEVER, Part, Problem};
use super::relax::Relaxation;
use super::request::Objective;
use super::schedule::{Routes, schedule};
use insert::Order;

/// How strongly long routes weigh against the sum, where the last end must be small: the norm's exponent.
const EXPONENT: i32 = 16;

/// The most tasks taken out at once.
const REMOVED_MAX: usize = 24;

/// How many plans are made at first before one is given up to find.
const STARTS_MAX: usize = 50;

/// How fast weights follow success.
const LEARNING: f64 = 0.05;

/// A plan of the search.
#[derive(Debug, Clone)]
struct Candidate {
    routes: Routes,
    /// When each vehicle ends, without waiting.
    ends: Vec<i64>,
    cost: f64,
}

/// The search; it can be stopped after any number of nodes and go on later.
#[derive(Debug, Clone)]
pub(super) struct Neighbourhood {
    random: fastrand::Rng,
    relaxation: Relaxation,
    /// The groups near each group, the nearest first.
    near: Vec<Vec<usize>>,
    current: Candidate,
    success: Vec<f64>,
    /// What is taken for a small and a large change of cost.
    warm: f64,
    cold: f64,
}

impl Neighbourhood {
    /// Makes a first plan; none where that is too hard for putting in one by one. Counts nodes.
    pub(super) fn new(problem: &Problem, relaxation: Relaxation, seed: u64, nodes: &mut u64) -> Option<Self> {
        let vehicles = problem.vehicles.len();
        let empty = Candidate { routes: vec![Vec::new(); vehicles], ends: vec![0; vehicles], cost: 0.0 };
        let mut search = Self {
            random: fastrand::Rng::with_seed(seed),
            near: remove::near(problem),
            relaxation,
            current: empty.clone(),
            success: vec![1.0; remove::WAYS * insert::WAYS],
            warm: 0.0,
            cold: 0.0,
        };
        for start in 0..STARTS_MAX {
            let chosen = search.first_selection(&problem.parts, start);
            let mut plan = empty.clone();
            let order = if start % 2 == 0 { Order::AsTheyCome } else { Order::Random };
            if search.insert_all(problem, &mut plan, chosen, order, nodes) {
                search.current = plan;
                let mean = search.current.cost / problem.groups.len() as f64;
                (search.warm, search.cold) = (mean * vehicles as f64 * 0.1, mean * vehicles as f64 * 0.0005);
                return Some(search);
            }
        }
        None
    }

    /// The plan that it is at.
    pub(super) fn routes(&self) -> &Routes {
        &self.current.routes
    }

    /// Changes the plan until at least `until` nodes are used of `all`, each found plan of less than `best` becoming it.
    pub(super) fn search(
        &mut self,
        problem: &Problem,
        nodes: &mut u64,
        until: u64,
        all: u64,
        best: &mut (i64, i64),
        found: &mut impl FnMut(&Routes),
    ) {
        while *nodes < until {
            let share = *nodes as f64 / all as f64;
            let temperature = self.warm * (self.cold / self.warm.max(1e-9)).powf(share);
            let way = self.choose();
            let mut plan = self.current.clone();
            let before = plan.routes.clone();
            let missing = self.remove(problem, &mut plan, way / insert::WAYS);
            let order = Order::of(way % insert::WAYS);
            *nodes += 1;
            let mut reward = 0.0;
            if self.insert_all(problem, &mut plan, missing, order, nodes) && plan.routes != before {
                let worse = plan.cost - self.current.cost;
                if worse < 0.0 || self.random.f64() < (-worse / temperature.max(1e-9)).exp() {
                    reward = if worse < 0.0 { 4.0 } else { 1.0 };
                    self.current = plan;
                    if let Some(value) = value(problem, &self.current.routes).filter(|value| value < best) {
                        *best = value;
                        reward = 10.0;
                        found(&self.current.routes);
                    }
                }
            }
            let success = &mut self.success[way];
            *success += LEARNING * (reward - *success);
        }
    }

    /// A way to take out and put in, by success so far; none is ever given up.
    fn choose(&mut self) -> usize {
        let weight = |success: &f64| success + 0.1;
        let sum: f64 = self.success.iter().map(weight).sum();
        let mut at = self.random.f64() * sum;
        for (way, success) in self.success.iter().enumerate() {
            at -= weight(success);
            if at <= 0.0 {
                return way;
            }
        }
        0
    }

    /// What must be done at first: of each choice the least, and later ones at random.
    fn first_selection(&mut self, part: &Part, start: usize) -> Vec<usize> {
        match part {
            Part::Group(group) => vec![*group],
            Part::All(parts) => parts.iter().flat_map(|part| self.first_selection(part, start)).collect(),
            Part::Choice(parts) => {
                let all: Vec<_> = parts.iter().map(|part| self.first_selection(part, start)).collect();
                let work = |groups: &&Vec<usize>| {
                    groups.iter().fold(0, |sum, &group| (sum + self.relaxation.least(group)).min(NEVER))
                };
                let least = all.iter().min_by_key(work).cloned().unwrap_or_default();
                if start == 0 { least } else { all[self.random.usize(..all.len())].clone() }
            }
        }
    }
}

/// The makespan and total of routes, in the objective's order.
fn value(problem: &Problem, routes: &Routes) -> Option<(i64, i64)> {
    schedule(problem, routes).map(|times| problem.value(times.makespan, times.total))
}

/// What one end adds to a plan's cost before its root is taken.
fn weight(problem: &Problem, end: i64) -> f64 {
    match problem.objective {
        Objective::MinMax => (end as f64).powi(EXPONENT),
        Objective::Cumulative => end as f64,
    }
}

/// The cost of a plan: near what must be small, but sensitive to every vehicle.
fn cost(problem: &Problem, ends: &[i64]) -> f64 {
    let sum: f64 = ends.iter().map(|&end| weight(problem, end)).sum();
    match problem.objective {
        Objective::MinMax => sum.powf(1.0 / f64::from(EXPONENT)),
        Objective::Cumulative => sum,
    }
}
