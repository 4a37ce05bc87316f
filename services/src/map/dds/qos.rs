//! The quality of service of a bridge's own endpoints: by the pattern of a topic's name (umaa-so, Quality of service; dds, What
//! bites 6), and by what those have who are there.
//!
//! A writer of ours offers the strongest, so that every reader matches it. A reader of ours requests what the pattern needs, weakened
//! to what the writers offer that discovery has found: one that requested less at once would lose samples, or the history that
//! a late joiner is due, also where the writer keeps them (DDS 1.4, 2.2.3).

use super::rules::QualityRule;
use crate::dds::Pattern;
use crate::service::domain::{Durable, Quality, Xcdr};
use std::fmt;

/// How many samples of an instance a writer keeps where all are wanted: what kits of UMAA vendors take.
const KEPT_MAX: u32 = 500;

/// What the patterns of UMAA and a configuration say of a topic.
fn of_topic(topic: &str, rules: &[QualityRule], partition: &str) -> Quality {
    let pattern = Pattern::of(topic);
    let all = matches!(pattern, Some(Pattern::Status | Pattern::Log | Pattern::Element));
    let mut quality = Quality {
        reliable: true,
        durable: Durable::TransientLocal,
        keep_last: (!all).then_some(1),
        samples_max: None,
        exclusive: false,
        access: 1,
        ordered: true,
        coherent: false,
        by_source_time: true,
        deadline_ns: None,
        latency_budget_ns: 0,
        liveliness: 0,
        lease_ns: None,
        partitions: if partition.is_empty() { Vec::new() } else { vec![partition.to_owned()] },
        autodispose: false,
        xcdr: Vec::new(),
    };
    if let Some(rule) = rules.iter().find(|rule| rule.topics.matches(topic)) {
        rule.apply(&mut quality);
    }
    quality
}

/// Whether a configuration says how long samples of a topic last.
fn is_ruled(topic: &str, rules: &[QualityRule]) -> bool {
    rules.iter().find(|rule| rule.topics.matches(topic)).is_some_and(|rule| rule.durable.is_some())
}

/// What a reader of ours requests of a topic: no more than the writers offer. It hands on what comes, in its writers' order, and so asks
/// for none of it to be kept or put in order.
pub fn requested(topic: &str, rules: &[QualityRule], partition: &str, writers: &[&Quality]) -> Quality {
    let base = of_topic(topic, rules, partition);
    // Entries of a log that are past are nobody's news, though a writer may keep them.
    let is_log = Pattern::of(topic) == Some(Pattern::Log) && !is_ruled(topic, rules);
    let needed = if is_log { Durable::Volatile } else { base.durable };
    let durable = writers.iter().map(|offer| offer.durable).min().unwrap_or_default();
    Quality {
        reliable: base.reliable && writers.iter().all(|offer| offer.reliable),
        durable: durable.min(needed),
        access: 0,
        ordered: false,
        by_source_time: false,
        exclusive: writers.iter().any(|offer| offer.exclusive),
        latency_budget_ns: writers.iter().map(|offer| offer.latency_budget_ns).max().unwrap_or(0),
        keep_last: None,
        ..base
    }
}

/// What a writer of ours offers of a topic: the strongest, and what must be equal as those have it who hear it.
pub fn offered(
    topic: &str,
    rules: &[QualityRule],
    partition: &str,
    readers: &[&Quality],
    xcdr: Xcdr,
) -> Quality {
    let base = of_topic(topic, rules, partition);
    Quality {
        keep_last: Some(base.keep_last.unwrap_or(KEPT_MAX)),
        exclusive: readers.iter().any(|request| request.exclusive),
        deadline_ns: readers.iter().filter_map(|request| request.deadline_ns).min(),
        // What is written says that its writer lives; between, Cyclone DDS says so where it is automatic.
        lease_ns: readers.iter().filter_map(|request| request.lease_ns).min(),
        xcdr: vec![xcdr],
        ..base
    }
}

/// A value of one policy on both sides that keeps a writer and a reader from matching.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mismatch {
    /// The policy by its name in the standard.
    pub policy: &'static str,
    /// What the writer offers.
    pub offered: String,
    /// What the reader requests.
    pub requested: String,
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} is offered, {} requested", self.policy, self.offered, self.requested)
    }
}

/// Why a writer and a reader do not match; nothing where they do (DDS 1.4, 2.2.3, table of request and offer).
pub fn mismatches(offered: &Quality, requested: &Quality) -> Vec<Mismatch> {
    let within = |offered: Option<u64>, requested: Option<u64>| {
        offered.unwrap_or(u64::MAX) <= requested.unwrap_or(u64::MAX)
    };
    let duration =
        |time: Option<u64>| time.map_or_else(|| "infinite".to_owned(), |time| format!("{time} ns"));
    type Words = fn(&Quality) -> String;
    let same: [(&str, bool, Words); 8] = [
        ("RELIABILITY", offered.reliable >= requested.reliable, |q| reliability(q).to_owned()),
        ("DURABILITY", offered.durable >= requested.durable, |q| durability(q).to_owned()),
        ("OWNERSHIP", offered.exclusive == requested.exclusive, |q| ownership(q).to_owned()),
        ("PRESENTATION access_scope", offered.access >= requested.access, |q| access(q).to_owned()),
        ("PRESENTATION ordered_access", offered.ordered >= requested.ordered, |q| q.ordered.to_string()),
        ("PRESENTATION coherent_access", offered.coherent >= requested.coherent, |q| q.coherent.to_string()),
        ("DESTINATION_ORDER", offered.by_source_time >= requested.by_source_time, |q| order(q).to_owned()),
        ("LIVELINESS kind", offered.liveliness >= requested.liveliness, |q| liveliness(q).to_owned()),
    ];
    let found = same.into_iter().filter(|(_, matches, _)| !matches);
    let mut found: Vec<_> = found
        .map(|(policy, _, words)| Mismatch { policy, offered: words(offered), requested: words(requested) })
        .collect();
    let times = [
        ("DEADLINE", offered.deadline_ns, requested.deadline_ns),
        // A budget of zero is the least that a reader can ask for.
        ("LATENCY_BUDGET", Some(offered.latency_budget_ns), Some(requested.latency_budget_ns)),
        ("LIVELINESS lease_duration", offered.lease_ns, requested.lease_ns),
    ];
    for (policy, offered, requested) in times {
        if !within(offered, requested) {
            found.push(Mismatch { policy, offered: duration(offered), requested: duration(requested) });
        }
    }
    let in_common =
        requested.xcdr.is_empty() || offered.xcdr.first().is_none_or(|first| requested.xcdr.contains(first));
    if !in_common {
        let policy = "DATA_REPRESENTATION";
        found.push(Mismatch {
            policy,
            offered: representations(offered),
            requested: representations(requested),
        });
    }
    found
}

fn reliability(quality: &Quality) -> &'static str {
    if quality.reliable { "RELIABLE" } else { "BEST_EFFORT" }
}

fn durability(quality: &Quality) -> &'static str {
    match quality.durable {
        Durable::Volatile => "VOLATILE",
        Durable::TransientLocal => "TRANSIENT_LOCAL",
        Durable::Transient => "TRANSIENT",
        Durable::Persistent => "PERSISTENT",
    }
}

fn ownership(quality: &Quality) -> &'static str {
    if quality.exclusive { "EXCLUSIVE" } else { "SHARED" }
}

fn access(quality: &Quality) -> &'static str {
    ["INSTANCE", "TOPIC", "GROUP"][usize::from(quality.access.min(2))]
}

fn order(quality: &Quality) -> &'static str {
    if quality.by_source_time { "BY_SOURCE_TIMESTAMP" } else { "BY_RECEPTION_TIMESTAMP" }
}

fn liveliness(quality: &Quality) -> &'static str {
    ["AUTOMATIC", "MANUAL_BY_PARTICIPANT", "MANUAL_BY_TOPIC"][usize::from(quality.liveliness.min(2))]
}

fn representations(quality: &Quality) -> String {
    let version = |xcdr: &Xcdr| if *xcdr == Xcdr::V1 { "XCDR1" } else { "XCDR2" };
    quality.xcdr.iter().map(version).collect::<Vec<_>>().join("+")
}

/// In words, as DDS names it; what is as DDS has it by default is left out.
pub fn in_words(quality: &Quality) -> String {
    let kept = quality.keep_last.map_or_else(|| "KEEP_ALL".to_owned(), |count| format!("KEEP_LAST {count}"));
    let mut words = vec![reliability(quality).to_owned(), durability(quality).to_owned(), kept];
    if quality.exclusive {
        words.push(ownership(quality).into());
    }
    if quality.access > 0 {
        let ordered = if quality.ordered { " ordered" } else { "" };
        let coherent = if quality.coherent { " coherent" } else { "" };
        words.push(format!("{}{ordered}{coherent}", access(quality)));
    }
    if quality.by_source_time {
        words.push(order(quality).into());
    }
    words.extend(quality.deadline_ns.map(|deadline| format!("DEADLINE {} ms", deadline as f64 / 1e6)));
    if let Some(lease) = quality.lease_ns {
        words.push(format!("LIVELINESS {} {} ms", liveliness(quality), lease as f64 / 1e6));
    }
    if !quality.xcdr.is_empty() {
        words.push(representations(quality));
    }
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOPICS: [&str; 8] = [
        "UMAA::SO::X::XCommand",
        "UMAA::SO::X::XCommandStatusType",
        "UMAA::SO::X::XCommandAckReport",
        "UMAA::SO::X::XExecutionStatusReport",
        "UMAA::SO::LogReport::LogReport",
        "UMAA::SA::X::XReportTypeTracksSetElement",
        "UMAA::SO::HealthReport::HealthReport",
        "any",
    ];

    #[test]
    fn what_we_offer_matches_what_vendors_request_and_what_we_request_what_they_offer() {
        for topic in TOPICS {
            let own = offered(topic, &[], "", &[], Xcdr::V2);
            let durable = Durable::TransientLocal;
            let strict = Quality { durable, deadline_ns: Some(9), lease_ns: Some(5), ..own.clone() };
            let own = offered(topic, &[], "", &[&strict], Xcdr::V2);
            assert_eq!(mismatches(&own, &strict), [], "{topic}");
            let weak = Quality {
                reliable: false,
                durable: Durable::Volatile,
                exclusive: true,
                access: 0,
                ordered: false,
                by_source_time: false,
                latency_budget_ns: 7,
                deadline_ns: None,
                ..own
            };
            assert_eq!(mismatches(&weak, &requested(topic, &[], "", &[&weak])), [], "{topic}");
        }
        let asked = |topic| requested(topic, &[], "", &[&offered(topic, &[], "", &[], Xcdr::V2)]).durable;
        assert_eq!((asked(TOPICS[4]), asked(TOPICS[0])), (Durable::Volatile, Durable::TransientLocal));
        assert_eq!(offered(TOPICS[1], &[], "", &[], Xcdr::V2).keep_last, Some(500));
        assert_eq!(offered(TOPICS[0], &[], "", &[], Xcdr::V2).keep_last, Some(1));
        let rule = QualityRule {
            topics: "*Health*".parse().unwrap(),
            reliable: Some(false),
            durable: Some(false),
            keep_last: Some(0),
        };
        let telemetry = offered(TOPICS[6], &[rule], "p", &[], Xcdr::V1);
        assert_eq!(
            in_words(&telemetry),
            "BEST_EFFORT VOLATILE KEEP_LAST 500 TOPIC ordered BY_SOURCE_TIMESTAMP XCDR1"
        );
        assert_eq!(telemetry.partitions, ["p"]);
    }

    #[test]
    fn a_mismatch_names_both_sides() {
        let strong = offered("any", &[], "", &[], Xcdr::V2);
        let writer = Quality {
            reliable: false,
            durable: Durable::Volatile,
            exclusive: true,
            deadline_ns: Some(2),
            ..strong.clone()
        };
        let reader = Quality {
            durable: Durable::Persistent,
            deadline_ns: Some(1),
            lease_ns: Some(5),
            xcdr: vec![Xcdr::V1],
            ..strong
        };
        let told: Vec<_> = mismatches(&writer, &reader).iter().map(Mismatch::to_string).collect();
        assert_eq!(
            told,
            [
                "RELIABILITY: BEST_EFFORT is offered, RELIABLE requested",
                "DURABILITY: VOLATILE is offered, PERSISTENT requested",
                "OWNERSHIP: EXCLUSIVE is offered, SHARED requested",
                "DEADLINE: 2 ns is offered, 1 ns requested",
                "LIVELINESS lease_duration: infinite is offered, 5 ns requested",
                "DATA_REPRESENTATION: XCDR2 is offered, XCDR1 requested",
            ]
        );
    }
}
