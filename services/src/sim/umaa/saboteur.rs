//! Breaks one rule of the ICD, once or whenever it can, in what a service hears and says.

use super::act::Act;
use super::commands::{RudderCommand, VectorExecutionStatus};
use super::tamper::Tamper;
use crate::service::{Action, Input};
use aldis_envelope::umaa::{
    self, Command, CommandAckReport, CommandState, CommandStatus, CommandStatusReason,
    ResourceAllocationCommand, ResourceAllocationReport, Topic,
};
use aldis_envelope::{Change, DateTime, Envelope, Guid, KeyHash, Message, Monotonic, Now};
use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

type Status = CommandStatus<RudderCommand>;

/// How late a cancel is heard: longer than an answer may take, sooner than what is said of a command must be gone.
const LATE: Duration = Duration::from_secs(8);

/// Does an [`Act`].
pub(super) struct Saboteur {
    act: Act,
    /// How often it was done; shared with who wants to know.
    count: Arc<AtomicU64>,
    /// The commands that were put, and those that have ended.
    known: BTreeSet<KeyHash>,
    last_command: Option<RudderCommand>,
    held: Vec<Message>,
    late: VecDeque<(Monotonic, Envelope)>,
    /// What was held back and is let through now.
    passing: Option<KeyHash>,
}

impl Saboteur {
    pub(super) fn new(act: Act, count: Arc<AtomicU64>) -> Self {
        Self {
            act,
            count,
            known: BTreeSet::new(),
            last_command: None,
            held: Vec::new(),
            late: VecDeque::new(),
            passing: None,
        }
    }

    fn is_done(&self) -> bool {
        self.count.load(Ordering::Relaxed) > 0
    }

    fn done(&self) {
        self.count.fetch_add(1, Ordering::Relaxed);
    }

    /// What becomes of a message that the service writes.
    fn write(&mut self, message: Message) -> Vec<Message> {
        let is_put = message.change == Change::Put;
        let status = is_put.then(|| read::<Status>(&message)).flatten();
        if let Some(status) = status {
            return self.status(message, &status);
        }
        let name = message.label.descriptor();
        let is_ack = name == RudderCommand::ACK_REPORT_NAME;
        match self.act {
            Act::AcknowledgesLate if is_ack && is_put && !self.is_done() => {
                self.held.push(message);
                Vec::new()
            }
            Act::AcknowledgesOther if is_ack && is_put && !self.is_done() => self.other_ack(message),
            Act::HidesExecution if name == VectorExecutionStatus::NAME => {
                self.done();
                Vec::new()
            }
            Act::LeavesAcknowledgement if is_ack && message.change == Change::Dispose && !self.is_done() => {
                self.done();
                Vec::new()
            }
            Act::UnregistersReport | Act::NamesSecondHolder if name == ResourceAllocationReport::NAME => {
                self.report(message)
            }
            _ if name == RudderCommand::NAME => self.command(message),
            _ => vec![message],
        }
    }

    fn status(&mut self, message: Message, status: &Status) -> Vec<Message> {
        use CommandState as State;
        let (state, reason) = (status.command_status, status.command_status_reason);
        if state != State::Commanded && !self.held.is_empty() {
            let held = std::mem::take(&mut self.held);
            return std::iter::once(message).chain(held).collect();
        }
        let succeeded = reason == CommandStatusReason::Succeeded;
        let label = message.label.clone();
        let later = |change: fn(&mut Status)| {
            let mut changed = status.clone();
            change(&mut changed);
            umaa::put(label.clone(), &changed)
        };
        let fits = match self.act {
            Act::LeavesOutIssued | Act::SpeaksForAnother | Act::WritesNonsense => state == State::Issued,
            Act::LeavesOutCommanded | Act::AcknowledgesLate => state == State::Commanded,
            Act::ExecutesTwice | Act::UnregistersStatus => state == State::Executing,
            Act::GivesWrongReason | Act::CancelsUnasked | Act::CleansUpEarly => state == State::Completed,
            _ => false,
        };
        if !fits || !succeeded || self.is_done() {
            return vec![message];
        }
        match self.act {
            Act::LeavesOutIssued | Act::LeavesOutCommanded => {
                self.done();
                Vec::new()
            }
            Act::AcknowledgesLate if self.held.is_empty() => vec![message],
            Act::AcknowledgesLate => {
                self.done();
                std::iter::once(message).chain(std::mem::take(&mut self.held)).collect()
            }
            Act::ExecutesTwice => {
                self.done();
                vec![message, later(|status| status.time_stamp = next(status.time_stamp))]
            }
            Act::GivesWrongReason => {
                self.done();
                vec![later(|status| status.command_status_reason = CommandStatusReason::Timeout)]
            }
            Act::CancelsUnasked => {
                self.done();
                vec![later(|status| {
                    status.command_status = State::Canceled;
                    status.command_status_reason = CommandStatusReason::Canceled;
                })]
            }
            Act::CleansUpEarly => {
                self.done();
                vec![message, umaa::dispose(label.clone(), status)]
            }
            Act::UnregistersStatus => {
                self.done();
                let gone = Message { change: Change::Unregister, ..umaa::dispose(label.clone(), status) };
                vec![message, gone]
            }
            Act::SpeaksForAnother => {
                self.done();
                vec![message, later(|status| status.source = Guid([0x99; 16]))]
            }
            Act::WritesNonsense => {
                self.done();
                let content = message.content.slice(..message.content.len() / 2);
                let nonsense = Message { content, ..message.clone() };
                vec![nonsense, message]
            }
            _ => vec![message],
        }
    }

    /// An acknowledgement of another command comes before the right one.
    fn other_ack(&mut self, message: Message) -> Vec<Message> {
        let Some(ack) = read::<CommandAckReport<RudderCommand>>(&message) else { return vec![message] };
        self.done();
        let command = RudderCommand { angle_degrees: ack.command.angle_degrees + 1.0, ..ack.command.clone() };
        let other = CommandAckReport { command, ..ack };
        vec![umaa::put(message.label.clone(), &other), message]
    }

    fn report(&mut self, message: Message) -> Vec<Message> {
        let Some(report) = read::<ResourceAllocationReport>(&message) else { return vec![message] };
        if self.is_done() {
            return vec![message];
        }
        let label = message.label.clone();
        if self.act == Act::UnregistersReport {
            self.done();
            let gone = Message { change: Change::Unregister, ..umaa::dispose(label, &report) };
            return vec![message, gone];
        }
        let mut other = report.clone();
        let mut infos: Vec<_> = other.control_info.iter().cloned().collect();
        let Some(session) = infos.first_mut().and_then(|info| info.control_session.as_mut()) else {
            return vec![message];
        };
        session.controlling_consumer = Guid([0x99; 16]);
        other.control_info = umaa::Sequence::new(infos).unwrap_or_default();
        other.source = Guid([0x98; 16]);
        self.done();
        vec![message, umaa::put(label, &other)]
    }

    /// What a consumer writes of its commands.
    fn command(&mut self, message: Message) -> Vec<Message> {
        let Some(hash) = message.instance.as_ref().map(|instance| instance.hash) else {
            return vec![message];
        };
        let label = message.label.clone();
        match (message.change, read::<RudderCommand>(&message)) {
            (Change::Put, Some(command)) => {
                let is_update = !self.known.insert(hash);
                let before = self.last_command.replace(command.clone());
                if self.is_done() {
                    return vec![message];
                }
                match (self.act, before) {
                    (Act::UpdatesWithoutTime, Some(before))
                        if is_update && before.session_id == command.session_id =>
                    {
                        self.done();
                        vec![umaa::put(label, &RudderCommand { time_stamp: before.time_stamp, ..command })]
                    }
                    (Act::UsesSessionTwice, _) if !is_update => {
                        self.done();
                        let other = RudderCommand { destination: Guid([0x99; 16]), ..command };
                        vec![message, umaa::put(label, &other)]
                    }
                    (Act::UnregistersCommand, _) if !is_update => {
                        self.done();
                        let gone = Message { change: Change::Unregister, ..umaa::dispose(label, &command) };
                        vec![message, gone]
                    }
                    _ => vec![message],
                }
            }
            (Change::Dispose, _) if self.act == Act::LeavesCommand && !self.is_done() => {
                self.done();
                Vec::new()
            }
            _ => vec![message],
        }
    }

    /// A report that names a holder is sent without it, and comes right when control has been given.
    fn late_report(&mut self, message: &Message) -> Option<Message> {
        let report = read::<ResourceAllocationReport>(message)?;
        let mut infos: Vec<_> = report.control_info.iter().cloned().collect();
        infos.iter_mut().for_each(|info| info.control_session = None);
        let control_info = umaa::Sequence::new(infos).ok()?;
        Some(umaa::put(message.label.clone(), &ResourceAllocationReport { control_info, ..report }))
    }

    fn hears_command(&mut self, now: Now, envelope: &Envelope) -> bool {
        let Some(hash) = envelope.message.instance.as_ref().map(|instance| instance.hash) else {
            return true;
        };
        if self.act == Act::IgnoresCommand {
            self.done();
            return false;
        }
        match self.act {
            Act::HearsCancelLate if envelope.message.change == Change::Dispose => {
                if self.passing.take_if(|passing| *passing == hash).is_some() {
                    return true;
                }
                self.done();
                self.late.push_back((now.monotonic + LATE, envelope.clone()));
                false
            }
            _ => true,
        }
    }
}

fn read<T: Topic>(message: &Message) -> Option<T> {
    let is_of = message.label.descriptor() == T::NAME;
    is_of.then(|| umaa::decode::<T>(&message.content).ok()).flatten()
}

fn next(time: DateTime) -> DateTime {
    DateTime::new(time.seconds() + 1, time.nanoseconds()).unwrap_or(time)
}

impl Tamper for Saboteur {
    fn hears(&mut self, now: Now, input: &Input<'_>) -> bool {
        let Input::Message(envelope) = input else { return true };
        match envelope.message.label.descriptor() {
            RudderCommand::NAME => self.hears_command(now, envelope),
            _ => true,
        }
    }

    fn wants(&mut self, _: Now, action: Action, wanted: &mut Vec<Action>, _: &mut Vec<u64>) {
        match action {
            Action::SendConfirmed(message, number, within)
                if self.act == Act::ReportsLate && !self.is_done() =>
            {
                match self.late_report(&message) {
                    Some(empty) => {
                        self.done();
                        self.held.push(message);
                        wanted.push(Action::SendConfirmed(empty, number, within));
                    }
                    None => wanted.push(Action::SendConfirmed(message, number, within)),
                }
            }
            Action::Send(message) if self.act == Act::ReportsLate => {
                let is_report = message.label.descriptor() == ResourceAllocationReport::NAME;
                // Those that are only repeated wait too.
                if is_report && !self.held.is_empty() {
                    return;
                }
                let status = read::<CommandStatus<ResourceAllocationCommand>>(&message);
                let is_given = status.is_some_and(|status| status.command_status == CommandState::Executing);
                wanted.push(Action::Send(message));
                if is_given {
                    wanted.extend(std::mem::take(&mut self.held).into_iter().map(Action::Send));
                }
            }
            Action::Send(message) => wanted.extend(self.write(message).into_iter().map(Action::Send)),
            Action::SendConfirmed(message, number, within) => {
                let mut messages = self.write(message).into_iter();
                wanted.extend(messages.next().map(|first| Action::SendConfirmed(first, number, within)));
                wanted.extend(messages.map(Action::Send));
            }
            action => wanted.push(action),
        }
    }

    fn due(&mut self, now: Now) -> Option<Envelope> {
        self.late.front().filter(|(at, _)| *at <= now.monotonic)?;
        let (_, envelope) = self.late.pop_front()?;
        self.passing = envelope.message.instance.as_ref().map(|instance| instance.hash);
        Some(envelope)
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.late.front().map(|(at, _)| *at)
    }
}
