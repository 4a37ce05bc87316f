//! Carries out what sessions want done, and asks their executor how it goes.

use super::super::decisions::failure_at_shutdown;
use super::super::executor::{
    Admission, Commanded, Executor, Failure, FailureKind, Progress, SessionId, Stop, Stopped, Verdict,
};
use super::super::session::{Effect, Event};
use super::{Held, Provider, Stage, Step};
use crate::service::{Level, Outbox};
use aldis_envelope::umaa::{
    Command, CommandAckReport, CommandState, CommandStatus, CommandStatusReason, Key, LongDescription,
};
use aldis_envelope::{Monotonic, Now};
use std::collections::VecDeque;
use std::time::Duration;

impl<C: Command> Held<C> {
    fn commanded(&self, id: SessionId) -> Commanded<'_, C> {
        Commanded { id, command: &self.command, writer: self.writer }
    }
}

impl<C: Command, E: Executor<C>, A: Admission> Provider<C, E, A> {
    /// Tells a session what happened, and does what follows until nothing more does.
    pub(super) fn drive(&mut self, now: Now, id: SessionId, event: Event, out: &mut Outbox) {
        let mut events = VecDeque::from([event]);
        while let Some(event) = events.pop_front() {
            let Some(held) = self.held.get_mut(&id) else { return };
            let mut effects = Vec::new();
            held.session.on(event, self.settings.answer_finished_update, &mut effects);
            for effect in effects {
                events.extend(self.carry_out(now, id, effect, out));
            }
        }
    }

    fn carry_out(&mut self, now: Now, id: SessionId, effect: Effect, out: &mut Outbox) -> Option<Event> {
        match effect {
            Effect::Publish(state, reason, text) => self.publish(now, id, state, reason, &text, out),
            Effect::Acknowledge => self.acknowledge(now, id, out),
            Effect::Validate => {
                self.held.get_mut(&id)?.step = Step::Validating;
                return self.ask_validity(now, id, out);
            }
            Effect::Start => {
                self.held.get_mut(&id)?.step = Step::Starting;
                return self.ask_start(now, id, out);
            }
            Effect::Resume => {
                let held = self.held.get_mut(&id)?;
                (held.step, held.was_started) = (Step::Started, true);
                return self.ask_progress(now, id, out);
            }
            Effect::Stop(why) => return self.stop(now, id, why, out),
            Effect::CleanUp => self.clean_up(id, out),
            Effect::RefuseUpdate => {
                self.held.get_mut(&id)?.update = None;
                let text =
                    format!("the update of session {} of {} is refused: it is over", id.session, id.source);
                out.note(Level::Warning, text);
            }
        }
        None
    }

    fn publish(
        &mut self,
        now: Now,
        id: SessionId,
        state: CommandState,
        reason: CommandStatusReason,
        text: &str,
        out: &mut Outbox,
    ) {
        let text = LongDescription::shortened(text);
        let status = CommandStatus::new(now.wall.into(), self.key(id.session), state, reason, text);
        self.statuses.put(&status, out);
        let limit = self.limit(now.monotonic, state);
        let Some(held) = self.held.get_mut(&id) else { return };
        held.limit = limit;
        if state.is_terminal() {
            held.step = Step::None;
        }
        if let Some(report) = held.report.take_if(|_| state == CommandState::Executing) {
            held.has_execution_status = true;
            self.executions.put(&report, out);
        }
    }

    /// When a command that comes into a state now has been in it too long.
    pub(super) fn limit(&self, now: Monotonic, state: CommandState) -> Option<Monotonic> {
        let within: Option<Duration> = match state {
            CommandState::Issued => self.settings.validate_within,
            CommandState::Commanded => self.settings.start_within,
            CommandState::Executing => self.settings.execute_within,
            _ => None,
        };
        within.map(|within| now + within)
    }

    fn acknowledge(&mut self, now: Now, id: SessionId, out: &mut Outbox) {
        let Some(held) = self.held.get(&id) else { return };
        let (command, source, session_id) = (held.command.clone(), self.guid, id.session);
        self.acks.put(&CommandAckReport { command, time_stamp: now.wall.into(), source, session_id }, out);
    }

    /// Whether a command is valid, and then whether its consumer is let through.
    fn ask_validity(&mut self, now: Now, id: SessionId, out: &mut Outbox) -> Option<Event> {
        let held = self.held.get(&id)?;
        if let Some(failure) = &held.refused {
            return Some(Event::Broken(Stop::Broken, failure.clone()));
        }
        match self.executor.validate(now, held.commanded(id), out) {
            Verdict::Valid => {}
            Verdict::Later => return None,
            Verdict::Failed(failure) => return Some(Event::Failed(failure)),
        }
        match self.admission.admits(now, id.source) {
            Verdict::Valid => Some(Event::Validated),
            Verdict::Later => None,
            Verdict::Failed(failure) => Some(Event::Broken(Stop::Broken, failure)),
        }
    }

    /// Starts a command where its consumer is still let through. One that a former life has taken was let through by what was
    /// so then.
    fn ask_start(&mut self, now: Now, id: SessionId, out: &mut Outbox) -> Option<Event> {
        match self.admission.admits(now, id.source) {
            Verdict::Valid => {}
            Verdict::Later => return None,
            Verdict::Failed(failure) => return Some(Event::Broken(Stop::Broken, failure)),
        }
        let held = self.held.get_mut(&id)?;
        (held.step, held.was_started) = (Step::Started, true);
        let progress = self.executor.start(now, held.commanded(id), out);
        self.progressed(id, progress, out)
    }

    /// How a command goes that was started. It may not come to be executed while its consumer is not let through.
    fn ask_started(
        &mut self,
        now: Now,
        id: SessionId,
        state: Option<CommandState>,
        out: &mut Outbox,
    ) -> Option<Event> {
        if state == Some(CommandState::Commanded) {
            match self.admission.admits(now, id.source) {
                Verdict::Valid => {}
                Verdict::Later => return None,
                Verdict::Failed(failure) => return Some(Event::Broken(Stop::Broken, failure)),
            }
        }
        self.ask_progress(now, id, out)
    }

    fn ask_progress(&mut self, now: Now, id: SessionId, out: &mut Outbox) -> Option<Event> {
        let held = self.held.get(&id)?;
        let progress = self.executor.progress(now, held.commanded(id), out);
        self.progressed(id, progress, out)
    }

    fn progressed(
        &mut self,
        id: SessionId,
        progress: Progress<C::ExecutionStatus>,
        out: &mut Outbox,
    ) -> Option<Event> {
        let held = self.held.get_mut(&id)?;
        match progress {
            Progress::Waiting => None,
            Progress::Running(report) if held.session.state() == Some(CommandState::Executing) => {
                if let Some(report) = report {
                    held.has_execution_status = true;
                    self.executions.put(&report, out);
                }
                None
            }
            Progress::Running(report) => {
                held.report = report;
                Some(Event::Executing)
            }
            Progress::Completed => Some(Event::Completed),
            Progress::Failed(failure) => Some(Event::Failed(failure)),
        }
    }

    fn stop(&mut self, now: Now, id: SessionId, why: Stop, out: &mut Outbox) -> Option<Event> {
        let held = self.held.get_mut(&id)?;
        // An executor that was never told to start has nothing to stop.
        let stopped = match held.was_started {
            true => self.executor.stop(now, held.commanded(id), why, out),
            false => Stopped::Now,
        };
        if why == Stop::Updated {
            held.command = held.update.take()?;
            (held.step, held.report) = (Step::None, None);
        }
        (why == Stop::Canceled && stopped == Stopped::Now).then_some(Event::Stopped)
    }

    fn clean_up(&mut self, id: SessionId, out: &mut Outbox) {
        let Some(held) = self.held.remove(&id) else { return };
        self.instances.remove(&held.command.key().instance().hash);
        let key = self.key(id.session);
        self.statuses.dispose(key, out);
        self.acks.dispose(key, out);
        if held.has_execution_status {
            self.executions.dispose(key, out);
        }
    }

    /// Asks after every open command until none goes on any more.
    pub(super) fn poll(&mut self, now: Now, out: &mut Outbox) {
        loop {
            let open = self.held.iter().filter(|(_, held)| held.session.is_open());
            let open: Vec<_> = open.map(|(&id, _)| id).collect();
            let mut moved = false;
            for id in open {
                moved |= self.poll_one(now, id, out);
            }
            if !moved {
                return;
            }
        }
    }

    fn poll_one(&mut self, now: Now, id: SessionId, out: &mut Outbox) -> bool {
        let Some(held) = self.held.get(&id).filter(|held| held.session.is_open()) else { return false };
        let (before, step) = (held.session.state(), held.step);
        let late = held.limit.is_some_and(|limit| limit <= now.monotonic);
        let was_taken = matches!(step, Step::Starting | Step::Started);
        let ended = if was_taken { self.admission.ends(now, id.source) } else { None };
        let event = match (late, ended, step) {
            (true, ..) => {
                let state = before.map_or("", CommandState::name);
                let failure = Failure::new(FailureKind::TimedOut, format!("{state} for too long"));
                Some(Event::Broken(Stop::Broken, failure))
            }
            (false, Some(failure), _) => Some(Event::Broken(Stop::Broken, failure)),
            (false, None, Step::Validating) => self.ask_validity(now, id, out),
            (false, None, Step::Starting) => self.ask_start(now, id, out),
            (false, None, Step::Started) => self.ask_started(now, id, before, out),
            (false, None, Step::None) => None,
        };
        if let Some(event) = event {
            self.drive(now, id, event, out);
        }
        self.held.get(&id).is_none_or(|held| held.session.state() != before)
    }

    /// 4.1.6.1: fails what is incomplete, then unregisters.
    pub(super) fn shut_down(&mut self, now: Now, out: &mut Outbox) {
        let ids: Vec<_> = self.held.keys().copied().collect();
        for id in ids {
            self.drive(now, id, Event::Broken(Stop::Shutdown, failure_at_shutdown()), out);
        }
        for (id, held) in std::mem::take(&mut self.held) {
            let key = self.key(id.session);
            self.statuses.unregister(key, out);
            self.acks.unregister(key, out);
            if held.has_execution_status {
                self.executions.unregister(key, out);
            }
        }
        self.instances.clear();
        self.stage = Stage::Ended;
    }
}
