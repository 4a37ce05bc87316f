//! Reads wire values from bytes, within bounds of length, depth and memory.

use super::error::{DecodeError, DecodeFault, PATH_STEP};
use super::schema::{Count, FieldInfo, Kind, SeriesName};
use super::value::{Text, Value};

/// Result of reading one value. The error is boxed so that success stays small.
pub type Decoded<T> = Result<T, Box<DecodeError>>;

/// How deep objects may be nested. The model's deepest sound chain, a plan response with its
/// missions, waypoints, actions and places, has six; more only come from actions put into places of
/// actions, which an attacker can repeat until the stack ends.
pub const DEPTH_MAX: u8 = 16;

/// Bytes of memory that one byte of a message may take while it is decoded, the object and an error counted. Objects with
/// all texts and arrays empty take up to four for one, in whatever array they stand. Only nulls take more, one byte on the
/// wire and up to a hundred in memory: a long array of them is refused.
pub const MEMORY_FACTOR: usize = 4;

/// Bytes of memory that any message may take, however short it is: for some nulls, and for the error of a few bytes. So
/// the factor holds from 512 bytes on.
pub const MEMORY_FLOOR: usize = 2 * 1024;

/// What an error takes in memory, but for the names of what it is in: it is made in a box and moved out of it.
const ERROR: usize = 2 * size_of::<DecodeError>();

/// What the names of an error take for one object that it is in: a field and an index, while their list grows.
const ERROR_LEVEL: usize = 4 * PATH_STEP;

/// A cursor over the bytes of a message.
#[derive(Debug)]
pub struct Reader<'a> {
    rest: &'a [u8],
    /// Offset of the end of `rest`, from where offsets are counted.
    end: usize,
    depth: u8,
    /// Bytes that may still be allocated.
    memory: usize,
}

impl<'a> Reader<'a> {
    /// Reads `bytes`, which begin at `offset` of the message.
    #[inline]
    pub(super) fn new(bytes: &'a [u8], offset: usize) -> Self {
        let memory = bytes.len().saturating_mul(MEMORY_FACTOR).max(MEMORY_FLOOR) - ERROR - ERROR_LEVEL;
        Self { rest: bytes, end: offset + bytes.len(), depth: 0, memory }
    }

    /// Bytes not yet read.
    pub fn left(&self) -> usize {
        self.rest.len()
    }

    /// An error at the cursor.
    #[cold]
    pub(super) fn fail<T>(&self, fault: DecodeFault) -> Decoded<T> {
        self.fail_back(0, fault)
    }

    /// An error `back` bytes before the cursor.
    #[cold]
    pub(super) fn fail_back<T>(&self, back: usize, fault: DecodeFault) -> Decoded<T> {
        Err(Box::new(DecodeError::new(fault, self.end - self.rest.len() - back)))
    }

    /// An error at the beginning of the header that was just read.
    #[cold]
    pub(super) fn fail_header<T>(&self, fault: DecodeFault) -> Decoded<T> {
        self.fail_back(HEADER, fault)
    }

    /// The next `N` bytes.
    #[inline(always)]
    pub(super) fn array<const N: usize>(&mut self) -> Decoded<&'a [u8; N]> {
        match self.rest.split_first_chunk() {
            Some((bytes, rest)) => {
                self.rest = rest;
                Ok(bytes)
            }
            None => self.fail(DecodeFault::Truncated { needed: N, left: self.left() }),
        }
    }

    /// The next `count` bytes.
    #[inline]
    pub(super) fn bytes(&mut self, count: usize) -> Decoded<&'a [u8]> {
        match self.rest.split_at_checked(count) {
            Some((bytes, rest)) => {
                self.rest = rest;
                Ok(bytes)
            }
            None => self.fail(DecodeFault::Truncated { needed: count, left: self.left() }),
        }
    }

    /// A text of at most 16 bytes, where so many follow: most keys, labels and names. What follows the text is blanked
    /// out, so that words are checked and not bytes. None where that is not to be had, or the bytes are not UTF-8.
    #[inline]
    pub(super) fn short_text(&mut self, length: usize) -> Option<Text> {
        let shift = 128_u32.checked_sub(8 * u32::try_from(length).ok()?)?;
        let following = u128::from_le_bytes(*self.rest.first_chunk()?);
        let padded = following.unbounded_shl(shift).unbounded_shr(shift).to_le_bytes();
        let text = str::from_utf8(&padded).ok()?.get(..length)?;
        self.rest = self.rest.get(length..)?;
        Some(Text::new(text))
    }

    #[inline]
    pub(super) fn u16(&mut self) -> Decoded<u16> {
        Ok(u16::from_be_bytes(*self.array()?))
    }

    #[inline]
    pub(super) fn u32(&mut self) -> Decoded<u32> {
        Ok(u32::from_be_bytes(*self.array()?))
    }

    /// A byte that is 0 or 1; `fault` says what any other one is.
    #[inline]
    pub(super) fn flag(&mut self, fault: fn(u8) -> DecodeFault) -> Decoded<bool> {
        match self.array()? {
            [0] => Ok(false),
            [1] => Ok(true),
            &[other] => self.fail_back(1, fault(other)),
        }
    }

    /// Checks at once that the fields of fixed width that begin with this one are there; `width` is what they take.
    #[inline(always)]
    pub fn run(&mut self, width: usize, fields: &'static [FieldInfo], first: usize) -> Decoded<()> {
        if self.rest.len() < width { Err(self.fail_run(width, &fields[first..])) } else { Ok(()) }
    }

    /// The error of the first of the fields for which the bytes that are left do not suffice.
    #[cold]
    #[inline(never)]
    fn fail_run(&mut self, needed: usize, fields: &'static [FieldInfo]) -> Box<DecodeError> {
        for field in fields {
            let (count, width) = match field.kind {
                Kind::List(element, Count::Fixed(count)) => (Some(count), element.width()),
                kind => (None, kind.width()),
            };
            for index in 0..count.unwrap_or(1) {
                if let Err(error) = self.bytes(width.unwrap_or(0)) {
                    let error = if count.is_some() { error.in_element(index) } else { error };
                    return error.in_field(field.name);
                }
            }
        }
        let fault = DecodeFault::Truncated { needed, left: self.left() };
        Box::new(DecodeError::new(fault, self.end - self.rest.len()))
    }

    /// A field of an object; an error names it.
    #[inline(always)]
    pub fn field<T: Value>(&mut self, name: &'static str, value: &mut T) -> Decoded<()> {
        match value.decode(self) {
            Ok(()) => Ok(()),
            Err(error) => Err(error.in_field(name)),
        }
    }

    /// Accounts for `bytes` to be allocated.
    #[inline]
    pub(super) fn allocate(&mut self, bytes: usize) -> Decoded<()> {
        match self.memory.checked_sub(bytes) {
            Some(memory) => {
                self.memory = memory;
                Ok(())
            }
            None => self.fail(DecodeFault::Memory),
        }
    }

    /// Takes `bytes` that were accounted for back: they are free again.
    #[inline]
    pub(super) fn release(&mut self, bytes: usize) {
        self.memory += bytes;
    }

    /// Checks that `count` elements of at least `size_min` bytes can follow.
    #[inline]
    pub(super) fn bound(&self, count: usize, size_min: usize) -> Decoded<()> {
        match count.checked_mul(size_min) {
            Some(needed) if needed <= self.left() => Ok(()),
            _ => self.fail(DecodeFault::Count { count, left: self.left() }),
        }
    }

    /// Passes over `expected`, if that is what follows.
    #[inline(always)]
    pub(super) fn skip(&mut self, expected: &[u8; HEADER]) -> bool {
        match self.rest.split_first_chunk() {
            Some((bytes, rest)) if bytes == expected => {
                self.rest = rest;
                true
            }
            _ => false,
        }
    }

    /// Reads what is inside an object.
    #[inline]
    pub(super) fn nested<T>(&mut self, read: impl FnOnce(&mut Self) -> Decoded<T>) -> Decoded<T> {
        if self.depth == DEPTH_MAX {
            return self.fail(DecodeFault::Depth);
        }
        self.allocate(ERROR_LEVEL)?;
        self.depth += 1;
        let inside = read(self)?;
        self.depth -= 1;
        self.release(ERROR_LEVEL);
        Ok(inside)
    }

    /// What tells an object's type: none for a null.
    #[inline]
    pub(super) fn header(&mut self) -> Decoded<Option<Header>> {
        if !self.flag(DecodeFault::Presence)? {
            return Ok(None);
        }
        let [s0, s1, s2, s3, s4, s5, s6, s7, t0, t1, t2, t3, v0, v1] = *self.array()?;
        Ok(Some(Header {
            series: SeriesName(u64::from_be_bytes([s0, s1, s2, s3, s4, s5, s6, s7])),
            type_id: u32::from_be_bytes([t0, t1, t2, t3]),
            version: u16::from_be_bytes([v0, v1]),
        }))
    }
}

/// Bytes from an object's presence byte to its first field.
pub(super) const HEADER: usize = 15;

/// The series, number and version of an object's type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// The series that the type belongs to.
    pub series: SeriesName,
    /// The number of the type in its series.
    pub type_id: u32,
    /// The version of the series.
    pub version: u16,
}
