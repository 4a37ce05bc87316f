//! The header that travels as the attachment of a Zenoh sample: `WIRE.md` shows it byte by byte.
//!
//! The format is postcard's, behind one byte of version. It is written and read by hand because this is the hottest
//! path of the project; a test holds it against postcard itself. What is constant in a stream comes first, so that a
//! receiver recognises it by comparing bytes and a sender writes it once.

mod decoder;
mod reader;

pub use decoder::Decoder;

use crate::call::Call;
use crate::change::Change;
use crate::id::{BootId, EntityId};
use crate::key::KeyError;
use crate::key::escape::{Spelling, spelling};
use crate::message::{Envelope, Label};
use crate::name::ContentType;
use crate::stamp::{Priority, Stamp};
use crate::{Address, Message};

/// The first byte of every header.
pub const VERSION: u8 = 1;

/// Why a sample is not an envelope of ours. Each is counted by its name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum HeaderError {
    /// A sample without attachment: some other program's.
    #[error("the sample has no header")]
    Missing,
    /// The header's first byte.
    #[error("header version {0} is not {VERSION}: the sender speaks another version of Aldis")]
    Version(u8),
    /// The header ends too early.
    #[error("the header ends inside its {0}")]
    Truncated(&'static str),
    /// Bytes are left after the header.
    #[error("{0} bytes follow the end of the header")]
    Trailing(usize),
    /// A field holds what it cannot.
    #[error("the header's {field}: {why}")]
    Invalid {
        /// Which field.
        field: &'static str,
        /// What is wrong.
        why: String,
    },
    /// The key is none of ours.
    #[error(transparent)]
    Key(#[from] KeyError),
    /// The header says another thing than the key on which it came.
    #[error("header and key disagree: {0}")]
    Disagrees(String),
}

/// Appends a whole header.
pub fn encode(envelope: &Envelope, out: &mut Vec<u8>) {
    let stamp = &envelope.stamp;
    encode_constant(&envelope.message.label, stamp.node, stamp.boot, stamp.priority, out);
    encode_variable(&envelope.message, stamp, out);
}

/// Appends the part of the header that all samples of a stream with one label share.
pub fn encode_constant(label: &Label, node: EntityId, boot: BootId, priority: Priority, out: &mut Vec<u8>) {
    out.push(VERSION);
    let spelled = match &label.address {
        Address::Name(name) => spelling(name.as_str()),
        _ => Spelling::Dots,
    };
    match &spelled {
        Spelling::Dots => out.push(0),
        Spelling::Colons => out.push(1),
        Spelling::Exact(text) => {
            out.push(2);
            put_text(text, out);
        }
    }
    let attributes = &label.attributes;
    match &attributes.content_type {
        ContentType::Lmcp => out.push(0),
        ContentType::Umaa => out.push(1),
        ContentType::Cdr => out.push(2),
        ContentType::Aldis => out.push(3),
        ContentType::Other(name) => {
            out.push(4);
            put_text(name.as_str(), out);
        }
    }
    if label.is_broadcast() {
        out.push(0);
    } else {
        out.push(1);
        put_text(attributes.descriptor.as_str(), out);
    }
    put_text(attributes.source_group.as_str(), out);
    put_varint(node.get(), out);
    put_varint(boot.0, out);
    out.push(priority.into());
}

/// Appends the part of the header that differs from sample to sample.
pub fn encode_variable(message: &Message, stamp: &Stamp, out: &mut Vec<u8>) {
    put_varint(stamp.sequence, out);
    put_varint(zigzag(stamp.source_time.0), out);
    if says_no_more(message, stamp) {
        return out.extend_from_slice(&NO_MORE);
    }
    match stamp.lifespan_left_ms {
        None => out.push(0),
        Some(milliseconds) => {
            out.push(1);
            put_varint(u64::from(milliseconds), out);
        }
    }
    put_varint(u64::from(stamp.skipped), out);
    put_varint(stamp.via.len() as u64, out);
    for node in stamp.via.iter() {
        put_varint(node.get(), out);
    }
    out.push(match message.change {
        Change::Put => 0,
        Change::Dispose => 1,
        Change::Unregister => 2,
    });
    match key_on_the_wire(message) {
        None => out.push(0),
        Some(key) => {
            out.push(1);
            put_varint(key.len() as u64, out);
            out.extend_from_slice(key);
        }
    }
    match &message.call {
        None => out.push(0),
        Some(call) => {
            out.push(1);
            put_call(call, out);
        }
    }
}

/// What follows the source time of a put that is part of no call, was passed on by nobody and follows its predecessor: nearly all.
const NO_MORE: [u8; 6] = [0; 6];

fn says_no_more(message: &Message, stamp: &Stamp) -> bool {
    let Message { label, change, instance, call, .. } = message;
    *change == Change::Put
        && call.is_none()
        && stamp.lifespan_left_ms.is_none()
        && stamp.skipped == 0
        && stamp.via.is_empty()
        && (instance.is_none() || label.is_broadcast())
}

/// The serialized key travels where the receiver has neither the content nor the hash in the key to take it from.
fn key_on_the_wire(message: &Message) -> Option<&[u8]> {
    let spoken_by_content = message.change == Change::Put && message.label.is_broadcast();
    if spoken_by_content { None } else { message.instance.as_ref()?.key.as_deref() }
}

/// Calls are rare enough for serde.
fn put_call(call: &Call, out: &mut Vec<u8>) {
    // Postcard fails on a growing buffer only for types without a length, which a call has not.
    if let Ok(bytes) = postcard::to_allocvec(call) {
        out.extend_from_slice(&bytes);
    }
}

fn put_text(text: &str, out: &mut Vec<u8>) {
    put_varint(text.len() as u64, out);
    out.extend_from_slice(text.as_bytes());
}

fn put_varint(mut number: u64, out: &mut Vec<u8>) {
    let (mut bytes, mut count) = ([0; 10], 0);
    while number >= 0x80 {
        bytes[count] = number as u8 | 0x80;
        number >>= 7;
        count += 1;
    }
    bytes[count] = number as u8;
    out.extend_from_slice(&bytes[..=count]);
}

fn zigzag(number: i64) -> u64 {
    ((number << 1) ^ (number >> 63)) as u64
}

#[cfg(test)]
mod tests;
