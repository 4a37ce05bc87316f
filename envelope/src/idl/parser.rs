//! Definitions: modules, constants, other names, and what has a body (IDL 4.2, 7.4).

use super::annotation::Annotations;
use super::constant::Constant;
use super::error::IdlError;
use super::lexer::{Placed, Token};
use super::scope::{Scopes, TopicConstant, joined};
use crate::description::{DEPTH_MAX, Definition, Extensibility, Type};

pub(super) type Parsed<T> = Result<T, IdlError>;

/// Reads the tokens of one file.
pub(super) struct Parser<'a> {
    file: &'a str,
    tokens: &'a [Placed],
    at: usize,
    pub(super) default: Extensibility,
    pub(super) scopes: &'a mut Scopes,
    /// The modules, and the structure or union, that stand around.
    pub(super) scope: Vec<String>,
}

impl<'a> Parser<'a> {
    pub(super) fn new(
        file: &'a str,
        tokens: &'a [Placed],
        default: Extensibility,
        scopes: &'a mut Scopes,
    ) -> Self {
        Self { file, tokens, at: 0, default, scopes, scope: Vec::new() }
    }

    pub(super) fn parse(mut self) -> Parsed<()> {
        while self.at < self.tokens.len() {
            self.definition()?;
        }
        Ok(())
    }

    fn line(&self) -> usize {
        let token = self.tokens.get(self.at).or_else(|| self.tokens.last());
        token.map_or(1, |(_, line)| *line)
    }

    #[cold]
    pub(super) fn error(&self, what: impl Into<String>) -> IdlError {
        IdlError { file: self.file.to_owned(), line: self.line(), what: what.into() }
    }

    #[cold]
    pub(super) fn unexpected(&self, wanted: &str) -> IdlError {
        let found = match self.peek(0) {
            None => "the end of the file".to_owned(),
            Some(Token::Word(word)) => format!("`{}`", crate::name::shortened(word)),
            Some(Token::Integer(value)) => format!("`{value}`"),
            Some(Token::Float(value)) => format!("`{value}`"),
            Some(Token::Text(text)) => format!("\"{}\"", crate::name::shortened(text)),
            Some(Token::Character(unit)) => format!("'{unit}'"),
            Some(Token::Sign(sign)) => format!("`{sign}`"),
            Some(Token::Scope) => "`::`".to_owned(),
        };
        self.error(format!("{wanted} is due, {found} stands here"))
    }

    pub(super) fn place(&self) -> (String, usize) {
        (self.file.to_owned(), self.line())
    }

    pub(super) fn peek(&self, ahead: usize) -> Option<&Token> {
        self.tokens.get(self.at + ahead).map(|(token, _)| token)
    }

    pub(super) fn advance(&mut self) {
        self.at += 1;
    }

    pub(super) fn takes(&mut self, sign: char) -> bool {
        let found = self.peek(0) == Some(&Token::Sign(sign));
        self.at += usize::from(found);
        found
    }

    pub(super) fn expect(&mut self, sign: char) -> Parsed<()> {
        if self.takes(sign) { Ok(()) } else { Err(self.unexpected(&format!("`{sign}`"))) }
    }

    pub(super) fn takes_word(&mut self, word: &str) -> bool {
        let found = matches!(self.peek(0), Some(Token::Word(found)) if found == word);
        self.at += usize::from(found);
        found
    }

    pub(super) fn word(&mut self) -> Parsed<String> {
        match self.peek(0) {
            Some(Token::Word(word)) => {
                let word = word.clone();
                self.advance();
                Ok(word)
            }
            _ => Err(self.unexpected("a name")),
        }
    }

    /// A name with the scopes before it; one from the outermost scope begins with `::`.
    pub(super) fn scoped_name(&mut self) -> Parsed<String> {
        let mut name = String::new();
        if self.peek(0) == Some(&Token::Scope) {
            self.advance();
            name.push_str("::");
        }
        name.push_str(&self.word()?);
        while self.peek(0) == Some(&Token::Scope) {
            self.advance();
            name.push_str("::");
            name.push_str(&self.word()?);
        }
        Ok(name)
    }

    fn definition(&mut self) -> Parsed<()> {
        if self.takes(';') {
            return Ok(());
        }
        let annotations = self.annotations()?;
        let place = self.place();
        let keyword = self.word()?;
        match keyword.as_str() {
            "module" => self.module(),
            "const" => self.constant_definition(place),
            "typedef" => self.typedef(place),
            "struct" => self.structure(&annotations, place),
            "union" => self.union(&annotations, place),
            "enum" => self.enumeration(&annotations, place),
            "bitmask" => self.bitmask(&annotations, place),
            other => {
                self.at -= 1;
                let shown = crate::name::shortened(other);
                Err(self.error(format!(
                    "`{shown}` is not read: module, const, typedef, struct, union, enum and bitmask are"
                )))
            }
        }
    }

    fn module(&mut self) -> Parsed<()> {
        if self.scope.len() >= DEPTH_MAX {
            return Err(self.error("modules nested too deep"));
        }
        let name = self.word()?;
        self.scope.push(name);
        self.expect('{')?;
        while !self.takes('}') {
            if self.peek(0).is_none() {
                return Err(self.unexpected("`}`"));
            }
            self.definition()?;
        }
        self.scope.pop();
        self.takes(';');
        Ok(())
    }

    fn constant_definition(&mut self, (file, line): (String, usize)) -> Parsed<()> {
        let is_text = matches!(self.peek(0), Some(Token::Word(word)) if word == "string");
        self.type_of()?;
        let word = self.word()?;
        let name = joined(&self.scope, &word);
        self.expect('=')?;
        let value = self.constant()?;
        self.expect(';')?;
        if let Constant::Text(text) = &value
            && is_text
            && name.ends_with("Topic")
        {
            let topic = text.clone();
            self.scopes.topics.push(TopicConstant { name: name.clone(), topic, type_name: None, file, line });
        }
        match self.scopes.constants.get(&name) {
            Some(known) if *known != value => {
                Err(self.error(format!("the constant `{name}` is there twice with different values")))
            }
            _ => {
                self.scopes.constants.insert(name, value);
                Ok(())
            }
        }
    }

    fn typedef(&mut self, place: (String, usize)) -> Parsed<()> {
        let of = self.type_of()?;
        loop {
            let name = self.word()?;
            let of = self.dimensions(of.clone())?;
            self.define(&name, Definition::Alias(of), place.clone())?;
            if !self.takes(',') {
                return self.expect(';');
            }
        }
    }

    /// Keeps a definition of this scope.
    pub(super) fn define(
        &mut self,
        name: &str,
        definition: Definition,
        place: (String, usize),
    ) -> Parsed<()> {
        let full = joined(&self.scope, name);
        let known = self.scopes.places.get(&full).cloned();
        let added = self.scopes.draft.add(full.clone(), definition);
        added.map_err(|error| {
            let before = known.map(|(file, line)| format!(" (before in {file}:{line})")).unwrap_or_default();
            IdlError { file: place.0.clone(), line: place.1, what: format!("{error}{before}") }
        })?;
        self.scopes.announced.remove(&full);
        self.scopes.places.entry(full).or_insert(place);
        Ok(())
    }

    /// Keeps a topic that is annotated as one.
    pub(super) fn annotated_topic(&mut self, name: &str, annotations: &Annotations, place: &(String, usize)) {
        if let Some(topic) = &annotations.topic {
            let full = joined(&self.scope, name);
            let topic = topic.clone().unwrap_or_else(|| full.clone());
            let (file, line) = place.clone();
            let type_name = Some(full.clone());
            self.scopes.topics.push(TopicConstant { name: full, topic, type_name, file, line });
        }
    }

    /// A type without the dimensions behind a name.
    pub(super) fn type_of(&mut self) -> Parsed<Type> {
        self.nested_type(0)
    }

    fn nested_type(&mut self, depth: usize) -> Parsed<Type> {
        if depth >= DEPTH_MAX {
            return Err(self.error("types nested too deep"));
        }
        let name = self.scoped_name()?;
        Ok(match name.as_str() {
            "boolean" => Type::Boolean,
            "octet" => Type::Octet,
            "char" => Type::Char8,
            "wchar" => Type::Char16,
            "int8" => Type::Int8,
            "uint8" => Type::UInt8,
            "int16" | "short" => Type::Int16,
            "uint16" => Type::UInt16,
            "int32" => Type::Int32,
            "uint32" => Type::UInt32,
            "int64" => Type::Int64,
            "uint64" => Type::UInt64,
            "float" => Type::Float32,
            "double" => Type::Float64,
            "long" if self.takes_word("long") => Type::Int64,
            "long" if self.takes_word("double") => {
                return Err(self.error("`long double` is not read: use `double`"));
            }
            "long" => Type::Int32,
            "unsigned" => match self.word()?.as_str() {
                "short" => Type::UInt16,
                "long" if self.takes_word("long") => Type::UInt64,
                "long" => Type::UInt32,
                _ => return Err(self.error("`unsigned` stands before `short`, `long` or `long long`")),
            },
            "string" => Type::String { bound: self.bound()? },
            "wstring" => Type::WideString { bound: self.bound()? },
            "sequence" => {
                self.expect('<')?;
                let element = self.nested_type(depth + 1)?;
                let bound = if self.takes(',') { Some(self.size()?) } else { None };
                self.expect('>')?;
                Type::sequence(element, bound)
            }
            "map" | "any" | "fixed" | "Object" => {
                return Err(self.error(format!("`{name}` is not read: UMAA has no such type")));
            }
            _ => match self.scopes.type_name(&self.scope, &name) {
                Some(full) => Type::Named(full),
                None => {
                    let cure = "define it before, or include the file that does";
                    return Err(self.error(format!("no type `{name}` is known: {cure}")));
                }
            },
        })
    }

    fn bound(&mut self) -> Parsed<Option<u32>> {
        if !self.takes('<') {
            return Ok(None);
        }
        let bound = self.size()?;
        self.expect('>')?;
        Ok(Some(bound))
    }

    /// The type with the dimensions that stand behind a name.
    pub(super) fn dimensions(&mut self, element: Type) -> Parsed<Type> {
        let mut dimensions = Vec::new();
        while self.takes('[') {
            if dimensions.len() >= DEPTH_MAX {
                return Err(self.error("more dimensions than are read"));
            }
            dimensions.push(self.size()?);
            self.expect(']')?;
        }
        Ok(match dimensions.is_empty() {
            true => element,
            false => Type::Array { element: Box::new(element), dimensions },
        })
    }
}
