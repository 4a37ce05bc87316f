//! An expression over bit sets: what may come next.

use super::bits::Bits;
use super::{Expression, Operator};

/// A part of the process.
#[derive(Debug, Clone)]
enum Kind {
    Atom(usize),
    Node(Operator, Vec<usize>),
}

/// A process over the atoms 0, 1, 2, …, ready to be asked.
#[derive(Debug, Clone)]
pub struct Algebra<B> {
    kinds: Vec<Kind>,
    /// The atoms below each part.
    masks: Vec<B>,
    root: usize,
    atoms: usize,
    /// Whether every atom is named once and no operator is empty, so that masks tell what was executed.
    plain: bool,
}

impl<B: Bits> Algebra<B> {
    /// Compiles a process over atoms below `atoms`.
    pub fn new(expression: &Expression<usize>, atoms: usize) -> Self {
        let mut algebra =
            Self { kinds: Vec::new(), masks: Vec::new(), root: 0, atoms, plain: is_plain(expression, atoms) };
        algebra.root = algebra.add(expression);
        algebra
    }

    fn add(&mut self, expression: &Expression<usize>) -> usize {
        let mut mask = B::empty(self.atoms);
        let kind = match expression {
            Expression::Atom(atom) => {
                mask.insert(*atom);
                Kind::Atom(*atom)
            }
            Expression::Node(operator, parts) => {
                let parts: Vec<_> = parts.iter().map(|part| self.add(part)).collect();
                parts.iter().for_each(|&part| mask.unite(&self.masks[part]));
                Kind::Node(*operator, parts)
            }
        };
        self.kinds.push(kind);
        self.masks.push(mask);
        self.kinds.len() - 1
    }

    /// How many atoms there are.
    pub fn atoms(&self) -> usize {
        self.atoms
    }

    /// Tells the atoms that may come next, from left to right, and whether there is one. The process is complete when
    /// there is none.
    ///
    /// An atom may come while it was not executed; of `.`, what may come of the first part that is not complete; of `|`,
    /// what may come of any part; of `+`, the same until a part has executed something, then what may come of that part.
    pub fn next(&self, executed: &B, tell: &mut impl FnMut(usize)) -> bool {
        self.next_of(self.root, executed, tell)
    }

    /// Whether nothing more may come.
    pub fn is_complete(&self, executed: &B) -> bool {
        !self.next(executed, &mut |_| {})
    }

    fn next_of(&self, part: usize, executed: &B, tell: &mut impl FnMut(usize)) -> bool {
        match &self.kinds[part] {
            Kind::Atom(atom) => {
                let open = !executed.contains(*atom);
                if open {
                    tell(*atom);
                }
                open
            }
            Kind::Node(Operator::Sequential, parts) => {
                parts.iter().any(|&part| self.next_of(part, executed, tell))
            }
            Kind::Node(Operator::Alternative, parts) => {
                match parts.iter().find(|&&part| self.has_executed(part, executed)) {
                    Some(&chosen) => self.next_of(chosen, executed, tell),
                    None => parts.iter().fold(false, |open, &part| self.next_of(part, executed, tell) | open),
                }
            }
            Kind::Node(Operator::Parallel, parts) => {
                parts.iter().fold(false, |open, &part| self.next_of(part, executed, tell) | open)
            }
        }
    }

    /// Whether a part has executed something. In a process that is not plain, as the reference has it: `.` has when its
    /// first part is complete, even if that is empty.
    fn has_executed(&self, part: usize, executed: &B) -> bool {
        if self.plain {
            return self.masks[part].meets(executed);
        }
        match &self.kinds[part] {
            Kind::Atom(atom) => executed.contains(*atom),
            Kind::Node(Operator::Sequential, parts) => parts.first().is_none_or(|&first| {
                !self.next_of(first, executed, &mut |_| {}) || self.has_executed(first, executed)
            }),
            Kind::Node(_, parts) => parts.iter().any(|&part| self.has_executed(part, executed)),
        }
    }
}

fn is_plain(expression: &Expression<usize>, atoms: usize) -> bool {
    let mut seen = vec![false; atoms];
    let once = expression.atoms().into_iter().all(|&atom| !std::mem::replace(&mut seen[atom], true));
    once && has_no_empty_part(expression)
}

fn has_no_empty_part(expression: &Expression<usize>) -> bool {
    match expression {
        Expression::Atom(_) => true,
        Expression::Node(_, parts) => !parts.is_empty() && parts.iter().all(has_no_empty_part),
    }
}
