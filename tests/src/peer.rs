//! A UxAS as a bridge sees it: a client of its TCP stream.

use crate::PATIENCE;
use aldis_envelope::codec::delimited::payload_offset;
use aldis_envelope::codec::stream::{Item, Reader};
use bytes::Bytes;
use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};

/// The largest message that a test expects.
const MESSAGE_BYTES_MAX: usize = 16 << 20;

/// A connection to a bridge.
#[derive(Debug)]
pub struct Peer {
    stream: TcpStream,
    reader: Reader,
}

/// A message that came from a bridge, in delimited form.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Received(pub Bytes);

impl Received {
    /// Address and attributes, with both `$`.
    ///
    /// # Panics
    /// When the message has none.
    pub fn head(&self) -> &str {
        std::str::from_utf8(&self.0[..self.offset()]).expect("a head is text")
    }

    /// The payload.
    ///
    /// # Panics
    /// When the message has none.
    pub fn payload(&self) -> &[u8] {
        &self.0[self.offset()..]
    }

    fn offset(&self) -> usize {
        payload_offset(&self.0).unwrap_or_else(|why| panic!("{why}: {:?}", self.0))
    }
}

impl Peer {
    /// Connects to a port of this machine.
    ///
    /// # Errors
    /// Nobody listens there.
    pub fn connect(port: u16) -> std::io::Result<Self> {
        let stream = TcpStream::connect((Ipv4Addr::LOCALHOST, port))?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_write_timeout(Some(PATIENCE))?;
        Ok(Self { stream, reader: Reader::new(MESSAGE_BYTES_MAX) })
    }

    /// This side's address, by which the bridge knows the peer.
    ///
    /// # Panics
    /// When the connection is gone.
    pub fn name(&self) -> SocketAddr {
        self.stream.local_addr().expect("a connection has an address")
    }

    /// Writes bytes as they are.
    ///
    /// # Panics
    /// When they cannot be written within [`PATIENCE`].
    pub fn send(&mut self, bytes: &[u8]) {
        self.stream.write_all(bytes).expect("the bridge takes what is written");
    }

    /// Writes bytes in pieces of so many bytes, each in one write.
    pub fn send_in_pieces(&mut self, mut bytes: &[u8], mut size: impl FnMut() -> usize) {
        while !bytes.is_empty() {
            let (piece, rest) = bytes.split_at(size().clamp(1, bytes.len()));
            self.send(piece);
            bytes = rest;
        }
    }

    /// The next message.
    ///
    /// # Panics
    /// When none comes within [`PATIENCE`], or the bridge wrote something that is none.
    pub fn receive(&mut self) -> Received {
        loop {
            match self.reader.next_item() {
                Some(Item::Message(message)) => return Received(message),
                Some(Item::Bad(why)) => panic!("the bridge wrote what is no frame: {why}"),
                None => self.read(),
            }
        }
    }

    /// The next messages.
    pub fn receive_many(&mut self, count: usize) -> Vec<Received> {
        (0..count).map(|_| self.receive()).collect()
    }

    /// Whether bytes wait to be read.
    ///
    /// # Panics
    /// When the bridge closed the connection.
    pub fn is_waiting(&self) -> bool {
        self.stream.set_nonblocking(true).expect("a connection can be asked without waiting");
        let peeked = self.stream.peek(&mut [0]);
        self.stream.set_nonblocking(false).expect("a connection can be waited for");
        match peeked {
            Ok(count) => {
                assert!(count > 0, "the bridge closed the connection");
                true
            }
            Err(why) if why.kind() == ErrorKind::WouldBlock => false,
            Err(why) => panic!("the connection is gone: {why}"),
        }
    }

    fn read(&mut self) {
        let mut piece = vec![0; 64 * 1024];
        match self.stream.read(&mut piece) {
            Ok(0) => panic!("the bridge closed the connection"),
            Ok(count) => self.reader.buffer().extend_from_slice(&piece[..count]),
            Err(why) if why.kind() == ErrorKind::Interrupted => {}
            Err(why) => panic!("nothing came within {PATIENCE:?}: {why}"),
        }
    }
}
