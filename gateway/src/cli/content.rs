//! Contents on the command line: what goes in, and what comes out for people and machines.

use super::exit::Failure;
use aldis_envelope::{ContentType, Descriptor, Label, aldis, lmcp, umaa};
use bytes::Bytes;
use serde_json::{Value, json};
use std::path::Path;

/// A descriptor as an argument.
pub(super) fn descriptor(text: &str) -> Result<Descriptor, String> {
    Descriptor::new(text).map_err(|why| why.to_string())
}

/// A content type as an argument.
pub(super) fn content_type(text: &str) -> Result<ContentType, String> {
    ContentType::new(text).map_err(|why| why.to_string())
}

/// A content for people and machines: read where its type is known, LMCP where it is to be decoded, otherwise its bytes
/// in hexadecimal.
pub(super) fn content_text(label: &Label, content: &[u8], decode: bool) -> Value {
    let read = match (label.descriptor(), &label.attributes.content_type) {
        (aldis::NODE_STATUS, ContentType::Aldis) => {
            aldis::decode::<aldis::NodeStatus>(content).map(|s| status_text(&s))
        }
        (name, ContentType::Umaa) => umaa::topic(name).and_then(|topic| topic.json(content).ok()),
        (_, ContentType::Lmcp) if decode && !content.is_empty() => return lmcp_text(content),
        _ => None,
    };
    read.unwrap_or_else(|| json!({ "bytes": content.len(), "hex": hex(content) }))
}

/// An LMCP message; one that cannot be decoded as its bytes, with what is wrong.
fn lmcp_text(content: &[u8]) -> Value {
    match lmcp::decode(content) {
        Ok(object) => lmcp::to_json(object.as_ref()),
        Err(why) => json!({ "bytes": content.len(), "hex": hex(content), "error": why.to_string() }),
    }
}

/// A node's status for people and machines.
pub(super) fn status_text(status: &aldis::NodeStatus) -> Value {
    let counters: serde_json::Map<_, _> =
        status.counters.iter().map(|(name, value)| (name.clone(), (*value).into())).collect();
    json!({
        "node": status.node, "entities": status.entities, "boot": status.boot, "uptime_ms": status.uptime_ms,
        "services": status.services.iter().map(|service| json!({
            "source": service.source.to_string(), "name": service.name, "state": service.state,
        })).collect::<Vec<_>>(),
        "counters": counters,
    })
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A content from a file.
pub(super) fn read_file(path: &Path) -> Result<Bytes, Failure> {
    let wrong = |why| Failure::Usage(format!("cannot read {}: {why}", path.display()));
    std::fs::read(path).map(Bytes::from).map_err(wrong)
}
