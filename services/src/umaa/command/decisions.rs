//! What this project does where the ICD contradicts itself or says nothing: one function each, with its reason.
//!
//! | decision | clauses | what is done, and why |
//! | --- | --- | --- |
//! | [`is_update`] | 4.1.4.2 against 5.1 | a newer command of the same session is an update: 5.1 calls commands immutable, 4.1.4.2 says in detail how they change |
//! | [`is_same_session`] | 4.1 against 4.1.4.2 | a session belongs to its source: 4.1 asks for the session id alone, then one consumer could change another's command |
//! | [`answer_to_an_update_of_a_finished_command`] | 4.1.4.2 item 2 against figure 5 | nothing is published: figure 5 lets nothing follow a terminal state; the refusal is a log entry |
//! | [`way_of_a_failure`] | figure 5 | a reason that a row of figure 5 lacks becomes the nearest that it has, over COMMANDED where it must |
//! | [`failure_at_shutdown`] | 4.1.6.1 | SERVICE_FAILED: the clause names no reason, and the service is what ends |
//! | [`failure_at_preemption`] | 5.1.3, table 33 | INTERRUPTED: table 33 has it for higher priority, and a new holder is just that |
//! | [`is_cancel`] | 4.1.4.5 | only a dispose cancels: a writer that vanished is lost contact and may come back |
//! | [`is_orphan`] | 4.1.2.1 | what tells of a command that nobody knows is disposed once its consumer has told all, or after a bounded wait: a command that comes back must not be executed twice |

use super::executor::{Failure, FailureKind};
use aldis_envelope::umaa::{CommandHeader, CommandState, CommandStatusReason};
use aldis_envelope::{Change, DateTime, Monotonic};

/// Whether a command of a session that is known updates it: it is newer. The same or an older one is a duplicate.
pub fn is_update(known: DateTime, heard: DateTime) -> bool {
    heard > known
}

/// Whether two commands are of one session: one source and one session id.
pub fn is_same_session(known: &CommandHeader, heard: &CommandHeader) -> bool {
    (known.source, known.session_id) == (heard.source, heard.session_id)
}

/// What is published where a command is updated that is over already: nothing, or FAILED / SERVICE_FAILED for peers that
/// wait for an answer (`answer_finished_update`).
pub fn answer_to_an_update_of_a_finished_command(
    answer: bool,
) -> Option<(CommandState, CommandStatusReason)> {
    answer.then_some((CommandState::Failed, CommandStatusReason::ServiceFailed))
}

/// How a command in a state fails: whether it walks over COMMANDED, and the reason of FAILED.
///
/// RESOURCE_REJECTED exists from COMMANDED alone, so a provider that rejects at once walks there first. RESOURCE_FAILED does
/// not exist from COMMANDED: a resource that fails then does not take the command. A running command cannot be rejected or
/// invalid any more.
pub fn way_of_a_failure(from: CommandState, kind: FailureKind) -> (bool, CommandStatusReason) {
    use CommandStatusReason as Reason;
    use FailureKind as Kind;
    let walks = from == CommandState::Issued && kind == Kind::Rejected;
    let from = if walks { CommandState::Commanded } else { from };
    let reason = match (kind, from) {
        (Kind::Interrupted, _) => Reason::Interrupted,
        (Kind::TimedOut, _) => Reason::Timeout,
        (Kind::Service, _) => Reason::ServiceFailed,
        (_, CommandState::Commanded) => Reason::ResourceRejected,
        (Kind::Invalid, CommandState::Issued) => Reason::ValidationFailed,
        (Kind::Resource, _) | (Kind::Rejected, CommandState::Executing) => Reason::ResourceFailed,
        (Kind::Objective, CommandState::Executing) => Reason::ObjectiveFailed,
        _ => Reason::ServiceFailed,
    };
    (walks, reason)
}

/// How an unfinished command fails where its provider shuts down.
pub fn failure_at_shutdown() -> Failure {
    Failure::new(FailureKind::Service, "the service shuts down")
}

/// How a running command fails where its consumer has lost the resource to another.
pub fn failure_at_preemption(text: impl Into<String>) -> Failure {
    Failure::new(FailureKind::Interrupted, text)
}

/// Whether what happened to a command's instance cancels it.
pub fn is_cancel(change: Change) -> bool {
    change == Change::Dispose
}

/// Whether a status, acknowledgement or execution status whose command nobody knows is given up: at once where its consumer
/// is here and has told all that it retains, else at the end of a bounded wait. The consumer may be down or behind a silent
/// link; were its command to come back and find no status, it would be executed a second time.
pub fn is_orphan(consumer_has_told: bool, now: Monotonic, wait_ends: Monotonic) -> bool {
    consumer_has_told || now >= wait_ends
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::umaa::command::table::Transition;

    #[test]
    fn every_failure_from_every_open_state_is_a_legal_walk() {
        for from in [CommandState::Issued, CommandState::Commanded, CommandState::Executing] {
            for kind in FailureKind::ALL {
                let (walks, reason) = way_of_a_failure(from, kind);
                let last = if walks { CommandState::Commanded } else { from };
                let end = Transition { from: Some(last), to: CommandState::Failed, reason };
                assert!(end.is_legal(), "{from} {kind:?}: {end:?}");
                let step = Transition {
                    from: Some(from),
                    to: CommandState::Commanded,
                    reason: CommandStatusReason::Succeeded,
                };
                assert!(!walks || step.is_legal(), "{from} {kind:?}");
            }
        }
    }

    #[test]
    fn a_rejection_walks_over_commanded() {
        let rejected = (true, CommandStatusReason::ResourceRejected);
        assert_eq!(way_of_a_failure(CommandState::Issued, FailureKind::Rejected), rejected);
    }

    #[test]
    fn only_a_newer_command_is_an_update() {
        let at = |nanoseconds| DateTime::new(7, nanoseconds).unwrap();
        assert!(is_update(at(1), at(2)));
        assert!(!is_update(at(1), at(1)) && !is_update(at(2), at(1)));
    }
}
