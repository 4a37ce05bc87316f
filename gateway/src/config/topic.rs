//! What topics promise to their readers, where it is not what the patterns of UMAA say.

use super::error::Fault;
use super::journal::Journal;
use super::schema;
use aldis_envelope::Prefix;
use aldis_services::dds::{Durability, Keep, Qos, TopicRule};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::num::NonZeroU32;

/// One `[[topic]]`, the first whose prefix fits counts. Writers and readers of a topic are to be told the same.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Topic {
    /// Which topics: the beginning of their names.
    #[schemars(with = "schema::Prefix")]
    pub(crate) prefix: Prefix,
    /// Whether what is lost is asked for again. Default: reliable.
    #[serde(default)]
    pub(crate) reliability: Reliability,
    /// For how long samples are kept. Default: transient-local. Without meaning where reliability is best-effort.
    #[serde(default)]
    pub(crate) durability: Kept,
    /// How many samples of each instance are kept. Default: what the pattern of UMAA says of the topic, all of other topics.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u32>", range(min = 1))]
    pub(crate) keep_last: Option<NonZeroU32>,
    /// How many samples of one source are kept at the most; beyond it the oldest go. Default: 200 000.
    #[serde(default = "samples_max")]
    #[schemars(with = "u32", range(min = 1))]
    pub(crate) samples_max: NonZeroU32,
}

/// Whether what is lost is asked for again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Reliability {
    /// Each sample arrives once and in order, or its loss is told.
    #[default]
    Reliable,
    /// What is lost is lost.
    BestEffort,
}

/// For how long samples are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Kept {
    /// Until all readers that are there have them.
    Volatile,
    /// For late joiners, as long as the node runs.
    #[default]
    TransientLocal,
    /// For late joiners, also after the program has ended and started again: needs a `[journal]`.
    Persistent,
}

fn samples_max() -> NonZeroU32 {
    NonZeroU32::new(200_000).unwrap_or(NonZeroU32::MIN)
}

impl Topic {
    /// The rule as the node reads it.
    pub(crate) fn rule(&self) -> TopicRule {
        let durability = match self.durability {
            Kept::Volatile => Durability::Volatile,
            Kept::TransientLocal => Durability::TransientLocal,
            Kept::Persistent => Durability::Persistent,
        };
        let keep = self.keep_last.map_or(Keep::ByPattern, |count| Keep::Last(count.get()));
        let qos = Qos { durability, keep, samples_max: self.samples_max.get() as usize };
        TopicRule {
            prefix: self.prefix.clone(),
            qos: (self.reliability == Reliability::Reliable).then_some(qos),
        }
    }
}

/// What topics promise and the rest of a configuration does not keep.
pub(super) fn check(topics: &[Topic], journal: Option<&Journal>) -> Vec<Fault> {
    let persistent = topics.iter().enumerate().filter(|(_, topic)| topic.durability == Kept::Persistent);
    let fault = |(index, topic): (usize, &Topic)| {
        let (message, help) = if topic.reliability == Reliability::BestEffort {
            ("of a best-effort topic nothing is kept", "leave `reliability` out, or `durability`")
        } else if journal.is_none() {
            (
                "a persistent topic without a journal",
                "add a table [journal] with path = \"journal\", or choose durability = \"transient-local\"",
            )
        } else {
            return None;
        };
        Some(Fault::new(format!("topic.{index}.durability"), message, help))
    };
    persistent.filter_map(fault).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Config;

    const TOP: &str = "name = \"a\"\nentities = [1]\n[[topic]]\n";

    #[test]
    fn a_topic_says_what_it_promises() {
        let rules =
            |text: &str| Config::parse("", &format!("{TOP}{text}")).map(|config| config.topics[0].rule());
        let kept = rules("prefix = \"UMAA::X\"\nkeep_last = 3\nsamples_max = 10").unwrap().qos.unwrap();
        assert_eq!((kept.keep, kept.samples_max), (aldis_services::dds::Keep::Last(3), 10));
        assert_eq!(rules("prefix = \"afrl\"\nreliability = \"best-effort\"").unwrap().qos, None);
        let kept = rules("prefix = \"afrl\"").unwrap().qos.unwrap();
        assert_eq!(kept.keep, aldis_services::dds::Keep::ByPattern);
        for wrong in ["prefix = \"a\"\nkeep_last = 0", "prefix = \"eid0\"", "durability = \"volatile\""] {
            assert!(rules(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn what_is_persistent_needs_a_journal_and_reliability() {
        let persistent = format!("{TOP}prefix = \"UMAA::X\"\ndurability = \"persistent\"\n");
        let error = Config::parse("a.toml", &persistent).unwrap_err();
        assert_eq!(
            (error.message(), error.position()),
            ("a persistent topic without a journal", Some((5, 14)))
        );
        assert!(error.cure().contains("[journal]"), "{}", error.cure());
        let with_journal = format!("{persistent}[journal]\npath = \"kept\"\n");
        let config = Config::parse("a.toml", &with_journal).unwrap();
        let qos = config.topics[0].rule().qos.unwrap();
        assert_eq!(qos.durability, aldis_services::dds::Durability::Persistent);
        let best_effort = with_journal.replace("[journal]", "reliability = \"best-effort\"\n[journal]");
        let error = Config::parse("a.toml", &best_effort).unwrap_err();
        assert_eq!(error.message(), "of a best-effort topic nothing is kept");
    }
}
