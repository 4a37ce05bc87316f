//! Writes wire values, and refuses what a count or length cannot tell.

use super::error::{EncodeError, EncodeFault};
use super::reader::DEPTH_MAX;
use super::value::Value;

/// Result of writing one value. The error is boxed so that success stays small.
pub type Encoded = Result<(), Box<EncodeError>>;

/// Collects the bytes of a message.
#[derive(Debug)]
pub struct Writer<'a> {
    bytes: &'a mut Vec<u8>,
    depth: u8,
}

impl<'a> Writer<'a> {
    /// Appends to `bytes`.
    pub(super) fn new(bytes: &'a mut Vec<u8>) -> Self {
        Self { bytes, depth: 0 }
    }

    #[inline]
    pub(super) fn put(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    /// A count of elements in 16 bits.
    #[inline]
    pub(super) fn count16(&mut self, count: usize) -> Encoded {
        let max = usize::from(u16::MAX);
        let wire = u16::try_from(count).or_else(|_| fail(EncodeFault::Count { count, max }))?;
        self.put(&wire.to_be_bytes());
        Ok(())
    }

    /// A count of elements in 32 bits.
    #[inline]
    pub(super) fn count32(&mut self, count: usize) -> Encoded {
        let max = u32::MAX as usize;
        let wire = u32::try_from(count).or_else(|_| fail(EncodeFault::Count { count, max }))?;
        self.put(&wire.to_be_bytes());
        Ok(())
    }

    /// A text with its length in bytes before it.
    #[inline]
    pub(super) fn text(&mut self, text: &str) -> Encoded {
        let length = u16::try_from(text.len()).or_else(|_| fail(EncodeFault::Text(text.len())))?;
        self.put(&length.to_be_bytes());
        self.put(text.as_bytes());
        Ok(())
    }

    /// A field of an object; an error names it.
    #[inline(always)]
    pub fn field<T: Value>(&mut self, name: &'static str, value: &T) -> Encoded {
        match value.encode(self) {
            Ok(()) => Ok(()),
            Err(error) => Err(error.in_field(name)),
        }
    }

    /// Writes what is inside an object.
    #[inline]
    pub(super) fn nested(&mut self, write: impl FnOnce(&mut Self) -> Encoded) -> Encoded {
        if self.depth == DEPTH_MAX {
            return fail(EncodeFault::Depth);
        }
        self.depth += 1;
        write(self)?;
        self.depth -= 1;
        Ok(())
    }
}

/// An error without a path yet.
#[cold]
pub(super) fn fail<T>(fault: EncodeFault) -> Result<T, Box<EncodeError>> {
    Err(Box::new(EncodeError::new(fault)))
}
