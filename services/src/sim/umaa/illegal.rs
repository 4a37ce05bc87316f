//! Every transition that figure 5 does not have is put on a bus once, and must be found: by the checker of commands and by the
//! monitor, which share nothing.

use super::commands::{RudderCommand, turn};
use super::flow::Flow;
use super::watch::topics;
use crate::conform::{Bounds, Clause, Decoder, Monitor, Watcher};
use crate::umaa::command::table::Transition;
use aldis_envelope::umaa::{
    self, Command, CommandAckReport, CommandHeader, CommandState, CommandStatus, CommandStatusReason,
    LongDescription, SessionKey, Topic,
};
use aldis_envelope::{
    BootId, DateTime, EntityId, Envelope, Guid, Message, Monotonic, Priority, ServiceId, Source, Stamp, Wall,
};
use std::time::Duration;

/// What became of the transitions that are no transitions, and of those that are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct IllegalCount {
    /// How many figure 5 does not have.
    pub illegal: usize,
    /// How many of them both have found.
    pub rejected: usize,
    /// How many figure 5 has.
    pub legal: usize,
    /// How many of them both have let pass.
    pub accepted: usize,
}

/// Puts all 420 triples of a state before, a state after and a reason on a bus, each in a run of its own.
pub fn reject_all_illegal() -> IllegalCount {
    let mut count = IllegalCount::default();
    let from = std::iter::once(None).chain(CommandState::ALL.iter().copied().map(Some));
    for from in from {
        for &to in CommandState::ALL {
            for &reason in CommandStatusReason::ALL {
                let Some((flow, monitor)) = finds(from, to, reason) else { continue };
                let transition = Transition { from, to, reason };
                if transition.is_legal() {
                    count.legal += 1;
                    count.accepted += usize::from(!flow && !monitor);
                } else {
                    count.illegal += 1;
                    count.rejected += usize::from(flow && monitor);
                }
            }
        }
    }
    count
}

/// A consumer and a provider that writes whatever it likes.
struct Rogue {
    consumer: Source,
    provider: Source,
    command: RudderCommand,
    flow: Flow,
    watcher: Watcher,
    written: u64,
}

/// Whether the checker and the monitor find something wrong where a command comes from one state to another.
fn finds(from: Option<CommandState>, to: CommandState, reason: CommandStatusReason) -> Option<(bool, bool)> {
    use CommandState as State;
    use CommandStatusReason as Reason;
    let mut rogue = Rogue::new()?;
    rogue.command()?;
    let reached = |at: State| from.is_some_and(|from| from != State::Canceled && rank(from) >= rank(at));
    for state in [State::Issued, State::Commanded, State::Executing, State::Completed] {
        let is_on_the_way = match from {
            Some(State::Failed | State::Canceled) => state == State::Issued,
            _ => reached(state),
        };
        if is_on_the_way {
            rogue.status(state, Reason::Succeeded)?;
        }
        if is_on_the_way && state == State::Issued {
            rogue.acknowledge()?;
        }
    }
    match from {
        Some(State::Failed) => rogue.status(State::Failed, Reason::ServiceFailed)?,
        Some(State::Canceled) => {
            rogue.dispose()?;
            rogue.status(State::Canceled, Reason::Canceled)?;
        }
        _ => {}
    }
    if reason == Reason::Updated && from.is_some_and(|from| !from.is_terminal()) {
        rogue.command()?;
    }
    if to == State::Canceled && from != Some(State::Canceled) {
        rogue.dispose()?;
    }
    rogue.status(to, reason)?;
    Some(rogue.finish())
}

/// The order of the states that a command goes through.
fn rank(state: CommandState) -> usize {
    match state {
        CommandState::Issued => 0,
        CommandState::Commanded => 1,
        CommandState::Executing => 2,
        CommandState::Completed => 3,
        CommandState::Failed | CommandState::Canceled => 4,
    }
}

impl Rogue {
    fn new() -> Option<Self> {
        let at = |entity, service: u32| {
            let (entity, service) = (EntityId::new(entity).ok()?, ServiceId::new(service.into()).ok()?);
            Some(Source::new(entity, service))
        };
        let mut flow = Flow::default();
        flow.watch::<RudderCommand>();
        let monitor = Monitor::new(Bounds::default(), []);
        Some(Self {
            consumer: at(1, 100)?,
            provider: at(2, 100)?,
            command: turn(0.0, 1, ""),
            flow,
            watcher: Watcher::from_the_start(monitor, Decoder::new(topics())),
            written: 0,
        })
    }

    fn key(&self) -> SessionKey {
        SessionKey { source: Guid([0x81; 16]), session_id: Guid([0x82; 16]) }
    }

    fn time(&self) -> Option<DateTime> {
        DateTime::new(self.written as i64, 0).ok()
    }

    fn write(&mut self, writer: Source, message: Message) {
        self.written += 1;
        let stamp = Stamp {
            node: writer.entity,
            boot: BootId(1),
            sequence: self.written,
            source_time: Wall(0),
            lifespan_left_ms: None,
            priority: Priority::Data,
            skipped: 0,
            via: Default::default(),
        };
        let envelope = Envelope { message, stamp };
        self.flow.published(&envelope);
        self.watcher.message(Monotonic::since_start(Duration::from_millis(self.written)), &envelope);
    }

    /// The command is put, as an update where it was put before.
    fn command(&mut self) -> Option<()> {
        let SessionKey { source: destination, session_id } = self.key();
        let header =
            CommandHeader { time_stamp: self.time()?, source: Guid([0x83; 16]), session_id, destination };
        self.command.set_header(header);
        let label = umaa::label::<RudderCommand>(self.consumer).ok()?;
        self.write(self.consumer, umaa::put(label, &self.command.clone()));
        Some(())
    }

    fn dispose(&mut self) -> Option<()> {
        let label = umaa::label::<RudderCommand>(self.consumer).ok()?;
        self.write(self.consumer, umaa::dispose(label, &self.command.clone()));
        Some(())
    }

    fn acknowledge(&mut self) -> Option<()> {
        let SessionKey { source, session_id } = self.key();
        let ack =
            CommandAckReport { command: self.command.clone(), time_stamp: self.time()?, source, session_id };
        let label = umaa::label::<CommandAckReport<RudderCommand>>(self.provider).ok()?;
        self.write(self.provider, umaa::put(label, &ack));
        Some(())
    }

    fn status(&mut self, state: CommandState, reason: CommandStatusReason) -> Option<()> {
        let status = CommandStatus::<RudderCommand>::new(
            self.time()?,
            self.key(),
            state,
            reason,
            LongDescription::default(),
        );
        let label = umaa::label::<CommandStatus<RudderCommand>>(self.provider).ok()?;
        self.write(self.provider, umaa::put(label, &status));
        Some(())
    }

    /// Whether the checker has found something, and whether the monitor has: of the states and their reasons alone.
    fn finish(self) -> (bool, bool) {
        let now = Monotonic::since_start(Duration::from_millis(self.written));
        let report = self.watcher.finish(now);
        let clauses = [Clause::FirstStatus, Clause::Transition, Clause::Reason];
        let found = report.broken().any(|found| clauses.contains(&found.clause));
        let told = self.flow.violations.iter().any(|what| what.starts_with(RudderCommand::NAME));
        (told, found)
    }
}
