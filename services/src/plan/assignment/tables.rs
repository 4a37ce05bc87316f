//! Exact, by dynamic programming over sets of tasks: where vehicles do not wait for each other.
//!
//! For each vehicle the earliest end over every set of tasks and last option, in the orders that the process allows; then the
//! vehicles share the tasks of one of the selections that it leaves. That the orders of several vehicles may wait for each other in
//! a circle is left out: so what is found is a bound, and the best plan where it can be kept.

use super::problem::{NEVER, Part, Problem};
use super::schedule::Routes;

/// The most groups: the tables of more do not fit.
const GROUPS_MAX: usize = 20;

/// The most entries of one vehicle's table: 256 MB.
const TABLE_MAX: usize = 1 << 25;

/// The most selections of groups that are tried.
const SELECTIONS_MAX: usize = 64;

/// How many entries of the tables are looked at in the time of one node of a tree search.
const ENTRIES_PER_NODE: u64 = 1024;

/// The nodes that the tables cost, or none where they do not fit, or where vehicles wait for each other.
pub(super) fn nodes(problem: &Problem) -> Option<u64> {
    let (groups, atoms) = (problem.groups.len(), problem.atoms.len());
    let waits = problem.temporal && problem.has_order();
    if waits || !problem.is_once() || groups > GROUPS_MAX || atoms << groups > TABLE_MAX {
        return None;
    }
    let selections = selections(&problem.parts)?;
    let vehicles = problem.vehicles.len() as u64;
    let tables = vehicles * ((atoms * atoms) << groups) as u64 / 2;
    let share = |set: &usize| 2 * vehicles.saturating_sub(2) * 3_u64.pow(set.count_ones());
    Some((tables + selections.iter().map(share).sum::<u64>()) / ENTRIES_PER_NODE + 1)
}

/// The best routes, as far as no circle of waiting is in them, with their makespan and total; none where there are none.
pub(super) fn solve(problem: &Problem) -> Option<(Routes, (i64, i64))> {
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
    let routes = shares.iter().enumerate();
    let routes = routes.map(|(vehicle, &set)| Table::new(problem, vehicle, set).route()).collect();
    let last = || shares.iter().zip(&ends).map(|(&set, ends)| ends[set]);
    Some((routes, (last().max().unwrap_or(0), last().sum())))
}

/// The sets of groups of which one must be done; none where they are too many.
fn selections(part: &Part) -> Option<Vec<usize>> {
    let found = match part {
        Part::Group(group) => vec![1 << group],
        Part::All(parts) => {
            let mut all = vec![0];
            for part in parts {
                let more = selections(part)?;
                all = all.iter().flat_map(|&set| more.iter().map(move |&other| set | other)).collect();
                if all.len() > SELECTIONS_MAX {
                    return None;
                }
            }
            all
        }
        Part::Choice(parts) => {
            parts.iter().map(selections).collect::<Option<Vec<_>>>()?.into_iter().flatten().collect()
        }
    };
    (found.len() <= SELECTIONS_MAX).then_some(found)
}

/// The earliest ends of one vehicle, for sets of groups within `within` and the option done last.
struct Table<'a> {
    problem: &'a Problem,
    vehicle: usize,
    within: usize,
    ends: Vec<i64>,
    /// The groups that each group comes before.
    before: Vec<usize>,
    /// The ways into each atom, from each in turn.
    into: Vec<i64>,
}

impl<'a> Table<'a> {
    fn new(problem: &'a Problem, vehicle: usize, within: usize) -> Self {
        let atoms = problem.atoms.len();
        let into = (0..atoms).flat_map(|to| (0..atoms).map(move |from| problem.travel(vehicle, from, to)));
        let (ends, into) = (vec![NEVER; (within + 1) * atoms], into.collect());
        let mut before = vec![0; problem.groups.len()];
        for (group, earlier) in problem.before.iter().enumerate() {
            earlier.iter().for_each(|&earlier| before[earlier] |= 1 << group);
        }
        let mut table = Self { problem, vehicle, within, ends, before, into };
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
        let group = self.problem.group_of[atom];
        let rest = set & !(1 << group);
        if rest & self.before[group] != 0 {
            return NEVER;
        }
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
    let selections = selections(&problem.parts)?;
    match problem.objective {
        Cumulative => {
            let add = |(total, latest): (i64, i64), end: i64| ((total + end).min(NEVER), latest.max(end));
            divide(ends, &selections, (0, 0), (NEVER, NEVER), add)
        }
        MinMax => {
            // The latest end first; then, among all plans that keep it, the least sum.
            let shares = divide(ends, &selections, 0, NEVER, i64::max)?;
            let latest = shares.iter().zip(ends).map(|(&set, ends)| ends[set]).max().unwrap_or(0);
            let add = |total: i64, end: i64| if end > latest { NEVER } else { (total + end).min(NEVER) };
            divide(ends, &selections, 0, NEVER, add)
        }
    }
}

/// Divides the groups of one of the selections among the vehicles so that the value, which begins at `none` and which `add` makes
/// larger by a vehicle's end, is least, and below `worst`.
fn divide<V: Copy + Ord>(
    ends: &[Vec<i64>],
    selections: &[usize],
    none: V,
    worst: V,
    add: impl Fn(V, i64) -> V,
) -> Option<Vec<usize>> {
    let mut best: Option<(V, Vec<usize>)> = None;
    for &whole in selections {
        let (value, shares) = divide_whole(ends, whole, none, worst, &add);
        if value < best.as_ref().map_or(worst, |best| best.0) {
            best = Some((value, shares));
        }
    }
    best.map(|(_, shares)| shares)
}

/// The least value, and the set of each vehicle.
fn divide_whole<V: Copy + Ord>(
    ends: &[Vec<i64>],
    whole: usize,
    none: V,
    worst: V,
    add: &impl Fn(V, i64) -> V,
) -> (V, Vec<usize>) {
    let (sets, last) = (whole + 1, ends.len() - 1);
    let mut values: Vec<_> = ends[0][..sets].iter().map(|&end| add(none, end)).collect();
    let mut taken: Vec<Vec<u32>> = vec![(0..sets as u32).collect()];
    for (vehicle, ends) in ends.iter().enumerate().skip(1) {
        // Of the last vehicle only the whole is asked.
        let from = if vehicle == last { whole } else { 0 };
        let (mut next, mut parts) = (vec![worst; sets], vec![0; sets]);
        for set in (from..sets).filter(|set| set & !whole == 0) {
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
    let mut rest = whole;
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
    (values[whole], shares)
}
