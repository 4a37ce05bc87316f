//! Ways to put tasks into a plan.

use super::super::problem::{NEVER, Problem};
use super::super::schedule::schedule;
use super::{Candidate, Neighbourhood, cost, weight};

/// How many ways there are.
pub(super) const WAYS: usize = 3;

/// One in so many places is overlooked, so that the same tasks do not always come to the same places.
const BLINK: u32 = 64;

/// How many of the best places are tried where the order matters.
const TRIED_MAX: usize = 12;

/// Which task is put in next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    /// By number: what comes before something has the lower number.
    AsTheyCome,
    /// By chance.
    Random,
    /// The one that loses most if it does not get its best vehicle.
    Regret,
}

impl Order {
    pub(super) fn of(way: usize) -> Self {
        [Self::AsTheyCome, Self::Random, Self::Regret][way]
    }
}

/// A place for a task.
#[derive(Debug, Clone, Copy)]
struct Place {
    added: f64,
    vehicle: usize,
    at: usize,
    atom: usize,
    end: i64,
}

impl Neighbourhood {
    /// Puts groups in, each where it costs least then. Whether all have found a place.
    pub(super) fn insert_all(
        &mut self,
        problem: &Problem,
        plan: &mut Candidate,
        mut missing: Vec<usize>,
        order: Order,
        nodes: &mut u64,
    ) -> bool {
        match order {
            Order::AsTheyCome => missing.sort_unstable(),
            Order::Random => self.random.shuffle(&mut missing),
            Order::Regret => {}
        }
        missing.reverse();
        while !missing.is_empty() {
            let next = match order {
                Order::Regret => self.most_regretted(problem, plan, &missing, nodes),
                _ => missing.len() - 1,
            };
            *nodes += 1;
            if !self.insert(problem, plan, missing.swap_remove(next)) {
                return false;
            }
        }
        plan.cost = match problem.temporal {
            false => cost(problem, &plan.ends),
            true => match schedule(problem, &plan.routes) {
                Some(times) => {
                    let ends = times.completed.iter().map(|route| route.last().copied().unwrap_or(0));
                    cost(problem, &ends.collect::<Vec<_>>())
                }
                None => return false,
            },
        };
        true
    }

    fn most_regretted(
        &mut self,
        problem: &Problem,
        plan: &Candidate,
        missing: &[usize],
        nodes: &mut u64,
    ) -> usize {
        let mut most = (f64::NEG_INFINITY, 0);
        for (at, &group) in missing.iter().enumerate() {
            *nodes += 1;
            let (mut best, mut second) = (f64::INFINITY, f64::INFINITY);
            places(problem, plan, group, &mut |place| {
                if place.added < best {
                    (best, second) = (place.added, best);
                } else {
                    second = second.min(place.added);
                }
            });
            let regret = if second.is_finite() { second - best } else { f64::MAX };
            if regret > most.0 {
                most = (regret, at);
            }
        }
        most.1
    }

    fn insert(&mut self, problem: &Problem, plan: &mut Candidate, group: usize) -> bool {
        if problem.has_order() {
            return self.insert_in_order(problem, plan, group);
        }
        let mut best: Option<Place> = None;
        let random = &mut self.random;
        places(problem, plan, group, &mut |place| {
            if best.is_none_or(|best| place.added < best.added) && random.u32(..BLINK) != 0 {
                best = Some(place);
            }
        });
        // Where chance overlooked all, none is overlooked.
        if best.is_none() {
            places(problem, plan, group, &mut |place| best = Some(best.unwrap_or(place)));
        }
        best.map(|place| put(plan, place)).is_some()
    }

    /// The same where some places break the order: the best that does not.
    fn insert_in_order(&mut self, problem: &Problem, plan: &mut Candidate, group: usize) -> bool {
        let mut all = Vec::new();
        places(problem, plan, group, &mut |place| all.push(place));
        all.sort_by(|a, b| a.added.total_cmp(&b.added));
        all.retain(|_| self.random.u32(..BLINK) != 0 || problem.atoms.len() < 8);
        // The ends of the routes always keep the order when tasks come by number.
        let last = |place: &Place| place.at == plan.routes[place.vehicle].len();
        let lasts: Vec<_> = all.iter().copied().filter(last).collect();
        all.truncate(TRIED_MAX);
        let mut best: Option<(f64, Place)> = None;
        for place in all.into_iter().chain(lasts) {
            if best.is_some() && !problem.temporal {
                break;
            }
            let mut tried = plan.clone();
            put(&mut tried, place);
            let Some(times) = schedule(problem, &tried.routes) else { continue };
            let ends: Vec<_> =
                times.completed.iter().map(|route| route.last().copied().unwrap_or(0)).collect();
            let cost = cost(problem, &ends);
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, place));
            }
        }
        best.map(|(_, place)| put(plan, place)).is_some()
    }
}

fn put(plan: &mut Candidate, place: Place) {
    plan.routes[place.vehicle].insert(place.at, place.atom);
    plan.ends[place.vehicle] = place.end;
}

/// Tells every place that a group could take.
fn places(problem: &Problem, plan: &Candidate, group: usize, tell: &mut impl FnMut(Place)) {
    for (vehicle, route) in plan.routes.iter().enumerate() {
        let before = weight(problem, plan.ends[vehicle]);
        for &atom in &problem.groups[group] {
            for at in 0..=route.len() {
                let from = at.checked_sub(1).map_or(problem.start(), |last| route[last]);
                let step = problem.step(vehicle, from, atom);
                let (onwards, spared) = match route.get(at) {
                    Some(&next) => (problem.travel(vehicle, atom, next), problem.travel(vehicle, from, next)),
                    None => (0, 0),
                };
                if step >= NEVER || onwards >= NEVER {
                    continue;
                }
                let end = plan.ends[vehicle] + step + onwards - spared;
                tell(Place { added: weight(problem, end) - before, vehicle, at, atom, end });
            }
        }
    }
}
