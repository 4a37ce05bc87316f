//! A plan checked from the request alone: it shares nothing with the searches but the meaning of the algebra.

use super::Assignment;
use super::request::{Precedence, Request};
use crate::plan::algebra::{Algebra, AtomSet, Bits, compose};
use std::collections::BTreeMap;

/// What a plan costs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Evaluation {
    /// When the last vehicle has finished, in milliseconds.
    pub makespan_ms: i64,
    /// The sum of when each has finished.
    pub total_ms: i64,
}

/// Checks a plan against its request: every option and way is the vehicle's own, the relationships are kept and
/// complete, and the times are right. The order of the list is the order of each vehicle.
///
/// # Errors
/// What is wrong with the plan.
pub fn evaluate(request: &Request, plan: &[Assignment]) -> Result<Evaluation, String> {
    let compositions = request.tasks.iter().map(|(&id, task)| (id, task.composition.as_str())).collect();
    let known = |task: i64, option: i64| request.tasks[&task].options.contains_key(&option);
    let expression = compose(&request.relationships, &compositions, &known, request.unnamed)
        .map_err(|error| error.to_string())?;
    let atoms: Vec<(i64, i64)> = expression.atoms().into_iter().copied().collect();
    let place: BTreeMap<_, _> = atoms.iter().enumerate().map(|(at, &atom)| (atom, at)).collect();
    let algebra = expression.map(&mut |atom| place.get(atom).copied().ok_or("an atom is lost"))?;
    let algebra = Algebra::<AtomSet>::new(&algebra, atoms.len());
    let ways: BTreeMap<_, _> =
        request.travel.iter().map(|way| ((way.vehicle, way.from, way.to), way.time_ms)).collect();

    let mut executed = AtomSet::empty(atoms.len());
    let mut at: BTreeMap<i64, (i64, Option<(i64, i64)>)> =
        request.vehicles.iter().map(|&vehicle| (vehicle, (0, None))).collect();
    let mut open: Vec<&Assignment> = plan.iter().collect();
    let mut completed: Vec<(usize, i64)> = Vec::new();
    while !open.is_empty() {
        let mut next = Vec::new();
        algebra.next(&executed, &mut |atom| next.push(atoms[atom]));
        // The first that may come of those that are next on their vehicle.
        let is_first = |at: usize| !open[..at].iter().any(|earlier| earlier.vehicle == open[at].vehicle);
        let may =
            (0..open.len()).find(|&at| is_first(at) && next.contains(&(open[at].task, open[at].option)));
        let Some(found) = may else {
            return Err(format!("the relationships forbid that {:?} comes next", open[0]));
        };
        let assignment = open.remove(found);
        let atom = (assignment.task, assignment.option);
        let (end, last) = at.get_mut(&assignment.vehicle).ok_or("no such vehicle")?;
        let way = ways.get(&(assignment.vehicle, *last, atom)).copied().filter(|&time| time >= 0);
        let way = way.ok_or_else(|| format!("no way for {assignment:?} from {last:?}"))?;
        let option = &request.tasks[&atom.0].options[&atom.1];
        if !option.eligible.is_empty() && !option.eligible.contains(&assignment.vehicle) {
            return Err(format!("{assignment:?}: the vehicle is not eligible"));
        }
        let ready = match request.precedence {
            Precedence::Choice => 0,
            Precedence::Temporal => waits_for(&algebra, &executed, &completed, place[&atom]),
        };
        *end = (*end + way).max(ready) + option.cost_ms;
        *last = Some(atom);
        if *end != assignment.completed_ms {
            return Err(format!("{assignment:?} is complete at {end} ms"));
        }
        executed.insert(place[&atom]);
        completed.push((place[&atom], *end));
    }
    if !algebra.is_complete(&executed) {
        return Err("the relationships ask for more than the plan does".to_owned());
    }
    let ends = || at.values().map(|(end, _)| *end);
    Ok(Evaluation { makespan_ms: ends().max().unwrap_or(0), total_ms: ends().sum() })
}

/// When all that an atom depends on is complete: those without which it could not come now.
fn waits_for(algebra: &Algebra<AtomSet>, executed: &AtomSet, completed: &[(usize, i64)], atom: usize) -> i64 {
    let needed = |&&(earlier, _): &&(usize, i64)| {
        let mut without = AtomSet::empty(algebra.atoms());
        (0..algebra.atoms())
            .filter(|&at| at != earlier && executed.contains(at))
            .for_each(|at| without.insert(at));
        let mut may_come = false;
        algebra.next(&without, &mut |next| may_come |= next == atom);
        !may_come
    };
    completed.iter().filter(needed).map(|(_, end)| *end).max().unwrap_or(0)
}
