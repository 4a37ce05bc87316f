//! What a bridge to a domain is configured to do.

use crate::service::domain::{Durable, Quality};
use aldis_envelope::description::Library;
use aldis_envelope::{EntityId, Fleet};
use std::collections::BTreeSet;
use std::sync::Arc;

/// What a bridge to a domain is configured to do.
#[derive(Debug, Clone)]
pub struct DomainConfig {
    /// The fleet and the node's own entity: two gateways on one bus know each other by them.
    pub fleet: Fleet,
    /// The node's own entity.
    pub entity: EntityId,
    /// The partition; empty is the default one.
    pub partition: String,
    /// Which topics cross.
    pub allow: Vec<Pattern>,
    /// Which do not, though they are allowed.
    pub deny: Vec<Pattern>,
    /// What is said of the quality of service of topics; the first that matches counts.
    pub rules: Vec<QualityRule>,
    /// The types that are described.
    pub types: Arc<Library>,
    /// The names of types whose samples are messages of this project, member for member.
    pub exact: Arc<BTreeSet<String>>,
    /// How many changes may wait for slow readers; over half of it the node stops reading.
    pub queue_max: usize,
}

/// A pattern of topic names: `*` stands for any text, `?` for any character.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern(pub String);

impl Pattern {
    /// Whether a text is such.
    pub fn matches(&self, text: &str) -> bool {
        let (pattern, text): (Vec<char>, Vec<char>) = (self.0.chars().collect(), text.chars().collect());
        let (mut p, mut t) = (0, 0);
        // Where the last star stands, and how far it reaches.
        let mut star = None;
        while t < text.len() {
            match pattern.get(p) {
                Some('*') => {
                    star = Some((p, t));
                    p += 1;
                }
                Some(c) if *c == '?' || *c == text[t] => {
                    p += 1;
                    t += 1;
                }
                _ => {
                    let Some((at, reach)) = star else { return false };
                    star = Some((at, reach + 1));
                    p = at + 1;
                    t = reach + 1;
                }
            }
        }
        pattern[p..].iter().all(|c| *c == '*')
    }
}

/// What a configuration says of the quality of service of topics.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct QualityRule {
    /// Of which.
    pub topics: Pattern,
    /// RELIABLE, or BEST_EFFORT.
    pub reliable: Option<bool>,
    /// TRANSIENT_LOCAL, or VOLATILE.
    pub durable: Option<bool>,
    /// HISTORY of so many samples of an instance; 0 is all.
    pub keep_last: Option<u32>,
}

impl QualityRule {
    /// Changes what the patterns of UMAA say.
    pub(super) fn apply(&self, quality: &mut Quality) {
        quality.reliable = self.reliable.unwrap_or(quality.reliable);
        if let Some(durable) = self.durable {
            quality.durable = if durable { Durable::TransientLocal } else { Durable::Volatile };
        }
        if let Some(count) = self.keep_last {
            quality.keep_last = (count > 0).then_some(count);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_reach_as_far_as_they_must() {
        let matches = |pattern: &str, text| Pattern(pattern.into()).matches(text);
        assert!(matches("*", "") && matches("*", "anything") && matches("UMAA::*", "UMAA::SO::X"));
        assert!(
            matches("*Command", "UMAA::SO::XCommand") && !matches("*Command", "UMAA::SO::XCommandStatus")
        );
        assert!(matches("a*b*c", "aXbYbZc") && !matches("a*b*c", "acb") && matches("a?c", "abc"));
        assert!(!matches("", "a") && matches("", "") && !matches("a?", "a"));
    }
}
