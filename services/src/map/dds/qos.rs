//! The quality of service that a topic is written and read with: by the pattern of its name (umaa-so, Quality of service).
//!
//! A writer of ours offers the strongest, so that every reader matches it. A reader of ours requests what the pattern needs, weakened
//! to what the writers offer that discovery has found: one that requested less at once would lose samples, or the history that
//! a late joiner is due, also where the writer keeps them (DDS 1.4, 2.2.3).

use crate::dds::Pattern;
use std::fmt;

/// Whether samples may be lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs, reason = "the names are the standard's")]
pub enum Reliability {
    BestEffort,
    Reliable,
}

/// What late joiners get.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs, reason = "the names are the standard's")]
pub enum Durability {
    Volatile,
    TransientLocal,
    Transient,
    Persistent,
}

/// How many samples of an instance are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum History {
    /// The newest so many.
    KeepLast(u32),
    /// All, within the limits of resources: so many samples of an instance.
    KeepAll(u32),
}

/// Who may write an instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are the standard's")]
pub enum Ownership {
    Shared,
    Exclusive,
}

/// How far order and coherence reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs, reason = "the names are the standard's")]
pub enum AccessScope {
    Instance,
    Topic,
    Group,
}

/// The quality of service of an endpoint, as far as it decides whether two match, and what is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Qos {
    /// Whether samples may be lost.
    pub reliability: Reliability,
    /// What late joiners get.
    pub durability: Durability,
    /// What is kept.
    pub history: History,
    /// Who may write an instance.
    pub ownership: Ownership,
    /// How far order reaches.
    pub access_scope: AccessScope,
    /// Whether samples come in the order of their writing within that scope.
    pub ordered_access: bool,
    /// Whether several samples may belong together.
    pub coherent_access: bool,
    /// The longest time between two samples of an instance, in nanoseconds; none: no bound.
    pub deadline: Option<u64>,
    /// The longest time that a delivery should take, in nanoseconds.
    pub latency_budget: u64,
    /// How often a writer says that it lives, in nanoseconds; none: never.
    pub liveliness_lease: Option<u64>,
    /// 0 automatic, 1 by participant, 2 by topic.
    pub liveliness_kind: u8,
    /// 0 by reception, 1 by source.
    pub destination_order: u8,
}

impl Default for Qos {
    /// The standard's defaults of a reader.
    fn default() -> Self {
        Self {
            reliability: Reliability::BestEffort,
            durability: Durability::Volatile,
            history: History::KeepLast(1),
            ownership: Ownership::Shared,
            access_scope: AccessScope::Instance,
            ordered_access: false,
            coherent_access: false,
            deadline: None,
            latency_budget: 0,
            liveliness_lease: None,
            liveliness_kind: 0,
            destination_order: 0,
        }
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

/// How many samples of an instance are kept where all are: vendors' kits use 500.
const SAMPLES_MAX: u32 = 500;

/// What a reader of ours requests for a topic, before it is [weakened](Qos::weakened_to) to what writers offer. `telemetry` where
/// the configuration calls it a periodic report of high rate.
pub fn requested(topic: &str, telemetry: bool) -> Qos {
    let pattern = Pattern::of(topic);
    let history = match pattern {
        _ if telemetry => History::KeepLast(1),
        Some(Pattern::Command | Pattern::State) => History::KeepLast(1),
        // What is taken late must not have swallowed a transition, an entry or an element.
        _ => History::KeepAll(SAMPLES_MAX),
    };
    let kept = !telemetry && !matches!(pattern, None | Some(Pattern::Log));
    let durability = if kept { Durability::TransientLocal } else { Durability::Volatile };
    let reliability = if telemetry { Reliability::BestEffort } else { Reliability::Reliable };
    // An ordered topic whose reader does not ask for order would have its updates torn apart.
    let ordered_access = pattern == Some(Pattern::Element);
    let access_scope = if ordered_access { AccessScope::Topic } else { AccessScope::Instance };
    Qos { reliability, durability, history, access_scope, ordered_access, ..Qos::default() }
}

impl Qos {
    /// The same request with nothing in it that a writer does not offer, so that the two match.
    pub fn weakened_to(self, offered: &Self) -> Self {
        Self {
            reliability: self.reliability.min(offered.reliability),
            durability: self.durability.min(offered.durability),
            access_scope: self.access_scope.min(offered.access_scope),
            ordered_access: self.ordered_access && offered.ordered_access,
            coherent_access: self.coherent_access && offered.coherent_access,
            ownership: offered.ownership,
            liveliness_kind: self.liveliness_kind.min(offered.liveliness_kind),
            destination_order: self.destination_order.min(offered.destination_order),
            deadline: self.deadline.and_then(|own| Some(own.max(offered.deadline?))),
            liveliness_lease: self.liveliness_lease.and_then(|own| Some(own.max(offered.liveliness_lease?))),
            latency_budget: self.latency_budget.max(offered.latency_budget),
            history: self.history,
        }
    }
}

/// What a writer of ours offers for a topic.
pub fn offered(topic: &str, telemetry: bool) -> Qos {
    let pattern = Pattern::of(topic);
    let history = match pattern {
        _ if telemetry => History::KeepLast(1),
        Some(Pattern::Command | Pattern::Response | Pattern::State) => History::KeepLast(1),
        _ => History::KeepAll(SAMPLES_MAX),
    };
    let durability = if telemetry { Durability::Volatile } else { Durability::TransientLocal };
    let reliability = if telemetry { Reliability::BestEffort } else { Reliability::Reliable };
    Qos {
        reliability,
        durability,
        history,
        access_scope: AccessScope::Topic,
        ordered_access: true,
        destination_order: 1,
        ..Qos::default()
    }
}

/// Why a writer and a reader do not match; nothing where they do (DDS 1.4, 2.2.3, table of request and offer).
pub fn mismatches(offered: &Qos, requested: &Qos) -> Vec<Mismatch> {
    let mut found = Vec::new();
    let mut check = |policy, matches: bool, offered: &dyn fmt::Debug, requested: &dyn fmt::Debug| {
        if !matches {
            let (offered, requested) = (format!("{offered:?}"), format!("{requested:?}"));
            found.push(Mismatch { policy, offered, requested });
        }
    };
    macro_rules! at_least {
        ($policy:literal, $member:ident) => {
            check($policy, offered.$member >= requested.$member, &offered.$member, &requested.$member)
        };
    }
    at_least!("RELIABILITY", reliability);
    at_least!("DURABILITY", durability);
    at_least!("PRESENTATION access_scope", access_scope);
    at_least!("PRESENTATION ordered_access", ordered_access);
    at_least!("PRESENTATION coherent_access", coherent_access);
    at_least!("LIVELINESS kind", liveliness_kind);
    at_least!("DESTINATION_ORDER", destination_order);
    let same = offered.ownership == requested.ownership;
    check("OWNERSHIP", same, &offered.ownership, &requested.ownership);
    let within = |offered: Option<u64>, requested: Option<u64>| {
        requested.is_none_or(|requested| offered.is_some_and(|offered| offered <= requested))
    };
    check("DEADLINE", within(offered.deadline, requested.deadline), &offered.deadline, &requested.deadline);
    let lease = within(offered.liveliness_lease, requested.liveliness_lease);
    check("LIVELINESS lease_duration", lease, &offered.liveliness_lease, &requested.liveliness_lease);
    // A budget of zero is the least that a reader can ask for.
    let budget = offered.latency_budget <= requested.latency_budget;
    check("LATENCY_BUDGET", budget, &offered.latency_budget, &requested.latency_budget);
    found
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
    fn what_we_offer_matches_what_we_request_and_what_vendors_do() {
        for topic in TOPICS {
            assert_eq!(mismatches(&offered(topic, false), &requested(topic, false)), [], "{topic}");
            let strict = Qos {
                reliability: Reliability::Reliable,
                durability: Durability::TransientLocal,
                access_scope: AccessScope::Topic,
                ordered_access: true,
                ..Qos::default()
            };
            assert_eq!(mismatches(&offered(topic, false), &strict), [], "{topic}");
            let theirs = Qos {
                ownership: Ownership::Exclusive,
                latency_budget: 7,
                deadline: Some(9),
                ..Qos::default()
            };
            let request = Qos { deadline: Some(3), liveliness_lease: Some(1), ..requested(topic, false) };
            assert_eq!(mismatches(&theirs, &request.weakened_to(&theirs)), [], "{topic}");
        }
        let status = requested(TOPICS[1], false);
        assert_eq!(status.history, History::KeepAll(500));
        assert_eq!(offered(TOPICS[0], false).history, History::KeepLast(1));
        assert_eq!(offered(TOPICS[6], true).reliability, Reliability::BestEffort);
    }

    #[test]
    fn a_mismatch_names_both_sides() {
        let writer = Qos { deadline: Some(2), ownership: Ownership::Exclusive, ..Qos::default() };
        let reader = Qos {
            reliability: Reliability::Reliable,
            durability: Durability::Persistent,
            deadline: Some(1),
            liveliness_lease: Some(5),
            latency_budget: 0,
            ..Qos::default()
        };
        let told: Vec<_> = mismatches(&writer, &reader).iter().map(Mismatch::to_string).collect();
        assert_eq!(
            told,
            [
                "RELIABILITY: BestEffort is offered, Reliable requested",
                "DURABILITY: Volatile is offered, Persistent requested",
                "OWNERSHIP: Exclusive is offered, Shared requested",
                "DEADLINE: Some(2) is offered, Some(1) requested",
                "LIVELINESS lease_duration: None is offered, Some(5) requested",
            ]
        );
    }
}
