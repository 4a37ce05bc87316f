//! A few seeds, bugs and breaches that must be found, and tables that must be alike. Many seeds are for `aldis sim umaa`.

use super::*;
use crate::conform::transition::is_reason;
use crate::umaa::command::table::Transition;
use aldis_envelope::umaa::{CommandState, CommandStatusReason};

fn run(seed: u64, planted: Option<Planted>) -> Campaign {
    let mut campaign = Campaign::default();
    campaign.run(seed, planted, false).unwrap();
    campaign
}

#[test]
fn a_quiet_fleet_and_a_stormy_one_do_nothing_wrong() {
    let mut campaign = run(0, None);
    campaign.run(7, None, false).unwrap();
    let wrong = campaign.wrong.iter().map(|report| format!("{report}\n{}", report.trace));
    assert_eq!(wrong.collect::<String>(), "");
    let seen: Vec<_> =
        campaign.tally.sights().filter(|(_, count)| *count > 0).map(|(sight, _)| sight).collect();
    for sight in ["update", "cancel_won", "take_over", "expiry", "renewal", "nested_provider"] {
        assert!(seen.contains(&sight), "{sight} is not in {seen:?}");
    }
    assert_eq!(campaign.conform.broken().count(), 0);
    assert!(campaign.conform.count(crate::conform::Verdict::Held) > 25, "{}", campaign.conform);
}

#[test]
fn what_is_no_transition_is_rejected_from_outside() {
    let count = reject_all_illegal();
    assert_eq!(count, IllegalCount { illegal: 396, rejected: 396, legal: 24, accepted: 24 });
}

/// The monitor's table is typed in from the ICD anew and shares nothing with that of the machines.
#[test]
fn the_monitor_and_the_machines_have_the_same_transitions() {
    let from = std::iter::once(None).chain(CommandState::ALL.iter().copied().map(Some));
    let triples = from.flat_map(|from| {
        let pairs =
            CommandState::ALL.iter().flat_map(|&to| CommandStatusReason::ALL.iter().map(move |&r| (to, r)));
        pairs.map(move |(to, reason)| Transition { from, to, reason })
    });
    let mut count = 0;
    for transition in triples {
        let Transition { from, to, reason } = transition;
        let by_monitor = is_reason(from.map(CommandState::name), to.name(), reason.name());
        assert_eq!(transition.is_legal(), by_monitor, "{transition:?}");
        count += 1;
    }
    assert_eq!(count, 420);
}

#[test]
fn planted_breaches_are_found_and_nothing_else() {
    for violation in violations() {
        let finding = violation.find(1).unwrap();
        assert!(finding.is_exact(violation), "{violation:?}: {finding:?}");
    }
}
