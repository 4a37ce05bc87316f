//! All that a link can be told, and all that it can ask for.

use super::export::Newest;
use super::path::CarrierId;
use super::seal::LinkKey;
use aldis_envelope::{Envelope, Monotonic};
use bytes::Bytes;
use std::time::Duration;

/// How a message crosses the link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// Journaled, exactly once, in order in its stream, until its lifespan ends.
    Command,
    /// The newest sample of each instance.
    State,
    /// In the background, in pieces, resumable.
    Bulk,
}

/// A number under which the sender of a message hears what became of it. 0 is nobody's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Ticket(pub u64);

/// A message that arrived, by its number in the link; [`Event::Done`] answers it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct DeliveryId(pub u64);

/// Records that are written together: all of them or none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct BatchId(pub u64);

/// A change of the journal. Keys are unique to a node: a link's begin with `L` and its peer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Record {
    /// This key has this value now.
    Put {
        /// The key.
        key: Bytes,
        /// The value.
        value: Bytes,
    },
    /// This key is gone.
    Forget {
        /// The key.
        key: Bytes,
    },
}

impl Record {
    /// The key that changes.
    pub fn key(&self) -> &Bytes {
        match self {
            Self::Put { key, .. } | Self::Forget { key } => key,
        }
    }

    /// About how many bytes it takes in a journal.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Put { key, value } => key.len() + value.len(),
            Self::Forget { key } => key.len(),
        }
    }
}

/// A message for the peer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Offer {
    /// Where to say what became of it.
    pub ticket: Ticket,
    /// The message. The lifespan left in its stamp is the link's deadline.
    pub envelope: Envelope,
    /// How it crosses.
    pub class: Class,
    /// For a state: the least time between two samples of its instance.
    pub interval: Duration,
    /// For a state: what counts as one thing, of which the newest is enough.
    pub newest: Newest,
    /// The number of the rule that lets it cross, and the part of the link's bytes that all under that rule may take, in per cent.
    pub share: (u32, u8),
}

impl Offer {
    /// A message under no rule.
    pub fn new(ticket: Ticket, envelope: Envelope, class: Class) -> Self {
        Self {
            ticket,
            envelope,
            class,
            interval: Duration::ZERO,
            newest: Newest::Instance,
            share: (u32::MAX, 100),
        }
    }
}

/// Something that happened.
#[derive(Debug, Clone)]
pub enum Event {
    /// A message is to cross.
    Offer(Offer),
    /// The sender of a command no longer wants it to cross.
    Cancel(Ticket),
    /// A frame came.
    Frame(CarrierId, Bytes),
    /// A carrier can be used, with frames of at most so many bytes.
    CarrierUp(CarrierId, usize),
    /// A carrier cannot be used.
    CarrierDown(CarrierId),
    /// A carrier takes frames (true), or must be waited for.
    CarrierFree(CarrierId, bool),
    /// A record that the journal holds under a key of this link. Before [`Event::ReadBackEnd`] alone.
    ReadBack {
        /// The key.
        key: Bytes,
        /// The value.
        value: Bytes,
    },
    /// The journal has told all that it holds. Nothing is sent or accepted before.
    ReadBackEnd,
    /// A batch is safe.
    Written(BatchId),
    /// A batch was not written, and why.
    WriteFailed(BatchId, String),
    /// The receiver of a command is done with it; `with` is written together with that.
    Done {
        /// Which delivery.
        delivery: DeliveryId,
        /// The receiver's own effects.
        with: Vec<Record>,
    },
    /// Radio silence begins (true) or ends.
    Silent(bool),
    /// These keys are good now. With none, frames are not authenticated.
    Keys(Vec<LinkKey>),
    /// The moment of the last [`Effect::Arm`] has come.
    Deadline,
}

/// Something to do.
#[derive(Debug, Clone, PartialEq)]
pub enum Effect {
    /// Send a frame.
    Transmit(CarrierId, Vec<u8>),
    /// Hand a message over.
    Deliver(Delivery),
    /// Write a batch, then tell. What all links of a node ask for in one turn is to be written as one: so a relay's hand-over
    /// from one link to the next is whole or has not happened.
    Persist(BatchId, Vec<Record>),
    /// What became of a message.
    Ticket(Ticket, TicketState),
    /// The peer is heard (true), or has been silent too long.
    Peer(bool),
    /// Tell people.
    Note(String),
    /// Send [`Event::Deadline`] at this moment; replaces the last one.
    Arm(Monotonic),
}

/// A message that arrived.
#[derive(Debug, Clone, PartialEq)]
pub struct Delivery {
    /// To be answered with [`Event::Done`]; none for what is not journaled.
    pub id: Option<DeliveryId>,
    /// The message, with what is left of its lifespan.
    pub envelope: Envelope,
    /// How it crossed.
    pub class: Class,
    /// It was handed over in an earlier life already and not answered.
    pub recovered: bool,
}

/// What became of a message.
#[derive(Debug, Clone, PartialEq)]
pub enum TicketState {
    /// It is safe in the journal; about so long until it arrives, where that can be told.
    Accepted {
        /// From now to its arrival.
        estimate: Option<Duration>,
    },
    /// It was sent so many times.
    OnAir {
        /// How often.
        tries: u32,
    },
    /// The peer has it safe in its journal.
    Delivered {
        /// Since it was accepted.
        after: Duration,
        /// How often it was sent.
        tries: u32,
    },
    /// Its lifespan ended. Where it was sent and no word came back, it may have arrived; if word comes later,
    /// [`TicketState::Delivered`] follows.
    Expired {
        /// How often it was sent.
        tries: u32,
    },
    /// Its sender took it back. Where it was sent, it may have arrived.
    Cancelled {
        /// How often it was sent.
        tries: u32,
    },
    /// It is not carried.
    Refused(Reason),
}

/// Why a message is not carried.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Reason {
    /// Silent mode, and the lifespan is shorter than anybody can wait.
    #[error("the link is silent and the message has no lifespan to wait")]
    Silent,
    /// The queue is full.
    #[error("the queue holds {0} already, which is its limit")]
    QueueFull(usize),
    /// The message is too large for its class.
    #[error("{bytes} bytes, at most {limit} cross in this class")]
    TooLarge {
        /// Its length.
        bytes: usize,
        /// The most.
        limit: usize,
    },
    /// It would arrive too late.
    #[error("it would take about {estimate:?} and is worth carrying for {lifespan:?}")]
    TooSlow {
        /// How long it would take.
        estimate: Duration,
        /// How long it is worth carrying.
        lifespan: Duration,
    },
    /// It has passed this node or its peer before.
    #[error("it has passed this link's ends before, or too many nodes")]
    Loop,
    /// The tables of names are full.
    #[error("the link knows too many labels, instances or origins")]
    TooManyNames,
    /// Calls and keyless disposes are commands.
    #[error("this cannot be a state: {0}")]
    NotAState(&'static str),
    /// The journal failed.
    #[error("the journal failed: {0}")]
    Journal(String),
    /// The journal is not read back yet.
    #[error("the journal is still being read")]
    NotReady,
}
