//! Figures 4 and 5 of the ICD, typed in from there.

/// A start, an end, and the reasons that lead from one to the other. The start of a command is no state.
type Row = (Option<&'static str>, &'static str, &'static [&'static str]);

const ROWS: [Row; 11] = [
    (None, "ISSUED", &["SUCCEEDED"]),
    (Some("ISSUED"), "ISSUED", &["UPDATED"]),
    (Some("ISSUED"), "COMMANDED", &["SUCCEEDED"]),
    (
        Some("ISSUED"),
        "FAILED",
        &["VALIDATION_FAILED", "RESOURCE_FAILED", "INTERRUPTED", "TIMEOUT", "SERVICE_FAILED"],
    ),
    (Some("COMMANDED"), "ISSUED", &["UPDATED"]),
    (Some("COMMANDED"), "EXECUTING", &["SUCCEEDED"]),
    (Some("COMMANDED"), "FAILED", &["RESOURCE_REJECTED", "INTERRUPTED", "TIMEOUT", "SERVICE_FAILED"]),
    (Some("EXECUTING"), "ISSUED", &["UPDATED"]),
    (Some("EXECUTING"), "COMPLETED", &["SUCCEEDED"]),
    (
        Some("EXECUTING"),
        "FAILED",
        &["OBJECTIVE_FAILED", "RESOURCE_FAILED", "INTERRUPTED", "TIMEOUT", "SERVICE_FAILED"],
    ),
    // From every state that is not terminal.
    (Some("ISSUED COMMANDED EXECUTING"), "CANCELED", &["CANCELED"]),
];

/// Whether figure 4 leads from one state to the other.
pub(super) fn is_legal(from: Option<&str>, to: &str) -> bool {
    reasons(from, to).is_some()
}

/// Whether figure 5 has that reason for the transition.
pub(crate) fn is_reason(from: Option<&str>, to: &str, reason: &str) -> bool {
    reasons(from, to).is_some_and(|reasons| reasons.contains(&reason))
}

fn reasons(from: Option<&str>, to: &str) -> Option<&'static [&'static str]> {
    let starts = |start: Option<&str>| match (start, from) {
        (None, None) => true,
        (Some(start), Some(from)) => start.split(' ').any(|state| state == from),
        _ => false,
    };
    ROWS.iter().find(|(start, end, _)| starts(*start) && *end == to).map(|(_, _, reasons)| *reasons)
}

/// Whether a command in this state is over.
pub(super) fn is_terminal(state: &str) -> bool {
    matches!(state, "COMPLETED" | "FAILED" | "CANCELED")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twenty_four_of_all_triples_are_legal() {
        let states = ["ISSUED", "COMMANDED", "EXECUTING", "COMPLETED", "FAILED", "CANCELED"];
        let reasons = [
            "SUCCEEDED",
            "UPDATED",
            "CANCELED",
            "VALIDATION_FAILED",
            "OBJECTIVE_FAILED",
            "RESOURCE_FAILED",
            "RESOURCE_REJECTED",
            "SERVICE_FAILED",
            "INTERRUPTED",
            "TIMEOUT",
        ];
        let starts = std::iter::once(None).chain(states.map(Some));
        let triples = starts.flat_map(|from| states.map(|to| reasons.map(|reason| (from, to, reason))));
        let all: Vec<_> = triples.flatten().collect();
        let legal = all.iter().filter(|(from, to, reason)| is_reason(*from, to, reason));
        assert_eq!((all.len(), legal.count()), (420, 24));
        assert!(states.iter().all(|to| !is_legal(Some("FAILED"), to)));
    }
}
