//! How the options of a task are related, as text and with options taken out.

use crate::plan::algebra::{Expression, Operator};

/// One of these options.
pub fn one_of(ids: impl IntoIterator<Item = i64>) -> Expression<i64> {
    Expression::Node(Operator::Alternative, ids.into_iter().map(Expression::Atom).collect())
}

/// All of these options, by different vehicles.
pub fn all_of(ids: impl IntoIterator<Item = i64>) -> Expression<i64> {
    Expression::Node(Operator::Parallel, ids.into_iter().map(Expression::Atom).collect())
}

/// The text that other services read: a blank stands after every atom.
pub fn text(expression: &Expression<i64>) -> String {
    match expression {
        Expression::Atom(id) => format!("p{id} "),
        Expression::Node(operator, parts) => {
            format!("{operator}({})", parts.iter().map(text).collect::<Vec<_>>().join(""))
        }
    }
}

/// The expression without options that cannot be done; none where nothing is left. What needs all of its parts goes with
/// any of them.
pub fn without(expression: &Expression<i64>, is_dead: &impl Fn(i64) -> bool) -> Option<Expression<i64>> {
    match expression {
        Expression::Atom(id) => (!is_dead(*id)).then_some(Expression::Atom(*id)),
        Expression::Node(Operator::Alternative, parts) => {
            let left: Vec<_> = parts.iter().filter_map(|part| without(part, is_dead)).collect();
            (!left.is_empty()).then_some(Expression::Node(Operator::Alternative, left))
        }
        Expression::Node(operator, parts) => {
            let left: Option<Vec<_>> = parts.iter().map(|part| without(part, is_dead)).collect();
            left.map(|left| Expression::Node(*operator, left))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_done_takes_with_it_what_needs_it() {
        let teams = Expression::Node(Operator::Alternative, vec![all_of([1, 2]), all_of([3, 4])]);
        assert_eq!(text(&teams), "+(|(p1 p2 )|(p3 p4 ))");
        assert_eq!(text(&without(&teams, &|id| id == 2).unwrap()), "+(|(p3 p4 ))");
        assert_eq!(without(&teams, &|id| id % 2 == 0), None);
    }
}
