//! A request's relationships between tasks, with each task's composition in its place.

use super::error::{AlgebraError, Mistake};
use super::parse::{Reading, parse};
use super::{Expression, Named, Operator};
use std::collections::{BTreeMap, BTreeSet};

/// The name of the first text.
const RELATIONSHIPS: &str = "the task relationships";

/// What becomes of a task of the request that its relationships do not name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Unnamed {
    /// It is a mistake.
    #[default]
    Refuse,
    /// It is left out of the plan, as the reference does.
    LeaveOut,
}

/// Puts the compositions of the tasks into the relationships of the request. Atoms of the result are task and option, and
/// `known` says which there are. Without relationships all tasks are done in any order.
///
/// # Errors
/// The first mistake in one of the texts: wrong form, a task or option that is not there, one named twice, a task that is
/// left out.
pub fn compose(
    relationships: &str,
    compositions: &BTreeMap<i64, &str>,
    known: &impl Fn(i64, i64) -> bool,
    unnamed: Unnamed,
) -> Result<Expression<(i64, i64)>, AlgebraError> {
    let relations = if relationships.trim().is_empty() {
        let tasks = compositions.keys().map(|&id| Expression::Atom(Named { id, at: 0 })).collect();
        Expression::Node(Operator::Parallel, tasks)
    } else {
        parse(relationships, Reading::Strict, RELATIONSHIPS)?
    };
    let wrong = |at, mistake| AlgebraError {
        whose: RELATIONSHIPS.to_owned(),
        text: relationships.to_owned(),
        at,
        mistake,
    };
    let whole = substitute(&relations, &mut |atom: &Named| {
        let text = compositions.get(&atom.id).ok_or_else(|| wrong(atom.at, Mistake::NoSuchTask(atom.id)))?;
        let whose = format!("the composition of task {}", atom.id);
        parse(text, Reading::Strict, &whose)?.map(&mut |option: &Named| {
            let (task, option, at) = (atom.id, option.id, option.at);
            let mistake = Mistake::NoSuchOption { task, option };
            let missing = || AlgebraError { whose: whose.clone(), text: (*text).to_owned(), at, mistake };
            known(task, option).then_some((task, option)).ok_or_else(missing)
        })
    })?;
    let named: BTreeSet<_> = relations.atoms().into_iter().map(|atom| atom.id).collect();
    let left_out = compositions.keys().find(|task| !named.contains(task));
    if let (Some(&task), Unnamed::Refuse) = (left_out, unnamed) {
        return Err(wrong(relationships.len(), Mistake::LeftOut(task)));
    }
    Ok(whole)
}

/// Puts an expression in the place of each atom.
fn substitute<A, B, E>(
    expression: &Expression<A>,
    change: &mut impl FnMut(&A) -> Result<Expression<B>, E>,
) -> Result<Expression<B>, E> {
    Ok(match expression {
        Expression::Atom(atom) => change(atom)?,
        Expression::Node(operator, parts) => {
            let parts = parts.iter().map(|part| substitute(part, change)).collect::<Result<_, E>>()?;
            Expression::Node(*operator, parts)
        }
    })
}
