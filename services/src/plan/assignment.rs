//! Assignment: which vehicle does which task in which way and order.
//!
//! A greedy plan comes first and gets better with each slice of work. Where tasks are few and vehicles do not wait for each
//! other, tables give the best plan; where they wait, a tree search does, if its nodes suffice; beyond that a neighbourhood search
//! does what it can. Every plan says how far from the best it can be at most.

mod arborescence;
mod bound;
mod depth_first;
mod evaluate;
mod exhaustive;
mod file;
mod group_tree;
mod infeasible;
pub mod instance;
mod neighbourhood;
mod problem;
mod relax;
mod request;
mod schedule;
mod tables;
#[cfg(test)]
mod tests;
mod tree;

pub use evaluate::{Evaluation, evaluate};
pub use exhaustive::exhaustive;
pub use file::{OptionRow, RequestFile, WayRow};
pub use infeasible::{Cause, Infeasible};
pub use request::{Objective, Precedence, Request, RequestError, TIME_MS_MAX, Task, TaskOption, Travel};

use depth_first::Search;
use neighbourhood::Neighbourhood;
use problem::{NEVER, Problem};
use relax::Relaxation;
use schedule::{Routes, schedule};

/// How much work a plan may cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// The budget: states of a tree search, tasks put into a plan, or so many entries of tables as take as long.
    pub nodes: u64,
    /// The seed of all chance.
    pub seed: u64,
}

impl Default for Effort {
    /// About a second on a machine of 2025.
    fn default() -> Self {
        Self { nodes: 150_000, seed: 1 }
    }
}

/// One task of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Assignment {
    /// Who does it.
    pub vehicle: i64,
    /// The task.
    pub task: i64,
    /// The option by which it is done.
    pub option: i64,
    /// When it may start at the earliest, in milliseconds from the start of the plan; 0 where it waits for nothing.
    pub threshold_ms: i64,
    /// When it is complete, in milliseconds from the start of the plan.
    pub completed_ms: i64,
}

/// How good a plan is, for certain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Certificate {
    /// Whether no plan is better: neither in what the objective names nor, with that the same, in the other value.
    pub proven: bool,
    /// No plan has less than this, in milliseconds of the objective.
    pub bound_ms: i64,
    /// How much more than the bound the plan costs at most, as a share of the plan's cost.
    pub gap: f64,
    /// The nodes used.
    pub nodes: u64,
}

/// A plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// When the last vehicle has finished, in milliseconds.
    pub makespan_ms: i64,
    /// The sum over the vehicles of when each has finished, in milliseconds.
    pub total_ms: i64,
    /// The tasks in order of completion, those of a vehicle in its order.
    pub assignments: Vec<Assignment>,
    /// How good it is.
    pub certificate: Certificate,
}

/// Why there is no plan.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AssignError {
    /// The request cannot be understood.
    #[error(transparent)]
    Request(#[from] RequestError),
    /// There is none, and these tasks are the reason.
    #[error("no plan: {}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Infeasible(Vec<Infeasible>),
    /// None was found within the budget; there may be one.
    #[error("no plan was found within {0} nodes: allow more, or relate fewer tasks")]
    NotFound(u64),
}

/// What is left of the work.
enum Work {
    Nothing,
    /// Tables, and what comes after them if they do not settle it.
    Tables(Option<Box<Neighbourhood>>, Option<Box<dyn Search>>),
    /// A tree search, after some neighbourhood search.
    Search(Option<Box<Neighbourhood>>, Option<Box<dyn Search>>),
}

/// Work on a request, done in slices.
pub struct Assigner {
    problem: Problem,
    effort: Effort,
    work: Work,
    best: Option<Routes>,
    value: (i64, i64),
    bound: i64,
    nodes: u64,
    proven: bool,
}

/// The most groups of which a tree search sees all sooner than a neighbourhood search is of use.
const TINY: usize = 8;

/// The most groups of which a tree search is expected to see all.
const SMALL: usize = 16;

impl Assigner {
    /// Prepares a request and makes a greedy plan.
    ///
    /// # Errors
    /// What is wrong with the request, or which tasks nobody can do.
    pub fn new(request: &Request, effort: Effort) -> Result<Self, AssignError> {
        let problem = Problem::new(request)?;
        let causes = infeasible::causes(request, &problem);
        if !causes.is_empty() {
            return Err(AssignError::Infeasible(causes));
        }
        let relaxation = Relaxation::new(&problem);
        let idle = vec![0; problem.vehicles.len()];
        let (makespan, total) = relaxation.bound(&problem.parts, &idle, &|_| false);
        let mut nodes = 0;
        let near = Neighbourhood::new(&problem, relaxation.clone(), effort.seed, &mut nodes);
        let tree: Option<Box<dyn Search>> = match group_tree::search(&problem, relaxation.clone()) {
            Some(search) => Some(Box::new(search)),
            None => tree::search(&problem, relaxation).map(|search| Box::new(search) as Box<dyn Search>),
        };
        let then = near.clone().map(Box::new);
        let work = match tables::nodes(&problem) {
            Some(nodes) if nodes <= effort.nodes => Work::Tables(then, tree),
            _ => Work::Search(then, tree),
        };
        let bound = problem.value(makespan, total).0;
        let mut assigner =
            Self { problem, effort, work, best: None, value: (NEVER, NEVER), bound, nodes, proven: false };
        if let Some(near) = near {
            assigner.take(near.routes().clone());
        }
        Ok(assigner)
    }

    /// Works for about this many nodes; whether there is more to do. What was found is in [`Self::plan`].
    pub fn work(&mut self, nodes: u64) -> bool {
        match std::mem::replace(&mut self.work, Work::Nothing) {
            Work::Nothing => return false,
            Work::Tables(near, tree) => self.tables(near, tree),
            Work::Search(near, tree) => self.search(near, tree, nodes),
        }
        if matches!(self.work, Work::Nothing) {
            self.settle();
        }
        !matches!(self.work, Work::Nothing)
    }

    fn tables(&mut self, near: Option<Box<Neighbourhood>>, tree: Option<Box<dyn Search>>) {
        self.nodes += tables::nodes(&self.problem).unwrap_or(0);
        match tables::solve(&self.problem) {
            Some((routes, (makespan, total))) => {
                self.bound = self.bound.max(self.problem.value(makespan, total).0);
                self.proven = schedule(&self.problem, &routes).is_some();
                self.take(routes);
            }
            None => self.proven = true,
        }
        if !self.proven {
            self.work = Work::Search(near, tree);
        }
    }

    fn search(&mut self, near: Option<Box<Neighbourhood>>, tree: Option<Box<dyn Search>>, nodes: u64) {
        let all = self.before_tree(tree.is_some());
        let (mut near, mut tree, mut left) = (near, tree, nodes.max(1));
        if let Some(search) = near.as_mut().filter(|_| self.nodes < all) {
            let (mut value, mut best) = (self.value, None);
            let before = self.nodes;
            let mut found = |routes: &Routes| best = Some(routes.clone());
            let until = all.min(self.nodes.saturating_add(left));
            search.search(&self.problem, &mut self.nodes, until, all, &mut value, &mut found);
            left = left.saturating_sub(self.nodes - before);
            best.into_iter().for_each(|routes| self.take(routes));
        }
        if self.nodes >= all {
            near = None;
        }
        if let (Some(tree), None) = (&mut tree, &near) {
            let slice = left.min(self.effort.nodes.saturating_sub(self.nodes));
            let (mut value, mut best) = (self.value, None);
            self.nodes += tree.search(&self.problem, slice, &mut value, &mut |routes| best = Some(routes));
            best.into_iter().for_each(|routes| self.take(routes));
            self.proven = tree.is_done();
        }
        let is_over = self.proven || self.nodes >= self.effort.nodes || near.is_none() && tree.is_none();
        if is_over {
            let open = tree.and_then(|tree| tree.open_bound()).map_or(0, |open| open.0);
            self.bound = self.bound.max(open);
        } else {
            self.work = Work::Search(near, tree);
        }
    }

    /// How many nodes a neighbourhood search gets: enough for a good first plan where a tree search will see all, most where it
    /// may just prove something.
    fn before_tree(&self, tree: bool) -> u64 {
        let (groups, all) = (self.problem.groups.len(), self.effort.nodes);
        match tree {
            true if groups <= TINY => 0,
            true if groups <= SMALL => (200 * groups as u64).min(all / 5),
            true => all / 5 * 4,
            false => all,
        }
    }

    /// The last of the work: what is the bound?
    fn settle(&mut self) {
        if self.proven {
            self.bound = self.value.0;
        } else if self.best.is_some() {
            let relaxed = bound::bound(&self.problem, self.value.0).unwrap_or(0);
            self.bound = self.bound.max(relaxed).min(self.value.0);
        }
    }

    fn take(&mut self, routes: Routes) {
        let Some(times) = schedule(&self.problem, &routes) else { return };
        let value = self.problem.value(times.makespan, times.total);
        if value < self.value || self.best.is_none() {
            (self.value, self.best) = (value, Some(routes));
        }
    }

    /// The best plan so far.
    ///
    /// # Errors
    /// That there is none, or none yet.
    pub fn plan(&self) -> Result<Plan, AssignError> {
        let times = self.best.as_ref().and_then(|routes| Some((routes, schedule(&self.problem, routes)?)));
        let Some((routes, times)) = times else {
            return Err(match self.proven {
                true => AssignError::Infeasible(vec![Infeasible { task: None, cause: Cause::NoOrder }]),
                false => AssignError::NotFound(self.nodes),
            });
        };
        let mut assignments = Vec::new();
        for (vehicle, route) in routes.iter().enumerate() {
            for (at, &atom) in route.iter().enumerate() {
                let (task, option) = self.problem.atoms[atom];
                let (completed_ms, threshold_ms) =
                    (times.completed[vehicle][at], times.thresholds[vehicle][at]);
                let vehicle = self.problem.vehicles[vehicle];
                assignments.push(Assignment { vehicle, task, option, threshold_ms, completed_ms });
            }
        }
        // A stable sort: tasks that take no time stay in their vehicle's order.
        assignments.sort_by_key(|assignment| (assignment.completed_ms, assignment.vehicle));
        let bound_ms = self.bound.min(self.value.0);
        let gap = (self.value.0 - bound_ms) as f64 / self.value.0.max(1) as f64;
        let certificate = Certificate { proven: self.proven, bound_ms, gap, nodes: self.nodes };
        Ok(Plan { makespan_ms: times.makespan, total_ms: times.total, assignments, certificate })
    }
}

/// The best plan within a budget.
///
/// # Errors
/// What is wrong with the request, or that there is no plan or none was found.
pub fn assign(request: &Request, effort: Effort) -> Result<Plan, AssignError> {
    let mut assigner = Assigner::new(request, effort)?;
    while assigner.work(effort.nodes) {}
    assigner.plan()
}
