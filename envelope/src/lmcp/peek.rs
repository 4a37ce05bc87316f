//! What a message tells without being decoded: its type, and values at places that the schema fixes.

use super::cmasi::{AltitudeType, EntityState, Location3D};
use super::container;
use super::error::DecodeError;
use super::object::Struct;
use super::reader::{Header, Reader};
use super::schema::TypeInfo;

impl Header {
    /// The type of a message's root object. Looks at the first 23 bytes and the length only.
    ///
    /// # Errors
    /// When the bytes are not a message of the length that they declare, or have no root object.
    #[inline]
    pub fn peek(message: &[u8]) -> Result<Self, DecodeError> {
        container::read_root_header(message).map(|(header, _)| header)
    }
}

/// Where an entity is, read from its state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// In degrees, positive north.
    pub latitude: f64,
    /// In degrees, positive east.
    pub longitude: f64,
    /// In metres.
    pub altitude: f32,
    /// What the altitude is measured from.
    pub altitude_type: AltitudeType,
}

const LOCATION: usize = fixed_offset(EntityState::TYPE, "Location");

/// Where the entity of an entity state is; none for messages of other types, for a state without a
/// location, and for damaged ones. The checksum is not looked at.
pub fn position(message: &[u8]) -> Option<Position> {
    let (header, mut fields) = container::read_root_header(message).ok()?;
    if !header.type_info().ok()?.is_a(EntityState::TYPE) {
        return None;
    }
    fields.bytes(LOCATION).ok()?;
    if !fields.header().ok()??.type_info().ok()?.is_a(Location3D::TYPE) {
        return None;
    }
    let mut location = Location3D::default();
    super::Object::decode_fields(&mut location, &mut fields).ok()?;
    let Location3D { latitude, longitude, altitude, altitude_type } = location;
    Some(Position { latitude, longitude, altitude, altitude_type })
}

/// The 64-bit number `offset` bytes after the start of the root object's fields.
pub(super) fn int64(fields: &mut Reader<'_>, offset: usize) -> Option<i64> {
    fields.bytes(offset).ok()?;
    fields.array().ok().copied().map(i64::from_be_bytes)
}

/// Where the own field `name` of a type begins; does not compile unless the schema fixes it.
pub(super) const fn fixed_offset(info: &TypeInfo, name: &str) -> usize {
    match info.offset_of(name) {
        Some(offset) => offset,
        None => panic!("the field has no fixed place"),
    }
}
