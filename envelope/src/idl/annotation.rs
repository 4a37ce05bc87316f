//! Annotations (IDL 4.2, 8.3; DDS-XTypes 1.3, 7.3.1.2).

use super::constant::Constant;
use super::lexer::Token;
use super::parser::{Parsed, Parser};
use crate::description::{Extensibility, MEMBER_ID_MAX};
use md5::{Digest, Md5};

/// What annotations say that matters for the wire; all others, as `@unit` and `@range`, are for people and passed over.
#[derive(Debug, Clone, Default)]
pub(super) struct Annotations {
    pub(super) key: bool,
    pub(super) optional: bool,
    pub(super) must_understand: bool,
    pub(super) extensibility: Option<Extensibility>,
    /// The id of a member; a hash is of its name, or of the text that is given.
    pub(super) id: Option<Id>,
    /// Whether the ids of a type's members are hashes.
    pub(super) ids_are_hashes: bool,
    pub(super) bit_bound: Option<u16>,
    pub(super) position: Option<u16>,
    pub(super) value: Option<i128>,
    pub(super) default_literal: bool,
    /// The structure is a topic, by this name where one is given.
    pub(super) topic: Option<Option<String>>,
}

/// How a member gets its id.
#[derive(Debug, Clone)]
pub(super) enum Id {
    Number(u32),
    /// The hash of this text, or of the member's name.
    Hash(Option<String>),
}

impl Id {
    /// The id of a member with this name.
    pub(super) fn of(&self, name: &str) -> u32 {
        match self {
            Self::Number(id) => *id,
            Self::Hash(text) => hashed(text.as_deref().unwrap_or(name)),
        }
    }
}

/// The lowest 28 bits of the MD5 of a name (DDS-XTypes 1.3, 7.3.1.2.1.1).
pub(super) fn hashed(name: &str) -> u32 {
    let digest: [u8; 16] = Md5::digest(name.as_bytes()).into();
    u32::from_le_bytes([digest[0], digest[1], digest[2], digest[3]]) & MEMBER_ID_MAX
}

/// A parameter of an annotation, with its name where it has one.
type Parameter = (Option<String>, Parameters);

enum Parameters {
    Constant(Constant),
    /// A word that is no constant, as in `@extensibility(FINAL)`.
    Word(String),
}

impl Parser<'_> {
    /// All annotations that stand here.
    pub(super) fn annotations(&mut self) -> Parsed<Annotations> {
        let mut found = Annotations::default();
        while self.peek(0) == Some(&Token::Sign('@')) {
            self.advance();
            let name = self.scoped_name()?;
            let parameters = self.parameters()?;
            self.annotation(&name, &parameters, &mut found)?;
        }
        Ok(found)
    }

    fn parameters(&mut self) -> Parsed<Vec<Parameter>> {
        let mut found = Vec::new();
        if !self.takes('(') {
            return Ok(found);
        }
        while !self.takes(')') {
            let name = match (self.peek(0), self.peek(1)) {
                (Some(Token::Word(name)), Some(Token::Sign('='))) => Some(name.clone()),
                _ => None,
            };
            if name.is_some() {
                self.advance();
                self.advance();
            }
            let word = match self.peek(0) {
                Some(Token::Word(word)) if self.scopes.constant(&self.scope, word).is_none() => {
                    Some(word.clone())
                }
                _ => None,
            };
            let parameter = match word {
                Some(word) if word != "TRUE" && word != "FALSE" => {
                    self.scoped_name()?;
                    Parameters::Word(word)
                }
                _ => Parameters::Constant(self.constant()?),
            };
            found.push((name, parameter));
            if !self.takes(',') && self.peek(0) != Some(&Token::Sign(')')) {
                return Err(self.unexpected("`,` or `)`"));
            }
        }
        Ok(found)
    }

    fn annotation(&self, name: &str, parameters: &[Parameter], found: &mut Annotations) -> Parsed<()> {
        let first = parameters.first().map(|(_, parameter)| parameter);
        let on = !matches!(first, Some(Parameters::Constant(Constant::Boolean(false))));
        let number = |what: &str, max: i128| match first {
            Some(Parameters::Constant(Constant::Integer(value))) if (0..=max).contains(value) => Ok(*value),
            _ => Err(self.error(format!("`@{what}` wants a number from 0 to {max}"))),
        };
        let word = match first {
            Some(Parameters::Word(word)) => word.as_str(),
            _ => "",
        };
        match name {
            "key" | "Key" => found.key = on,
            "optional" => found.optional = on,
            "must_understand" => found.must_understand = on,
            "final" => found.extensibility = Some(Extensibility::Final),
            "appendable" => found.extensibility = Some(Extensibility::Appendable),
            "mutable" => found.extensibility = Some(Extensibility::Mutable),
            "extensibility" => {
                found.extensibility =
                    Some(match word.to_ascii_uppercase().trim_end_matches("_EXTENSIBILITY") {
                        "FINAL" => Extensibility::Final,
                        "APPENDABLE" | "EXTENSIBLE" => Extensibility::Appendable,
                        "MUTABLE" => Extensibility::Mutable,
                        _ => return Err(self.error("`@extensibility` wants FINAL, APPENDABLE or MUTABLE")),
                    });
            }
            "id" => found.id = Some(Id::Number(number("id", MEMBER_ID_MAX.into())? as u32)),
            "hashid" => {
                let text = match first {
                    Some(Parameters::Constant(Constant::Text(text))) if !text.is_empty() => {
                        Some(text.clone())
                    }
                    _ => None,
                };
                found.id = Some(Id::Hash(text));
            }
            "autoid" => found.ids_are_hashes = !word.eq_ignore_ascii_case("SEQUENTIAL"),
            "bit_bound" => found.bit_bound = Some(number("bit_bound", 64)? as u16),
            "position" => found.position = Some(number("position", 63)? as u16),
            "value" => {
                found.value = match first {
                    Some(Parameters::Constant(Constant::Integer(value))) => Some(*value),
                    _ => return Err(self.error("`@value` wants a number")),
                };
            }
            "default_literal" => found.default_literal = true,
            "topic" => {
                let named = parameters.iter().find(|(name, _)| name.as_deref() == Some("name"));
                found.topic = Some(match named {
                    Some((_, Parameters::Constant(Constant::Text(text)))) => Some(text.clone()),
                    _ => None,
                });
            }
            _ => {}
        }
        Ok(())
    }
}
