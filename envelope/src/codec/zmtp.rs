//! ZMTP 3.0, the protocol of ZeroMQ over TCP, as far as UxAS needs it: the NULL mechanism, and the sockets PUB, SUB, PUSH
//! and PULL.
//!
//! A connection begins with a greeting of 64 bytes each way, then a READY command each way, then messages of one or more
//! frames. A frame is a byte of flags, its length in one or eight bytes, and its body. Peers of ZMTP 3.1 fall back to 3.0
//! when they are greeted by it; what they say in its new words (SUBSCRIBE, CANCEL, PING) is understood all the same.

mod greeting;
mod reader;
mod topics;
mod writer;

pub use greeting::{GREETING, SocketType, ready};
pub use reader::{Item, Reader, ZmtpError};
pub use topics::{TopicError, Topics};
pub use writer::{Framing, Writer, pong, subscription};

/// More frames of this message follow.
const MORE: u8 = 0b001;
/// The length has eight bytes.
const LONG: u8 = 0b010;
/// The frame is a command.
const COMMAND: u8 = 0b100;

/// Appends the head of a frame.
fn frame_head(flags: u8, length: usize, out: &mut Vec<u8>) {
    match u8::try_from(length) {
        Ok(length) => out.extend_from_slice(&[flags, length]),
        Err(_) => {
            out.push(flags | LONG);
            out.extend_from_slice(&(length as u64).to_be_bytes());
        }
    }
}

#[cfg(test)]
mod tests;
