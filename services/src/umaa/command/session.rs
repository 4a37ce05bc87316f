//! One command at its provider, as a machine without types and without time: what happened goes in, what is to be done comes
//! out. Every status that it wants published is a transition of figure 5.

use super::decisions::{answer_to_an_update_of_a_finished_command, way_of_a_failure};
use super::executor::{Failure, Stop};
use super::table::Transition;
use aldis_envelope::umaa::{CommandState, CommandStatusReason};

/// What happened to a command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Event {
    /// It came, and nobody has said anything of it yet.
    Received,
    /// It was there in a former life of the provider, which goes on with it.
    Resumed,
    /// A newer command of the same session came.
    Updated,
    /// It is valid, and whoever has to has let it through.
    Validated,
    /// It is executed.
    Executing,
    /// It is done.
    Completed,
    /// It failed.
    Failed(Failure),
    /// Others than the executor fail it: it has to stop.
    Broken(Stop, Failure),
    /// The consumer has disposed it.
    Disposed,
    /// The executor has stopped as asked for by a cancel.
    Stopped,
}

/// What is to be done for a command, in this order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Effect {
    /// Publish a status with this text for people.
    Publish(CommandState, CommandStatusReason, String),
    /// Publish the acknowledgement.
    Acknowledge,
    /// Have the command validated.
    Validate,
    /// Have it started.
    Start,
    /// Ask how it goes: it ran in a former life.
    Resume,
    /// Have it stopped.
    Stop(Stop),
    /// Dispose status, acknowledgement and execution status; the session is over.
    CleanUp,
    /// Say that an update was refused because the command is over.
    RefuseUpdate,
}

/// Where a command stands.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(crate) struct Session {
    /// The last status published.
    state: Option<CommandState>,
    /// Whether the consumer has disposed the command.
    disposed: bool,
    /// Whether status and all have been disposed.
    over: bool,
}

impl Session {
    /// A session that a former life has left in this state.
    pub(crate) fn in_state(state: CommandState) -> Self {
        Self { state: Some(state), ..Self::default() }
    }

    /// The last state published.
    pub(crate) fn state(&self) -> Option<CommandState> {
        self.state
    }

    /// Whether the command has not ended.
    pub(crate) fn is_open(&self) -> bool {
        !self.over && self.state.is_some_and(|state| !state.is_terminal())
    }

    /// Takes what happened; appends what is to be done. `answer_finished_update` is the setting of that name.
    pub(crate) fn on(&mut self, event: Event, answer_finished_update: bool, effects: &mut Vec<Effect>) {
        // Nothing happens to a session before its command came, or after all of it is gone.
        if self.over || (self.state.is_none() && event != Event::Received) {
            return;
        }
        match event {
            Event::Received if self.state.is_none() => self.received(effects),
            Event::Resumed => self.resumed(effects),
            Event::Updated => self.updated(answer_finished_update, effects),
            Event::Validated if self.state == Some(CommandState::Issued) => {
                self.succeed(CommandState::Commanded, effects);
                effects.push(Effect::Start);
            }
            Event::Executing if self.state == Some(CommandState::Commanded) => {
                self.succeed(CommandState::Executing, effects);
            }
            Event::Completed => self.completed(effects),
            Event::Failed(failure) => self.failed(failure, effects),
            Event::Broken(why, failure) if self.is_open() => {
                effects.push(Effect::Stop(why));
                self.failed(failure, effects);
            }
            Event::Disposed => self.disposed(effects),
            Event::Stopped if self.disposed && self.is_open() => {
                self.publish(CommandState::Canceled, CommandStatusReason::Canceled, String::new(), effects);
                self.clean_up(effects);
            }
            _ => {}
        }
    }

    /// 4.1.4 item 3, then 4.1.4.1 items 1 and 2.
    fn received(&mut self, effects: &mut Vec<Effect>) {
        self.succeed(CommandState::Issued, effects);
        effects.push(Effect::Acknowledge);
        effects.push(Effect::Validate);
    }

    /// 4.1.2.1: picks up from the last status on the bus. A terminal one awaits the consumer's dispose.
    fn resumed(&mut self, effects: &mut Vec<Effect>) {
        match self.state {
            // The acknowledgement may be missing where the former life ended between the two.
            Some(CommandState::Issued) => effects.extend([Effect::Acknowledge, Effect::Validate]),
            Some(CommandState::Commanded) => effects.push(Effect::Start),
            Some(CommandState::Executing) => effects.push(Effect::Resume),
            _ => {}
        }
    }

    /// 4.1.4.2: an entirely new command, all that belonged to the old one is reset.
    fn updated(&mut self, answer_finished_update: bool, effects: &mut Vec<Effect>) {
        if self.is_open() {
            self.disposed = false;
            effects.push(Effect::Stop(Stop::Updated));
            let text = String::new();
            self.publish(CommandState::Issued, CommandStatusReason::Updated, text, effects);
            effects.push(Effect::Acknowledge);
            effects.push(Effect::Validate);
        } else {
            effects.push(Effect::RefuseUpdate);
            if let Some((state, reason)) = answer_to_an_update_of_a_finished_command(answer_finished_update) {
                // The one status that is no transition of figure 5, and only where the configuration asks for it.
                self.state = Some(state);
                effects.push(Effect::Publish(state, reason, "the command is over, send a new one".into()));
            }
        }
    }

    /// 4.1.4.3; a command that is done sooner than it was seen executing walks there first (4.1: no state is skipped).
    fn completed(&mut self, effects: &mut Vec<Effect>) {
        if !self.is_open() {
            return;
        }
        if self.state == Some(CommandState::Issued) {
            self.succeed(CommandState::Commanded, effects);
        }
        if self.state == Some(CommandState::Commanded) {
            self.succeed(CommandState::Executing, effects);
        }
        self.succeed(CommandState::Completed, effects);
        self.clean_up_if_disposed(effects);
    }

    /// 4.1.4.4.
    fn failed(&mut self, failure: Failure, effects: &mut Vec<Effect>) {
        let Some(from) = self.state.filter(|_| self.is_open()) else { return };
        let (walks, reason) = way_of_a_failure(from, failure.kind);
        if walks {
            self.succeed(CommandState::Commanded, effects);
        }
        self.publish(CommandState::Failed, reason, failure.text, effects);
        self.clean_up_if_disposed(effects);
    }

    /// 4.1.4.5: the cancel of an open command; 4.1.5: the consumer has seen the end of a finished one.
    fn disposed(&mut self, effects: &mut Vec<Effect>) {
        if std::mem::replace(&mut self.disposed, true) {
            return;
        }
        if self.is_open() {
            effects.push(Effect::Stop(Stop::Canceled));
        } else {
            self.clean_up(effects);
        }
    }

    fn clean_up_if_disposed(&mut self, effects: &mut Vec<Effect>) {
        if self.disposed {
            self.clean_up(effects);
        }
    }

    fn clean_up(&mut self, effects: &mut Vec<Effect>) {
        self.over = true;
        effects.push(Effect::CleanUp);
    }

    fn succeed(&mut self, to: CommandState, effects: &mut Vec<Effect>) {
        self.publish(to, CommandStatusReason::Succeeded, String::new(), effects);
    }

    fn publish(
        &mut self,
        to: CommandState,
        reason: CommandStatusReason,
        text: String,
        effects: &mut Vec<Effect>,
    ) {
        let transition = Transition { from: self.state, to, reason };
        debug_assert!(transition.is_legal(), "{transition:?} is not in figure 5");
        self.state = Some(to);
        effects.push(Effect::Publish(to, reason, text));
    }
}

#[cfg(test)]
mod tests;
