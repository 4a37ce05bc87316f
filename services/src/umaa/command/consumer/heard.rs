//! What a consumer makes of what it hears of its commands.

use super::super::writer::is_about;
use super::{Consumer, Outcome, Recovery, Stage, Told};
use crate::service::{Input, Outbox};
use aldis_envelope::umaa::{self, Command, CommandKey, CommandState, CommandStatus, Key, Topic};
use aldis_envelope::{Change, Envelope, Guid, Now};

impl<C: Command> Consumer<C> {
    /// Takes one input of the service, and says what came of it.
    pub fn handle(&mut self, now: Now, input: &Input<'_>, out: &mut Outbox) -> Vec<Told<C::ExecutionStatus>> {
        match input {
            Input::Recovered(envelope) if is_about::<C>(envelope) => self.recovered(envelope, out),
            Input::Message(envelope) if is_about::<CommandStatus<C>>(envelope) => {
                self.status(now, envelope, out);
            }
            Input::Message(envelope) if is_about::<C::ExecutionStatus>(envelope) => {
                self.execution_status(envelope);
            }
            Input::HistoryComplete(_) => self.recover(now, out),
            Input::Shutdown => self.shut_down(out),
            _ => {}
        }
        self.expire(now, out);
        std::mem::take(&mut self.told)
    }

    /// A command of a former life is still on the bus.
    fn recovered(&mut self, envelope: &Envelope, out: &mut Outbox) {
        if envelope.message.change != Change::Put {
            return;
        }
        let command = umaa::decode::<C>(&envelope.message.content);
        match command {
            Ok(command) if command.header().source == self.guid => {
                self.hold(command);
            }
            // It was made under another GUID, or cannot be read any more: nobody else will ever dispose it.
            Ok(command) => self.commands.dispose(command.key(), out),
            Err(_) => {
                let key = envelope.message.instance.as_deref().and_then(CommandKey::of_instance);
                if let Some(key) = key {
                    self.commands.dispose(key, out);
                }
            }
        }
    }

    /// 4.1.2.2: every command of a former life goes on or is cancelled.
    fn recover(&mut self, now: Now, out: &mut Outbox) {
        let open = self.held.iter().filter(|(_, held)| held.stage == Stage::Open && held.limit.is_none());
        let sessions: Vec<Guid> = open.map(|(&session, _)| session).collect();
        for session in sessions {
            match self.settings.recovery {
                Recovery::Cancel => self.cancel(now, session, out),
                Recovery::Resume => {
                    self.told.push(Told::Recovered { session });
                    if let Some(held) = self.held.get_mut(&session) {
                        let silent = held.state.is_none();
                        held.limit = silent.then_some(now.monotonic + self.settings.answer_within);
                    }
                }
            }
        }
    }

    fn status(&mut self, now: Now, envelope: &Envelope, out: &mut Outbox) {
        match envelope.message.change {
            Change::Put => {
                let status = umaa::decode::<CommandStatus<C>>(&envelope.message.content);
                if let Ok(status) = status
                    && let Some(&session) = self.instances.get(&status.key().instance().hash)
                    && self
                        .guids
                        .service(status.source)
                        .is_none_or(|claimed| claimed == envelope.message.label.source())
                {
                    self.status_put(now, session, &status, out);
                }
            }
            Change::Dispose => {
                let session = envelope.message.instance.as_ref();
                let session = session.and_then(|instance| self.instances.get(&instance.hash)).copied();
                if let Some(session) = session {
                    self.end(now, session, Outcome::Abandoned, out);
                    self.forget(session);
                }
            }
            // The provider is out of contact, which says nothing of the command.
            Change::Unregister => {}
        }
    }

    fn status_put(&mut self, now: Now, session: Guid, status: &CommandStatus<C>, out: &mut Outbox) {
        let (state, reason) = (status.command_status, status.command_status_reason);
        let text = || status.log_message.as_str().to_owned();
        let outcome = match state {
            CommandState::Completed => Outcome::Completed,
            CommandState::Canceled => Outcome::Canceled,
            CommandState::Failed => Outcome::Failed { reason, text: text() },
            CommandState::Issued | CommandState::Commanded | CommandState::Executing => {
                let Some(held) = self.held.get_mut(&session) else { return };
                held.state = Some(state);
                if state == CommandState::Issued || held.limit.is_none() {
                    held.awaits_issued = false;
                    // A cancel waits for the end, not for an answer.
                    held.limit = held.limit.filter(|_| held.stage != Stage::Open);
                }
                if held.stage != Stage::Ended && !held.awaits_issued {
                    self.told.push(Told::State { session, state, reason, text: text() });
                }
                return;
            }
        };
        if let Some(held) = self.held.get_mut(&session) {
            held.state = Some(state);
        }
        self.end(now, session, outcome, out);
    }

    fn execution_status(&mut self, envelope: &Envelope) {
        if envelope.message.change != Change::Put {
            return;
        }
        let Ok(status) = umaa::decode::<C::ExecutionStatus>(&envelope.message.content) else { return };
        let session = self.instances.get(&status.key().instance().hash).copied();
        if let Some(session) = session
            && self.held.get(&session).is_some_and(|held| held.stage != Stage::Ended)
        {
            self.told.push(Told::Execution { session, status });
        }
    }

    /// Gives up on providers that have been silent too long.
    fn expire(&mut self, now: Now, out: &mut Outbox) {
        let late =
            self.held.iter().filter(|(_, held)| held.limit.is_some_and(|limit| limit <= now.monotonic));
        let late: Vec<_> = late.map(|(&session, held)| (session, held.stage)).collect();
        for (session, stage) in late {
            if stage != Stage::Ended {
                self.end(now, session, Outcome::Unanswered, out);
            } else {
                self.forget(session);
            }
        }
    }
}
