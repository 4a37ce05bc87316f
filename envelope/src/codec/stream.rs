//! The stream form of UxAS over TCP and serial lines:
//! `+=+=+=+=` size `#@#@#@#@` delimited form `!%!%!%!%` checksum `?^?^?^?^`.
//!
//! Size and checksum are decimal text; the checksum is the sum of the bytes of the delimited form. The reader takes a
//! message by its declared size, so a payload may hold any sentinel, and finds the next head after garbage.

mod reader;

pub use reader::{Counters, Item, Reader, StreamError};

use super::delimited;
use crate::address::Dialect;
use crate::message::Label;
use std::io::Write;
use std::sync::Arc;

/// Begins a frame.
pub const HEAD: &[u8; 8] = b"+=+=+=+=";
/// Ends the size.
pub const SIZE_END: &[u8; 8] = b"#@#@#@#@";
/// Ends the delimited form.
pub const BODY_END: &[u8; 8] = b"!%!%!%!%";
/// Ends the checksum and the frame.
pub const TAIL: &[u8; 8] = b"?^?^?^?^";

/// The sum of the bytes, as the stream form counts it.
pub fn checksum(bytes: &[u8]) -> u32 {
    bytes.iter().fold(0, |sum, &byte| sum.wrapping_add(u32::from(byte)))
}

/// Appends a number as decimal text: each frame has two, and formatting costs more than the rest of the frame.
fn put_decimal(mut number: u64, out: &mut Vec<u8>) {
    let (mut digits, mut from) = ([0; 20], 20);
    loop {
        from -= 1;
        digits[from] = b'0' + (number % 10) as u8;
        number /= 10;
        if number == 0 {
            return out.extend_from_slice(&digits[from..]);
        }
    }
}

/// How damage of a frame is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Check {
    /// The sum of the bytes alone. Damage of two bytes can cancel out in it.
    #[default]
    Sum,
    /// In addition the CRC-32 of the delimited form in eight hexadecimal digits after the frame. Both ends must have it: for
    /// OpenUxAS it is junk between frames.
    Crc,
}

/// How many digits a CRC has.
const CRC_DIGITS: usize = 8;

/// Writes frames. It keeps the head of the label that it wrote last, since streams come in runs.
#[derive(Debug)]
pub struct Writer {
    dialect: Dialect,
    last: Option<Arc<Label>>,
    head: Vec<u8>,
    head_sum: u32,
    check: Check,
}

impl Writer {
    /// A writer that spells ids in a dialect.
    pub fn new(dialect: Dialect) -> Self {
        Self { dialect, last: None, head: Vec::new(), head_sum: 0, check: Check::Sum }
    }

    /// The same writer with a check of its frames.
    #[must_use]
    pub fn with_check(self, check: Check) -> Self {
        Self { check, ..self }
    }

    /// Appends one frame.
    pub fn write(&mut self, label: &Arc<Label>, payload: &[u8], out: &mut Vec<u8>) {
        if !self.last.as_ref().is_some_and(|last| Arc::ptr_eq(last, label)) {
            self.head.clear();
            delimited::write_head(label, self.dialect, &mut self.head);
            self.head_sum = checksum(&self.head);
            self.last = Some(label.clone());
        }
        let sum = self.head_sum.wrapping_add(checksum(payload));
        out.reserve(self.head.len() + payload.len() + 52);
        out.extend_from_slice(HEAD);
        put_decimal((self.head.len() + payload.len()) as u64, out);
        out.extend_from_slice(SIZE_END);
        out.extend_from_slice(&self.head);
        out.extend_from_slice(payload);
        out.extend_from_slice(BODY_END);
        put_decimal(u64::from(sum), out);
        out.extend_from_slice(TAIL);
        if self.check == Check::Crc {
            let mut crc = crc32fast::Hasher::new();
            crc.update(&self.head);
            crc.update(payload);
            // Writing to a Vec cannot fail.
            let _ = write!(out, "{:08x}", crc.finalize());
        }
    }
}

#[cfg(test)]
mod tests;
