//! One command from its first sign to its last.

mod crossing;

use super::{Role, SessionId, Step};
use crate::conform::Clause;
use crate::conform::ledger::{Debt, Ledger};
use crate::conform::sample::Sample;
use crate::conform::transition::{is_legal, is_reason, is_terminal};
use aldis_envelope::{Guid, Monotonic};
use std::collections::VecDeque;

/// How many earlier forms of a command are remembered.
const BEFORE_MAX: usize = 16;

/// What is known of a command.
#[derive(Debug)]
pub(super) struct Session {
    id: SessionId,
    /// Whether an execution status is defined for the command.
    has_execution_status: bool,
    command: Option<Sample>,
    /// The command before its latest updates: acknowledgements may have crossed them.
    before: VecDeque<Sample>,
    /// The command was on the bus before the monitor was.
    was_there: bool,
    /// The consumer has disposed the command.
    disposed: bool,
    /// How many updates are on the bus that have not been answered.
    updates: u32,
    state: Option<String>,
    /// When it came to a terminal state.
    ended: Option<Monotonic>,
    last_status: Option<Sample>,
    /// The command as it was acknowledged last: it may come later than that.
    last_ack: Option<Sample>,
    last_execution_status: Option<Sample>,
    acknowledged: bool,
    /// Who spoke about the command has unregistered, or contact is lost: its next life may go on, or begin anew.
    provider_gone: bool,
    /// Contact was lost while a status was there: it may come again.
    may_return: bool,
    /// The status came again after that, and nothing new has been said since.
    has_returned: bool,
    status_there: bool,
    ack_there: bool,
    execution_status_there: bool,
}

impl Session {
    pub(super) fn new(id: SessionId, has_execution_status: bool) -> Self {
        Self {
            id,
            has_execution_status,
            command: None,
            before: VecDeque::new(),
            was_there: false,
            disposed: false,
            updates: 0,
            state: None,
            ended: None,
            last_status: None,
            last_ack: None,
            last_execution_status: None,
            acknowledged: false,
            provider_gone: false,
            may_return: false,
            has_returned: false,
            status_there: false,
            ack_there: false,
            execution_status_there: false,
        }
    }

    /// The consumer of the command, as long as the command is on the bus.
    pub(super) fn active_source(&self) -> Option<Guid> {
        self.command.as_ref().filter(|_| !self.disposed)?.guid("source")
    }

    /// Whether nothing of it is left on the bus.
    pub(super) fn is_over(&self) -> bool {
        let said = self.status_there || self.ack_there || self.execution_status_there;
        !said && !self.may_return && (self.command.is_none() || self.disposed && self.is_terminal())
    }

    /// Whether it was cancelled before anything was said of it: its provider may still take it up, or never hear of it.
    pub(super) fn is_unanswered(&self) -> bool {
        self.disposed && self.state.is_none()
    }

    fn is_terminal(&self) -> bool {
        self.state.as_deref().is_some_and(is_terminal)
    }

    fn debt(&self, clause: Clause) -> Debt {
        let (family, session, provider) = &self.id;
        (clause, family.clone(), *provider, *session)
    }

    fn owe(&self, clause: Clause, ledger: &mut Ledger, text: &str) {
        let bounds = ledger.bounds;
        let within = match clause {
            Clause::ConsumerCleanUp | Clause::ProviderCleanUp => bounds.clean_up,
            Clause::ExecutionStatus => bounds.follow,
            Clause::Correlated | Clause::CleanUpOrder | Clause::CancelAsked => bounds.slack,
            Clause::UpdatedOnly | Clause::AckFirst | Clause::AckMatches => bounds.slack,
            _ => bounds.answer,
        };
        ledger.owe(self.debt(clause), within, format!("session {}: {text}", self.id.1));
    }

    fn judge(&self, clause: Clause, held: bool, ledger: &mut Ledger, text: impl FnOnce() -> String) {
        ledger.judge(clause, held, || format!("session {}: {}", self.id.1, text()));
    }

    /// The command is put: a new one, an update, or the same again.
    pub(super) fn command(&mut self, sample: &Sample, retained: bool, ledger: &mut Ledger) {
        ledger.pay(&self.debt(Clause::Correlated));
        let Some(known) = self.command.clone().filter(|_| !self.disposed) else {
            self.begin(sample, retained, ledger);
            return;
        };
        if known == *sample {
            return;
        }
        let newer = sample.time("timeStamp") > known.time("timeStamp");
        self.judge(Clause::UpdateNewer, newer, ledger, || "changed without a newer timestamp".to_owned());
        if !newer {
            return;
        }
        let state = self.state.clone().unwrap_or_default();
        // The end may have crossed the update.
        let crossing = ledger.bounds.slack + ledger.bounds.unheard;
        let in_time = self.ended.is_none_or(|ended| ledger.now() - ended <= crossing);
        self.judge(Clause::UpdateInTime, in_time, ledger, || format!("updated when it was {state}"));
        self.before.extend(self.command.replace(sample.clone()));
        if self.before.len() > BEFORE_MAX {
            self.before.pop_front();
        }
        if ledger.forgive(&self.debt(Clause::UpdatedOnly)) {
            // Its answer was here sooner.
            ledger.held(Clause::UpdatedOnly);
        } else if self.ended.is_none() && self.may_be_answered(ledger) {
            self.updates += 1;
            self.owe(Clause::UpdateAnswered, ledger, "its update is not answered");
        }
        self.comes_after_its_ack(sample, ledger);
    }

    /// A command that was not there before, or one that reuses the session of another.
    fn begin(&mut self, sample: &Sample, retained: bool, ledger: &mut Ledger) {
        let reused = self.disposed;
        self.command = Some(sample.clone());
        (self.disposed, self.updates) = (false, 0);
        self.before.clear();
        if reused {
            (self.state, self.ended, self.acknowledged) = (None, None, false);
            for clause in [Clause::ProviderCleanUp, Clause::CancelAnswered] {
                ledger.forgive(&self.debt(clause));
            }
        }
        if !self.acknowledged {
            self.comes_after_its_ack(sample, ledger);
        }
        self.was_there = retained;
        if self.state.is_none() && !retained {
            self.owe(Clause::Answered, ledger, "its command is not answered");
        }
    }

    /// An acknowledgement.
    pub(super) fn ack(&mut self, sample: &Sample, retained: bool, ledger: &mut Ledger) {
        self.ack_there = true;
        self.correlate(retained, "an acknowledgement", ledger);
        let acknowledged = Sample::new(sample.value()["command"].clone());
        let is_now = self.command.as_ref() == Some(&acknowledged);
        self.acknowledged |= is_now || retained;
        if is_now {
            // Where a provider hears of the command as updated first, this is the answer.
            self.updates = 0;
            ledger.pay(&self.debt(Clause::UpdateAnswered));
        }
        if self.command.is_some() {
            let matches = is_now || self.before.contains(&acknowledged);
            self.judge_crossing(Clause::AckMatches, matches, ledger, || {
                format!("it acknowledges {}", acknowledged.value())
            });
        }
        self.last_ack = Some(acknowledged);
    }

    fn correlate(&self, retained: bool, what: &str, ledger: &mut Ledger) {
        if self.command.is_some() {
            ledger.held(Clause::Correlated);
        } else if !retained {
            self.owe(Clause::Correlated, ledger, &format!("{what} without a command"));
        }
    }

    /// A status.
    pub(super) fn status(&mut self, sample: &Sample, retained: bool, ledger: &mut Ledger) -> Option<Step> {
        let (to, reason) =
            (sample.text("commandStatus")?.to_owned(), sample.text("commandStatusReason")?.to_owned());
        // The same sample again, after a restart of who carries it, is no new status.
        if self.last_status.as_ref() == Some(sample) {
            (self.status_there, self.provider_gone) = (true, false);
            self.has_returned |= std::mem::take(&mut self.may_return);
            return None;
        }
        self.last_status = Some(sample.clone());
        (self.status_there, self.may_return, self.has_returned) = (true, false, false);
        self.correlate(retained, "a status", ledger);
        if std::mem::take(&mut self.provider_gone)
            && (to.as_str(), reason.as_str()) == ("ISSUED", "SUCCEEDED")
        {
            (self.state, self.acknowledged) = (None, false);
        }
        if !retained {
            self.transition(&to, &reason, ledger);
        }
        self.state = Some(to.clone());
        self.ended = is_terminal(&to).then_some(ledger.now());
        self.after(&to, &reason, retained, ledger);
        let (family, session, provider) = self.id.clone();
        Some(Step { family, provider, session, command: self.commanded().cloned(), to, reason, retained })
    }

    fn transition(&self, to: &str, reason: &str, ledger: &mut Ledger) {
        let from = self.state.as_deref();
        if from.is_none() {
            self.judge(Clause::FirstStatus, to == "ISSUED", ledger, || format!("its first status is {to}"));
        }
        let legal = is_legal(from, to);
        if from.is_some() {
            self.judge(Clause::Transition, legal, ledger, || {
                format!("from {} to {to}", from.unwrap_or_default())
            });
        }
        if legal {
            self.judge(Clause::Reason, is_reason(from, to, reason), ledger, || {
                format!("from {} to {to} for the reason {reason}", from.unwrap_or("the start"))
            });
        }
        if legal && from.is_some() && to == "ISSUED" {
            self.judge_crossing(Clause::UpdatedOnly, self.updates > 0, ledger, || {
                "back to ISSUED without an update".to_owned()
            });
        }
        if to == "COMMANDED" && legal && self.updates == 0 {
            self.judge_ack_first(ledger);
        }
        if to == "CANCELED" {
            if self.disposed {
                ledger.held(Clause::CancelAsked);
            } else {
                self.owe(Clause::CancelAsked, ledger, "CANCELED, but its command was not disposed");
            }
        }
    }

    /// What the new state pays, and what it brings about.
    fn after(&mut self, to: &str, reason: &str, retained: bool, ledger: &mut Ledger) {
        ledger.pay(&self.debt(Clause::Answered));
        // An update may have crossed the answer to the command before it, which is none to the update.
        if reason == "UPDATED" || is_terminal(to) {
            ledger.pay(&self.debt(Clause::UpdateAnswered));
            self.updates = if is_terminal(to) { 0 } else { self.updates.saturating_sub(1) };
        }
        if to == "EXECUTING" && self.has_execution_status && !retained {
            self.owe(Clause::ExecutionStatus, ledger, "no execution status while EXECUTING");
        }
        if !is_terminal(to) {
            return;
        }
        ledger.forgive(&self.debt(Clause::ExecutionStatus));
        if self.disposed {
            ledger.pay(&self.debt(Clause::CancelAnswered));
            self.owe(Clause::ProviderCleanUp, ledger, "what was said of it is not disposed");
        } else if to != "CANCELED" && self.command.is_some() {
            self.owe(
                Clause::ConsumerCleanUp,
                ledger,
                &format!("it is {to}, and its command is not disposed"),
            );
        }
    }

    /// An instance is disposed.
    pub(super) fn disposed(&mut self, role: Role, ledger: &mut Ledger) {
        if role == Role::Command {
            self.command_disposed(ledger);
            return;
        }
        self.no_longer_there(role);
        if role == Role::Status {
            self.may_return = false;
            // A provider that has started again clears up without a last word where the command is gone (4.1.2.1).
            if self.has_returned {
                ledger.forgive(&self.debt(Clause::CancelAnswered));
            }
        }
        if self.command.is_some() && !self.disposed {
            self.owe(Clause::CleanUpOrder, ledger, "what was said of it is disposed before its command");
        } else {
            ledger.held(Clause::CleanUpOrder);
        }
        if !self.status_there && !self.ack_there && !self.execution_status_there {
            ledger.pay(&self.debt(Clause::ProviderCleanUp));
        }
    }

    fn no_longer_there(&mut self, role: Role) {
        match role {
            Role::Command => {}
            Role::Status => self.status_there = false,
            Role::Ack => self.ack_there = false,
            Role::ExecutionStatus => self.execution_status_there = false,
        }
    }

    fn command_disposed(&mut self, ledger: &mut Ledger) {
        if self.disposed || self.command.is_none() {
            return;
        }
        self.disposed = true;
        for clause in [Clause::ConsumerCleanUp, Clause::CleanUpOrder, Clause::CancelAsked] {
            ledger.pay(&self.debt(clause));
        }
        for clause in [Clause::Answered, Clause::UpdateAnswered] {
            ledger.forgive(&self.debt(clause));
        }
        let there = self.status_there || self.ack_there || self.execution_status_there;
        if self.is_terminal() && there {
            self.owe(Clause::ProviderCleanUp, ledger, "what was said of it is not disposed");
        } else if self.state.is_some() && !self.is_terminal() && !self.provider_gone {
            self.owe(Clause::CancelAnswered, ledger, "it was cancelled, and has not ended");
        }
    }

    /// Who wrote an instance unregisters.
    pub(super) fn unregistered(&mut self, role: Role, ledger: &mut Ledger) {
        let state = self.state.clone().unwrap_or_default();
        match role {
            Role::Command => {
                let held = self.disposed || self.command.is_none();
                self.judge(Clause::ConsumerShutdown, held, ledger, || {
                    "unregistered with its command on the bus".to_owned()
                });
            }
            Role::Status => {
                let held = self.state.is_none() || self.is_terminal();
                self.judge(Clause::ProviderShutdown, held, ledger, || {
                    format!("unregistered when it was {state}")
                });
            }
            Role::Ack | Role::ExecutionStatus => {}
        }
        self.lost(role, ledger);
    }

    /// Contact with who wrote an instance is lost: it may come again.
    pub(super) fn vanished(&mut self, role: Role, ledger: &mut Ledger) {
        self.may_return |= role == Role::Status && self.status_there;
        self.lost(role, ledger);
    }

    /// Who wrote an instance is gone, and owes nothing any longer.
    fn lost(&mut self, role: Role, ledger: &mut Ledger) {
        let consumer = [Clause::ConsumerCleanUp];
        let provider = [
            Clause::Answered,
            Clause::UpdateAnswered,
            Clause::CancelAnswered,
            Clause::ProviderCleanUp,
            Clause::ExecutionStatus,
        ];
        let clauses = if role == Role::Command { &consumer[..] } else { &provider[..] };
        self.provider_gone |= role == Role::Status;
        self.no_longer_there(role);
        for clause in clauses {
            ledger.forgive(&self.debt(*clause));
        }
    }
}
