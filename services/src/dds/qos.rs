//! Quality of service by topic: the pattern of data that a name belongs to, or what the configuration says.

use super::Pattern;
use aldis_envelope::{Address, Prefix};

/// How many samples of one stream are retained where nothing else is said: at 300 bytes each 60 MB.
const SAMPLES_MAX: usize = 200_000;

/// For how long a sample is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Durability {
    /// Until every reader that is there has it.
    Volatile,
    /// For late joiners, as long as the writer's node lives.
    TransientLocal,
    /// For late joiners, also after the process of the writer's node has ended and started again. It is on disk before anybody
    /// has it.
    Persistent,
}

/// How many samples of an instance are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Keep {
    /// The newest so many.
    Last(u32),
    /// All, within the limit.
    All,
    /// As the pattern of the topic's name says; all where it says nothing. A rule may say so, never a topic.
    ByPattern,
}

/// What a topic promises to its reliable readers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Qos {
    /// For how long.
    pub durability: Durability,
    /// How many an instance.
    pub keep: Keep,
    /// How many samples of one stream are kept at the most; beyond it the oldest go, and readers are told.
    pub samples_max: usize,
}

/// What a configuration says of topics.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicRule {
    /// Of which.
    pub prefix: Prefix,
    /// None: best effort, nothing is kept.
    pub qos: Option<Qos>,
}

/// The quality of service of every topic.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Topics {
    rules: Vec<TopicRule>,
}

impl Topics {
    /// Topics under some rules, the first that matches counts; then the patterns of UMAA.
    pub fn new(rules: Vec<TopicRule>) -> Self {
        Self { rules }
    }

    /// What an address promises; none is best effort. Ids and mailboxes are no topics.
    pub fn of(&self, address: &Address) -> Option<Qos> {
        let Address::Name(name) = address else { return None };
        match self.rules.iter().find(|rule| rule.prefix.matches(address)) {
            Some(rule) => rule.qos.map(|qos| match qos.keep {
                Keep::ByPattern => {
                    Qos { keep: by_pattern(name.as_str()).map_or(Keep::All, |p| p.keep), ..qos }
                }
                Keep::Last(_) | Keep::All => qos,
            }),
            None => by_pattern(name.as_str()),
        }
    }
}

/// What the pattern of a name asks for.
fn by_pattern(name: &str) -> Option<Qos> {
    if name.starts_with("dds::") {
        // Any other topic of a DDS domain: its own promises are kept there, on the way the newest of each instance is.
        return Some(Qos {
            durability: Durability::TransientLocal,
            keep: Keep::Last(1),
            samples_max: SAMPLES_MAX,
        });
    }
    let (durability, keep) = match Pattern::of(name)? {
        Pattern::Log => (Durability::Volatile, Keep::All),
        // No transition may be skipped.
        Pattern::Status => (Durability::TransientLocal, Keep::All),
        Pattern::Command | Pattern::Response | Pattern::Element | Pattern::State => {
            (Durability::TransientLocal, Keep::Last(1))
        }
    };
    Some(Qos { durability, keep, samples_max: SAMPLES_MAX })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(name: &str) -> Option<(Durability, Keep)> {
        Topics::default().of(&Address::new(name).unwrap()).map(|qos| (qos.durability, qos.keep))
    }

    #[test]
    fn names_tell_their_pattern() {
        let kept = |keep| Some((Durability::TransientLocal, keep));
        assert_eq!(of("UMAA::SO::HealthReport::HealthReport"), kept(Keep::Last(1)));
        assert_eq!(of("UMAA::SO::X::XCommand"), kept(Keep::Last(1)));
        assert_eq!(of("UMAA::SO::X::XCommandStatus"), kept(Keep::All));
        assert_eq!(of("UMAA::SO::X::XCommandStatusType"), kept(Keep::All));
        assert_eq!(of("UMAA::SO::LogReport::LogReport"), Some((Durability::Volatile, Keep::All)));
        assert_eq!(of("afrl.cmasi.AirVehicleState"), None);
        assert_eq!(of("eid400sid1"), None);
    }

    #[test]
    fn the_first_rule_that_matches_counts() {
        let qos = Qos { durability: Durability::TransientLocal, keep: Keep::Last(3), samples_max: 9 };
        let rule = |prefix: &str, qos| TopicRule { prefix: Prefix::new(prefix).unwrap(), qos };
        let topics = Topics::new(vec![rule("UMAA::SO::X", None), rule("UMAA", Some(qos))]);
        assert_eq!(topics.of(&Address::new("UMAA::SO::XCommand").unwrap()), None);
        assert_eq!(topics.of(&Address::new("UMAA::SO::YCommand").unwrap()), Some(qos));
        assert_eq!(topics.of(&Address::new("afrl").unwrap()), None);
    }

    #[test]
    fn a_rule_may_leave_how_many_are_kept_to_the_pattern() {
        let qos = Qos { durability: Durability::Persistent, keep: Keep::ByPattern, samples_max: 9 };
        let topics = Topics::new(vec![TopicRule { prefix: Prefix::all(), qos: Some(qos) }]);
        let kept = |name: &str| topics.of(&Address::new(name).unwrap()).map(|qos| (qos.durability, qos.keep));
        assert_eq!(kept("UMAA::SO::XReport"), Some((Durability::Persistent, Keep::Last(1))));
        assert_eq!(kept("UMAA::SO::XCommandStatus"), Some((Durability::Persistent, Keep::All)));
        assert_eq!(kept("afrl.cmasi.AirVehicleState"), Some((Durability::Persistent, Keep::All)));
    }
}
