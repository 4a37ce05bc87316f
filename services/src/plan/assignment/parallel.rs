//! All tasks in any order: exact, by dynamic programming over sets of tasks.
//!
//! For each vehicle the earliest end over every set of tasks and last option; then the vehicles share the tasks.

use super::problem::{NEVER, Problem};
use super::schedule::Routes;

/// The most groups: the tables of more do not fit.
const GROUPS_MAX: usize = 20;

/// The most entries of one vehicle's table: 256 MB.
const TABLE_MAX: usize = 1 << 25;

/// How many entries of the tables are looked at in the time of one node of a tree search.
const ENTRIES_PER_NODE: u64 = 1024;

/// The nodes that the tables cost, or none where they do not fit.
pub(super) fn nodes(problem: &Problem) -> Option<u64> {
    let (groups, atoms) = (problem.groups.len(), problem.atoms.len());
    if !problem.is_parallel() || groups > GROUPS_MAX || atoms << groups > TABLE_MAX {
        return None;
    }
    let vehicles = problem.vehicles.len() as u64;
    let tables = vehicles * ((atoms * atoms) << groups) as u64 / 2;
    let shares = 2 * vehicles.saturating_sub(2) * 3_u64.pow(groups as u32);
    Some((tables + shares) / ENTRIES_PER_NODE + 1)
}

/// The best routes, or none where there are none.
pub(super) fn solve(problem: &Problem) -> Option<Routes> {
    let vehicles = problem.vehicles.len();
    let all = (1 << problem.groups.len()) - 1;
    let mut ends: Vec<Vec<i64>> = Vec::with_capacity(vehicles);
    for vehicle in 0..vehicles {
        let twin = (0..vehicle).find(|&twin| problem.ways(twin) == problem.ways(vehicle));
        ends.push(match twin {
            Some(twin) => ends[twin].clone(),
            None => Table::new(problem, vehicle, all).ends(),
        });
    }
    let shares = share(problem, &ends)?;
    Some(shares.iter().enumerate().map(|(vehicle, &set)| Table::new(problem, vehicle, set).route()).collect())
}

/// The earliest ends of one vehicle, for sets of groups within `within` and the option done last.
struct Table<'a> {
    problem: &'a Problem,
    vehicle: usize,
    within: usize,
    ends: Vec<i64>,
    /// The ways into each atom, from each in turn.
    into: Vec<i64>,
}

impl<'a> Table<'a> {
    fn new(problem: &'a Problem, vehicle: usize, within: usize) -> Self {
        let atoms = problem.atoms.len();
        let into = (0..atoms).flat_map(|to| (0..atoms).map(move |from| problem.travel(vehicle, from, to)));
        let (ends, into) = (vec![NEVER; (within + 1) * atoms], into.collect());
        let mut table = Self { problem, vehicle, within, ends, into };
        for set in (1..=within).filter(|set| set & !within == 0) {
            for atom in (0..atoms).filter(|&atom| set >> problem.group_of[atom] & 1 == 1) {
                table.ends[set * atoms + atom] = table.earliest(set, atom);
            }
        }
        table
    }

    /// When the vehicle can be at an atom at the earliest, from each of the atoms that it may have done last.
    fn arrivals(&self, rest: usize, atom: usize) -> impl Iterator<Item = i64> {
        let atoms = self.problem.atoms.len();
        let former = &self.ends[rest * atoms..(rest + 1) * atoms];
        former.iter().zip(&self.into[atom * atoms..(atom + 1) * atoms]).map(|(end, way)| end + way)
    }

    /// The earliest end of a set with this atom last.
    fn earliest(&self, set: usize, atom: usize) -> i64 {
        let rest = set & !(1 << self.problem.group_of[atom]);
        if rest == 0 {
            return self.problem.step(self.vehicle, self.problem.start(), atom);
        }
        let arrival = self.arrivals(rest, atom).fold(NEVER, i64::min);
        (arrival + self.problem.service[atom]).min(NEVER)
    }

    /// The earliest end of each set.
    fn ends(&self) -> Vec<i64> {
        let atoms = self.problem.atoms.len();
        let mut ends: Vec<_> =
            self.ends.chunks_exact(atoms).map(|row| row.iter().copied().min().unwrap_or(NEVER)).collect();
        ends[0] = 0;
        ends
    }

    /// The order in which the whole set ends earliest.
    fn route(&self) -> Vec<usize> {
        let (mut set, mut route) = (self.within, Vec::new());
        let last = |&atom: &usize| self.ends[set * self.problem.atoms.len() + atom];
        let mut next = if set == 0 { None } else { (0..self.problem.atoms.len()).min_by_key(last) };
        while let Some(atom) = next {
            route.push(atom);
            set &= !(1 << self.problem.group_of[atom]);
            let best = self.arrivals(set, atom).enumerate().min_by_key(|(_, arrival)| *arrival);
            next = best.map(|(from, _)| from).filter(|_| set != 0);
        }
        route.reverse();
        route
    }
}

/// Which set of groups each vehicle takes.
fn share(problem: &Problem, ends: &[Vec<i64>]) -> Option<Vec<usize>> {
    use super::Objective::{Cumulative, MinMax};
    match problem.objective {
        Cumulative => {
            let add = |(total, latest): (i64, i64), end: i64| ((total + end).min(NEVER), latest.max(end));
            divide(ends, (0, 0), (NEVER, NEVER), add)
        }
        MinMax => {
            // The latest end first; then, among all plans that keep it, the least sum.
            let shares = divide(ends, 0, NEVER, i64::max)?;
            let latest = shares.iter().zip(ends).map(|(&set, ends)| ends[set]).max().unwrap_or(0);
            let add = |total: i64, end: i64| if end > latest { NEVER } else { (total + end).min(NEVER) };
            divide(ends, 0, NEVER, add)
        }
    }
}

/// Divides all groups among the vehicles so that the value, which begins at `none` and which `add` makes larger by a vehicle's
/// end, is least, and below `worst`.
fn divide<V: Copy + Ord>(
    ends: &[Vec<i64>],
    none: V,
    worst: V,
    add: impl Fn(V, i64) -> V,
) -> Option<Vec<usize>> {
    let (sets, last) = (ends[0].len(), ends.len() - 1);
    let mut values: Vec<_> = ends[0].iter().map(|&end| add(none, end)).collect();
    let mut taken: Vec<Vec<u32>> = vec![(0..sets as u32).collect()];
    for (vehicle, ends) in ends.iter().enumerate().skip(1) {
        // Of the last vehicle only the whole is asked.
        let from = if vehicle == last { sets - 1 } else { 0 };
        let (mut next, mut parts) = (vec![worst; sets], vec![0; sets]);
        for set in from..sets {
            let (mut best, mut best_part, mut part) = (worst, 0, set);
            loop {
                let value = add(values[set & !part], ends[part]);
                if value <= best {
                    (best, best_part) = (value, part);
                }
                if part == 0 {
                    break;
                }
                part = (part - 1) & set;
            }
            (next[set], parts[set]) = (best, best_part as u32);
        }
        values = next;
        taken.push(parts);
    }
    let mut rest = sets - 1;
    (values[rest] < worst).then_some(())?;
    let mut shares: Vec<_> = taken
        .iter()
        .rev()
        .map(|taken| {
            let part = taken[rest] as usize;
            rest &= !part;
            part
        })
        .collect();
    shares.reverse();
    Some(shares)
}
