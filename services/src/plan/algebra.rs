//! Process algebra: which tasks, in which order, which of several.
//!
//! Prefix notation: `.( … )` one after the other, `+( … )` one of these, `|( … )` all in any order; atoms are `p` and an id,
//! followed by a blank or `)`. A request relates tasks; each task's composition relates its options and takes the task's
//! place.
//!
//! The meaning is "what may come next, given what was done", without clocks; see [`Algebra::next`].

mod bits;
mod compile;
mod compose;
mod error;
mod parse;
#[cfg(test)]
mod tests;

pub use bits::{AtomSet, Bits};
pub use compile::Algebra;
pub use compose::{Unnamed, compose};
pub use error::{AlgebraError, Mistake};
pub use parse::{Reading, parse};

use std::fmt;

/// How the parts of an expression are related.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Operator {
    /// `.`: each when the one before it is complete.
    Sequential,
    /// `+`: exactly one of them.
    Alternative,
    /// `|`: all of them, in any order.
    Parallel,
}

impl Operator {
    /// The operator that a character stands for.
    pub fn of(character: char) -> Option<Self> {
        match character {
            '.' => Some(Self::Sequential),
            '+' => Some(Self::Alternative),
            '|' => Some(Self::Parallel),
            _ => None,
        }
    }

    /// Its character.
    pub fn character(self) -> char {
        match self {
            Self::Sequential => '.',
            Self::Alternative => '+',
            Self::Parallel => '|',
        }
    }
}

/// A process: an atom, or parts under an operator.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Expression<A> {
    /// Something to do.
    Atom(A),
    /// Parts and how they are related.
    Node(Operator, Vec<Self>),
}

impl<A> Expression<A> {
    /// Its atoms, from left to right.
    pub fn atoms(&self) -> Vec<&A> {
        let mut found = Vec::new();
        let mut open = vec![self];
        while let Some(expression) = open.pop() {
            match expression {
                Self::Atom(atom) => found.push(atom),
                Self::Node(_, parts) => open.extend(parts.iter().rev()),
            }
        }
        found
    }

    /// The same process over other atoms.
    ///
    /// # Errors
    /// The first error of `change`.
    pub fn map<B, E>(&self, change: &mut impl FnMut(&A) -> Result<B, E>) -> Result<Expression<B>, E> {
        Ok(match self {
            Self::Atom(atom) => Expression::Atom(change(atom)?),
            Self::Node(operator, parts) => {
                let parts = parts.iter().map(|part| part.map(change)).collect::<Result<_, E>>()?;
                Expression::Node(*operator, parts)
            }
        })
    }
}

impl<A: Ord> Expression<A> {
    /// The same process in its only canonical form: operators of one part and operators directly in their like are dissolved,
    /// and the parts of `+` and `|` are sorted, so that requests that say the same are the same.
    #[must_use]
    pub fn canonical(self) -> Self {
        let Self::Node(operator, parts) = self else { return self };
        let mut flat = Vec::with_capacity(parts.len());
        for part in parts.into_iter().map(Self::canonical) {
            match part {
                Self::Node(inner, parts) if inner == operator => flat.extend(parts),
                part => flat.push(part),
            }
        }
        if operator != Operator::Sequential {
            flat.sort();
        }
        match flat.pop() {
            Some(only) if flat.is_empty() => only,
            Some(last) => {
                flat.push(last);
                Self::Node(operator, flat)
            }
            None => Self::Node(operator, flat),
        }
    }
}

/// An atom as it stands in a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Named {
    /// The number after `p`.
    pub id: i64,
    /// Where it begins, in bytes from the start of the text.
    pub at: usize,
}

impl fmt::Display for Operator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.character())
    }
}
