//! Executors that do what their commands say: as simple as an author may write them.

use super::commands::{RudderCommand, Script, VectorCommand, turn};
use crate::service::{Input, Outbox};
use crate::umaa::command::{
    Commanded, Consumer, ConsumerSettings, Executor, Failure, FailureKind, Progress, SessionId, Stop,
    Stopped, Verdict,
};
use aldis_envelope::umaa::{Command, CommandState, SessionKey};
use aldis_envelope::{Guid, Guids, Monotonic, Now, Prefix, Source};
use std::collections::BTreeMap;
use std::marker::PhantomData;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Where an executor tells what it was asked.
pub(crate) type Said = Arc<Mutex<Vec<String>>>;

/// What may go wrong with a command, by name: all that figure 5 has a reason for.
pub(crate) const TROUBLES: [&str; 14] = [
    "",
    "",
    "",
    "dead at validation",
    "slow to validate",
    "rejected",
    "slow to start",
    "aground",
    "dead",
    "not to be stopped",
    "not to be recovered",
    "slow to validate, not to be recovered",
    "slow to start, not to be recovered",
    "interrupted at validation",
];

/// Executes commands as they say. It takes many at a time, which an honest helm would not.
pub(crate) struct Scripted<C> {
    guid: Guid,
    running: BTreeMap<SessionId, Monotonic>,
    said: Option<Said>,
    of: PhantomData<fn(C)>,
}

impl<C: Script> Scripted<C> {
    /// The executor of the provider with this GUID; what it is asked it tells there.
    pub(crate) fn new(guid: Guid, said: Option<Said>) -> Self {
        Self { guid, running: BTreeMap::new(), said, of: PhantomData }
    }

    fn ends(now: Now, command: &C) -> Monotonic {
        let seconds = if command.seconds() == 0 { 1_000_000 } else { command.seconds() };
        now.monotonic + Duration::from_secs(seconds.into())
    }

    fn report(&self, now: Now, id: SessionId, ends: Monotonic) -> Option<C::ExecutionStatus> {
        let seconds_left = (ends - now.monotonic).as_secs() as u32;
        let key = SessionKey { source: self.guid, session_id: id.session };
        C::status(key, now.wall.into(), seconds_left)
    }

    fn say(&self, text: impl FnOnce() -> String) {
        if let Some(said) = &self.said {
            said.lock().unwrap_or_else(PoisonError::into_inner).push(text());
        }
    }
}

impl<C: Script> Executor<C> for Scripted<C> {
    fn validate(&mut self, _: Now, commanded: Commanded<'_, C>, _: &mut Outbox) -> Verdict {
        let failed = |kind, text: &str| Verdict::Failed(Failure::new(kind, text));
        match commanded.command.trouble() {
            _ if !commanded.command.is_valid() => failed(FailureKind::Invalid, "it is outside its range"),
            "dead at validation" => failed(FailureKind::Resource, "no rudder answers"),
            "interrupted at validation" => failed(FailureKind::Interrupted, "somebody has the wheel"),
            trouble if trouble.starts_with("slow to validate") => Verdict::Later,
            _ => Verdict::Valid,
        }
    }

    fn start(
        &mut self,
        now: Now,
        commanded: Commanded<'_, C>,
        _: &mut Outbox,
    ) -> Progress<C::ExecutionStatus> {
        self.say(|| format!("start {}", commanded.command.text()));
        match commanded.command.trouble() {
            "rejected" => Progress::Failed(Failure::new(FailureKind::Rejected, "not in this sea")),
            trouble if trouble.starts_with("slow to start") => Progress::Waiting,
            "done at once" => Progress::Completed,
            _ => {
                let ends = Self::ends(now, commanded.command);
                self.running.insert(commanded.id, ends);
                Progress::Running(self.report(now, commanded.id, ends))
            }
        }
    }

    fn progress(
        &mut self,
        now: Now,
        commanded: Commanded<'_, C>,
        _: &mut Outbox,
    ) -> Progress<C::ExecutionStatus> {
        let ends = match self.running.get(&commanded.id) {
            Some(&ends) => ends,
            None if commanded.command.trouble().starts_with("slow to start") => return Progress::Waiting,
            // A former life has started it.
            None => *self.running.entry(commanded.id).or_insert(Self::ends(now, commanded.command)),
        };
        if now.monotonic < ends {
            return Progress::Waiting;
        }
        self.running.remove(&commanded.id);
        match commanded.command.trouble() {
            "aground" => Progress::Failed(Failure::new(FailureKind::Objective, "aground")),
            "dead" => Progress::Failed(Failure::new(FailureKind::Resource, "no rudder answers")),
            _ => Progress::Completed,
        }
    }

    fn stop(&mut self, _: Now, commanded: Commanded<'_, C>, why: Stop, _: &mut Outbox) -> Stopped {
        self.say(|| format!("stop {} {why:?}", commanded.command.text()));
        if why == Stop::Canceled && commanded.command.trouble() == "not to be stopped" {
            return Stopped::NotYet;
        }
        self.running.remove(&commanded.id);
        Stopped::Now
    }

    fn recover(&mut self, _: Now, commanded: Commanded<'_, C>, _: CommandState) -> bool {
        !commanded.command.trouble().ends_with("not to be recovered")
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.running.values().min().copied()
    }
}

/// Steers, and sets the rudder of a nested provider while it does (ICD 5.1.3).
pub(super) struct Helm {
    steering: Scripted<VectorCommand>,
    rudder: Guid,
    rudders: Consumer<RudderCommand>,
    turning: BTreeMap<SessionId, Guid>,
}

impl Helm {
    pub(super) fn new(source: Source, guids: &Guids, rudder: Source) -> Self {
        Self {
            steering: Scripted::new(guids.of_service(source), None),
            rudder: guids.of_service(rudder),
            rudders: Consumer::new(source, guids.clone(), ConsumerSettings::default()),
            turning: BTreeMap::new(),
        }
    }

    fn midships(&mut self, now: Now, id: SessionId, out: &mut Outbox) {
        if let Some(session) = self.turning.remove(&id) {
            self.rudders.cancel(now, session, out);
        }
    }
}

impl Executor<VectorCommand> for Helm {
    fn validate(&mut self, now: Now, commanded: Commanded<'_, VectorCommand>, out: &mut Outbox) -> Verdict {
        self.steering.validate(now, commanded, out)
    }

    fn start(
        &mut self,
        now: Now,
        commanded: Commanded<'_, VectorCommand>,
        out: &mut Outbox,
    ) -> Progress<<VectorCommand as Command>::ExecutionStatus> {
        let (id, command) = (commanded.id, commanded.command);
        let progress = self.steering.start(now, commanded, out);
        if matches!(progress, Progress::Running(_)) {
            let command = turn(command.course_degrees / 360.0 * 35.0, command.seconds.div_ceil(2), "");
            // A rudder that has too much to do already is left as it is.
            if let Ok(session) = self.rudders.start(now, self.rudder, command, out) {
                self.turning.insert(id, session);
            }
        }
        progress
    }

    fn progress(
        &mut self,
        now: Now,
        commanded: Commanded<'_, VectorCommand>,
        out: &mut Outbox,
    ) -> Progress<<VectorCommand as Command>::ExecutionStatus> {
        let id = commanded.id;
        let progress = self.steering.progress(now, commanded, out);
        if matches!(progress, Progress::Completed | Progress::Failed(_)) {
            self.midships(now, id, out);
        }
        progress
    }

    fn stop(
        &mut self,
        now: Now,
        commanded: Commanded<'_, VectorCommand>,
        why: Stop,
        out: &mut Outbox,
    ) -> Stopped {
        let id = commanded.id;
        let stopped = self.steering.stop(now, commanded, why, out);
        if stopped == Stopped::Now {
            self.midships(now, id, out);
        }
        stopped
    }

    fn recover(&mut self, now: Now, commanded: Commanded<'_, VectorCommand>, state: CommandState) -> bool {
        self.steering.recover(now, commanded, state)
    }

    fn subscriptions(&self) -> Vec<Prefix> {
        self.rudders.subscriptions()
    }

    fn observe(&mut self, now: Now, input: &Input<'_>, out: &mut Outbox) {
        self.rudders.handle(now, input, out);
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        [self.steering.next_deadline(), self.rudders.next_deadline()].into_iter().flatten().min()
    }
}
