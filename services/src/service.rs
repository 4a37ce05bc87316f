//! What a service is: subscriptions, inputs, an outbox and a next deadline. A service knows nothing else of the world.

pub mod domain;
mod outbox;

pub(crate) use outbox::refusal;
pub use outbox::{Action, Outbox};

use aldis_envelope::{CallId, EntityId, Envelope, Monotonic, Now, Prefix, Refusal, Source};
use std::any::Any;
use std::sync::Arc;

/// A service. It runs on one thread at a time, and only when it gets an input.
pub trait Service: Send {
    /// What it receives beside what is addressed to it, to its entity and to all services of its entity.
    fn subscriptions(&self) -> Vec<Prefix> {
        Vec::new()
    }

    /// Whether it wants [`Input::Bus`] and [`Input::Token`].
    fn follows_bus(&self) -> bool {
        false
    }

    /// Whether it has to start again where the journal refuses something that it says. What it goes by is then what it has said
    /// before, as [`Input::Recovered`] tells it: else others would miss a step that it believes it has made.
    fn goes_by_what_is_kept(&self) -> bool {
        false
    }

    /// Takes one input. What it puts into the outbox is sent after it returns; it never gets its own messages back.
    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox);

    /// When it wants [`Input::Deadline`] next; asked after each input.
    fn next_deadline(&self) -> Option<Monotonic> {
        None
    }
}

/// What happens to a service.
#[derive(Debug)]
pub enum Input<'a> {
    /// It has been started, or started again after a crash.
    Started,
    /// A message that it subscribed to or that is addressed to it; requests and replies of calls too.
    Message(&'a Envelope),
    /// A retained sample of its own, from a former life of this service: it comes right after the start. The node keeps what it
    /// retains over a crash of the service; over the end of the process it keeps what is persistent, in the journal. What had
    /// ended does not come.
    Recovered(&'a Envelope),
    /// A sample that it has got before and that is retained, as [`Outbox::tell_again`] asked.
    Again(&'a Envelope),
    /// What others retain for its subscriptions has come, as far as it is to be had: true where every node that is known
    /// has told all of it, false where one has not in time or no other node is known. Comes once after each start; what comes later is news.
    HistoryComplete(bool),
    /// How [`Outbox::send_confirmed`] with this number ended.
    Confirmed(u64, Result<(), Unconfirmed>),
    /// A call of its own has ended: with answers (each came as a message), or with the reason why there are none.
    CallEnded(CallId, Result<(), Refusal>),
    /// The deadline that it asked for has come.
    Deadline,
    /// The session on the bus is up and knows who is alive (true), or it is down. Only for those that follow the bus.
    Bus(bool),
    /// A service of another node is alive (true), or no longer. Only for those that follow the bus.
    Token(Source, bool),
    /// A job of its own is done, or panicked with this text.
    Job(u64, Result<JobOutput, String>),
    /// Something in the DDS domain that this service bridges.
    Domain(domain::DomainEvent),
    /// The health of a part of the node changed. Only the health service gets it.
    Component(&'a ComponentHealth),
    /// The node itself has something to say. Only the log service gets it.
    Note(&'a Note),
    /// The node shuts down: last words.
    Shutdown,
}

/// Why a sample is not confirmed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unconfirmed {
    /// Not every matched reliable reader has confirmed it in time.
    #[error("not confirmed in time by {}", .missing.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "))]
    Missing {
        /// The nodes whose readers have not.
        missing: Vec<EntityId>,
    },
    /// Its topic is persistent and the journal does not keep it: nobody has got it.
    #[error("not kept: {0}")]
    NotKept(String),
}

/// What a job returns.
pub type JobOutput = Box<dyn Any + Send>;
/// A computation that leaves the loop: a pure function, cut by a budget of steps and never by time.
pub type Job = Box<dyn FnOnce() -> JobOutput + Send>;
/// Makes a service, at the start and after each crash.
pub type Factory = Arc<dyn Fn() -> Box<dyn Service> + Send + Sync>;

/// A service to run.
#[derive(Clone)]
pub struct ServiceSpec {
    /// Its ids.
    pub source: Source,
    /// What it is, for people.
    pub name: String,
    /// Makes it.
    pub factory: Factory,
}

impl std::fmt::Debug for ServiceSpec {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({})", self.source, self.name)
    }
}

/// How a part of a node does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Condition {
    /// All is well.
    Well,
    /// It works, but somebody should look at it.
    Degraded,
    /// It does not work.
    Failed,
    /// It has been taken away: there is nothing more to report.
    Gone,
}

/// The health of a part of the node: a service, a bridge, the bus, the disk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ComponentHealth {
    /// Which part.
    pub component: Component,
    /// How it does.
    pub condition: Condition,
    /// In words, for people.
    pub status: String,
}

/// A part of a node whose health is reported.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Component {
    /// A service or a bridge.
    Service(Source),
    /// Something without a service id: `bus`, `disk`.
    Resource(&'static str),
}

/// How serious a note is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Worth knowing.
    Information,
    /// Worth a look.
    Warning,
    /// Something failed.
    Error,
}

/// Something worth saying to people.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Note {
    /// How serious it is.
    pub level: Level,
    /// In words.
    pub text: String,
}
