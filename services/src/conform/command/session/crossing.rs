//! Commands that are heard later than the answers to them: what one writer says is in order, what two say is not.

use super::Session;
use crate::conform::Clause;
use crate::conform::ledger::Ledger;
use crate::conform::sample::Sample;

impl Session {
    /// Whether somebody answers this command at all: where it has been told that nobody does, updates are not told too.
    pub(super) fn may_be_answered(&self, ledger: &Ledger) -> bool {
        self.state.is_some() || self.was_there || ledger.is_owed(&self.debt(Clause::Answered))
    }

    /// An execution status.
    pub(in crate::conform::command) fn execution_status(
        &mut self,
        sample: &Sample,
        retained: bool,
        ledger: &mut Ledger,
    ) {
        self.execution_status_there = true;
        // The same sample again, after a restart of who carries it, says nothing of now.
        if self.last_execution_status.replace(sample.clone()).as_ref() == Some(sample) {
            return;
        }
        self.correlate(retained, "an execution status", ledger);
        if retained {
            return;
        }
        let executing = self.state.as_deref() == Some("EXECUTING") || self.updates > 0;
        let state = self.state.clone().unwrap_or_else(|| "not answered".to_owned());
        if executing {
            ledger.pay(&self.debt(Clause::ExecutionStatus));
        }
        self.judge(Clause::ExecutionStatus, executing, ledger, || {
            format!("an execution status while {state}")
        });
    }

    /// The command that a status is about: an update that its provider has not acknowledged is on its way to it.
    pub(super) fn commanded(&self) -> Option<&Sample> {
        let acknowledged = self.last_ack.as_ref().filter(|ack| self.before.contains(ack));
        acknowledged.or(self.command.as_ref())
    }

    /// Judges what a command that the consumer has written already may excuse as soon as it comes.
    pub(super) fn judge_crossing(
        &self,
        clause: Clause,
        held: bool,
        ledger: &mut Ledger,
        text: impl FnOnce() -> String,
    ) {
        if held || ledger.bounds.slack.is_zero() {
            self.judge(clause, held, ledger, text);
        } else {
            self.owe(clause, ledger, &text());
        }
    }

    /// The command has come that was acknowledged before.
    pub(super) fn comes_after_its_ack(&mut self, sample: &Sample, ledger: &mut Ledger) {
        self.acknowledged = self.last_ack.as_ref() == Some(sample);
        if self.acknowledged {
            ledger.pay(&self.debt(Clause::AckFirst));
            ledger.pay(&self.debt(Clause::AckMatches));
        }
    }

    /// COMMANDED comes after the acknowledgement of what is commanded.
    pub(super) fn judge_ack_first(&self, ledger: &mut Ledger) {
        let text = || "COMMANDED before it is acknowledged".to_owned();
        if self.acknowledges_what_is_to_come() {
            self.judge_crossing(Clause::AckFirst, self.acknowledged, ledger, text);
        } else {
            self.judge(Clause::AckFirst, self.acknowledged, ledger, text);
        }
    }

    /// Whether the last acknowledgement is of a command that has not come.
    fn acknowledges_what_is_to_come(&self) -> bool {
        let known = |ack: &Sample| self.command.as_ref() == Some(ack) || self.before.contains(ack);
        self.last_ack.as_ref().is_some_and(|ack| !known(ack))
    }
}
