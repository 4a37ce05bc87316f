//! All that a node can be told, and all that it can ask for. A shell knows nothing else of it.

use crate::journal::{Batch, JournalEvent};
use crate::link::CarrierId;
use crate::service::domain::{DomainCommand, DomainEvent};
use crate::service::{ComponentHealth, Job, JobOutput, Note};
use aldis_envelope::codec::native::HeaderError;
use aldis_envelope::codec::stream::StreamError;
use aldis_envelope::codec::zmtp::ZmtpError;
use aldis_envelope::{Envelope, Label, Monotonic, Priority, Source};
use bytes::Bytes;
use std::sync::Arc;

/// A bridge of a node, by its place in the configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct BridgeId(pub usize);

/// A peer of a bridge, numbered by the shell, never twice in a node's life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct PeerId(pub u64);

/// A key that the node puts envelopes on, numbered by the node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct PublisherId(pub usize);

/// A link of a node, by its place in the configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct LinkId(pub usize);

/// A place that frames come from, numbered by the shell: an address of the network. What it is, the shell alone knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place(pub u64);

/// Something that happened.
pub enum Event {
    /// The session on the bus is up.
    BusOpened,
    /// The session on the bus is down, and why.
    BusClosed(String),
    /// An envelope from the bus.
    Sample(Envelope),
    /// A sample from the bus that is no envelope.
    SampleRefused(HeaderError),
    /// So many samples from the bus were dropped because the node did not keep up.
    SamplesShed(u64),
    /// A service's token appeared (true) or vanished. A hint, and idempotent.
    Alive(Source, bool),
    /// All tokens that were there when the session opened have been told.
    AliveKnown,
    /// Something at a bridge.
    Bridge(BridgeId, BridgeEvent),
    /// Something at a peer of a bridge.
    Peer(BridgeId, PeerId, PeerEvent),
    /// Something at a link.
    Link(LinkId, LinkEvent),
    /// A job is done, or panicked with this text.
    Job(Source, u64, Result<JobOutput, String>),
    /// Something in the DDS domain that a service bridges.
    Domain(Source, DomainEvent),
    /// The health of something that the shell looks after changed.
    Component(ComponentHealth),
    /// The journal tells something. A node with a journal starts when all that stands in it has been told.
    Journal(JournalEvent),
    /// The moment of the last [`Effect::Arm`] has come.
    Deadline,
    /// The node must end.
    Shutdown,
}

/// Something at a bridge.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BridgeEvent {
    /// It listens or looks for its peer, in words.
    Working(String),
    /// It cannot, and why; the shell tries again.
    Failing(String),
}

/// Something at a peer of a bridge.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PeerEvent {
    /// The peer is there under this name, and so many bytes may be sent to it.
    Up(String, usize),
    /// A peer is there under this name that takes nothing.
    Gives(String),
    /// The peer is gone, and why.
    Down(String),
    /// A message in delimited form.
    Message(Bytes),
    /// A message in several frames.
    Parts(Vec<Bytes>),
    /// So many messages that were sent to the peer it had not subscribed to, so that they were left out.
    Unwanted(u64),
    /// So many bytes more may be sent.
    Ready(usize),
    /// Something that is no message.
    Bad(BadInput),
}

/// Something that a peer sent and that is no message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BadInput {
    /// A stretch of a stream.
    #[error(transparent)]
    Stream(#[from] StreamError),
    /// What ends a ZeroMQ connection.
    #[error(transparent)]
    Zmtp(#[from] ZmtpError),
    /// One frame where several are spoken.
    #[error("a message of one frame; this bridge speaks seven (`framing = \"multipart\"`)")]
    OneFrame,
    /// Several frames where one is spoken.
    #[error("a message of {0} frames; this bridge speaks one (`framing = \"single\"`)")]
    SeveralFrames(usize),
    /// A message over the limit.
    #[error("a message of {declared} bytes or more, at most {limit} are allowed")]
    TooLarge {
        /// What was declared.
        declared: u64,
        /// The limit.
        limit: usize,
    },
}

/// Something at a link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LinkEvent {
    /// A frame came by a carrier, from a place.
    Frame(CarrierId, Place, Bytes),
    /// A carrier can be used, with frames of at most so many bytes.
    Up(CarrierId, usize),
    /// A carrier cannot be used, and why.
    Down(CarrierId, String),
    /// Radio silence begins (true) or ends.
    Silent(bool),
}

/// Something to do.
pub enum Effect {
    /// Have these key expressions subscribed to, and no others.
    Subscribe(Vec<String>),
    /// Prepare a publisher. What is put with it has this constant part of the header.
    Declare {
        /// Its number.
        publisher: PublisherId,
        /// Its key.
        key: String,
        /// The first part of every header.
        constant: Vec<u8>,
        /// Fixed for the stream.
        priority: Priority,
    },
    /// Put an envelope with a prepared publisher; a dispose as a DELETE.
    Publish(PublisherId, Envelope),
    /// Put an envelope on a key that is used too rarely for a publisher.
    PublishOn(String, Box<Envelope>),
    /// Show (true) or withdraw the token of a service.
    Token(Source, bool),
    /// Write a message to a peer.
    Send(BridgeId, PeerId, Arc<Label>, Bytes),
    /// Send a frame of a link by a carrier, to where its peer is. A carrier that cannot take it now drops it.
    Transmit(LinkId, CarrierId, Vec<u8>),
    /// The peer of a link is at this place: what came from there was authentic.
    Found(LinkId, CarrierId, Place),
    /// Stop (true) or go on reading from peers and bus.
    PauseInput(bool),
    /// Compute something outside the loop and tell with [`Event::Job`].
    Job(Source, u64, Job),
    /// Append a batch to the journal, written before those after it. It has this number, one more than the last one's; what
    /// becomes of it is told with [`Event::Journal`]. No more is on its way at a time than a journal takes.
    Append(u64, Batch),
    /// Do something in the DDS domain that a service bridges.
    Domain(Source, DomainCommand),
    /// Tell people.
    Say(Note),
    /// Send [`Event::Deadline`] at this moment; replaces the last one.
    Arm(Monotonic),
    /// The node has ended; nothing follows.
    Exit,
}
