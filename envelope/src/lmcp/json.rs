//! The JSON form: an object is a map of what tells its type and, under `fields`, its fields by the
//! model's names.
//!
//! ```json
//! {
//!  "_type": "afrl.cmasi.KeyValuePair",
//!  "_series": "CMASI", "_series_id": 4849604199710720000, "_lmcp_type": 2, "_version": 3,
//!  "fields": { "Key": "colour", "Value": "red" }
//! }
//! ```
//!
//! Numbers are numbers, those of enumerations too. What JSON has no number for is text: `NaN`, `inf`
//! and `-inf`; a NaN's other bits are lost. Null is null.
//!
//! Text is read straight into the objects, within the memory that a binary message of its length is allowed.

mod cursor;
mod read;
mod write;

pub use read::{JsonError, JsonFault, from_json, read_json};
pub use write::to_json;

/// The members of an object's map.
mod member {
    pub(super) const TYPE: &str = "_type";
    pub(super) const SERIES: &str = "_series";
    pub(super) const SERIES_ID: &str = "_series_id";
    pub(super) const TYPE_ID: &str = "_lmcp_type";
    pub(super) const VERSION: &str = "_version";
    pub(super) const FIELDS: &str = "fields";
    /// The object itself, in the map of what describes it.
    pub(super) const DESCRIBED: &str = "object";
}
