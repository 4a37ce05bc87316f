//! Natural keys: which messages are states of something that has a number, and that number.
//!
//! A newer message of the same type and key replaces an older one: so late joiners get the newest of
//! each, and a link may drop what is replaced. Messages of all other types are events: each counts.

use super::cmasi::{AbstractZone, EntityConfiguration, EntityState, OperatingRegion, Task};
use super::container;
use super::impact::{AreaOfInterest, LineOfInterest, PointOfInterest};
use super::object::Struct;
use super::peek;
use super::route::GraphRegion;
use super::schema::TypeInfo;

/// A type that has a natural key, and so have all that descend from it.
#[derive(Debug, Clone, Copy)]
pub struct Keyed {
    /// The type.
    pub info: &'static TypeInfo,
    /// Its field that is the key.
    pub field: &'static str,
    /// Where that field begins, in bytes from the first field.
    offset: usize,
}

const fn keyed<T: Struct>(field: &'static str) -> Keyed {
    Keyed { info: T::TYPE, field, offset: peek::fixed_offset(T::TYPE, field) }
}

/// All types that have a natural key, descendants left out.
pub static KEYED: [Keyed; 9] = [
    keyed::<EntityState>("ID"),
    keyed::<EntityConfiguration>("ID"),
    keyed::<Task>("TaskID"),
    keyed::<AbstractZone>("ZoneID"),
    keyed::<OperatingRegion>("ID"),
    keyed::<PointOfInterest>("PointID"),
    keyed::<LineOfInterest>("LineID"),
    keyed::<AreaOfInterest>("AreaID"),
    keyed::<GraphRegion>("ID"),
];

/// The row of [`KEYED`] that holds for a type.
pub fn key_of(info: &TypeInfo) -> Option<&'static Keyed> {
    KEYED.iter().find(|keyed| info.is_a(keyed.info))
}

/// The natural key of a message, read without decoding it: none when its type has no key, when it is
/// not of the type that `descriptor` says, or when it is damaged. The checksum is not looked at.
pub fn natural_key(descriptor: &str, message: &[u8]) -> Option<i64> {
    let (header, mut fields) = container::read_root_header(message).ok()?;
    let info = header.type_info().ok()?;
    if info.full_name != descriptor {
        return None;
    }
    peek::int64(&mut fields, key_of(info)?.offset)
}
