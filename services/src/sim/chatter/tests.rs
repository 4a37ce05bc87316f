//! Seeds, and faults that must be found.

use super::{Chatter, Planted};
use crate::sim::{FaultOptions, Options, run};
use std::time::Duration;

/// The options of a seed, with shorter phases: many seeds are for `examples/chatter`.
fn short(seed: u64) -> Options {
    let (safety, liveness) = (Duration::from_secs(20), Duration::from_secs(40));
    Options { safety, liveness, ..if seed == 0 { Options::quiet() } else { Options::draw(seed) } }
}

#[test]
fn a_quiet_fleet_and_a_few_stormy_ones_do_nothing_wrong() {
    let mut lasted = Duration::ZERO;
    for seed in 0..6 {
        let report = run(&Chatter::default(), seed, short(seed)).unwrap();
        assert!(report.violations.is_empty(), "{report}\n{}", report.trace);
        assert!(report.events > 300, "{report}");
        lasted += report.lasted;
    }
    assert!(lasted > Duration::from_secs(300));
}

#[test]
fn the_same_seed_gives_the_same_trace() {
    let report = |seed| run(&Chatter::default(), seed, short(seed)).unwrap();
    let (first, again, other) = (report(5), report(5), report(6));
    assert_eq!(first, again);
    assert_ne!(first.hash, other.hash);
}

#[test]
fn what_is_wrong_on_purpose_is_found_and_told_with_its_trace() {
    for (planted, checker, words) in [
        (Planted::AnswersTwice, "calls", "two answers"),
        (Planted::SkipsTick, "streams", "no gap was told"),
        (Planted::ForgetsEnd, "calls", "is open since"),
    ] {
        let found = (0..30).find_map(|seed| {
            let report = run(&Chatter { planted: Some(planted) }, seed, short(seed)).unwrap();
            (!report.violations.is_empty()).then_some(report)
        });
        let report = found.unwrap_or_else(|| panic!("{planted:?} is not found"));
        let violation = &report.violations[0];
        assert_eq!(violation.checker, checker, "{violation}");
        assert!(violation.what.contains(words), "{violation}");
        assert!(report.trace.lines().count() > 100, "the end of the trace is told");
        let again = run(&Chatter { planted: Some(planted) }, report.seed, report.options).unwrap();
        assert_eq!(again, report, "and it is found again from its seed");
    }
}

#[test]
fn options_are_told_in_one_line() {
    let text = Options::draw(3).to_string();
    assert!(text.starts_with("nodes=") && !text.contains('\n'), "{text}");
    let all_on = (0..200).map(Options::draw).any(|options| {
        let FaultOptions { session_drops, partitions, crashes, stalls, .. } = options.faults;
        session_drops.and(partitions).and(crashes).and(stalls).is_some()
    });
    assert!(all_on, "some seed has all of them at once");
}
