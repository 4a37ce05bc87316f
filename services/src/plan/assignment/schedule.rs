//! When what is done, given who does what in which order.

use super::problem::{NEVER, Problem};

/// The atoms of each vehicle, in its order.
pub(super) type Routes = Vec<Vec<usize>>;

/// The times of a plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Schedule {
    /// When each atom of each route is complete.
    pub completed: Routes64,
    /// The earliest start of each atom of each route; 0 where nothing comes before it.
    pub thresholds: Routes64,
    /// When the last vehicle has finished.
    pub makespan: i64,
    /// The sum of when each has finished.
    pub total: i64,
}

/// A time for each atom of each route.
type Routes64 = Vec<Vec<i64>>;

/// The times of routes, or none where a way is missing or the order can never be kept.
pub(super) fn schedule(problem: &Problem, routes: &Routes) -> Option<Schedule> {
    let mut done: Vec<Option<i64>> = vec![None; problem.groups.len()];
    let mut chosen = vec![false; problem.groups.len()];
    routes.iter().flatten().for_each(|&atom| chosen[problem.group_of[atom]] = true);
    let mut completed: Routes64 = vec![Vec::new(); routes.len()];
    let mut thresholds = completed.clone();
    let mut open: usize = routes.iter().map(Vec::len).sum();
    while open > 0 {
        let before = open;
        for (vehicle, route) in routes.iter().enumerate() {
            while let Some(&atom) = route.get(completed[vehicle].len()) {
                let group = problem.group_of[atom];
                let Some(ready) = ready(problem, group, &chosen, &done) else { break };
                let place = completed[vehicle].len();
                let from = place.checked_sub(1).map_or(problem.start(), |last| route[last]);
                let travel = problem.travel(vehicle, from, atom);
                if travel >= NEVER {
                    return None;
                }
                let arrival = completed[vehicle].last().copied().unwrap_or(0) + travel;
                let threshold = if problem.temporal { ready } else { 0 };
                let end = arrival.max(threshold) + problem.service[atom];
                completed[vehicle].push(end);
                thresholds[vehicle].push(threshold);
                done[group] = Some(end);
                open -= 1;
            }
        }
        if open == before {
            return None;
        }
    }
    let ends = || completed.iter().filter_map(|route| route.last().copied());
    let (makespan, total) = (ends().max().unwrap_or(0), ends().sum());
    Some(Schedule { makespan, total, completed, thresholds })
}

/// When all is complete that comes before a group; none while something of it is open.
fn ready(problem: &Problem, group: usize, chosen: &[bool], done: &[Option<i64>]) -> Option<i64> {
    let before = problem.before[group].iter().filter(|&&earlier| chosen[earlier]);
    before.map(|&earlier| done[earlier]).try_fold(0, |latest, time| time.map(|time| latest.max(time)))
}
