//! Which tasks may follow one another on a vehicle, as far as the relationships say so.

use crate::plan::algebra::{Expression, Named, Operator, Reading, parse};
use std::collections::BTreeSet;

/// Pairs of tasks that no plan has in this order.
pub(super) struct Needed {
    never: BTreeSet<(i64, i64)>,
}

impl Needed {
    /// What relationships leave. A text with mistakes leaves all: who assigns tells the mistakes.
    pub(super) fn new(relationships: &str, tasks: &[i64]) -> Self {
        let mut never: BTreeSet<(i64, i64)> = tasks.iter().map(|&task| (task, task)).collect();
        if let Ok(expression) = parse(relationships, Reading::Strict, "relationships") {
            forbid(&expression, &mut never);
        }
        Self { never }
    }

    /// Whether a task may come after another on a vehicle.
    pub(super) fn may_follow(&self, before: i64, after: i64) -> bool {
        before != after && !self.never.contains(&(before, after))
    }
}

fn forbid(expression: &Expression<Named>, never: &mut BTreeSet<(i64, i64)>) {
    let Expression::Node(operator, parts) = expression else { return };
    let of = |part: &Expression<Named>| part.atoms().into_iter().map(|atom| atom.id).collect::<Vec<_>>();
    for (at, part) in parts.iter().enumerate() {
        forbid(part, never);
        for later in &parts[at + 1..] {
            for (a, b) in of(part).into_iter().flat_map(|a| of(later).into_iter().map(move |b| (a, b))) {
                match operator {
                    Operator::Sequential => drop(never.insert((b, a))),
                    Operator::Alternative => never.extend([(a, b), (b, a)]),
                    Operator::Parallel => {}
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_before_never_follows_and_of_two_ways_one_is_gone() {
        let needed = Needed::new("|(.(p1 +(p3 p5)) .(p2 p4 p6))", &[1, 2, 3, 4, 5, 6]);
        assert!(needed.may_follow(1, 3) && !needed.may_follow(3, 1));
        assert!(!needed.may_follow(3, 5) && !needed.may_follow(5, 3));
        assert!(needed.may_follow(6, 1) && needed.may_follow(2, 6) && !needed.may_follow(6, 4));
        assert!(Needed::new("", &[1, 2]).may_follow(2, 1));
        assert!(!Needed::new("", &[1, 2]).may_follow(2, 2));
        assert!(Needed::new("|(p1", &[1, 2]).may_follow(2, 1), "a mistake forbids nothing");
    }
}
