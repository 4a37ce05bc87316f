//! What a provider does with what its former life left on the bus (ICD 4.1.2.1).
//!
//! | on the bus | what is done |
//! | --- | --- |
//! | a command without a status | ISSUED first, then on |
//! | with a status that is not terminal | its executor goes on from there, or it fails with SERVICE_FAILED |
//! | with a terminal one | nothing is published, the consumer's dispose is awaited |
//! | updated since it was acknowledged | as the update that it is |
//! | a status that is not terminal, without its command | FAILED / SERVICE_FAILED: nobody executes it. At once where its executor does not await it, else when all have told |
//! | status, acknowledgement or execution status without their command | disposed, once the command cannot come any more |

use super::super::decisions::{is_orphan, is_update};
use super::super::executor::{Admission, Commanded, Executor, Failure, FailureKind, SessionId};
use super::super::session::{Event, Session};
use super::super::writer::is_about;
use super::{Provider, Stage};
use crate::service::Outbox;
use aldis_envelope::umaa::{
    self, Command, CommandAckReport, CommandState, CommandStatus, CommandStatusReason, Key, LongDescription,
    SessionKey, Topic,
};
use aldis_envelope::{Change, DateTime, Envelope, Guid, KeyHash, Monotonic, Now, Source};
use std::collections::BTreeMap;

/// What a former life said of one session.
struct Left<C> {
    /// The last status and when it was made.
    state: Option<(DateTime, CommandState)>,
    ack: Option<CommandAckReport<C>>,
    execution_status: bool,
    /// Whether the own node has told of it, which has all of it in its order.
    is_told_by_own: bool,
    /// Whether the consumer is known to be alive.
    consumer_is_here: bool,
}

impl<C> Default for Left<C> {
    fn default() -> Self {
        let (state, ack) = (None, None);
        Self { state, ack, execution_status: false, is_told_by_own: false, consumer_is_here: false }
    }
}

impl<C> Left<C> {
    /// Whether something counts that is told of the session. The own node tells in the order of writing, whatever the clock said
    /// then. Another node may be behind: what is older than what is known says nothing.
    fn believes(&mut self, told: DateTime, known: Option<DateTime>, by_own: bool) -> bool {
        self.is_told_by_own |= by_own;
        by_own || !self.is_told_by_own && known.is_none_or(|known| told >= known)
    }
}

/// All that a former life said, by session.
pub(super) struct Past<C> {
    left: BTreeMap<Guid, Left<C>>,
    /// When what has found no command is given up.
    wait_ends: Option<Monotonic>,
}

impl<C> Default for Past<C> {
    fn default() -> Self {
        Self { left: BTreeMap::new(), wait_ends: None }
    }
}

impl<C> Past<C> {
    pub(super) fn next_deadline(&self) -> Option<Monotonic> {
        self.wait_ends.filter(|_| !self.left.is_empty())
    }
}

impl<C: Command, E: Executor<C>, A: Admission> Provider<C, E, A> {
    /// A sample of a former life: told by the own node, or by one that retains it for this one.
    pub(super) fn remember(&mut self, envelope: &Envelope, by_own: bool) {
        let is_own = envelope.message.label.source() == self.source;
        if self.stage != Stage::Listening || envelope.message.change != Change::Put || !is_own {
            return;
        }
        let content = &envelope.message.content;
        if is_about::<CommandStatus<C>>(envelope) {
            if let Ok(status) = umaa::decode(content) {
                self.remember_status(&status, by_own);
            }
        } else if is_about::<CommandAckReport<C>>(envelope) {
            if let Ok(ack) = umaa::decode(content) {
                self.remember_ack(ack, by_own);
            }
        } else if is_about::<C::ExecutionStatus>(envelope) {
            let status = umaa::decode::<C::ExecutionStatus>(content);
            if let Ok(status) = status
                && let Some(left) = self.left_of(status.key())
            {
                left.execution_status = true;
            }
        }
    }

    fn remember_status(&mut self, status: &CommandStatus<C>, by_own: bool) {
        if let Some(left) = self.left_of(status.key())
            && left.believes(status.time_stamp, left.state.map(|(known, _)| known), by_own)
        {
            left.state = Some((status.time_stamp, status.command_status));
        }
    }

    fn remember_ack(&mut self, ack: CommandAckReport<C>, by_own: bool) {
        let consumer = self.guids.service(ack.command.header().source);
        // Of a consumer on the own entity no token is told; what it retains always is.
        let is_here = consumer.is_some_and(|consumer| consumer.entity == self.source.entity);
        if let Some(left) = self.left_of(ack.key())
            && left.believes(ack.time_stamp, left.ack.as_ref().map(|known| known.time_stamp), by_own)
        {
            left.consumer_is_here |= is_here;
            left.ack = Some(ack);
        }
    }

    fn left_of(&mut self, key: SessionKey) -> Option<&mut Left<C>> {
        let room = self.past.left.len() < self.most_held() || self.past.left.contains_key(&key.session_id);
        (key.source == self.guid && room).then(|| self.past.left.entry(key.session_id).or_default())
    }

    /// A service appeared or vanished.
    pub(super) fn alive(&mut self, source: Source, alive: bool) {
        for left in self.past.left.values_mut() {
            let consumer = left.ack.as_ref().and_then(|ack| self.guids.service(ack.command.header().source));
            if consumer == Some(source) {
                left.consumer_is_here = alive;
            }
        }
    }

    /// All of the past that is to be had is known: serves the commands that wait, and gives up what has none.
    pub(super) fn recover(&mut self, now: Now, all_is_told: bool, out: &mut Outbox) {
        if self.stage != Stage::Listening {
            return;
        }
        self.stage = Stage::Serving;
        // What was executed goes before what waited, or a resource would be given away behind its holder's back.
        let rank = |command: &C| match self
            .past
            .left
            .get(&command.header().session_id)
            .and_then(|left| left.state)
        {
            Some((_, CommandState::Executing)) => 0,
            Some((_, CommandState::Commanded)) => 1,
            _ => 2,
        };
        let mut waiting: Vec<_> = std::mem::take(&mut self.waiting).into_values().collect();
        waiting.sort_by_key(|(command, _)| (rank(command), command.header().time_stamp));
        for (command, writer) in waiting {
            self.take(now, command, writer, out);
        }
        self.past.wait_ends = Some(now.monotonic + self.settings.orphans_wait);
        self.give_up_orphans(now, all_is_told, out);
    }

    /// Goes on with a command that a former life knew; false where it did not.
    pub(super) fn adopt(
        &mut self,
        now: Now,
        id: SessionId,
        command: &C,
        writer: Source,
        out: &mut Outbox,
    ) -> bool {
        let Some(left) = self.past.left.remove(&id.session) else { return false };
        let known = left.ack.map(|ack| ack.command).unwrap_or_else(|| command.clone());
        let header = known.header();
        let Some((_, state)) = left.state.filter(|_| header.source == id.source) else {
            self.dispose_past(id.session, left.execution_status, out);
            return false;
        };
        let limit = self.limit(now.monotonic, state);
        let is_updated = is_update(header.time_stamp, command.header().time_stamp);
        let held = self.hold(id, known, writer, Session::in_state(state));
        held.has_execution_status = left.execution_status;
        held.limit = limit;
        held.was_started = matches!(state, CommandState::Commanded | CommandState::Executing);
        if is_updated {
            held.newest = command.header().time_stamp;
            held.update = Some(command.clone());
            self.drive(now, id, Event::Updated, out);
        } else if !state.is_terminal() {
            let goes_on = self.executor.recover(now, Commanded { id, command, writer }, state);
            let text = "it cannot go on after the restart of its provider";
            let event = match goes_on {
                true => Event::Resumed,
                false => Event::Failed(Failure::new(FailureKind::Service, text)),
            };
            self.drive(now, id, event, out);
        }
        true
    }

    /// The command of something that waits for one has been disposed.
    pub(super) fn past_disposed(&mut self, command: KeyHash, out: &mut Outbox) {
        let is_of = |left: &Left<C>| {
            left.ack.as_ref().is_some_and(|ack| ack.command.key().instance().hash == command)
        };
        let session = self.past.left.iter().find(|(_, left)| is_of(left)).map(|(&session, _)| session);
        if let Some(session) = session.filter(|_| self.stage == Stage::Serving)
            && let Some(left) = self.past.left.remove(&session)
        {
            self.dispose_past(session, left.execution_status, out);
        }
    }

    /// What a former life said of commands that nobody knows. Where everybody here has told what there is, nobody executes
    /// such a command any more, and its status must not say so. Nor may it where others are not executed because of it.
    pub(super) fn give_up_orphans(&mut self, now: Now, all_is_told: bool, out: &mut Outbox) {
        let Some(wait_ends) = self.past.wait_ends else { return };
        let fails = all_is_told || !self.executor.awaits_lost_commands();
        let sessions: Vec<Guid> = self.past.left.keys().copied().collect();
        for session in sessions {
            let Some(left) = self.past.left.get_mut(&session) else { continue };
            if is_orphan(all_is_told && left.consumer_is_here, now.monotonic, wait_ends) {
                let execution_status = left.execution_status;
                self.past.left.remove(&session);
                self.dispose_past(session, execution_status, out);
            } else if fails && left.state.is_some_and(|(_, state)| !state.is_terminal()) {
                left.state = Some((now.wall.into(), CommandState::Failed));
                let text = "its command was gone when its provider started again";
                self.publish_past(now, session, text, out);
            }
        }
    }

    fn publish_past(&self, now: Now, session: Guid, text: &str, out: &mut Outbox) {
        let (state, reason) = (CommandState::Failed, CommandStatusReason::ServiceFailed);
        let text = LongDescription::shortened(text);
        let status = CommandStatus::new(now.wall.into(), self.key(session), state, reason, text);
        self.statuses.put(&status, out);
    }

    fn dispose_past(&self, session: Guid, execution_status: bool, out: &mut Outbox) {
        let key = self.key(session);
        self.statuses.dispose(key, out);
        self.acks.dispose(key, out);
        if execution_status {
            self.executions.dispose(key, out);
        }
    }
}
