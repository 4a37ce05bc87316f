//! The consumer of one kind of commands: starts, updates and cancels them, and tells how they end.
//!
//! It is a part of a service: the service hands it every input, and takes what it tells.

mod heard;

use super::writer::Writer;
use crate::service::Outbox;
use aldis_envelope::umaa::{
    Command, CommandHeader, CommandKey, CommandState, CommandStatusReason, Key, SessionKey, Topic,
};
use aldis_envelope::{DateTime, Guid, Guids, KeyHash, Monotonic, Now, Prefix, Source};
use std::collections::BTreeMap;
use std::time::Duration;

/// How a consumer treats its commands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConsumerSettings {
    /// How many commands it may have on the bus at a time.
    pub sessions_max: usize,
    /// How long a provider has to answer a command or an update with ISSUED.
    pub answer_within: Duration,
    /// How long a provider has to end a cancelled command, and to clean up after any.
    pub end_within: Duration,
    /// What happens to the commands of a former life.
    pub recovery: Recovery,
}

impl Default for ConsumerSettings {
    fn default() -> Self {
        Self {
            sessions_max: 64,
            answer_within: Duration::from_secs(10),
            end_within: Duration::from_secs(30),
            recovery: Recovery::Cancel,
        }
    }
}

/// What a consumer does at its start with the commands that a former life left on the bus (ICD 4.1.2.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Recovery {
    /// Follows them to their ends.
    Resume,
    /// Cancels them.
    Cancel,
}

/// What a consumer tells.
#[derive(Debug, Clone, PartialEq)]
pub enum Told<E> {
    /// A command of a former life goes on.
    Recovered {
        /// The session.
        session: Guid,
    },
    /// A command has come into a state that is not its end.
    State {
        /// The session.
        session: Guid,
        /// The state.
        state: CommandState,
        /// Why.
        reason: CommandStatusReason,
        /// In words, for people.
        text: String,
    },
    /// What the execution status of a command says.
    Execution {
        /// The session.
        session: Guid,
        /// The execution status.
        status: E,
    },
    /// A command has ended; nothing more is told of it.
    Ended {
        /// The session.
        session: Guid,
        /// How.
        outcome: Outcome,
    },
}

/// How a command ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// It was done. After a cancel this says that the cancel was lost (ICD 4.1.4.5).
    Completed,
    /// It was cancelled.
    Canceled,
    /// It failed.
    Failed {
        /// Why.
        reason: CommandStatusReason,
        /// In words, for people.
        text: String,
    },
    /// The provider did not answer in time. The command has been disposed, so that nobody executes it later.
    Unanswered,
    /// The provider gave the command up without saying how it ended.
    Abandoned,
}

/// Why a command cannot be started or changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ConsumerError {
    /// As many commands as allowed are on the bus.
    #[error("{0} commands are on the bus, which is the most: wait until one has ended")]
    TooMany(usize),
    /// The session is not known, has ended or is being cancelled.
    #[error("session {0} has no open command: start a new one")]
    NotOpen(Guid),
}

/// Where a command stands for its consumer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// On the bus.
    Open,
    /// Disposed by the consumer; how it ended is not known.
    Canceling,
    /// Ended and disposed; the provider has yet to clean up.
    Ended,
}

struct Held<C> {
    command: C,
    stage: Stage,
    state: Option<CommandState>,
    /// Whether ISSUED has yet to come for the command or its last update: what is said before is of the past.
    awaits_issued: bool,
    /// When the provider has been silent too long.
    limit: Option<Monotonic>,
}

/// Consumes one kind of commands in the name of a service.
pub struct Consumer<C: Command> {
    guid: Guid,
    guids: Guids,
    settings: ConsumerSettings,
    commands: Writer<C>,
    held: BTreeMap<Guid, Held<C>>,
    /// The sessions by the instances of their statuses.
    instances: BTreeMap<KeyHash, Guid>,
    sessions_begun: u64,
    told: Vec<Told<C::ExecutionStatus>>,
}

impl<C: Command> Consumer<C> {
    /// A consumer in the name of the service with these ids.
    pub fn new(source: Source, guids: Guids, settings: ConsumerSettings) -> Self {
        Self {
            guid: guids.of_service(source),
            guids,
            settings,
            commands: Writer::new(source),
            held: BTreeMap::new(),
            instances: BTreeMap::new(),
            sessions_begun: 0,
            told: Vec::new(),
        }
    }

    /// What the service has to subscribe to for it: statuses, and execution statuses where they are defined.
    pub fn subscriptions(&self) -> Vec<Prefix> {
        let names = [C::STATUS_NAME, C::ExecutionStatus::NAME];
        names.into_iter().filter(|name| !name.is_empty()).filter_map(|name| Prefix::new(name).ok()).collect()
    }

    /// Who it is in its commands.
    pub fn guid(&self) -> Guid {
        self.guid
    }

    /// Starts a command at a provider and gives its session. The members that all commands have are set here.
    ///
    /// # Errors
    /// [`ConsumerError::TooMany`] when as many commands as allowed are on the bus.
    pub fn start(
        &mut self,
        now: Now,
        destination: Guid,
        mut command: C,
        out: &mut Outbox,
    ) -> Result<Guid, ConsumerError> {
        if self.held.len() >= self.settings.sessions_max {
            return Err(ConsumerError::TooMany(self.settings.sessions_max));
        }
        let session_id = self.new_session(now);
        let time_stamp = now.wall.into();
        command.set_header(CommandHeader { time_stamp, source: self.guid, session_id, destination });
        self.commands.put(&command, out);
        self.hold(command).limit = Some(now.monotonic + self.settings.answer_within);
        Ok(session_id)
    }

    /// Replaces an open command by a newer one of the same session (ICD 4.1.4.2).
    ///
    /// # Errors
    /// [`ConsumerError::NotOpen`] when the command has ended or is being cancelled: a new session is needed.
    pub fn update(
        &mut self,
        now: Now,
        session: Guid,
        mut command: C,
        out: &mut Outbox,
    ) -> Result<(), ConsumerError> {
        let held = self.held.get_mut(&session).filter(|held| held.stage == Stage::Open);
        let held = held.ok_or(ConsumerError::NotOpen(session))?;
        let header = held.command.header();
        command.set_header(CommandHeader { time_stamp: after(header.time_stamp, now), ..header });
        self.commands.put(&command, out);
        held.command = command;
        held.awaits_issued = true;
        held.limit = Some(now.monotonic + self.settings.answer_within);
        Ok(())
    }

    /// Cancels a command by disposing it (ICD 4.1.4.5). How it ends is told; it may still complete. Does nothing where the
    /// command is not open.
    pub fn cancel(&mut self, now: Now, session: Guid, out: &mut Outbox) {
        let Some(held) = self.held.get_mut(&session).filter(|held| held.stage == Stage::Open) else { return };
        held.stage = Stage::Canceling;
        held.limit = Some(now.monotonic + self.settings.end_within);
        self.commands.dispose(held.command.key(), out);
    }

    /// The state that an open command was last told to be in.
    pub fn state(&self, session: Guid) -> Option<CommandState> {
        self.held.get(&session)?.state
    }

    /// The command of a session that has not been cleaned up.
    pub fn command(&self, session: Guid) -> Option<&C> {
        self.held.get(&session).map(|held| &held.command)
    }

    /// When it wants [`Input::Deadline`](crate::Input::Deadline).
    pub fn next_deadline(&self) -> Option<Monotonic> {
        self.held.values().filter_map(|held| held.limit).min()
    }

    /// A session id that no command of this life or the former one has: a clock may stand still while a process restarts.
    fn new_session(&mut self, now: Now) -> Guid {
        loop {
            self.sessions_begun += 1;
            let session = self.guids.of_session(self.guid, now.wall, self.sessions_begun);
            if !self.held.contains_key(&session) {
                return session;
            }
        }
    }

    fn hold(&mut self, command: C) -> &mut Held<C> {
        let CommandHeader { session_id, destination, .. } = command.header();
        let statuses = SessionKey { source: destination, session_id };
        self.instances.insert(statuses.instance().hash, session_id);
        let held = Held { command, stage: Stage::Open, state: None, awaits_issued: true, limit: None };
        self.held.entry(session_id).or_insert(held)
    }

    fn forget(&mut self, session: Guid) {
        if let Some(held) = self.held.remove(&session) {
            let source = held.command.header().destination;
            self.instances.remove(&SessionKey { source, session_id: session }.instance().hash);
        }
    }

    /// A command has ended: disposes it, so that its provider may clean up (ICD 4.1.5), and tells.
    fn end(&mut self, now: Now, session: Guid, outcome: Outcome, out: &mut Outbox) {
        let Some(held) = self.held.get_mut(&session) else { return };
        if held.stage == Stage::Ended {
            return;
        }
        if held.stage == Stage::Open {
            self.commands.dispose(held.command.key(), out);
        }
        held.stage = Stage::Ended;
        held.limit = Some(now.monotonic + self.settings.end_within);
        self.told.push(Told::Ended { session, outcome });
    }

    /// 4.1.6.2: disposes what is incomplete, then unregisters.
    fn shut_down(&mut self, out: &mut Outbox) {
        let keys: Vec<(CommandKey, Stage)> =
            self.held.values().map(|held| (held.command.key(), held.stage)).collect();
        for (key, _) in keys.iter().filter(|(_, stage)| *stage == Stage::Open) {
            self.commands.dispose(*key, out);
        }
        for (key, _) in keys {
            self.commands.unregister(key, out);
        }
        self.held.clear();
        self.instances.clear();
    }
}

/// A time stamp for an update: now, or just after the one before where the clock has not gone on.
fn after(before: DateTime, now: Now) -> DateTime {
    let next = match before.nanoseconds() {
        999_999_999 => DateTime::new(before.seconds().saturating_add(1), 0),
        nanoseconds => DateTime::new(before.seconds(), nanoseconds + 1),
    };
    next.map_or(now.wall.into(), |next| next.max(now.wall.into()))
}
