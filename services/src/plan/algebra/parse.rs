//! From text to an expression.

use super::error::{AlgebraError, Mistake};
use super::{Expression, Named, Operator};

/// How deep parentheses may be nested: far beyond what is meant, far below what a stack holds.
const DEPTH_MAX: usize = 64;

/// How strictly a text is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading {
    /// What the reference crashes at, ignores or never gets to is a mistake: atoms that end the text without a blank,
    /// operators without parts, atoms named twice.
    Strict,
    /// As the reference reads it, for comparisons with it.
    Compat,
}

/// Reads a text. `whose` is put into errors.
///
/// # Errors
/// The first mistake, with its place.
pub fn parse(text: &str, reading: Reading, whose: &str) -> Result<Expression<Named>, AlgebraError> {
    let mut parser = Parser { text, at: 0, reading };
    let wrong = |(at, mistake)| AlgebraError { whose: whose.to_owned(), text: text.to_owned(), at, mistake };
    let expression = parser.expression(0).map_err(wrong)?;
    parser.skip_blanks();
    if parser.at < text.len() {
        return Err(wrong((parser.at, Mistake::Behind)));
    }
    if reading == Reading::Strict {
        no_atom_twice(&expression).map_err(wrong)?;
    }
    Ok(expression)
}

type Found<T> = Result<T, (usize, Mistake)>;

fn no_atom_twice(expression: &Expression<Named>) -> Found<()> {
    let mut seen = std::collections::BTreeSet::new();
    match expression.atoms().into_iter().find(|atom| !seen.insert(atom.id)) {
        Some(atom) => Err((atom.at, Mistake::Twice(atom.id))),
        None => Ok(()),
    }
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
    reading: Reading,
}

impl Parser<'_> {
    fn peek(&self) -> Option<char> {
        self.text.get(self.at..).and_then(|rest| rest.chars().next())
    }

    fn skip_blanks(&mut self) {
        while self.peek().is_some_and(char::is_whitespace) {
            self.at += self.peek().map_or(0, char::len_utf8);
        }
    }

    fn expression(&mut self, depth: usize) -> Found<Expression<Named>> {
        self.skip_blanks();
        let begin = self.at;
        let Some(first) = self.peek() else { return Err((begin, Mistake::Nothing)) };
        if first == 'p' {
            return self.atom().map(Expression::Atom);
        }
        let Some(operator) = Operator::of(first) else { return Err((begin, Mistake::Unknown(first))) };
        self.at += 1;
        if self.peek() != Some('(') {
            return Err((begin, Mistake::NoParenthesis(operator)));
        }
        if depth >= DEPTH_MAX {
            return Err((begin, Mistake::TooDeep(DEPTH_MAX)));
        }
        self.at += 1;
        let parts = self.parts(operator, begin, depth)?;
        if parts.is_empty() && self.reading == Reading::Strict {
            return Err((begin, Mistake::Empty(operator)));
        }
        Ok(Expression::Node(operator, parts))
    }

    /// What is in a parenthesis, and its end.
    fn parts(&mut self, operator: Operator, begin: usize, depth: usize) -> Found<Vec<Expression<Named>>> {
        let mut parts = Vec::new();
        loop {
            self.skip_blanks();
            match self.peek() {
                None => return Err((begin, Mistake::NotClosed(operator))),
                Some(')') => {
                    self.at += 1;
                    return Ok(parts);
                }
                Some(_) => parts.push(self.expression(depth + 1)?),
            }
        }
    }

    fn atom(&mut self) -> Found<Named> {
        let begin = self.at;
        self.at += 1;
        let rest = self.text.get(self.at..).unwrap_or_default();
        let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
        if digits == 0 {
            return Err((begin, Mistake::NoId));
        }
        let id = rest[..digits].parse().map_err(|_| (begin, Mistake::IdTooLarge))?;
        self.at += digits;
        let terminated = match self.peek() {
            Some(next) => next == ')' || next.is_whitespace(),
            None => self.reading == Reading::Compat,
        };
        if terminated { Ok(Named { id, at: begin }) } else { Err((begin, Mistake::NotTerminated)) }
    }
}
