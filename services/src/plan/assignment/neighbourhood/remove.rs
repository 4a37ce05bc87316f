//! Ways to take tasks out of a plan.

use super::super::problem::{NEVER, Problem};
use super::{Candidate, Neighbourhood, REMOVED_MAX, cost, select};

/// How many ways there are.
pub(super) const WAYS: usize = 4;

/// The groups near each group by the shortest way between them, the nearest first.
pub(super) fn near(problem: &Problem) -> Vec<Vec<usize>> {
    let groups = problem.groups.len();
    let mut least = vec![NEVER; groups * groups];
    for vehicle in 0..problem.vehicles.len() {
        for from in 0..problem.atoms.len() {
            for to in 0..problem.atoms.len() {
                let (a, b) = (problem.group_of[from], problem.group_of[to]);
                let way = problem.travel(vehicle, from, to);
                for place in [a * groups + b, b * groups + a] {
                    least[place] = least[place].min(way);
                }
            }
        }
    }
    let nearest = |group: usize| {
        let mut others: Vec<_> = (0..groups).filter(|&other| other != group).collect();
        others.sort_by_key(|&other| (least[group * groups + other], other));
        others
    };
    (0..groups).map(nearest).collect()
}

impl Neighbourhood {
    /// Takes groups out; gives what must be put in.
    pub(super) fn remove(&mut self, problem: &Problem, plan: &mut Candidate, way: usize) -> Vec<usize> {
        let all: Vec<usize> = plan.routes.iter().flatten().map(|&atom| problem.group_of[atom]).collect();
        if all.is_empty() {
            return all;
        }
        let most = (all.len() / 4 + 2).min(REMOVED_MAX).min(all.len());
        let count = self.random.usize(1..=most);
        let mut out = vec![false; problem.groups.len()];
        match way {
            0 => (0..count).for_each(|_| out[all[self.random.usize(..all.len())]] = true),
            1 => self.strings(problem, plan, count, &mut out),
            2 => self.worst(problem, plan, count, &mut out),
            _ => {
                let mut chosen = vec![false; problem.groups.len()];
                all.iter().for_each(|&group| chosen[group] = true);
                match select::switched(problem, &chosen, &mut self.random) {
                    Some(groups) => return self.replace(problem, plan, &chosen, &groups),
                    None => self.related(&all, count, &mut out),
                }
            }
        }
        let missing: Vec<_> = all.into_iter().filter(|&group| std::mem::take(&mut out[group])).collect();
        take_out(problem, plan, &missing);
        missing
    }

    /// Neighbours along the routes, around groups near one place.
    fn strings(&mut self, problem: &Problem, plan: &Candidate, count: usize, out: &mut [bool]) {
        let used: Vec<usize> = (0..plan.routes.len()).filter(|&at| !plan.routes[at].is_empty()).collect();
        let route = &plan.routes[used[self.random.usize(..used.len())]];
        let seed = problem.group_of[route[self.random.usize(..route.len())]];
        let mut left = count;
        let around = std::iter::once(seed).chain(self.near[seed].iter().copied());
        let mut touched = vec![false; plan.routes.len()];
        for group in around.collect::<Vec<_>>() {
            let at = |route: &Vec<usize>| route.iter().position(|&atom| problem.group_of[atom] == group);
            let found = plan.routes.iter().enumerate().find_map(|(v, route)| at(route).map(|at| (v, at)));
            let Some((vehicle, at)) = found.filter(|(vehicle, _)| !touched[*vehicle]) else { continue };
            touched[vehicle] = true;
            let route = &plan.routes[vehicle];
            let length = self.random.usize(1..=left.min(route.len()));
            let first = (at + 1).saturating_sub(self.random.usize(1..=length)).min(route.len() - length);
            route[first..first + length].iter().for_each(|&atom| out[problem.group_of[atom]] = true);
            left -= length;
            if left == 0 {
                break;
            }
        }
    }

    /// The groups whose absence saves most, with some chance.
    fn worst(&mut self, problem: &Problem, plan: &Candidate, count: usize, out: &mut [bool]) {
        let mut saved = Vec::new();
        for (vehicle, route) in plan.routes.iter().enumerate() {
            for (at, &atom) in route.iter().enumerate() {
                let from = at.checked_sub(1).map_or(problem.start(), |last| route[last]);
                let way = |to: Option<&usize>, from| to.map_or(0, |&to| problem.travel(vehicle, from, to));
                let next = route.get(at + 1);
                let save = problem.step(vehicle, from, atom) + way(next, atom) - way(next, from);
                saved.push((std::cmp::Reverse(save), problem.group_of[atom]));
            }
        }
        saved.sort_unstable();
        for _ in 0..count.min(saved.len()) {
            let at = (self.random.f64().powi(3) * saved.len() as f64) as usize;
            out[saved.remove(at.min(saved.len() - 1)).1] = true;
        }
    }

    /// One group and those near it.
    fn related(&mut self, all: &[usize], count: usize, out: &mut [bool]) {
        let seed = all[self.random.usize(..all.len())];
        out[seed] = true;
        self.near[seed].iter().take(count - 1).for_each(|&group| out[group] = true);
    }

    /// Takes out what is no longer to be done; gives what is to be done now.
    fn replace(
        &mut self,
        problem: &Problem,
        plan: &mut Candidate,
        chosen: &[bool],
        groups: &[usize],
    ) -> Vec<usize> {
        let gone: Vec<_> =
            (0..chosen.len()).filter(|group| chosen[*group] && !groups.contains(group)).collect();
        take_out(problem, plan, &gone);
        groups.iter().copied().filter(|&group| !chosen[group]).collect()
    }
}

fn take_out(problem: &Problem, plan: &mut Candidate, groups: &[usize]) {
    let mut out = vec![false; problem.groups.len()];
    groups.iter().for_each(|&group| out[group] = true);
    for (vehicle, route) in plan.routes.iter_mut().enumerate() {
        let before = route.len();
        route.retain(|&atom| !out[problem.group_of[atom]]);
        if route.len() != before {
            plan.ends[vehicle] = end(problem, vehicle, route);
        }
    }
    plan.cost = cost(problem, &plan.ends);
}

/// When a vehicle ends that never waits.
pub(super) fn end(problem: &Problem, vehicle: usize, route: &[usize]) -> i64 {
    let mut from = problem.start();
    route.iter().fold(0, |sum: i64, &atom| {
        let step = problem.step(vehicle, std::mem::replace(&mut from, atom), atom);
        (sum + step).min(NEVER)
    })
}
