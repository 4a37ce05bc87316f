//! Another branch of a choice.

use super::super::problem::{Part, Problem};
use super::super::relax::any;

/// The groups to be done when one of the choices that are open to `chosen` takes another branch; none where there is
/// no choice.
pub(super) fn switched(problem: &Problem, chosen: &[bool], random: &mut fastrand::Rng) -> Option<Vec<usize>> {
    let count = choices(&problem.parts, chosen);
    if count == 0 {
        return None;
    }
    let mut target = random.usize(..count);
    let mut groups = Vec::new();
    select(&problem.parts, chosen, &mut Some(&mut target), random, &mut groups);
    Some(groups)
}

fn is_chosen(part: &Part, chosen: &[bool]) -> bool {
    any(part, &|group| chosen[group])
}

/// How many choices are open.
fn choices(part: &Part, chosen: &[bool]) -> usize {
    match part {
        Part::Group(_) => 0,
        Part::All(parts) => parts.iter().map(|part| choices(part, chosen)).sum(),
        Part::Choice(parts) => {
            let branch = parts.iter().find(|part| is_chosen(part, chosen));
            1 + branch.map_or(0, |branch| choices(branch, chosen))
        }
    }
}

/// Keeps the branches of `chosen`, but for the choice that `target` counts down to; below a new branch all is chance.
fn select(
    part: &Part,
    chosen: &[bool],
    target: &mut Option<&mut usize>,
    random: &mut fastrand::Rng,
    groups: &mut Vec<usize>,
) {
    match part {
        Part::Group(group) => groups.push(*group),
        Part::All(parts) => parts.iter().for_each(|part| select(part, chosen, target, random, groups)),
        Part::Choice(parts) => {
            let old = parts.iter().position(|part| is_chosen(part, chosen));
            let is_target = target.as_deref_mut().is_some_and(|left| {
                let hit = *left == 0;
                *left = left.wrapping_sub(1);
                hit
            });
            match old {
                Some(old) if !is_target => select(&parts[old], chosen, target, random, groups),
                _ => {
                    let others = parts.len() - usize::from(old.is_some());
                    let mut new = random.usize(..others.max(1));
                    new += usize::from(old.is_some_and(|old| new >= old && parts.len() > 1));
                    select(&parts[new], chosen, &mut None, random, groups);
                }
            }
        }
    }
}
