//! What a service and a shell that takes part in a DDS domain tell each other.

use aldis_envelope::Wall;
use aldis_envelope::description::Extensibility;
use bytes::Bytes;

/// One reader or writer of the service's own, numbered by it, never twice in its life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct RouteId(pub u32);

/// The GUID of a participant or of an endpoint, as it is on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct DomainGuid(pub [u8; 16]);

/// DURABILITY (DDS 1.4, 2.2.3.4), the weakest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
#[allow(missing_docs, reason = "DDS 1.4, 2.2.3.4")]
pub enum Durable {
    #[default]
    Volatile,
    TransientLocal,
    Transient,
    Persistent,
}

/// The version of the representation that samples are written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs, reason = "DDS-XTypes 1.3, 7.6.3.1")]
pub enum Xcdr {
    V1,
    V2,
}

/// The quality of service of an endpoint, as far as a bridge looks at it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Quality {
    /// RELIABLE, or BEST_EFFORT.
    pub reliable: bool,
    /// DURABILITY.
    pub durable: Durable,
    /// HISTORY: the newest so many of an instance; none is all.
    pub keep_last: Option<u32>,
    /// RESOURCE_LIMITS: samples in all; none is without.
    pub samples_max: Option<u32>,
    /// OWNERSHIP is EXCLUSIVE.
    pub exclusive: bool,
    /// PRESENTATION: 0 instance, 1 topic, 2 group.
    pub access: u8,
    /// PRESENTATION: order is kept over the access scope.
    pub ordered: bool,
    /// PRESENTATION: sets of changes are seen together.
    pub coherent: bool,
    /// DESTINATION_ORDER is by source timestamp.
    pub by_source_time: bool,
    /// DEADLINE in nanoseconds.
    pub deadline_ns: Option<u64>,
    /// LATENCY_BUDGET in nanoseconds.
    pub latency_budget_ns: u64,
    /// LIVELINESS: 0 automatic, 1 by participant, 2 by topic.
    pub liveliness: u8,
    /// LIVELINESS: its lease in nanoseconds.
    pub lease_ns: Option<u64>,
    /// PARTITION.
    pub partitions: Vec<String>,
    /// Whether instances that a writer leaves are disposed of.
    pub autodispose: bool,
    /// DATA_REPRESENTATION.
    pub xcdr: Vec<Xcdr>,
}

/// A reader or a writer of another participant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Endpoint {
    /// Its GUID.
    pub guid: DomainGuid,
    /// Whose it is.
    pub participant: DomainGuid,
    /// Whether it writes, or reads.
    pub writes: bool,
    /// Its topic.
    pub topic: String,
    /// The name of its type.
    pub type_name: String,
    /// Its quality of service.
    pub quality: Quality,
    /// How its type may grow, where it told of it.
    pub extensibility: Option<Extensibility>,
}

/// A change of an instance, as its writer sent it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Arrival {
    /// Who wrote it.
    pub writer: DomainGuid,
    /// When, by its writer's clock.
    pub source_time: Wall,
    /// Whether the bytes are a whole sample; otherwise they are its key alone.
    pub is_sample: bool,
    /// Whether it disposes of the instance.
    pub disposes: bool,
    /// Whether the writer unregisters the instance.
    pub unregisters: bool,
    /// Whether the writer wants an instance disposed of that it unregisters.
    pub autodispose: bool,
    /// The bytes, with the representation's head of four.
    pub cdr: Bytes,
}

/// Something that happened in a domain.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DomainEvent {
    /// The domain is joined, as this participant.
    Joined,
    /// An endpoint has come, or its quality of service is different now.
    Endpoint(Box<Endpoint>),
    /// An endpoint is gone.
    EndpointGone(DomainGuid),
    /// A participant has come, with its USER_DATA.
    Participant(DomainGuid, Vec<u8>),
    /// A participant is gone.
    ParticipantGone(DomainGuid),
    /// A route is open, or why it is not.
    Opened(RouteId, Result<(), String>),
    /// A change has arrived.
    Arrived(RouteId, Arrival),
    /// A writer is gone, with its instances; whether it wants them disposed of.
    WriterGone(RouteId, DomainGuid, bool),
    /// An endpoint does not come together with a route because of this policy.
    Mismatch(RouteId, String),
    /// What is written cannot be: the bytes are refused.
    Refused(RouteId, String),
    /// So many changes of all routes wait because readers have not confirmed enough.
    Waiting(usize),
    /// So many changes of a route were dropped because readers confirmed nothing for too long.
    Shed(RouteId, u64),
}

/// What is done to an instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sending {
    /// The bytes are a sample.
    Sample,
    /// The bytes are the key of an instance that is disposed of.
    Dispose,
    /// The bytes are the key of an instance that is unregistered.
    Unregister,
}

/// A reader or a writer to open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Opening {
    /// Its number.
    pub route: RouteId,
    /// Whether it writes, or reads.
    pub writes: bool,
    /// Its topic.
    pub topic: String,
    /// The name of its type.
    pub type_name: String,
    /// The endpoint whose type it takes over; the description of its name where that has told nothing, or none is given.
    pub like: Option<DomainGuid>,
    /// How the type may grow, where the description is taken.
    pub extensibility: Extensibility,
    /// Its quality of service.
    pub quality: Quality,
}

/// What a service wants done in a domain.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DomainCommand {
    /// Open a reader or a writer.
    Open(Box<Opening>),
    /// Close one.
    Close(RouteId),
    /// Write a change.
    Write(RouteId, Sending, Bytes, Wall),
}
