//! Reading postcard's primitives from a slice, never past its end.

use super::HeaderError;

/// The bits that say that a number goes on, in eight of its bytes.
const CONTINUED: u64 = 0x8080_8080_8080_8080;

/// The seven low bits of each of eight bytes, side by side.
fn joined(bytes: u64) -> u64 {
    let seven = bytes & !CONTINUED;
    let fourteen = (seven & 0x007f_007f_007f_007f) | (seven & 0x7f00_7f00_7f00_7f00) >> 1;
    let half = (fourteen & 0x0000_3fff_0000_3fff) | (fourteen & 0x3fff_0000_3fff_0000) >> 2;
    (half & 0x0fff_ffff) | (half & 0x0fff_ffff_0000_0000) >> 4
}

/// A place in a header.
pub(super) struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    pub(super) fn left(&self) -> usize {
        self.rest.len()
    }

    /// Whether exactly these bytes are left, which are taken then.
    pub(super) fn is(&mut self, bytes: &[u8]) -> bool {
        let is = self.rest == bytes;
        if is {
            self.rest = &[];
        }
        is
    }

    pub(super) fn byte(&mut self, field: &'static str) -> Result<u8, HeaderError> {
        let (&byte, rest) = self.rest.split_first().ok_or(HeaderError::Truncated(field))?;
        self.rest = rest;
        Ok(byte)
    }

    /// A flag before an optional field.
    pub(super) fn present(&mut self, field: &'static str) -> Result<bool, HeaderError> {
        match self.byte(field)? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(HeaderError::Invalid { field, why: format!("{other} is neither 0 nor 1") }),
        }
    }

    #[inline]
    pub(super) fn varint(&mut self, field: &'static str) -> Result<u64, HeaderError> {
        match self.rest {
            // Most numbers of a header are this small.
            [byte, rest @ ..] if *byte < 0x80 => {
                self.rest = rest;
                Ok(u64::from(*byte))
            }
            _ => self.long_varint(field),
        }
    }

    fn long_varint(&mut self, field: &'static str) -> Result<u64, HeaderError> {
        if let Some((eight, [ninth, rest @ ..])) = self.rest.split_first_chunk::<8>()
            && *ninth < 0x80
            && u64::from_le_bytes(*eight) & CONTINUED == CONTINUED
        {
            // Nine bytes: what the nanoseconds of this century take.
            self.rest = rest;
            return Ok(joined(u64::from_le_bytes(*eight)) | u64::from(*ninth) << 56);
        }
        let (mut number, mut shift) = (0u64, 0);
        for (place, &byte) in self.rest.iter().enumerate() {
            if shift == 63 && byte > 1 {
                return Err(HeaderError::Invalid { field, why: "a number over 64 bits".into() });
            }
            number |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                self.rest = &self.rest[place + 1..];
                return Ok(number);
            }
            shift += 7;
        }
        Err(HeaderError::Truncated(field))
    }

    pub(super) fn varint_u32(&mut self, field: &'static str) -> Result<u32, HeaderError> {
        let number = self.varint(field)?;
        u32::try_from(number)
            .map_err(|_| HeaderError::Invalid { field, why: format!("{number} is over 32 bits") })
    }

    pub(super) fn zigzag(&mut self, field: &'static str) -> Result<i64, HeaderError> {
        let number = self.varint(field)?;
        Ok((number >> 1) as i64 ^ -((number & 1) as i64))
    }

    pub(super) fn bytes(&mut self, field: &'static str) -> Result<&'a [u8], HeaderError> {
        let length = usize::try_from(self.varint(field)?).map_err(|_| HeaderError::Truncated(field))?;
        let (bytes, rest) = self.rest.split_at_checked(length).ok_or(HeaderError::Truncated(field))?;
        self.rest = rest;
        Ok(bytes)
    }

    pub(super) fn text(&mut self, field: &'static str) -> Result<&'a str, HeaderError> {
        std::str::from_utf8(self.bytes(field)?)
            .map_err(|_| HeaderError::Invalid { field, why: "not UTF-8".into() })
    }

    /// A value that serde reads.
    pub(super) fn value<T: serde::Deserialize<'a>>(&mut self, field: &'static str) -> Result<T, HeaderError> {
        let (value, rest) = postcard::take_from_bytes(self.rest)
            .map_err(|why| HeaderError::Invalid { field, why: why.to_string() })?;
        self.rest = rest;
        Ok(value)
    }
}
