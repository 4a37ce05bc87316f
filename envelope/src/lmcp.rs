//! LMCP, the message protocol of UxAS: every type of its seven series, in binary, JSON and XML.

#[macro_use]
mod declare;

mod container;
mod error;
mod json;
mod key;
mod list;
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

pub use container::{CONTAINER, MAGIC, checksum, decode, decode_as, encode, encode_into};
pub use error::{DecodeError, DecodeFault, EncodeError, EncodeFault, FieldPath};
pub use json::{JsonError, JsonFault, from_json, to_json};
pub use key::{KEYED, Keyed, key_of, natural_key};
pub use list::LargeArray;
pub use object::{Object, Struct};
pub use peek::{Position, position};
pub use reader::{DEPTH_MAX, Decoded, Header, MEMORY_FACTOR, MEMORY_FLOOR, Reader};
pub use reference::Ref;
pub use registry::{descendants, type_in, type_of, types};
pub use schema::{Count, EnumInfo, FieldInfo, Kind, Series, SeriesName, TypeInfo};
pub use value::{Enumeration, List, Reference, Slot, Value, View};
pub use verify::{Verification, verify};
pub use writer::{Encoded, Writer};
pub use xml::{Document, Placed, Warning, WarningKind, XmlError, XmlFault, XmlTextError, read_xml, to_xml};
