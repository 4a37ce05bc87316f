//! Why a request has no plan: the task and the cause.

use super::problem::{NEVER, Part, Problem};
use super::request::{Request, TIME_MS_MAX};
use std::fmt;

/// Why a task cannot be done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Cause {
    /// None of the request's vehicles can do any of its options.
    NoEligibleVehicle,
    /// Its options have no cost that is a time: the planner of its route has failed.
    NoRouteWithin,
    /// No vehicle that may do it has a way to it, from where it is or from anything that it can reach.
    NoRoute,
    /// Each task can be done, but not all that the relationships ask for.
    NoOrder,
}

/// A task and the cause, or all tasks where it is not one of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Infeasible {
    /// The task, if it is one.
    pub task: Option<i64>,
    /// The cause.
    pub cause: Cause,
}

impl fmt::Display for Infeasible {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(task) = self.task {
            write!(f, "task {task}: ")?;
        }
        f.write_str(match self.cause {
            Cause::NoEligibleVehicle => {
                "no eligible vehicle: add a vehicle to the request that one of its options names"
            }
            Cause::NoRouteWithin => "its options have no cost: the route within the task was not found",
            Cause::NoRoute => {
                "no route from anywhere: look at the zones around it and at the planner's answers"
            }
            Cause::NoOrder => "no order of the tasks has all the ways that it needs",
        })
    }
}

/// The tasks that keep a request from having a plan, as far as each alone does.
pub(super) fn causes(request: &Request, problem: &Problem) -> Vec<Infeasible> {
    let reachable = reachable(problem);
    let mut atoms = Vec::new();
    dead(problem, &problem.parts, &reachable, &mut atoms);
    let mut tasks: Vec<_> = atoms.into_iter().map(|atom| problem.atoms[atom].0).collect();
    tasks.sort_unstable();
    tasks.dedup();
    let infeasible = |task| Infeasible { task: Some(task), cause: cause(request, task) };
    tasks.into_iter().map(infeasible).collect()
}

fn cause(request: &Request, task: i64) -> Cause {
    let options = || request.tasks[&task].options.values();
    let able =
        |vehicles: &[i64]| vehicles.is_empty() || vehicles.iter().any(|id| request.vehicles.contains(id));
    if !options().any(|option| able(&option.eligible)) {
        Cause::NoEligibleVehicle
    } else if options().all(|option| option.cost_ms > TIME_MS_MAX) {
        Cause::NoRouteWithin
    } else {
        Cause::NoRoute
    }
}

/// The atoms that some vehicle can come to, from its start or by way of others.
fn reachable(problem: &Problem) -> Vec<bool> {
    let mut any = vec![false; problem.atoms.len()];
    for vehicle in 0..problem.vehicles.len() {
        let mut own = vec![false; problem.atoms.len()];
        let mut open = vec![problem.start()];
        while let Some(from) = open.pop() {
            for (to, own) in own.iter_mut().enumerate() {
                if !*own && problem.step(vehicle, from, to) < NEVER {
                    *own = true;
                    open.push(to);
                }
            }
        }
        any.iter_mut().zip(&own).for_each(|(any, own)| *any |= own);
    }
    any
}

/// Collects the atoms that make a part impossible; whether it is.
fn dead(problem: &Problem, part: &Part, reachable: &[bool], found: &mut Vec<usize>) -> bool {
    match part {
        Part::Group(group) => {
            let atoms = &problem.groups[*group];
            let is_dead = !atoms.iter().any(|&atom| reachable[atom]);
            if is_dead {
                found.extend(atoms);
            }
            is_dead
        }
        Part::All(parts) => parts.iter().fold(false, |any, part| dead(problem, part, reachable, found) | any),
        Part::Choice(parts) => {
            let mut below = Vec::new();
            let all = parts.iter().fold(true, |all, part| dead(problem, part, reachable, &mut below) & all);
            if all {
                found.append(&mut below);
            }
            all
        }
    }
}
