//! A second kind of command beside ResourceAllocation, with an execution status: a course to steer for so many turns of a
//! clock. Its provider is as simple as an author may write one.

use super::asking::Seen;
use crate::service::{Outbox, Service};
use crate::umaa::command::{
    Admission, Commanded, Executor, Failure, FailureKind, Progress, Provider, ProviderSettings, SessionId,
    Stop, Stopped, Verdict,
};
use aldis_envelope::umaa::{CommandState, ExecutionStatus, LongDescription, SessionKey, Topic};
use aldis_envelope::{DateTime, Guid, Guids, Monotonic, Now, Source, umaa_command};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::time::Duration;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct VectorCommand {
    pub(crate) course_degrees: f64,
    /// How long it is steered; 0 is without end.
    pub(crate) seconds: u32,
    /// What goes wrong, by name; empty is nothing.
    pub(crate) trouble: LongDescription,
    pub(crate) time_stamp: DateTime,
    pub(crate) source: Guid,
    pub(crate) session_id: Guid,
    pub(crate) destination: Guid,
}

umaa_command!(VectorCommand, "UMAA::MO::VectorControl::VectorCommand", VectorExecutionStatus);

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct VectorExecutionStatus {
    pub(crate) seconds_left: u32,
    pub(crate) time_stamp: DateTime,
    pub(crate) source: Guid,
    pub(crate) session_id: Guid,
}

impl Topic for VectorExecutionStatus {
    const NAME: &'static str = "UMAA::MO::VectorControl::VectorExecutionStatusReport";
    const TYPE_NAME: &'static str = "UMAA::MO::VectorControl::VectorExecutionStatusReportType";
    type Key = SessionKey;

    fn key(&self) -> SessionKey {
        SessionKey { source: self.source, session_id: self.session_id }
    }
}

impl ExecutionStatus for VectorExecutionStatus {}

pub(crate) fn steer(course_degrees: f64, seconds: u32, trouble: &str) -> VectorCommand {
    VectorCommand {
        course_degrees,
        seconds,
        trouble: LongDescription::new(trouble).unwrap(),
        time_stamp: DateTime::default(),
        source: Guid::NIL,
        session_id: Guid::NIL,
        destination: Guid::NIL,
    }
}

/// Steers: one command at a time would be honest, but the tests want many.
pub(crate) struct Steering {
    guid: Guid,
    running: BTreeMap<SessionId, Monotonic>,
    asked: Seen<String>,
}

impl Steering {
    pub(crate) fn new(guid: Guid, asked: Seen<String>) -> Self {
        Self { guid, running: BTreeMap::new(), asked }
    }

    fn ends(now: Now, command: &VectorCommand) -> Monotonic {
        let seconds = if command.seconds == 0 { 1_000_000 } else { command.seconds };
        now.monotonic + Duration::from_secs(seconds.into())
    }

    fn report(&self, now: Now, id: SessionId, ends: Monotonic) -> Option<VectorExecutionStatus> {
        let seconds_left = (ends - now.monotonic).as_secs() as u32;
        let (time_stamp, source, session_id) = (now.wall.into(), self.guid, id.session);
        Some(VectorExecutionStatus { seconds_left, time_stamp, source, session_id })
    }

    fn say(&self, text: String) {
        self.asked.lock().unwrap().push(text);
    }
}

impl Executor<VectorCommand> for Steering {
    fn validate(&mut self, _: Now, commanded: Commanded<'_, VectorCommand>, _: &mut Outbox) -> Verdict {
        let command = commanded.command;
        match command.trouble.as_str() {
            _ if !(0.0..360.0).contains(&command.course_degrees) => {
                Verdict::Failed(Failure::new(FailureKind::Invalid, "the course is outside 0 to 360 degrees"))
            }
            "dead at validation" => Verdict::Failed(Failure::new(FailureKind::Resource, "no rudder answers")),
            "interrupted at validation" => {
                Verdict::Failed(Failure::new(FailureKind::Interrupted, "somebody has the wheel"))
            }
            "slow to validate" => Verdict::Later,
            _ => Verdict::Valid,
        }
    }

    fn start(
        &mut self,
        now: Now,
        commanded: Commanded<'_, VectorCommand>,
        _: &mut Outbox,
    ) -> Progress<VectorExecutionStatus> {
        self.say(format!("start {}", commanded.command.course_degrees));
        match commanded.command.trouble.as_str() {
            "rejected" => Progress::Failed(Failure::new(FailureKind::Rejected, "not in this sea")),
            "slow to start" => Progress::Waiting,
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
        commanded: Commanded<'_, VectorCommand>,
        _: &mut Outbox,
    ) -> Progress<VectorExecutionStatus> {
        let ends = match self.running.get(&commanded.id) {
            Some(&ends) => ends,
            None if commanded.command.trouble.as_str() == "slow to start" => return Progress::Waiting,
            // A former life has started it.
            None => *self.running.entry(commanded.id).or_insert(Self::ends(now, commanded.command)),
        };
        if now.monotonic < ends {
            return Progress::Waiting;
        }
        self.running.remove(&commanded.id);
        match commanded.command.trouble.as_str() {
            "aground" => Progress::Failed(Failure::new(FailureKind::Objective, "aground")),
            "dead" => Progress::Failed(Failure::new(FailureKind::Resource, "no rudder answers")),
            _ => Progress::Completed,
        }
    }

    fn stop(
        &mut self,
        _: Now,
        commanded: Commanded<'_, VectorCommand>,
        why: Stop,
        _: &mut Outbox,
    ) -> Stopped {
        self.say(format!("stop {} {why:?}", commanded.command.course_degrees));
        if why == Stop::Canceled && commanded.command.trouble.as_str() == "not to be stopped" {
            return Stopped::NotYet;
        }
        self.running.remove(&commanded.id);
        Stopped::Now
    }

    fn recover(&mut self, _: Now, commanded: Commanded<'_, VectorCommand>, _: CommandState) -> bool {
        commanded.command.trouble.as_str() != "not to be recovered"
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.running.values().min().copied()
    }
}

/// The provider as a service.
pub(crate) fn provider(
    source: Source,
    guids: &Guids,
    settings: ProviderSettings,
    admission: impl Admission + 'static,
    asked: Seen<String>,
) -> Box<dyn Service> {
    let steering = Steering::new(guids.of_service(source), asked);
    Box::new(Provider::<VectorCommand, _, _>::new(source, guids.clone(), settings, steering, admission))
}
