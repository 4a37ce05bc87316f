//! Bytes that are read in order, with the alignment of CDR.

use super::error::{CdrError, CdrFault};
use super::representation::{ByteOrder, Form, HEADER, Representation};

pub(super) type Read<T> = Result<T, Box<CdrError>>;

/// What was around a length that has been entered.
#[derive(Debug)]
pub(super) struct Outside {
    end: usize,
    origin: usize,
}

/// Reads the body of a sample.
#[derive(Debug, Clone)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Where alignment counts from.
    origin: usize,
    /// Where the innermost delimiter ends.
    end: usize,
    representation: Representation,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(bytes: &'a [u8], representation: Representation) -> Self {
        Self { bytes, at: 0, origin: 0, end: bytes.len(), representation }
    }

    pub(super) fn is_xcdr1(&self) -> bool {
        self.representation.form == Form::Xcdr1
    }

    pub(super) fn left(&self) -> usize {
        self.end - self.at
    }

    #[cold]
    pub(super) fn fault(&self, fault: CdrFault) -> Box<CdrError> {
        CdrError::new(fault, HEADER + self.at)
    }

    pub(super) fn take(&mut self, length: usize) -> Read<&'a [u8]> {
        match self.bytes[..self.end].get(self.at..).and_then(|rest| rest.get(..length)) {
            Some(taken) => {
                self.at += length;
                Ok(taken)
            }
            None => Err(self.fault(CdrFault::Truncated { needed: length, left: self.left() })),
        }
    }

    /// Goes on to where a number of this size stands.
    pub(super) fn align(&mut self, size: usize) -> Read<()> {
        let most = if self.is_xcdr1() { 8 } else { 4 };
        let next = self.origin + (self.at - self.origin).next_multiple_of(size.min(most));
        if next > self.end {
            return Err(self.fault(CdrFault::Truncated { needed: next - self.at + size, left: self.left() }));
        }
        self.at = next;
        Ok(())
    }

    /// A number of 1, 2, 4 or 8 bytes.
    pub(super) fn unsigned(&mut self, size: usize) -> Read<u64> {
        self.align(size)?;
        let mut wide = [0; 8];
        let taken = self.take(size)?;
        Ok(match self.representation.order {
            ByteOrder::Little => {
                wide[..size].copy_from_slice(taken);
                u64::from_le_bytes(wide)
            }
            ByteOrder::Big => {
                wide[8 - size..].copy_from_slice(taken);
                u64::from_be_bytes(wide)
            }
        })
    }

    pub(super) fn signed(&mut self, size: usize) -> Read<i64> {
        let spare = 64 - 8 * size as u32;
        Ok((self.unsigned(size)? << spare) as i64 >> spare)
    }

    pub(super) fn u32(&mut self) -> Read<u32> {
        self.unsigned(4).map(|number| number as u32)
    }

    pub(super) fn boolean(&mut self) -> Read<bool> {
        match self.take(1)? {
            [0] => Ok(false),
            [1] => Ok(true),
            other => {
                let other = other.first().copied().unwrap_or_default();
                self.at -= 1;
                Err(self.fault(CdrFault::NotBoolean(other)))
            }
        }
    }

    /// A text with its terminator. A length of 0 is taken for an empty text, as some write it.
    pub(super) fn text(&mut self, bound: Option<u32>) -> Read<&'a str> {
        let length = self.u32()?;
        let Some(bytes) = length.checked_sub(1) else { return Ok("") };
        if bound.is_some_and(|bound| bytes > bound) {
            let allowed = bound.unwrap_or_default().into();
            return Err(self.fault(CdrFault::Length { found: bytes.into(), allowed }));
        }
        match self.take(length as usize)? {
            [text @ .., 0] => std::str::from_utf8(text).map_err(|_| self.fault(CdrFault::NotText("UTF-8"))),
            _ => Err(self.fault(CdrFault::NoTerminator)),
        }
    }

    /// A text of 16-bit units: its length in bytes goes before it, and nothing ends it.
    pub(super) fn wide_text(&mut self, bound: Option<u32>) -> Read<String> {
        let length = self.u32()?;
        if bound.is_some_and(|bound| length / 2 > bound) {
            let allowed = bound.unwrap_or_default().into();
            return Err(self.fault(CdrFault::Length { found: (length / 2).into(), allowed }));
        }
        let order = self.representation.order;
        let units = self.take(length as usize)?.chunks(2).map(|pair| match (pair, order) {
            (&[low, high], ByteOrder::Little) | (&[high, low], ByteOrder::Big) => {
                u16::from_be_bytes([high, low])
            }
            // Half a unit: no text.
            _ => 0xd800,
        });
        char::decode_utf16(units)
            .collect::<Result<_, _>>()
            .map_err(|_| self.fault(CdrFault::NotText("UTF-16")))
    }

    /// Enters a length, whose end is the end of everything inside; `aligned` where alignment counts from its start.
    pub(super) fn enter(&mut self, length: usize, aligned: bool) -> Read<Outside> {
        if length > self.left() {
            return Err(self.fault(CdrFault::Truncated { needed: length, left: self.left() }));
        }
        let outside = Outside { end: self.end, origin: self.origin };
        self.end = self.at + length;
        if aligned {
            self.origin = self.at;
        }
        Ok(outside)
    }

    /// Leaves it, and says how many bytes in it were not read.
    pub(super) fn leave(&mut self, outside: Outside) -> usize {
        let left = self.left();
        self.at = self.end;
        Outside { end: self.end, origin: self.origin } = outside;
        left
    }
}
