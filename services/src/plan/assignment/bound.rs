//! A lower bound for large problems, by Lagrangian relaxation.
//!
//! Every plan reaches each group once. So with a price on leaving each option, which is paid back on entering it, no plan costs
//! less than the cheapest arborescence over the groups; prices are raised where it leaves an option more than once, as Held
//! and Karp do. The makespan is at least any mean of the vehicles' ends, so vehicles have weights, which are moved too.

use super::arborescence::{Costs, arborescence};
use super::problem::{NEVER, Part, Problem};
use super::request::Objective;

/// How often prices are moved at most.
const ROUNDS: usize = 200;

/// How many ways are looked at in all rounds: of large problems there are fewer rounds, but never fewer than …
const LOOKS_MAX: usize = 200_000_000;

/// … this.
const ROUNDS_MIN: usize = 5;

/// Rounds without a better bound after which smaller steps are made.
const PATIENCE: usize = 12;

struct Prices {
    /// Paid on leaving each atom.
    leave: Vec<f64>,
    /// Paid on leaving the start, by vehicle.
    start: Vec<f64>,
    /// The weight of each vehicle's end.
    weight: Vec<f64>,
}

/// A way between groups: whose, from which atom (or the start), to which.
type Way = (usize, usize, usize);

/// The least makespan (or total, where that is the objective) of any plan; none where there is a choice of more than options,
/// or where no plan reaches all. `value` is of a known plan.
pub(super) fn bound(problem: &Problem, value: i64) -> Option<i64> {
    let mandatory = match &problem.parts {
        Part::Group(_) => true,
        parts => is_mandatory(parts),
    };
    if !mandatory {
        return None;
    }
    let vehicles = problem.vehicles.len();
    let weight = match problem.objective {
        Objective::MinMax => 1.0 / vehicles as f64,
        Objective::Cumulative => 1.0,
    };
    let mut prices = Prices {
        leave: vec![0.0; problem.atoms.len()],
        start: vec![0.0; vehicles],
        weight: vec![weight; vehicles],
    };
    let (mut best, mut scale, mut since) = (0.0_f64, 1.0, 0);
    let looks = (vehicles * problem.atoms.len() * problem.atoms.len()).max(1);
    for _ in 0..(LOOKS_MAX / looks).clamp(ROUNDS_MIN, ROUNDS) {
        let (costs, ways) = priced(problem, &prices);
        let origins = arborescence(&costs)?;
        let sum: f64 =
            origins.iter().enumerate().map(|(to, &from)| costs.costs[from * costs.nodes + to]).sum();
        let found = sum - prices.start.iter().sum::<f64>();
        if found > best * (1.0 + 1e-6) {
            since = 0;
        } else {
            since += 1;
        }
        best = best.max(found);
        if since > PATIENCE {
            (scale, since) = (scale * 0.7, 0);
        }
        let used: Vec<Way> =
            origins.iter().enumerate().map(|(to, &from)| ways[from * costs.nodes + to]).collect();
        if !prices.follow(problem, &used, (value as f64 - found).max(0.0), scale) {
            break;
        }
    }
    // Rounding up is right for whole milliseconds; sums of floating point numbers may be too large by a hair.
    Some((best * (1.0 - 1e-10)).ceil() as i64)
}

fn is_mandatory(part: &Part) -> bool {
    match part {
        Part::Group(_) => true,
        Part::All(parts) => parts.iter().all(is_mandatory),
        Part::Choice(_) => false,
    }
}

/// The cheapest way from each group to each other, the last "group" being the start.
fn priced(problem: &Problem, prices: &Prices) -> (Costs, Vec<Way>) {
    let nodes = problem.groups.len() + 1;
    let mut costs = Costs { nodes, costs: vec![f64::INFINITY; nodes * nodes] };
    let mut ways = vec![(0, 0, 0); nodes * nodes];
    for vehicle in 0..problem.vehicles.len() {
        let weight = prices.weight[vehicle];
        for from in 0..=problem.start() {
            let (group, paid) = match problem.group_of.get(from) {
                Some(&group) => (group, prices.leave[from]),
                None => (nodes - 1, prices.start[vehicle]),
            };
            for (to, &back) in prices.leave.iter().enumerate() {
                let (other, step) = (problem.group_of[to], problem.step(vehicle, from, to));
                if group == other || step >= NEVER {
                    continue;
                }
                let cost = step as f64 * weight + paid - back;
                let place = group * nodes + other;
                if cost < costs.costs[place] {
                    costs.costs[place] = cost;
                    ways[place] = (vehicle, from, to);
                }
            }
        }
    }
    (costs, ways)
}

impl Prices {
    /// Moves prices against what was used too often or too seldom. Whether anything was.
    fn follow(&mut self, problem: &Problem, used: &[Way], distance: f64, scale: f64) -> bool {
        let vehicles = self.start.len();
        let (mut leave, mut start) = (vec![0.0; self.leave.len()], vec![-1.0; vehicles]);
        let mut ends = vec![0.0; vehicles];
        for &(vehicle, from, to) in used {
            match leave.get_mut(from) {
                Some(left) => *left += 1.0,
                None => start[vehicle] += 1.0,
            }
            leave[to] -= 1.0;
            ends[vehicle] += problem.step(vehicle, from, to) as f64;
        }
        // A price that is 0 and would fall stays.
        let moves = |(way, price): (&f64, &f64)| if *price <= 0.0 && *way < 0.0 { 0.0 } else { way * way };
        let length: f64 = leave.iter().zip(&self.leave).map(moves).sum::<f64>()
            + start.iter().zip(&self.start).map(moves).sum::<f64>();
        if length <= 0.0 {
            return false;
        }
        let step = scale * distance / length;
        let shift = |(price, way): (&mut f64, &f64)| *price = (*price + step * way).max(0.0);
        self.leave.iter_mut().zip(&leave).for_each(shift);
        self.start.iter_mut().zip(&start).for_each(shift);
        if problem.objective == Objective::MinMax {
            self.weigh(&ends, scale);
        }
        true
    }

    /// Gives more weight to vehicles that are used more than others, the sum kept.
    fn weigh(&mut self, ends: &[f64], scale: f64) {
        let sum: f64 = ends.iter().sum();
        if sum <= 0.0 {
            return;
        }
        let count = ends.len() as f64;
        for (weight, end) in self.weight.iter_mut().zip(ends) {
            *weight = (*weight + 0.02 * scale * (end / sum - 1.0 / count) / count).max(0.0);
        }
        let weights: f64 = self.weight.iter().sum();
        self.weight.iter_mut().for_each(|weight| *weight /= weights);
    }
}
