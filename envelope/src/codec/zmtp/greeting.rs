//! How a connection begins: who speaks which version, and as which socket.

use super::{COMMAND, frame_head};

/// What a side says first: signature, version 3.0, the NULL mechanism, filled up with zeros.
pub const GREETING: [u8; 64] = {
    let mut bytes = [0; 64];
    bytes[0] = 0xff;
    bytes[9] = 0x7f;
    bytes[10] = 3;
    bytes[12] = b'N';
    bytes[13] = b'U';
    bytes[14] = b'L';
    bytes[15] = b'L';
    bytes
};

/// What a socket does. Those that UxAS does not use are read, so that they can be refused by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SocketType {
    /// Sends to all that subscribed.
    Pub,
    /// Subscribes.
    Sub,
    /// Sends to one.
    Push,
    /// Receives what is pushed.
    Pull,
}

impl SocketType {
    /// Its name on the wire.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Pub => "PUB",
            Self::Sub => "SUB",
            Self::Push => "PUSH",
            Self::Pull => "PULL",
        }
    }

    /// Whether a socket that calls itself so fits the other end.
    pub fn fits(self, other: &[u8]) -> bool {
        match self {
            Self::Pub => matches!(other, b"SUB" | b"XSUB"),
            Self::Sub => matches!(other, b"PUB" | b"XPUB"),
            Self::Push => other == b"PULL",
            Self::Pull => other == b"PUSH",
        }
    }
}

/// The command by which a socket says what it is.
pub fn ready(socket: SocketType) -> Vec<u8> {
    let (name, value) = ("Socket-Type", socket.as_str());
    let mut body = b"\x05READY".to_vec();
    body.push(name.len() as u8);
    body.extend_from_slice(name.as_bytes());
    body.extend_from_slice(&(value.len() as u32).to_be_bytes());
    body.extend_from_slice(value.as_bytes());
    let mut out = Vec::new();
    frame_head(COMMAND, body.len(), &mut out);
    out.extend_from_slice(&body);
    out
}

/// The socket type among the properties of a READY command; none where it has none or they are cut off.
pub(super) fn socket_type(mut properties: &[u8]) -> Option<&[u8]> {
    while let Some((&length, rest)) = properties.split_first() {
        let (name, rest) = rest.split_at_checked(usize::from(length))?;
        let (length, rest) = rest.split_first_chunk()?;
        let (value, rest) = rest.split_at_checked(usize::try_from(u32::from_be_bytes(*length)).ok()?)?;
        if name.eq_ignore_ascii_case(b"Socket-Type") {
            return Some(value);
        }
        properties = rest;
    }
    None
}
