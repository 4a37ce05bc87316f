//! The four bytes in front of every sample (DDS-XTypes 1.3, 7.6.3.1.2; RTPS 2.5, 10.2).

use super::error::{CdrError, CdrFault};
use crate::description::Extensibility;

/// Bytes of the header.
pub const HEADER: usize = 4;

/// The order of the bytes of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
#[allow(missing_docs, reason = "the names say it all")]
pub enum ByteOrder {
    Big,
    #[default]
    Little,
}

/// How a sample is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Form {
    /// XCDR1: final and appendable types.
    Xcdr1,
    /// XCDR2 of a final type.
    PlainXcdr2,
    /// XCDR2 of an appendable type: its length goes before it.
    DelimitedXcdr2,
}

/// A representation of samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Representation {
    /// How the sample is written.
    pub form: Form,
    /// In which byte order.
    pub order: ByteOrder,
}

impl Representation {
    /// The representation of a header's first two bytes.
    pub fn of_id(id: u16) -> Option<Self> {
        let form = match id & !1 {
            0x0000 => Form::Xcdr1,
            0x0006 => Form::PlainXcdr2,
            0x0008 => Form::DelimitedXcdr2,
            _ => return None,
        };
        let order = if id & 1 == 0 { ByteOrder::Big } else { ByteOrder::Little };
        Some(Self { form, order })
    }

    /// The header's first two bytes as a number.
    pub fn id(self) -> u16 {
        let form = match self.form {
            Form::Xcdr1 => 0x0000,
            Form::PlainXcdr2 => 0x0006,
            Form::DelimitedXcdr2 => 0x0008,
        };
        form | u16::from(self.order == ByteOrder::Little)
    }

    /// What XCDR2 makes of a type with this extensibility, in the order of most machines.
    pub fn xcdr2(extensibility: Extensibility) -> Self {
        let form =
            if extensibility == Extensibility::Final { Form::PlainXcdr2 } else { Form::DelimitedXcdr2 };
        Self { form, order: ByteOrder::Little }
    }

    /// XCDR1 in the order of most machines.
    pub const XCDR1: Self = Self { form: Form::Xcdr1, order: ByteOrder::Little };

    /// The header, where `length` bytes follow: they are filled up to a multiple of four, and how many are filler stands in the
    /// lowest two bits.
    pub fn header(self, length: usize) -> [u8; HEADER] {
        let [high, low] = self.id().to_be_bytes();
        [high, low, 0, (length.next_multiple_of(4) - length) as u8]
    }
}

/// A sample taken apart: its representation and its body without filler.
pub(super) fn split(sample: &[u8]) -> Result<(Representation, &[u8]), Box<CdrError>> {
    let Some((header, body)) = sample.split_first_chunk::<HEADER>() else {
        let fault = CdrFault::Truncated { needed: HEADER, left: sample.len() };
        return Err(CdrError::new(fault, 0));
    };
    let id = u16::from_be_bytes([header[0], header[1]]);
    let representation =
        Representation::of_id(id).ok_or_else(|| CdrError::new(CdrFault::Representation(id), 0))?;
    let filler = usize::from(header[3] & 3);
    match body.len().checked_sub(filler) {
        Some(length) => Ok((representation, &body[..length])),
        None => Err(CdrError::new(CdrFault::Truncated { needed: HEADER + filler, left: body.len() }, HEADER)),
    }
}
