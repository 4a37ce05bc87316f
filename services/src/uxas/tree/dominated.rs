//! Options that no plan needs: another one of the same task is never worse, whatever comes before and after.

use crate::plan::algebra::{Expression, Named, Operator, Reading, parse};
use crate::plan::assignment::{Objective, Precedence, Request, TaskOption, Travel};
use crate::uxas::task::composition;
use std::collections::{BTreeMap, BTreeSet};

/// Where a vehicle comes from; none is where it is at first.
type From = Option<Atom>;

/// An option, by task and its own id.
type Atom = (i64, i64);

/// The ways of a request, by vehicle: those to an option, and those from it.
struct Ways {
    to: BTreeMap<(i64, Atom), BTreeMap<From, i64>>,
    from: BTreeMap<(i64, Atom), BTreeMap<Atom, i64>>,
}

impl Ways {
    fn new(request: &Request) -> Self {
        let mut ways = Self { to: BTreeMap::new(), from: BTreeMap::new() };
        // Of a task of which one option is done, no way leads from one option to another.
        let is_used = |way: &&Travel| way.time_ms >= 0 && way.from.is_none_or(|from| from.0 != way.to.0);
        for way in request.travel.iter().filter(is_used) {
            ways.to.entry((way.vehicle, way.to)).or_default().insert(way.from, way.time_ms);
            if let Some(from) = way.from {
                ways.from.entry((way.vehicle, from)).or_default().insert(way.to, way.time_ms);
            }
        }
        ways
    }
}

/// How much longer the ways of one are than those of another at the most; none where one is missing.
fn longer<K: Ord>(one: Option<&BTreeMap<K, i64>>, other: Option<&BTreeMap<K, i64>>) -> Option<i64> {
    let Some(other) = other else { return Some(i64::MIN / 4) };
    let one = one?;
    other.iter().try_fold(i64::MIN / 4, |most, (key, time)| Some(most.max(one.get(key)? - time)))
}

/// Whether a vehicle that does `one` in place of `other` is never later: neither when it is done, nor wherever it goes then.
fn is_never_worse(ways: &Ways, vehicle: i64, one: (Atom, i64), other: (Atom, i64)) -> bool {
    let ((one, one_ms), (other, other_ms)) = (one, other);
    let before = longer(ways.to.get(&(vehicle, one)), ways.to.get(&(vehicle, other)));
    let after = longer(ways.from.get(&(vehicle, one)), ways.from.get(&(vehicle, other)));
    let (Some(before), Some(after)) = (before, after) else { return false };
    one_ms + before <= other_ms && one_ms + before + after <= other_ms
}

/// An expression without the places of its atoms.
fn ids(named: &Expression<Named>) -> Expression<i64> {
    match named {
        Expression::Atom(atom) => Expression::Atom(atom.id),
        Expression::Node(operator, parts) => Expression::Node(*operator, parts.iter().map(ids).collect()),
    }
}

/// The options of a composition that has exactly one of them done, whichever.
fn one_of(composition: &str) -> Option<Vec<i64>> {
    let named = parse(composition, Reading::Strict, "composition").ok()?;
    let Expression::Node(Operator::Alternative, parts) = ids(&named).canonical() else { return None };
    let atom = |part: &Expression<i64>| match part {
        Expression::Atom(id) => Some(*id),
        Expression::Node(..) => None,
    };
    parts.iter().map(atom).collect()
}

/// Takes the options out of a request that no plan needs.
pub(super) fn without_dominated(request: &mut Request) {
    // Who waits for another may profit from what is later; and a sum counts other things than the last end.
    if request.precedence != Precedence::Choice || request.objective != Objective::MinMax {
        return;
    }
    let ways = Ways::new(request);
    let mut gone: BTreeSet<(i64, i64)> = BTreeSet::new();
    for (&task, asked) in &mut request.tasks {
        let Some(set) = one_of(&asked.composition) else { continue };
        for &other in &set {
            let is_beaten = |one: &i64| {
                *one != other
                    && !gone.contains(&(task, *one))
                    && beats(&ways, (task, *one, other), &asked.options)
            };
            if set.iter().any(is_beaten) {
                gone.insert((task, other));
            }
        }
        let left: Vec<i64> = set.into_iter().filter(|&id| !gone.contains(&(task, id))).collect();
        asked.options.retain(|id, _| left.contains(id));
        asked.composition = composition::text(&composition::one_of(left));
    }
    request.travel.retain(|way| !gone.contains(&way.to) && way.from.is_none_or(|from| !gone.contains(&from)));
}

/// Whether an option makes another needless.
fn beats(ways: &Ways, (task, one, other): (i64, i64, i64), options: &BTreeMap<i64, TaskOption>) -> bool {
    let (Some(first), Some(second)) = (options.get(&one), options.get(&other)) else { return false };
    // An empty list means all.
    let may = |vehicle: &i64| first.eligible.is_empty() || first.eligible.contains(vehicle);
    if second.eligible.is_empty() && !first.eligible.is_empty() || !second.eligible.iter().all(may) {
        return false;
    }
    let vehicles: BTreeSet<i64> = match second.eligible.as_slice() {
        [] => ways.to.keys().filter(|(_, to)| *to == (task, other)).map(|(vehicle, _)| *vehicle).collect(),
        some => some.iter().copied().collect(),
    };
    let (one, other) = (((task, one), first.cost_ms), ((task, other), second.cost_ms));
    !vehicles.is_empty() && vehicles.iter().all(|&vehicle| is_never_worse(ways, vehicle, one, other))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::assignment::instance::{Related, random_request};
    use crate::plan::assignment::{Effort, assign};

    #[test]
    fn the_best_plan_stays_as_good() {
        let mut fewer = 0;
        for seed in 0..60 {
            let mut request = random_request(seed, 2, 4, 4, Related::Parallel, Objective::MinMax);
            request.precedence = Precedence::Choice;
            // Costs that differ more than ways do, so that something is dominated.
            request
                .tasks
                .values_mut()
                .flat_map(|task| task.options.values_mut())
                .for_each(|option| option.cost_ms *= 20);
            let before: usize = request.tasks.values().map(|task| task.options.len()).sum();
            let whole = assign(&request, Effort::default());
            without_dominated(&mut request);
            let after: usize = request.tasks.values().map(|task| task.options.len()).sum();
            fewer += before - after;
            let makespan =
                |plan: Result<crate::plan::assignment::Plan, _>| plan.map(|plan| plan.makespan_ms).ok();
            assert_eq!(makespan(assign(&request, Effort::default())), makespan(whole), "seed {seed}");
        }
        assert!(fewer > 50, "{fewer}");
    }
}
