//! Checks messages of the reference: decoded, encoded, compared.

use serde_json::Value as Json;

use super::container::{decode, encode};
use super::error::DecodeError;
use super::json::to_json;
use super::schema::TypeInfo;

/// What became of a message that was decoded and encoded again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Verification {
    /// The type of the message.
    pub info: &'static TypeInfo,
    /// Whether encoding gave the same bytes.
    pub identical: bool,
    /// Whether the decoded fields equal the JSON form that was expected, down to the last bit.
    pub fields_equal: bool,
}

/// Decodes `message`, encodes it again and compares: the bytes with those that came, the fields with
/// the JSON form `expected`, which may stand by itself or as the member `object` of a description.
///
/// # Errors
/// When the message is not decoded.
pub fn verify(message: &[u8], expected: &Json) -> Result<Verification, DecodeError> {
    let object = decode(message)?;
    let identical = encode(object.as_ref()).is_ok_and(|again| again == message);
    let expected = expected.get("object").unwrap_or(expected);
    let fields_equal = to_json(object.as_ref()) == *expected;
    Ok(Verification { info: object.type_info(), identical, fields_equal })
}
