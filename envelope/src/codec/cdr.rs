//! CDR, the form of samples on a DDS bus: XCDR1 and XCDR2 of final and appendable types, driven by descriptions
//! (DDS-XTypes 1.3, 7.4; RTPS 2.5, 10).
//!
//! A [`Schema`] is a type made ready. What it reads becomes a [`Value`], or at once the content of an envelope in postcard. A
//! sample that has more or less than its type, as those of other versions do, is read as far as it goes and says so.

mod cursor;
mod error;
mod json;
mod key;
mod postcard;
mod read;
mod representation;
mod schema;
mod sink;
#[cfg(test)]
mod tests;
mod value;
mod write;

pub use error::{CdrError, CdrFault, SchemaError};
pub use key::KeySchema;
pub use representation::{ByteOrder, Form, HEADER, Representation};
pub use schema::Schema;
pub use value::Value;

use crate::description::Extensibility;
use cursor::{Cursor, Read};
use postcard::{PostcardSink, PostcardSource};
use read::Reader;
use sink::{Sink, Source};
use value::{Tree, Walk};
use write::Writer;

/// A sample that has been read.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// How it was written.
    pub representation: Representation,
    /// What it holds.
    pub value: Value,
    /// Whether it holds something that its type here does not have, or lacks something that it has.
    pub differs: bool,
}

impl Schema {
    /// Reads a sample, header included.
    ///
    /// # Errors
    /// [`CdrError`] where it is no sample of the type.
    pub fn read(&self, sample: &[u8]) -> Result<Sample, Box<CdrError>> {
        let mut tree = Tree::default();
        let (representation, differs) = self.read_into(sample, &mut tree)?;
        let value = tree.into_value().ok_or_else(|| CdrError::new(CdrFault::Absent, HEADER))?;
        Ok(Sample { representation, value, differs })
    }

    /// Writes a sample, header included and filled up to a multiple of four.
    ///
    /// # Errors
    /// [`CdrError`] where the value is not one of the type, or the representation not one that the type has.
    pub fn write(&self, value: &Value, representation: Representation) -> Result<Vec<u8>, Box<CdrError>> {
        self.write_from(&mut Walk::new(value), representation)
    }

    /// Reads a sample as the content of an envelope in postcard; none where it differs from its type here.
    ///
    /// # Errors
    /// [`CdrError`] where it is no sample of the type.
    pub fn to_postcard(&self, sample: &[u8]) -> Result<Option<Vec<u8>>, Box<CdrError>> {
        let mut sink = PostcardSink::default();
        let (_, differs) = self.read_into(sample, &mut sink)?;
        Ok(sink.into_content().filter(|_| !differs))
    }

    /// Writes the content of an envelope in postcard as a sample.
    ///
    /// # Errors
    /// [`CdrError`] where it is not exactly one content of the type.
    pub fn of_postcard(
        &self,
        content: &[u8],
        representation: Representation,
    ) -> Result<Vec<u8>, Box<CdrError>> {
        let mut source = PostcardSource::new(content);
        let sample = self.write_from(&mut source, representation)?;
        match source.left() {
            0 => Ok(sample),
            left => Err(CdrError::new(CdrFault::Trailing(left), sample.len())),
        }
    }

    fn read_into<S: Sink>(&self, sample: &[u8], sink: &mut S) -> Read<(Representation, bool)> {
        let (representation, body) = representation::split(sample)?;
        self.agrees(representation)?;
        let mut reader = Reader::new(self, Cursor::new(body, representation), sink);
        reader.value(self.root)?;
        // Fewer than four bytes may be filler that its writer did not count.
        let left = reader.cursor.left();
        let open_end = representation.form == Form::Xcdr1 && self.extensibility() != Extensibility::Final;
        if left >= 4 && !open_end {
            return Err(reader.cursor.fault(CdrFault::Trailing(left)));
        }
        Ok((representation, reader.differs || left >= 4))
    }

    fn write_from<'s, S: Source<'s>>(&self, source: &mut S, representation: Representation) -> Read<Vec<u8>> {
        self.agrees(representation)?;
        let mut out = vec![0; HEADER];
        Writer::new(self, representation, source, &mut out).value(self.root)?;
        let length = out.len() - HEADER;
        out[..HEADER].copy_from_slice(&representation.header(length));
        out.resize(HEADER + length.next_multiple_of(4), 0);
        Ok(out)
    }

    fn agrees(&self, representation: Representation) -> Read<()> {
        let is_final = self.extensibility() == Extensibility::Final;
        let agrees = match representation.form {
            Form::Xcdr1 => true,
            Form::PlainXcdr2 => is_final,
            Form::DelimitedXcdr2 => !is_final,
        };
        if agrees {
            return Ok(());
        }
        let is = if is_final { "final" } else { "appendable" };
        Err(CdrError::new(CdrFault::OtherExtensibility { is, found: representation.id() }, 0))
    }
}
