//! Checks messages and documents of the reference: read, written, compared.

use serde_json::Value as Json;

use super::container::{decode, encode};
use super::error::DecodeError;
use super::json::to_json;
use super::object::Object;
use super::schema::TypeInfo;
use super::xml::{Warning, XmlError, read_xml, to_xml};

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

/// What became of a document whose objects were written and read again.
#[derive(Debug, Clone, Default)]
pub struct XmlVerification {
    /// How many objects it holds.
    pub objects: usize,
    /// How many of them have a time, as those of a simulator's scenario have.
    pub timed: usize,
    /// Objects that did not come back as they were: the line where each begins, and its type.
    pub unstable: Vec<(usize, &'static TypeInfo)>,
    /// What was passed over, as far as there was memory for it.
    pub warnings: Vec<Warning>,
    /// How much more was passed over.
    pub more_warnings: usize,
}

/// Reads a document, and sends each of its objects through the forms: LMCP, object, XML, object, LMCP.
///
/// # Errors
/// Tells the line where the document is not well formed.
pub fn verify_xml(document: &[u8]) -> Result<XmlVerification, XmlError> {
    let read = read_xml(document)?;
    let unstable = read.objects.iter().filter(|placed| !is_stable(placed.object.as_ref()));
    Ok(XmlVerification {
        objects: read.objects.len(),
        timed: read.objects.iter().filter(|placed| placed.time.is_some()).count(),
        unstable: unstable.map(|placed| (placed.line, placed.object.type_info())).collect(),
        warnings: read.warnings,
        more_warnings: read.more_warnings,
    })
}

/// Whether an object comes back the same from LMCP, then from XML, as LMCP and as XML.
fn is_stable(object: &dyn Object) -> bool {
    let through = || {
        let message = encode(object).ok()?;
        let decoded = decode(&message).ok()?;
        let xml = to_xml(decoded.as_ref()).ok()?;
        let again = read_xml(xml.as_bytes()).ok()?;
        let [placed] = again.objects.as_slice() else { return None };
        let same_message = encode(placed.object.as_ref()).ok()? == message;
        Some(same_message && to_xml(placed.object.as_ref()).ok()? == xml && again.warnings.is_empty())
    };
    through().unwrap_or(false)
}
