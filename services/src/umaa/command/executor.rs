//! What the author of a provider writes: validate, start, progress, stop. All else of a command's flow is the provider's.

use crate::service::{Input, Outbox};
use aldis_envelope::umaa::{Command, CommandState};
use aldis_envelope::{Guid, Monotonic, Now, Prefix, Source};

/// A session of commands: its consumer and the id that the consumer gave it (ICD 4.1.4.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct SessionId {
    /// The consumer.
    pub source: Guid,
    /// The session's id.
    pub session: Guid,
}

/// A command as its executor sees it.
#[derive(Debug, Clone, Copy)]
pub struct Commanded<'a, C> {
    /// Its session.
    pub id: SessionId,
    /// The command.
    pub command: &'a C,
    /// The service that wrote it to the bus.
    pub writer: Source,
}

/// Executes commands of one kind. It is asked again whenever something happened to the provider, so none of its answers may
/// depend on how often.
pub trait Executor<C: Command>: Send {
    /// Checks a command, and negotiates with what executes it. Asked again while the answer is [`Verdict::Later`].
    fn validate(&mut self, now: Now, commanded: Commanded<'_, C>, out: &mut Outbox) -> Verdict;

    /// Begins to execute a command. COMMANDED has been published; EXECUTING follows with [`Progress::Running`].
    fn start(
        &mut self,
        now: Now,
        commanded: Commanded<'_, C>,
        out: &mut Outbox,
    ) -> Progress<C::ExecutionStatus>;

    /// How a command that was started goes on.
    fn progress(
        &mut self,
        now: Now,
        commanded: Commanded<'_, C>,
        out: &mut Outbox,
    ) -> Progress<C::ExecutionStatus>;

    /// Has to end a command, for a reason of others: it is not asked where it said itself that the command ended. After
    /// [`Stop::Canceled`] it may answer [`Stopped::NotYet`] and go on to completion; after the others it has no choice.
    fn stop(&mut self, now: Now, commanded: Commanded<'_, C>, why: Stop, out: &mut Outbox) -> Stopped;

    /// Whether a command that a former life left in this state goes on (ICD 4.1.2.1). Where it does not, it fails. One in
    /// ISSUED is validated anew, one in COMMANDED is started anew, one in EXECUTING is asked for its progress.
    fn recover(&mut self, _now: Now, _commanded: Commanded<'_, C>, state: CommandState) -> bool {
        state != CommandState::Executing
    }

    /// Whether the status of a command that nobody has told of at the start may stand until it is known whether the command
    /// comes back. Where it may not, because what it says keeps others from being executed, the command fails at once.
    fn awaits_lost_commands(&self) -> bool {
        true
    }

    /// What it subscribes to beside its commands.
    fn subscriptions(&self) -> Vec<Prefix> {
        Vec::new()
    }

    /// Sees every input of the service before the provider does.
    fn observe(&mut self, _now: Now, _input: &Input<'_>, _out: &mut Outbox) {}

    /// Comes after everything that an input brought about has been published.
    fn settled(&mut self, _now: Now, _out: &mut Outbox) {}

    /// When it wants to be asked for progress even if nothing happens.
    fn next_deadline(&self) -> Option<Monotonic> {
        None
    }
}

/// Whether a command is valid.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// It is.
    Valid,
    /// Not known yet.
    Later,
    /// It is not, or cannot be executed.
    Failed(Failure),
}

/// How the execution of a command goes.
#[derive(Debug, Clone, PartialEq)]
pub enum Progress<E> {
    /// It has not begun, or there is nothing new.
    Waiting,
    /// It is under way; with what the execution status says now, where that has changed.
    Running(Option<E>),
    /// It is done.
    Completed,
    /// It failed.
    Failed(Failure),
}

/// Why a command has to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The consumer cancelled it.
    Canceled,
    /// An update follows at once.
    Updated,
    /// It has failed: the time is up, another consumer took over, or it may not be executed.
    Broken,
    /// The service shuts down.
    Shutdown,
}

/// Whether a command has stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stopped {
    /// It has.
    Now,
    /// It goes on to its end.
    NotYet,
}

/// What kind of failure it is; each becomes a reason of figure 5.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FailureKind {
    /// Parameters are missing, outside their range or otherwise wrong.
    Invalid,
    /// The resource does not take the command.
    Rejected,
    /// The objective cannot be reached for reasons outside.
    Objective,
    /// The resource or the platform failed.
    Resource,
    /// Something of higher priority took over.
    Interrupted,
    /// The time is up.
    TimedOut,
    /// The service itself failed.
    Service,
}

impl FailureKind {
    /// All kinds.
    pub const ALL: [Self; 7] = [
        Self::Invalid,
        Self::Rejected,
        Self::Objective,
        Self::Resource,
        Self::Interrupted,
        Self::TimedOut,
        Self::Service,
    ];
}

/// A failure of a command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failure {
    /// What kind it is.
    pub kind: FailureKind,
    /// What happened, for people.
    pub text: String,
}

impl Failure {
    /// A failure.
    pub fn new(kind: FailureKind, text: impl Into<String>) -> Self {
        Self { kind, text: text.into() }
    }
}

/// Decides who may command a provider, beside the provider itself.
pub trait Admission: Send {
    /// What it subscribes to.
    fn subscriptions(&self) -> Vec<Prefix> {
        Vec::new()
    }

    /// Sees every input of the service.
    fn observe(&mut self, _now: Now, _input: &Input<'_>, _out: &mut Outbox) {}

    /// Whether a command of this consumer may be executed. Asked when it is valid, and again while the answer is
    /// [`Verdict::Later`].
    fn admits(&self, now: Now, consumer: Guid) -> Verdict;

    /// Whether a running command of this consumer has to end, and why.
    fn ends(&self, now: Now, consumer: Guid) -> Option<Failure>;

    /// When its answers change by themselves.
    fn next_deadline(&self) -> Option<Monotonic> {
        None
    }
}

/// Everybody may command.
#[derive(Debug, Clone, Copy, Default)]
pub struct Everybody;

impl Admission for Everybody {
    fn admits(&self, _: Now, _: Guid) -> Verdict {
        Verdict::Valid
    }

    fn ends(&self, _: Now, _: Guid) -> Option<Failure> {
        None
    }
}
