//! Samples as postcard writes them: contents of type `umaa`, without a detour over values.
//!
//! Whole numbers of more than a byte are variable in length, those with a sign zigzag; an enumeration is the place of its value;
//! lists have their length in front, arrays have not.

use super::error::CdrFault;
use super::sink::{Sink, Source};
use crate::description::Enumeration;

/// Writes what is read.
#[derive(Debug, Default)]
pub(super) struct PostcardSink {
    out: Vec<u8>,
    /// Whether something was read that a content cannot hold.
    unfit: bool,
}

impl PostcardSink {
    /// What has been written; none where that is not all that was read.
    pub(super) fn into_content(self) -> Option<Vec<u8>> {
        (!self.unfit).then_some(self.out)
    }

    fn varint(&mut self, mut value: u64) {
        while value > 0x7f {
            self.out.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.out.push(value as u8);
    }
}

impl Sink for PostcardSink {
    fn boolean(&mut self, value: bool) {
        self.out.push(value.into());
    }

    fn unsigned(&mut self, value: u64, size: usize) {
        if size == 1 { self.out.push(value as u8) } else { self.varint(value) }
    }

    fn signed(&mut self, value: i64, size: usize) {
        if size == 1 { self.out.push(value as u8) } else { self.varint((value << 1 ^ value >> 63) as u64) }
    }

    fn float32(&mut self, value: f32) {
        self.out.extend_from_slice(&value.to_le_bytes());
    }

    fn float64(&mut self, value: f64) {
        self.out.extend_from_slice(&value.to_le_bytes());
    }

    fn character(&mut self, _: u16) {
        self.unfit = true;
    }

    fn text(&mut self, text: &str) {
        self.varint(text.len() as u64);
        self.out.extend_from_slice(text.as_bytes());
    }

    fn bits(&mut self, bits: u64) {
        self.varint(bits);
    }

    fn enumeration(&mut self, value: i32, known: &Enumeration) {
        match known.literals.iter().position(|(_, literal)| *literal == value) {
            Some(place) => self.varint(place as u64),
            None => self.unfit = true,
        }
    }

    fn octets(&mut self, octets: &[u8], counted: bool) {
        if counted {
            self.varint(octets.len() as u64);
        }
        self.out.extend_from_slice(octets);
    }

    fn list(&mut self, length: usize, counted: bool) {
        if counted {
            self.varint(length as u64);
        }
    }

    fn structure(&mut self, _: usize) {}

    fn optional(&mut self, present: bool) {
        self.out.push(present.into());
    }

    fn missing(&mut self) {
        self.unfit = true;
    }

    fn union(&mut self, _: i64) {
        self.unfit = true;
    }

    fn end(&mut self) {}
}

/// Gives what postcard has written.
#[derive(Debug)]
pub(super) struct PostcardSource<'s> {
    rest: &'s [u8],
}

impl<'s> PostcardSource<'s> {
    pub(super) fn new(content: &'s [u8]) -> Self {
        Self { rest: content }
    }

    /// Bytes that have not been read.
    pub(super) fn left(&self) -> usize {
        self.rest.len()
    }

    fn take(&mut self, length: usize) -> Result<&'s [u8], CdrFault> {
        let left = self.rest.len();
        let (taken, rest) =
            self.rest.split_at_checked(length).ok_or(CdrFault::Truncated { needed: length, left })?;
        self.rest = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, CdrFault> {
        self.take(1).map(|taken| taken.first().copied().unwrap_or_default())
    }

    fn varint(&mut self) -> Result<u64, CdrFault> {
        let mut value = 0_u64;
        for place in (0..64).step_by(7) {
            let byte = self.byte()?;
            let part = u64::from(byte & 0x7f);
            if part << place >> place != part {
                break;
            }
            value |= part << place;
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(CdrFault::OutOfRange)
    }

    fn fixed<const N: usize>(&mut self) -> Result<[u8; N], CdrFault> {
        let taken = self.take(N)?;
        taken.try_into().map_err(|_| CdrFault::OutOfRange)
    }

    fn length(&mut self, length: Option<usize>) -> Result<usize, CdrFault> {
        match length {
            Some(length) => Ok(length),
            None => usize::try_from(self.varint()?).map_err(|_| CdrFault::OutOfRange),
        }
    }
}

impl<'s> Source<'s> for PostcardSource<'s> {
    fn boolean(&mut self) -> Result<bool, CdrFault> {
        match self.byte()? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(CdrFault::NotBoolean(other)),
        }
    }

    fn unsigned(&mut self, size: usize) -> Result<u64, CdrFault> {
        if size == 1 {
            return self.byte().map(u64::from);
        }
        let value = self.varint()?;
        if size < 8 && value >> (8 * size) > 0 { Err(CdrFault::OutOfRange) } else { Ok(value) }
    }

    fn signed(&mut self, size: usize) -> Result<i64, CdrFault> {
        if size == 1 {
            return self.byte().map(|byte| (byte as i8).into());
        }
        let bits = self.varint()?;
        let value = (bits >> 1) as i64 ^ -((bits & 1) as i64);
        let spare = 64 - 8 * size as u32;
        if (value << spare) >> spare == value { Ok(value) } else { Err(CdrFault::OutOfRange) }
    }

    fn float32(&mut self) -> Result<f32, CdrFault> {
        self.fixed().map(f32::from_le_bytes)
    }

    fn float64(&mut self) -> Result<f64, CdrFault> {
        self.fixed().map(f64::from_le_bytes)
    }

    fn character(&mut self) -> Result<u16, CdrFault> {
        Err(CdrFault::OtherKind { expected: "what contents of type umaa hold" })
    }

    fn text(&mut self) -> Result<&'s str, CdrFault> {
        let length = self.length(None)?;
        std::str::from_utf8(self.take(length)?).map_err(|_| CdrFault::NotText("UTF-8"))
    }

    fn bits(&mut self) -> Result<u64, CdrFault> {
        self.varint()
    }

    fn enumeration(&mut self, known: &Enumeration) -> Result<i32, CdrFault> {
        let place = self.varint()?;
        let literal = usize::try_from(place).ok().and_then(|place| known.literals.get(place));
        literal.map(|(_, value)| *value).ok_or(CdrFault::UnknownLiteral(place as i64))
    }

    fn octets(&mut self, length: Option<usize>) -> Result<&'s [u8], CdrFault> {
        let length = self.length(length)?;
        self.take(length)
    }

    fn list(&mut self, length: Option<usize>) -> Result<usize, CdrFault> {
        let length = self.length(length)?;
        let left = self.rest.len();
        if length > left {
            return Err(CdrFault::LengthBeyondEnd { declared: length as u64, left });
        }
        Ok(length)
    }

    fn structure(&mut self, _: usize) -> Result<(), CdrFault> {
        Ok(())
    }

    fn optional(&mut self) -> Result<bool, CdrFault> {
        self.boolean()
    }

    fn union(&mut self) -> Result<(i64, bool), CdrFault> {
        Err(CdrFault::OtherKind { expected: "what contents of type umaa hold" })
    }

    fn end(&mut self) {}
}
