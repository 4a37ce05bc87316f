//! What a value is read into, and what it is written from: one reader and one writer of CDR serve trees of values and postcard.

use super::error::CdrFault;
use crate::description::Enumeration;

/// Takes what is read, in the order of the type.
pub(super) trait Sink {
    fn boolean(&mut self, value: bool);
    fn unsigned(&mut self, value: u64, size: usize);
    fn signed(&mut self, value: i64, size: usize);
    fn float32(&mut self, value: f32);
    fn float64(&mut self, value: f64);
    fn character(&mut self, unit: u16);
    fn text(&mut self, text: &str);
    fn bits(&mut self, bits: u64);
    /// A value of an enumeration, which may be none that is known.
    fn enumeration(&mut self, value: i32, known: &Enumeration);
    /// A sequence (`counted`) or an array of octets.
    fn octets(&mut self, octets: &[u8], counted: bool);
    /// A sequence (`counted`) or an array of other elements, which follow.
    fn list(&mut self, length: usize, counted: bool);
    /// A structure with so many members, which follow.
    fn structure(&mut self, members: usize);
    /// Whether an optional member follows.
    fn optional(&mut self, present: bool);
    /// A member that must be there is not: the sample is of an older version of its type.
    fn missing(&mut self);
    /// A union, whose member follows where there is one.
    fn union(&mut self, discriminator: i64);
    /// The end of a list, a structure or a union.
    fn end(&mut self);
}

/// Gives what is written, in the order of the type.
pub(super) trait Source<'s> {
    fn boolean(&mut self) -> Result<bool, CdrFault>;
    fn unsigned(&mut self, size: usize) -> Result<u64, CdrFault>;
    fn signed(&mut self, size: usize) -> Result<i64, CdrFault>;
    fn float32(&mut self) -> Result<f32, CdrFault>;
    fn float64(&mut self) -> Result<f64, CdrFault>;
    fn character(&mut self) -> Result<u16, CdrFault>;
    fn text(&mut self) -> Result<&'s str, CdrFault>;
    fn bits(&mut self) -> Result<u64, CdrFault>;
    fn enumeration(&mut self, known: &Enumeration) -> Result<i32, CdrFault>;
    /// The octets of a sequence, or of an array of this length.
    fn octets(&mut self, length: Option<usize>) -> Result<&'s [u8], CdrFault>;
    /// The number of elements, which follow.
    fn list(&mut self, length: Option<usize>) -> Result<usize, CdrFault>;
    /// The members follow.
    fn structure(&mut self, members: usize) -> Result<(), CdrFault>;
    /// Whether an optional member follows.
    fn optional(&mut self) -> Result<bool, CdrFault>;
    /// The discriminator, and whether a member follows.
    fn union(&mut self) -> Result<(i64, bool), CdrFault>;
    fn end(&mut self);
}
