//! LMCP, the message protocol of UxAS: all 164 types of its seven series, in binary, JSON and XML.
//!
//! A type is declared once, in the module of its series ([`cmasi`] and its siblings); the macros that
//! read the declaration make a plain Rust struct of it, and its place in the schema. What every type
//! can do then follows:
//!
//! - **Binary**: [`decode`], [`decode_as`], [`encode`], [`split`]. What is decoded is encoded to the same bytes.
//!   A type or version that is not declared here is told ([`DecodeError::is_unknown_type`]), so that
//!   its message is carried as it is.
//! - **Without decoding**: [`Header::peek`], [`natural_key`], [`position`].
//! - **Text**: [`to_json`], and [`from_json`] and [`read_json`], which are strict; [`to_xml`] and [`read_xml`], which is as
//!   tolerant as users' scenario files need.
//! - **By name**: [`type_of`], [`descendants`]; the fields of any [`Object`] by [`Object::view`] and
//!   [`Object::slot`].
//!
//! A struct holds its parent's part as `base` and dereferences to it. A field for an object is a
//! [`Ref`]: null, of the declared type, or of one that descends from it.
//!
//! Bytes are not trusted: lengths are checked against what is left, depth against [`DEPTH_MAX`], memory
//! against [`MEMORY_FACTOR`] and [`MEMORY_FLOOR`].
//!
//! ```
//! use aldis_envelope::lmcp::cmasi::{EntityState, AirVehicleState, Location3D};
//! use aldis_envelope::lmcp::{decode, encode, natural_key};
//!
//! let mut state = AirVehicleState::default();
//! state.id = 400;
//! state.location = Location3D { latitude: 45.3, longitude: -121.0, ..Location3D::default() }.into();
//! let message = encode(&state)?;
//!
//! assert_eq!(natural_key("afrl.cmasi.AirVehicleState", &message), Some(400));
//! let object = decode(&message)?;
//! assert_eq!(object.type_info().full_name, "afrl.cmasi.AirVehicleState");
//! let entity: &EntityState = object.get().expect("a state of an aircraft is one of an entity");
//! assert_eq!(entity.id, 400);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[macro_use]
mod declare;

mod container;
mod error;
mod json;
mod key;
mod list;
mod memory;
mod object;
mod peek;
mod reader;
mod reference;
mod registry;
mod schema;
mod value;
mod verify;
mod writer;
mod xml;

pub mod cmasi;
pub mod impact;
pub mod perceive;
pub mod route;
pub mod uxnative;
pub mod uxtask;
pub mod vehicles;

#[cfg(test)]
mod tests;

pub use container::{CONTAINER, MAGIC, checksum, decode, decode_as, encode, encode_into, split};
pub use error::{DecodeError, DecodeFault, EncodeError, EncodeFault, FieldPath};
pub use json::{JsonError, JsonFault, from_json, read_json, to_json};
pub use key::{KEYED, Keyed, key_of, natural_key};
pub use list::LargeArray;
pub use object::{Object, Struct};
pub use peek::{Position, position};
pub use reader::{DEPTH_MAX, Decoded, Header, MEMORY_FACTOR, MEMORY_FLOOR, Reader};
pub use reference::{Inline, Place, Ref};
pub use registry::{descendants, type_in, type_of, types};
pub use schema::{Count, EnumInfo, FieldInfo, Kind, Series, SeriesName, TypeInfo};
pub use value::{Enumeration, List, Reference, Slot, Text, Value, View};
pub use verify::{Verification, XmlVerification, verify, verify_xml};
pub use writer::{Encoded, Writer};
pub use xml::{Document, Placed, Warning, WarningKind, XmlError, XmlFault, XmlTextError, read_xml, to_xml};
