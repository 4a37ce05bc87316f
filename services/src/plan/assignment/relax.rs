//! Lower bounds of what is left, by parts: cheap enough for every node of a search.

use super::problem::{NEVER, Part, Problem};

/// What each group takes at least, whoever does it and wherever it comes from.
#[derive(Debug, Clone)]
pub(super) struct Relaxation {
    /// The least way and work into each group.
    least: Vec<i64>,
    /// The same for each vehicle alone: by vehicle, then by group.
    of_vehicle: Vec<Vec<i64>>,
}

/// What is left to do.
#[derive(Debug, Clone, Copy, Default)]
struct Left {
    /// The least sum of ways and works.
    work: i64,
    /// The earliest that the last of it can be complete.
    complete: i64,
}

impl Relaxation {
    pub(super) fn new(problem: &Problem) -> Self {
        let least = |vehicle: usize, group: &Vec<usize>| {
            let steps = group.iter().flat_map(|&atom| {
                let other = (0..=problem.start()).filter(move |&from| {
                    from == problem.start() || problem.group_of[from] != problem.group_of[atom]
                });
                other.map(move |from| problem.step(vehicle, from, atom))
            });
            steps.min().unwrap_or(NEVER)
        };
        let of_vehicle: Vec<Vec<i64>> = (0..problem.vehicles.len())
            .map(|vehicle| problem.groups.iter().map(|group| least(vehicle, group)).collect())
            .collect();
        let groups = 0..problem.groups.len();
        let least =
            groups.map(|group| of_vehicle.iter().map(|row| row[group]).min().unwrap_or(NEVER)).collect();
        Self { least, of_vehicle }
    }

    /// What a group takes at least.
    pub(super) fn least(&self, group: usize) -> i64 {
        self.least[group]
    }

    /// The least makespan and total of any completion, from vehicles that end at `ends` with the groups that `done` tells.
    pub(super) fn bound(&self, parts: &Part, ends: &[i64], done: &impl Fn(usize) -> bool) -> (i64, i64) {
        let left = self.left(parts, ends, done);
        let total = (ends.iter().sum::<i64>() + left.work).min(NEVER);
        let vehicles = i64::try_from(ends.len()).unwrap_or(i64::MAX);
        let shared = total.div_euclid(vehicles) + i64::from(total.rem_euclid(vehicles) > 0);
        let latest = ends.iter().copied().max().unwrap_or(0);
        (latest.max(shared).max(left.complete).min(NEVER), total)
    }

    fn left(&self, part: &Part, ends: &[i64], done: &impl Fn(usize) -> bool) -> Left {
        match part {
            Part::Group(group) if done(*group) => Left::default(),
            Part::Group(group) => {
                let complete = ends.iter().zip(&self.of_vehicle).map(|(end, row)| end + row[*group]);
                Left { work: self.least[*group], complete: complete.min().unwrap_or(NEVER) }
            }
            Part::All(parts) => {
                parts.iter().map(|part| self.left(part, ends, done)).fold(Left::default(), |a, b| Left {
                    work: (a.work + b.work).min(NEVER),
                    complete: a.complete.max(b.complete),
                })
            }
            Part::Choice(parts) => match parts.iter().find(|part| any(part, done)) {
                Some(chosen) => self.left(chosen, ends, done),
                None => {
                    let lefts = parts.iter().map(|part| self.left(part, ends, done));
                    let first = Left { work: NEVER, complete: NEVER };
                    lefts.fold(first, |a, b| Left {
                        work: a.work.min(b.work),
                        complete: a.complete.min(b.complete),
                    })
                }
            },
        }
    }
}

/// Whether a group of a part is done.
pub(super) fn any(part: &Part, done: &impl Fn(usize) -> bool) -> bool {
    match part {
        Part::Group(group) => done(*group),
        Part::All(parts) | Part::Choice(parts) => parts.iter().any(|part| any(part, done)),
    }
}
