//! The handshake of a ZeroMQ connection, waiting for each step.

use super::super::super::exit::Failure;
use super::super::load::failed;
use aldis_envelope::codec::zmtp::{GREETING, Item, Reader, SocketType, ready, subscription};
use std::io::{Read, Write};
use std::net::TcpStream;

/// More than any handshake has.
const HANDSHAKE_BYTES_MAX: usize = 4_096;

/// A connection whose handshake is done; a SUB socket has subscribed to everything.
pub(super) fn opened(mut stream: TcpStream, socket: SocketType) -> Result<TcpStream, Failure> {
    stream.write_all(&GREETING).map_err(failed("handshake"))?;
    let mut reader = Reader::new(socket, HANDSHAKE_BYTES_MAX);
    loop {
        match reader.next_item().map_err(failed("handshake"))? {
            Some(Item::Greeted) => stream.write_all(&ready(socket)).map_err(failed("handshake"))?,
            Some(Item::Ready) => break,
            Some(_) => {}
            None => {
                // Byte by byte at the most: what follows the handshake is not read here.
                let mut piece = [0; 1];
                if stream.read(&mut piece).map_err(failed("handshake"))? == 0 {
                    return Err(Failure::Failed("the connection was closed in its handshake".into()));
                }
                reader.buffer().extend_from_slice(&piece);
            }
        }
    }
    if socket == SocketType::Sub {
        stream.write_all(&subscription(b"")).map_err(failed("subscription"))?;
    }
    Ok(stream)
}
