//! Constants and the expressions that give them (IDL 4.2, 7.4.1.4.3).

use super::lexer::Token;
use super::parser::{Parsed, Parser};
use crate::description::DEPTH_MAX;

/// The value of a constant.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Constant {
    Integer(i128),
    Float(f64),
    Boolean(bool),
    Text(String),
    Character(char),
}

/// Operators by their precedence, lowest first; each with as many signs as it has.
const LEVELS: [&[&str]; 6] = [&["|"], &["^"], &["&"], &["<<", ">>"], &["+", "-"], &["*", "/", "%"]];

impl Parser<'_> {
    /// A constant expression.
    pub(super) fn constant(&mut self) -> Parsed<Constant> {
        self.level(0, 0)
    }

    /// A constant expression that is a whole number.
    pub(super) fn integer(&mut self) -> Parsed<i128> {
        match self.constant()? {
            Constant::Integer(value) => Ok(value),
            Constant::Character(unit) => Ok(u32::from(unit).into()),
            Constant::Boolean(value) => Ok(value.into()),
            _ => Err(self.error("a whole number belongs here")),
        }
    }

    /// A bound or a dimension.
    pub(super) fn size(&mut self) -> Parsed<u32> {
        let value = self.integer()?;
        match u32::try_from(value) {
            Ok(size) if size > 0 => Ok(size),
            _ => Err(self.error(format!("a bound or dimension of {value}: 1 to 4294967295 are allowed"))),
        }
    }

    fn level(&mut self, level: usize, depth: usize) -> Parsed<Constant> {
        if depth > DEPTH_MAX {
            return Err(self.error("an expression nested too deep: name its parts by constants"));
        }
        let Some(operators) = LEVELS.get(level) else { return self.operand(depth) };
        let mut left = self.level(level + 1, depth)?;
        while let Some(operator) = operators.iter().find(|operator| self.is_operator(operator)) {
            operator.chars().for_each(|_| self.advance());
            let right = self.level(level + 1, depth)?;
            left = self.applied(operator, left, right)?;
        }
        Ok(left)
    }

    /// A single `>` ends a list of parameters, so that only two of them are an operator.
    fn is_operator(&self, operator: &str) -> bool {
        (0..).zip(operator.chars()).all(|(ahead, sign)| self.peek(ahead) == Some(&Token::Sign(sign)))
    }

    fn operand(&mut self, depth: usize) -> Parsed<Constant> {
        let token = self.peek(0).cloned();
        match token {
            Some(Token::Integer(value)) => self.taken(Constant::Integer(value)),
            Some(Token::Float(value)) => self.taken(Constant::Float(value)),
            Some(Token::Text(text)) => self.taken(Constant::Text(text)),
            Some(Token::Character(unit)) => self.taken(Constant::Character(unit)),
            Some(Token::Word(word)) if word == "TRUE" => self.taken(Constant::Boolean(true)),
            Some(Token::Word(word)) if word == "FALSE" => self.taken(Constant::Boolean(false)),
            Some(Token::Word(_) | Token::Scope) => {
                let name = self.scoped_name()?;
                let known = self.scopes.constant(&self.scope, &name).cloned();
                known.ok_or_else(|| self.error(format!("no constant `{name}` is known: declare it before")))
            }
            Some(Token::Sign('(')) => {
                self.advance();
                let inner = self.level(0, depth + 1)?;
                self.expect(')')?;
                Ok(inner)
            }
            Some(Token::Sign(sign @ ('-' | '+' | '~'))) => {
                self.advance();
                if depth > DEPTH_MAX {
                    return Err(self.error("an expression nested too deep: name its parts by constants"));
                }
                match (sign, self.operand(depth + 1)?) {
                    ('+', value) => Ok(value),
                    ('-', Constant::Integer(value)) if value != i128::MIN => Ok(Constant::Integer(-value)),
                    ('-', Constant::Float(value)) => Ok(Constant::Float(-value)),
                    ('~', Constant::Integer(value)) => Ok(Constant::Integer(!value)),
                    _ => Err(self.error(format!("`{sign}` wants a number behind it"))),
                }
            }
            _ => Err(self.unexpected("a constant")),
        }
    }

    fn taken(&mut self, constant: Constant) -> Parsed<Constant> {
        self.advance();
        Ok(constant)
    }

    fn applied(&self, operator: &str, left: Constant, right: Constant) -> Parsed<Constant> {
        let value = match (left, right) {
            (Constant::Integer(left), Constant::Integer(right)) => {
                whole(operator, left, right).map(Constant::Integer)
            }
            (left, right) => match (real(&left), real(&right)) {
                (Some(left), Some(right)) => floating(operator, left, right).map(Constant::Float),
                _ => None,
            },
        };
        value.ok_or_else(|| self.error(format!("`{operator}` has no result here: use numbers that it fits")))
    }
}

fn whole(operator: &str, left: i128, right: i128) -> Option<i128> {
    match operator {
        "|" => Some(left | right),
        "^" => Some(left ^ right),
        "&" => Some(left & right),
        "<<" => u32::try_from(right)
            .ok()
            .filter(|places| *places < 64)
            .and_then(|places| left.checked_mul(1 << places)),
        ">>" => u32::try_from(right).ok().and_then(|places| left.checked_shr(places)),
        "+" => left.checked_add(right),
        "-" => left.checked_sub(right),
        "*" => left.checked_mul(right),
        "/" => left.checked_div(right),
        "%" => left.checked_rem(right),
        _ => None,
    }
}

fn real(constant: &Constant) -> Option<f64> {
    match constant {
        Constant::Integer(value) => Some(*value as f64),
        Constant::Float(value) => Some(*value),
        _ => None,
    }
}

fn floating(operator: &str, left: f64, right: f64) -> Option<f64> {
    match operator {
        "+" => Some(left + right),
        "-" => Some(left - right),
        "*" => Some(left * right),
        "/" => Some(left / right),
        _ => None,
    }
}
