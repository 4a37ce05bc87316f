//! What a node says of its links: requests to service 1 and what they are answered with.

use super::dds::StreamName;
use crate::call::CallId;
use crate::id::{BootId, EntityId, Source};
use serde::{Deserialize, Serialize};

/// Asks service 1 how its links do; no content. Answered with a list of [`LinkStatus`].
pub const LINK_QUERY: &str = "aldis.LinkQuery";
/// The answer to a [`LINK_QUERY`].
pub const LINK_STATUS: &str = "aldis.LinkStatus";
/// Asks service 1 what waits to cross; the content is a [`QueueQuery`]. Answered with a list of [`QueuedCommand`].
pub const QUEUE_QUERY: &str = "aldis.QueueQuery";
/// The answer to a [`QUEUE_QUERY`].
pub const QUEUE_STATUS: &str = "aldis.QueueStatus";
/// Has service 1 take a command back that waits to cross; the content is a [`QueueCancel`]. Answered with whether it was there.
pub const QUEUE_CANCEL: &str = "aldis.QueueCancel";
/// The answer to a [`QUEUE_CANCEL`]: a bool.
pub const QUEUE_CANCELLED: &str = "aldis.QueueCancelled";
/// Begins or ends radio silence; the content is a [`Silence`]. Answered with [`LINK_STATUS`].
pub const LINK_SILENCE: &str = "aldis.LinkSilence";
/// What became of a call that crosses a link; to the caller, as a message of its own. The content is a [`CallTicket`].
pub const TICKET: &str = "aldis.Ticket";
/// The services of a node that are alive: what it tells the other end of a link. The content is a list of [`Source`].
pub const SERVICES: &str = "aldis.link.Services";
/// Asks the other end of a link to say when all readers there have a sample; the content is a [`ConfirmAsk`].
pub const CONFIRM_ASK: &str = "aldis.link.ConfirmAsk";
/// All readers there have it; the content is the number of the [`ConfirmAsk`]. Where they have not in time, no word comes.
pub const CONFIRMED: &str = "aldis.link.Confirmed";

/// A sample of which the sender's node wants to know when all readers beyond the link have it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ConfirmAsk {
    /// The number of this question: the answer names it.
    pub number: u64,
    /// The stream of the sample.
    pub stream: StreamName,
    /// The life of the node that asks, which has stamped the sample.
    pub boot: BootId,
    /// The sample's number in its stream.
    pub sequence: u64,
}

/// How a link does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LinkStatus {
    /// Its name in the configuration.
    pub name: String,
    /// The entity of the other end.
    pub peer: EntityId,
    /// The entities behind it.
    pub behind: Vec<EntityId>,
    /// Whether the peer was heard lately.
    pub heard: bool,
    /// Whether nothing is sent.
    pub silent: bool,
    /// Whether what waits outlives this process.
    pub durable: bool,
    /// Whether frames are authenticated.
    pub keyed: bool,
    /// Its carriers, the preferred one first.
    pub carriers: Vec<CarrierStatus>,
    /// Commands that wait or are on the air.
    pub commands: u64,
    /// Instances whose newest sample waits.
    pub states: u64,
    /// Bytes of large messages that wait.
    pub bulk_bytes: u64,
    /// Services behind it that the peer says are alive.
    pub services: Vec<Source>,
    /// Everything that it counts, by name.
    pub counters: Vec<(String, u64)>,
}

/// How a carrier of a link does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CarrierStatus {
    /// Its number, the same at both ends.
    pub id: u8,
    /// Whether it can be used.
    pub up: bool,
    /// Whether the data goes by it.
    pub in_use: bool,
    /// Milliseconds since the peer was heard by it.
    pub heard_ms_ago: Option<u64>,
    /// The round trip in milliseconds, measured or as configured.
    pub round_trip_ms: u32,
    /// The part of our frames that the peer does not hear, in thousandths.
    pub loss_out_permille: u16,
    /// The part of its frames that are not heard here, in thousandths.
    pub loss_in_permille: u16,
    /// Bytes a second that may be sent.
    pub rate: u64,
    /// The longest frame.
    pub mtu: u32,
}

/// Which commands are asked for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct QueueQuery {
    /// Only those for this peer.
    pub peer: Option<EntityId>,
    /// Only the one with this number.
    pub number: Option<u64>,
    /// At most so many, those that expire or were accepted first.
    pub limit: u32,
}

/// A command to take back.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct QueueCancel {
    /// The other end of its link.
    pub peer: EntityId,
    /// Its number.
    pub number: u64,
}

/// Radio silence.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Silence {
    /// Of the link to this peer; none for all links.
    pub peer: Option<EntityId>,
    /// Whether it begins.
    pub silent: bool,
}

/// A command that waits to cross, or is on the air.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct QueuedCommand {
    /// The other end of its link.
    pub peer: EntityId,
    /// Its number there.
    pub number: u64,
    /// Who sends it.
    pub source: Source,
    /// What it is.
    pub descriptor: String,
    /// Where it goes.
    pub address: String,
    /// Its bytes in the queue.
    pub bytes: u32,
    /// Milliseconds since it was accepted, in this life of the node.
    pub age_ms: u64,
    /// Milliseconds until its lifespan ends.
    pub left_ms: Option<u64>,
    /// How often it was sent.
    pub tries: u32,
    /// Why it is still here, in words.
    pub why: String,
}

/// What became of a call.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CallTicket {
    /// The call, by its caller's number.
    pub call: CallId,
    /// The other end of the link.
    pub peer: EntityId,
    /// What became of it.
    pub state: CallState,
}

/// What became of a call on a link.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum CallState {
    /// It waits its turn; it takes about so many milliseconds, where that can be told.
    Accepted(Option<u64>),
    /// It was sent so many times.
    OnAir(u32),
    /// The other end has it: milliseconds since it was accepted, and how often it was sent.
    Delivered(u64, u32),
    /// Its time ran out; it was sent so many times.
    Expired(u32),
    /// It was taken back; it was sent so many times.
    Cancelled(u32),
    /// It is not carried, and why.
    Refused(String),
}
