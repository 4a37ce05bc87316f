//! What is wrong with a text, and where.

use super::Operator;
use std::fmt;

/// A mistake in a process algebra text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AlgebraError {
    /// Whose text it is, such as "the task relationships" or "the composition of task 7".
    pub whose: String,
    /// The text.
    pub text: String,
    /// Where the mistake begins, in bytes from the start of the text.
    pub at: usize,
    /// The mistake.
    pub mistake: Mistake,
}

/// What can be wrong with a text.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Mistake {
    /// Neither an operator nor an atom.
    #[error("`{0}` is neither `.`, `+` or `|` followed by `(`, nor an atom `p` followed by its id")]
    Unknown(char),
    /// Nothing at all.
    #[error("there is no operator and no atom")]
    Nothing,
    /// An operator without its parenthesis.
    #[error("`{0}` must be followed directly by `(`")]
    NoParenthesis(Operator),
    /// A parenthesis without its end.
    #[error("the parenthesis of `{0}` is not closed: add `)`")]
    NotClosed(Operator),
    /// Text after the end.
    #[error("the expression is complete before this: take the rest away, or put all under one operator")]
    Behind,
    /// An atom without a number.
    #[error("`p` should be followed by an id")]
    NoId,
    /// A number beyond 64 bits.
    #[error("the id is too large")]
    IdTooLarge,
    /// An atom that runs into something else.
    #[error("the id after `p` should be followed by a blank or `)`")]
    NotTerminated,
    /// An operator without parts.
    #[error("`{0}()` has nothing in it: take it away")]
    Empty(Operator),
    /// Too deep to be meant.
    #[error("parentheses are nested deeper than {0}")]
    TooDeep(usize),
    /// An atom named twice.
    #[error("p{0} is named twice: each may be done once")]
    Twice(i64),
    /// A task that is not there.
    #[error("task {0} is not among the tasks of the request")]
    NoSuchTask(i64),
    /// A task that the relationships leave out.
    #[error("task {0} is in the request, but its relationships do not name it: it would be dropped")]
    LeftOut(i64),
    /// An option that is not there.
    #[error("option {option} is not among the options of task {task}")]
    NoSuchOption {
        /// The task.
        task: i64,
        /// The option.
        option: i64,
    },
}

impl fmt::Display for AlgebraError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let column = self.text.get(..self.at).map_or(0, |before| before.chars().count());
        write!(f, "{}, character {}: {}", self.whose, column + 1, self.mistake)?;
        write!(f, "\n  {}\n  {:column$}^", self.text, "")
    }
}

impl std::error::Error for AlgebraError {}
