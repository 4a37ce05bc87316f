//! The states of a command as data (ICD 4.1, figures 4 and 5): 24 legal transitions of 420 triples.

use aldis_envelope::umaa::{CommandState, CommandStatusReason};

use CommandState::{Canceled, Commanded, Completed, Executing, Failed, Issued};
use CommandStatusReason as Reason;

/// Figure 5 by rows: from, to, and the reasons that a status may give. What is not here must not be published.
const FIGURE_5: [(Option<CommandState>, CommandState, &[Reason]); 13] = [
    (None, Issued, &[Reason::Succeeded]),
    (Some(Issued), Issued, &[Reason::Updated]),
    (Some(Issued), Commanded, &[Reason::Succeeded]),
    (
        Some(Issued),
        Failed,
        &[
            Reason::ValidationFailed,
            Reason::ResourceFailed,
            Reason::Interrupted,
            Reason::Timeout,
            Reason::ServiceFailed,
        ],
    ),
    (Some(Issued), Canceled, &[Reason::Canceled]),
    (Some(Commanded), Issued, &[Reason::Updated]),
    (Some(Commanded), Executing, &[Reason::Succeeded]),
    (
        Some(Commanded),
        Failed,
        &[Reason::ResourceRejected, Reason::Interrupted, Reason::Timeout, Reason::ServiceFailed],
    ),
    (Some(Commanded), Canceled, &[Reason::Canceled]),
    (Some(Executing), Issued, &[Reason::Updated]),
    (Some(Executing), Completed, &[Reason::Succeeded]),
    (
        Some(Executing),
        Failed,
        &[
            Reason::ObjectiveFailed,
            Reason::ResourceFailed,
            Reason::Interrupted,
            Reason::Timeout,
            Reason::ServiceFailed,
        ],
    ),
    (Some(Executing), Canceled, &[Reason::Canceled]),
];

/// One change of a command's state as a status tells it. No state before it is the initial one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Transition {
    /// The state before.
    pub from: Option<CommandState>,
    /// The state that the status tells.
    pub to: CommandState,
    /// The reason that it tells.
    pub reason: Reason,
}

impl Transition {
    /// Whether figure 5 has it.
    pub fn is_legal(self) -> bool {
        FIGURE_5
            .iter()
            .any(|(from, to, reasons)| (*from, *to) == (self.from, self.to) && reasons.contains(&self.reason))
    }
}

/// The 24 legal transitions, in the order of figure 5.
pub fn transitions() -> impl Iterator<Item = Transition> {
    FIGURE_5
        .iter()
        .flat_map(|&(from, to, reasons)| reasons.iter().map(move |&reason| Transition { from, to, reason }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table as people read it. A change of behaviour shows here.
    const SNAPSHOT: &str = "\
(initial)  -> ISSUED     SUCCEEDED
ISSUED     -> ISSUED     UPDATED
ISSUED     -> COMMANDED  SUCCEEDED
ISSUED     -> FAILED     VALIDATION_FAILED
ISSUED     -> FAILED     RESOURCE_FAILED
ISSUED     -> FAILED     INTERRUPTED
ISSUED     -> FAILED     TIMEOUT
ISSUED     -> FAILED     SERVICE_FAILED
ISSUED     -> CANCELED   CANCELED
COMMANDED  -> ISSUED     UPDATED
COMMANDED  -> EXECUTING  SUCCEEDED
COMMANDED  -> FAILED     RESOURCE_REJECTED
COMMANDED  -> FAILED     INTERRUPTED
COMMANDED  -> FAILED     TIMEOUT
COMMANDED  -> FAILED     SERVICE_FAILED
COMMANDED  -> CANCELED   CANCELED
EXECUTING  -> ISSUED     UPDATED
EXECUTING  -> COMPLETED  SUCCEEDED
EXECUTING  -> FAILED     OBJECTIVE_FAILED
EXECUTING  -> FAILED     RESOURCE_FAILED
EXECUTING  -> FAILED     INTERRUPTED
EXECUTING  -> FAILED     TIMEOUT
EXECUTING  -> FAILED     SERVICE_FAILED
EXECUTING  -> CANCELED   CANCELED
";

    #[test]
    fn the_table_is_figure_5() {
        let line = |Transition { from, to, reason }| {
            let from = from.map_or("(initial)", CommandState::name);
            format!("{from:<10} -> {to:<10} {reason}\n")
        };
        assert_eq!(transitions().map(line).collect::<String>(), SNAPSHOT);
    }

    #[test]
    fn of_420_triples_24_are_legal() {
        let from = std::iter::once(None).chain(CommandState::ALL.iter().copied().map(Some));
        let triples = from.flat_map(|from| {
            let pairs = CommandState::ALL.iter().flat_map(|&to| Reason::ALL.iter().map(move |&r| (to, r)));
            pairs.map(move |(to, reason)| Transition { from, to, reason })
        });
        let (mut all, mut legal) = (0, 0);
        for triple in triples {
            let Transition { from, to, reason } = triple;
            let from = from.map_or("(initial)", CommandState::name);
            let line = format!("{from:<10} -> {to:<10} {reason}\n");
            assert_eq!(triple.is_legal(), SNAPSHOT.contains(&line), "{line}");
            all += 1;
            legal += usize::from(triple.is_legal());
        }
        assert_eq!((all, legal), (420, 24));
    }

    #[test]
    fn nothing_follows_a_terminal_state() {
        assert!(transitions().all(|transition| transition.from.is_none_or(|from| !from.is_terminal())));
    }
}
