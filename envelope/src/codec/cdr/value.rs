//! Samples as trees of values, for types that are known at run time alone.

use super::error::CdrFault;
use super::sink::{Sink, Source};
use crate::description::Enumeration;

/// A value of any type. Names are the schema's.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A boolean.
    Boolean(bool),
    /// A whole number without a sign.
    Unsigned(u64),
    /// A whole number with a sign.
    Signed(i64),
    /// A number of single precision.
    Float32(f32),
    /// A number of double precision.
    Float64(f64),
    /// A character: a byte, or a unit of UTF-16.
    Character(u16),
    /// A text.
    Text(String),
    /// A value of an enumeration, by its number.
    Enumeration(i32),
    /// The bits of a bitmask.
    Bits(u64),
    /// A sequence or an array of octets.
    Octets(Vec<u8>),
    /// Another sequence or array; of several dimensions the last runs fastest.
    List(Vec<Value>),
    /// The members in the order of the type; none where one is absent.
    Structure(Vec<Option<Value>>),
    /// The discriminator and the member that it chooses, if any.
    Union(i64, Option<Box<Value>>),
}

/// Makes a tree of what is read.
#[derive(Debug, Default)]
pub(super) struct Tree {
    open: Vec<Value>,
    whole: Option<Value>,
}

impl Tree {
    /// What has been read.
    pub(super) fn into_value(self) -> Option<Value> {
        self.whole
    }

    fn put(&mut self, value: Value) {
        match self.open.last_mut() {
            Some(Value::List(elements)) => elements.push(value),
            Some(Value::Structure(members)) => members.push(Some(value)),
            Some(Value::Union(_, held)) => *held = Some(Box::new(value)),
            _ => self.whole = Some(value),
        }
    }

    fn absent(&mut self) {
        if let Some(Value::Structure(members)) = self.open.last_mut() {
            members.push(None);
        }
    }
}

impl Sink for Tree {
    fn boolean(&mut self, value: bool) {
        self.put(Value::Boolean(value));
    }

    fn unsigned(&mut self, value: u64, _: usize) {
        self.put(Value::Unsigned(value));
    }

    fn signed(&mut self, value: i64, _: usize) {
        self.put(Value::Signed(value));
    }

    fn float32(&mut self, value: f32) {
        self.put(Value::Float32(value));
    }

    fn float64(&mut self, value: f64) {
        self.put(Value::Float64(value));
    }

    fn character(&mut self, unit: u16) {
        self.put(Value::Character(unit));
    }

    fn text(&mut self, text: &str) {
        self.put(Value::Text(text.to_owned()));
    }

    fn bits(&mut self, bits: u64) {
        self.put(Value::Bits(bits));
    }

    fn enumeration(&mut self, value: i32, _: &Enumeration) {
        self.put(Value::Enumeration(value));
    }

    fn octets(&mut self, octets: &[u8], _: bool) {
        self.put(Value::Octets(octets.to_vec()));
    }

    fn list(&mut self, _: usize, _: bool) {
        self.open.push(Value::List(Vec::new()));
    }

    fn structure(&mut self, _: usize) {
        self.open.push(Value::Structure(Vec::new()));
    }

    fn optional(&mut self, present: bool) {
        if !present {
            self.absent();
        }
    }

    fn missing(&mut self) {
        self.absent();
    }

    fn union(&mut self, discriminator: i64) {
        self.open.push(Value::Union(discriminator, None));
    }

    fn end(&mut self) {
        if let Some(done) = self.open.pop() {
            self.put(done);
        }
    }
}

/// What is still to be given.
#[derive(Debug)]
enum Rest<'s> {
    Elements(std::slice::Iter<'s, Value>),
    Members(std::slice::Iter<'s, Option<Value>>),
    One(Option<&'s Value>),
}

/// Gives the values of a tree.
#[derive(Debug)]
pub(super) struct Walk<'s> {
    rest: Vec<Rest<'s>>,
}

impl<'s> Walk<'s> {
    pub(super) fn new(value: &'s Value) -> Self {
        Self { rest: vec![Rest::One(Some(value))] }
    }

    fn next(&mut self) -> Result<&'s Value, CdrFault> {
        let next = match self.rest.last_mut() {
            Some(Rest::Elements(elements)) => elements.next(),
            Some(Rest::Members(members)) => members.next().and_then(Option::as_ref),
            Some(Rest::One(one)) => one.take(),
            None => None,
        };
        next.ok_or(CdrFault::Absent)
    }
}

/// The value of one kind, or a fault that says what was expected.
macro_rules! next {
    ($walk:expr, $kind:literal, $pattern:pat => $value:expr) => {
        match $walk.next()? {
            $pattern => Ok($value),
            _ => Err(CdrFault::OtherKind { expected: $kind }),
        }
    };
}

impl<'s> Source<'s> for Walk<'s> {
    fn boolean(&mut self) -> Result<bool, CdrFault> {
        next!(self, "a boolean", Value::Boolean(value) => *value)
    }

    fn unsigned(&mut self, size: usize) -> Result<u64, CdrFault> {
        let value = next!(self, "a number without a sign", Value::Unsigned(value) => *value)?;
        if size < 8 && value >> (8 * size) > 0 { Err(CdrFault::OutOfRange) } else { Ok(value) }
    }

    fn signed(&mut self, size: usize) -> Result<i64, CdrFault> {
        let value = next!(self, "a number with a sign", Value::Signed(value) => *value)?;
        let spare = 64 - 8 * size as u32;
        if (value << spare) >> spare == value { Ok(value) } else { Err(CdrFault::OutOfRange) }
    }

    fn float32(&mut self) -> Result<f32, CdrFault> {
        next!(self, "a float", Value::Float32(value) => *value)
    }

    fn float64(&mut self) -> Result<f64, CdrFault> {
        next!(self, "a double", Value::Float64(value) => *value)
    }

    fn character(&mut self) -> Result<u16, CdrFault> {
        next!(self, "a character", Value::Character(unit) => *unit)
    }

    fn text(&mut self) -> Result<&'s str, CdrFault> {
        next!(self, "a text", Value::Text(text) => text.as_str())
    }

    fn bits(&mut self) -> Result<u64, CdrFault> {
        next!(self, "bits", Value::Bits(bits) => *bits)
    }

    fn enumeration(&mut self, _: &Enumeration) -> Result<i32, CdrFault> {
        next!(self, "a value of an enumeration", Value::Enumeration(value) => *value)
    }

    fn octets(&mut self, length: Option<usize>) -> Result<&'s [u8], CdrFault> {
        let octets = next!(self, "octets", Value::Octets(octets) => octets.as_slice())?;
        fits(octets.len(), length).map(|_| octets)
    }

    fn list(&mut self, length: Option<usize>) -> Result<usize, CdrFault> {
        let elements = next!(self, "a list", Value::List(elements) => elements)?;
        self.rest.push(Rest::Elements(elements.iter()));
        fits(elements.len(), length)
    }

    fn structure(&mut self, members: usize) -> Result<(), CdrFault> {
        let held = next!(self, "a structure", Value::Structure(members) => members)?;
        self.rest.push(Rest::Members(held.iter()));
        fits(held.len(), Some(members)).map(drop)
    }

    fn optional(&mut self) -> Result<bool, CdrFault> {
        let Some(Rest::Members(members)) = self.rest.last_mut() else {
            return Err(CdrFault::OtherKind { expected: "a member" });
        };
        let present = members.as_slice().first().is_some_and(Option::is_some);
        if !present {
            members.next();
        }
        Ok(present)
    }

    fn union(&mut self) -> Result<(i64, bool), CdrFault> {
        let (chosen, held) = next!(self, "a union", Value::Union(chosen, held) => (*chosen, held))?;
        self.rest.push(Rest::One(held.as_deref()));
        Ok((chosen, held.is_some()))
    }

    fn end(&mut self) {
        self.rest.pop();
    }
}

fn fits(found: usize, length: Option<usize>) -> Result<usize, CdrFault> {
    match length {
        Some(length) if length != found => {
            Err(CdrFault::Length { found: found as u64, allowed: length as u64 })
        }
        _ => Ok(found),
    }
}
