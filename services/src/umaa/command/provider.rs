//! The provider of one kind of commands: all of a command's flow that is not its execution.

mod flow;
mod recovery;
mod service;

use super::decisions::{is_cancel, is_same_session, is_update};
use super::executor::{Admission, Everybody, Executor, Failure, FailureKind, SessionId};
use super::session::{Event, Session};
use super::writer::Writer;
use crate::service::{Level, Outbox};
use aldis_envelope::umaa::{self, Command, CommandAckReport, CommandHeader, CommandStatus, Key, SessionKey};
use aldis_envelope::{Change, DateTime, Envelope, Guid, Guids, KeyHash, Monotonic, Now, Source};
use recovery::Past;
use std::collections::BTreeMap;
use std::time::Duration;

/// How many finished and refused commands may await their consumer's dispose, for each that may be open. A consumer that
/// never disposes must not fill the provider.
const AWAITING_DISPOSE_PER_OPEN: usize = 4;

/// How a provider treats its commands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProviderSettings {
    /// How many commands may be open at a time. More are rejected, and told so.
    pub sessions_max: usize,
    /// How long a command may stay ISSUED; longer is FAILED / TIMEOUT.
    pub validate_within: Option<Duration>,
    /// How long a command may stay COMMANDED; longer is FAILED / TIMEOUT.
    pub start_within: Option<Duration>,
    /// How long a command may stay EXECUTING; longer is FAILED / TIMEOUT.
    pub execute_within: Option<Duration>,
    /// How long a former life's statuses wait for their commands where not every node has told what it retains.
    pub orphans_wait: Duration,
    /// Whether the update of a finished command is answered with FAILED / SERVICE_FAILED, for peers that wait for it.
    pub answer_finished_update: bool,
}

impl Default for ProviderSettings {
    fn default() -> Self {
        Self {
            sessions_max: 64,
            validate_within: Some(Duration::from_secs(10)),
            start_within: Some(Duration::from_secs(30)),
            execute_within: None,
            orphans_wait: Duration::from_secs(60),
            answer_finished_update: false,
        }
    }
}

/// Which of its author's answers a command waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    /// None: it has ended, or goes on by itself.
    None,
    /// Whether it is valid and admitted.
    Validating,
    /// Whether its consumer is still let through.
    Starting,
    /// How it goes.
    Started,
}

/// A command with all that the provider knows of it.
struct Held<C: Command> {
    command: C,
    writer: Source,
    session: Session,
    step: Step,
    /// Whether the executor has been told to start, in this life or a former one, and so must be told to stop.
    was_started: bool,
    /// The time stamp of the newest command heard, whether it was taken or not.
    newest: DateTime,
    /// The update that replaces the command once the executor has stopped.
    update: Option<C>,
    /// Why it is refused, where it is.
    refused: Option<Failure>,
    /// What the execution status says first, once EXECUTING is published.
    report: Option<C::ExecutionStatus>,
    has_execution_status: bool,
    /// When the state it is in has lasted too long.
    limit: Option<Monotonic>,
}

/// What a provider is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// It collects what was there before it.
    Listening,
    /// It serves commands.
    Serving,
    /// It has shut down.
    Ended,
}

/// Provides one kind of commands. It is a [`Service`](crate::Service); its author gives it an [`Executor`] and, where not
/// everybody may command it, an [`Admission`].
pub struct Provider<C: Command, E, A = Everybody> {
    source: Source,
    guid: Guid,
    guids: Guids,
    settings: ProviderSettings,
    executor: E,
    admission: A,
    statuses: Writer<CommandStatus<C>>,
    acks: Writer<CommandAckReport<C>>,
    executions: Writer<C::ExecutionStatus>,
    stage: Stage,
    /// Commands that came before all of the past was known.
    waiting: BTreeMap<SessionId, (C, Source)>,
    past: Past<C>,
    held: BTreeMap<SessionId, Held<C>>,
    /// The sessions by the instances of their commands: a dispose may come with the hash alone.
    instances: BTreeMap<KeyHash, SessionId>,
}

impl<C: Command, E: Executor<C>, A: Admission> Provider<C, E, A> {
    /// A provider that runs as a service with these ids.
    pub fn new(source: Source, guids: Guids, settings: ProviderSettings, executor: E, admission: A) -> Self {
        Self {
            source,
            guid: guids.of_service(source),
            guids,
            settings,
            executor,
            admission,
            statuses: Writer::new(source),
            acks: Writer::new(source),
            executions: Writer::new(source),
            stage: Stage::Listening,
            waiting: BTreeMap::new(),
            past: Past::default(),
            held: BTreeMap::new(),
            instances: BTreeMap::new(),
        }
    }

    /// What executes the commands.
    pub fn executor(&self) -> &E {
        &self.executor
    }

    /// What executes the commands.
    pub fn executor_mut(&mut self) -> &mut E {
        &mut self.executor
    }

    fn key(&self, session: Guid) -> SessionKey {
        SessionKey { source: self.guid, session_id: session }
    }

    /// A command, or the end of one. Those for other providers are passed over silently (ICD 4.1).
    fn command(&mut self, now: Now, envelope: &Envelope, out: &mut Outbox) {
        match envelope.message.change {
            Change::Put => match umaa::decode::<C>(&envelope.message.content) {
                Ok(command) if command.header().destination != self.guid => {}
                Ok(command) => self.command_put(now, command, envelope.message.label.source(), out),
                Err(why) => {
                    let writer = envelope.message.label.source();
                    out.note(Level::Warning, format!("a command of {writer} is not read: {why}"));
                }
            },
            change if is_cancel(change) => self.command_disposed(now, envelope, out),
            _ => {}
        }
    }

    fn command_put(&mut self, now: Now, command: C, writer: Source, out: &mut Outbox) {
        let header = command.header();
        if let Some(claimed) = self.guids.service(header.source)
            && claimed != writer
        {
            let text = format!("a command of {writer} names {claimed} as its source: not taken");
            out.note(Level::Warning, text);
            return;
        }
        let id = SessionId { source: header.source, session: header.session_id };
        match self.stage {
            Stage::Listening if self.waiting.contains_key(&id) || self.waiting.len() < self.most_held() => {
                self.instances.insert(command.key().instance().hash, id);
                self.waiting.insert(id, (command, writer));
            }
            Stage::Listening => self.note_full(&header, out),
            Stage::Serving => self.take(now, command, writer, out),
            Stage::Ended => {}
        }
    }

    /// A command that came, first or again.
    fn take(&mut self, now: Now, command: C, writer: Source, out: &mut Outbox) {
        let header = command.header();
        let id = SessionId { source: header.source, session: header.session_id };
        if let Some(held) = self.held.get_mut(&id) {
            if is_update(held.newest, header.time_stamp) {
                held.newest = header.time_stamp;
                held.update = Some(command);
                self.drive(now, id, Event::Updated, out);
            }
            return;
        }
        let other = self.held.values().find(|held| held.command.header().session_id == id.session);
        if let Some(other) = other.filter(|other| !is_same_session(&other.command.header(), &header)) {
            // Its status would be the other's: both have the key of this provider and the session.
            let text = format!("session {} of {} is not taken: it is in use by {}", id.session, id.source, {
                other.command.header().source
            });
            out.note(Level::Warning, text);
            return;
        }
        if self.adopt(now, id, &command, writer, out) {
            return;
        }
        if self.held.len() >= self.most_held() {
            self.note_full(&header, out);
            return;
        }
        let refused = self.refusal();
        self.hold(id, command, writer, Session::default()).refused = refused;
        self.drive(now, id, Event::Received, out);
    }

    fn hold(&mut self, id: SessionId, command: C, writer: Source, session: Session) -> &mut Held<C> {
        self.instances.insert(command.key().instance().hash, id);
        let newest = command.header().time_stamp;
        let held = Held {
            command,
            writer,
            session,
            step: Step::None,
            was_started: false,
            newest,
            update: None,
            refused: None,
            report: None,
            has_execution_status: false,
            limit: None,
        };
        self.held.entry(id).or_insert(held)
    }

    /// Why one more command is refused, if it is.
    fn refusal(&self) -> Option<Failure> {
        let (open, max) =
            (self.held.values().filter(|held| held.session.is_open()).count(), self.settings.sessions_max);
        let text = || format!("{max} commands are open, which is the most that this provider takes");
        (open >= max).then(|| Failure::new(FailureKind::Rejected, text()))
    }

    fn most_held(&self) -> usize {
        self.settings.sessions_max.saturating_mul(1 + AWAITING_DISPOSE_PER_OPEN)
    }

    fn note_full(&self, header: &CommandHeader, out: &mut Outbox) {
        let CommandHeader { source, session_id, .. } = header;
        let text = format!(
            "session {session_id} of {source} is not taken: {} commands await their dispose",
            self.most_held()
        );
        out.note(Level::Warning, text);
    }

    fn command_disposed(&mut self, now: Now, envelope: &Envelope, out: &mut Outbox) {
        let Some(instance) = &envelope.message.instance else { return };
        let writer = envelope.message.label.source();
        let Some(&id) = self.instances.get(&instance.hash) else {
            self.past_disposed(instance.hash, out);
            return;
        };
        let written_by = match self.held.get(&id) {
            Some(held) => Some(held.writer),
            None => self.waiting.get(&id).map(|(_, writer)| *writer),
        };
        if written_by != Some(writer) {
            out.note(Level::Warning, format!("{writer} disposes a command that is not its own: passed over"));
        } else if self.waiting.remove(&id).is_some() {
            self.instances.remove(&instance.hash);
        } else {
            self.drive(now, id, Event::Disposed, out);
        }
    }
}

#[cfg(test)]
mod tests;
