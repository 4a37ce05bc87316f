//! Versions 5.2.1 and 6.0 of Support Operations, each in the words of the other (umaa-so, Version 6.0).
//!
//! Members are matched by their names. What differs beyond that has a room of its own: health, whose code became a part of the key,
//! and the configuration's resources, which became a large set. What cannot be said in the other version is told, once for each
//! kind and topic.

mod convert;
mod health;
mod resources;
#[cfg(test)]
mod tests;

use aldis_envelope::codec::cdr::Value;
use aldis_envelope::description::{DescriptionError, Library};
use aldis_envelope::umaa::{self, v5_2_1, v6_0};
use aldis_envelope::{Change, Guid};
use std::collections::{BTreeMap, BTreeSet};

/// How many parents of identifiers are remembered, and how many instances of health.
const REMEMBERED_MAX: usize = 65_536;

/// A sample or the end of an instance, as a value of its topic's type. An end has its key members alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// The topic's name.
    pub topic: String,
    /// What it does to its instance.
    pub change: Change,
    /// What it holds.
    pub value: Value,
}

/// What cannot be said in the other version.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum Lost {
    /// The topic is none of Support Operations in its version.
    #[error("{0} is no topic of Support Operations that has an equivalent")]
    Topic(String),
    /// The parents of identifiers have no place in 5.2.1. They are remembered and put back where the identifier returns.
    #[error("{topic}: the parents of identifiers are not carried")]
    Parents {
        /// The topic.
        topic: String,
    },
    /// A sequence is longer than the other version allows.
    #[error("{topic}: {member} has {length} elements, {bound} fit: the sample is not carried")]
    TooLong {
        /// The topic.
        topic: String,
        /// The member.
        member: String,
        /// How many there are.
        length: usize,
        /// How many fit.
        bound: u32,
    },
    /// A member that must be there has no equivalent.
    #[error("{topic}: {member} is due and has no equivalent: the sample is not carried")]
    Member {
        /// The topic.
        topic: String,
        /// The member.
        member: String,
    },
    /// A sample has members that its type here does not have.
    #[error("{topic}: members that its type does not have here are not carried")]
    Members {
        /// The topic.
        topic: String,
    },
    /// One code of a resource's health ended while others are left, which in 5.2.1 are one instance.
    #[error("{topic}: the health of one code ended, others of the same resource are left")]
    OneOfSeveralCodes {
        /// The topic.
        topic: String,
    },
    /// Health ended of which no code is known.
    #[error("{topic}: health ended of which no code was told")]
    UnknownCode {
        /// The topic.
        topic: String,
    },
}

/// What a sample becomes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outcome {
    /// The samples of the other version, in the order in which they are written.
    pub samples: Vec<Sample>,
    /// What was lost, of what was not told before.
    pub lost: Vec<Lost>,
}

/// Translates between one bus of 6.0 and the fleet, which speaks 5.2.1.
#[derive(Debug)]
pub struct Translator {
    older: Library,
    newer: Library,
    /// The parents that identifiers had.
    parents: BTreeMap<Guid, Guid>,
    /// The codes of 6.0 that live, by source and resource.
    codes: BTreeMap<(Guid, Guid), BTreeSet<i32>>,
    /// Resources of the fleet's configurations as they were last said on the bus, by source.
    said: BTreeMap<Guid, resources::Said>,
    /// Resources of the bus's configurations as they come, by set.
    heard: resources::Heard,
    /// What the sample at hand has lost.
    lost: Vec<Lost>,
    told: BTreeSet<Lost>,
}

impl Translator {
    /// A translator that knows nothing yet.
    ///
    /// # Errors
    /// [`DescriptionError`] where the built-in types are unsound, which a test rules out.
    pub fn new() -> Result<Self, Vec<DescriptionError>> {
        Ok(Self {
            older: v5_2_1::library()?,
            newer: v6_0::library()?,
            parents: BTreeMap::new(),
            codes: BTreeMap::new(),
            said: BTreeMap::new(),
            heard: resources::Heard::default(),
            lost: Vec::new(),
            told: BTreeSet::new(),
        })
    }

    /// The types of 5.2.1.
    pub fn older(&self) -> &Library {
        &self.older
    }

    /// The types of 6.0.
    pub fn newer(&self) -> &Library {
        &self.newer
    }

    /// What a sample of 6.0 is in 5.2.1.
    pub fn to_older(&mut self, sample: &Sample) -> Outcome {
        let done = match (topic_of_newer(&sample.topic), sample.topic.as_str()) {
            (_, v6_0::RESOURCES_ELEMENT) => self.element_to_older(sample),
            (Some("UMAA::SO::HealthReport::HealthReport"), _) => self.health_to_older(sample),
            (Some(resources::CONFIG), _) => self.config_to_older(sample),
            (Some(topic), _) => self.plain_to_older(sample, topic).map(|sample| vec![sample]),
            (None, topic) => Err(Lost::Topic(topic.to_owned())),
        };
        self.outcome(done)
    }

    /// What a sample of 5.2.1 is in 6.0.
    pub fn to_newer(&mut self, sample: &Sample) -> Outcome {
        let done = match umaa::topic(&sample.topic) {
            None => Err(Lost::Topic(sample.topic.clone())),
            Some(_) if sample.topic == "UMAA::SO::HealthReport::HealthReport" => self.health_to_newer(sample),
            Some(_) if sample.topic == resources::CONFIG => self.config_to_newer(sample),
            Some(info) => self.plain_to_newer(sample, info.type_name).map(|sample| vec![sample]),
        };
        self.outcome(done)
    }

    fn outcome(&mut self, done: Result<Vec<Sample>, Lost>) -> Outcome {
        let (samples, refused) = match done {
            Ok(samples) => (samples, None),
            Err(lost) => (Vec::new(), Some(lost)),
        };
        let lost = std::mem::take(&mut self.lost).into_iter().chain(refused);
        let lost = lost.filter(|lost| self.told.insert(lost.kind())).collect();
        Outcome { samples, lost }
    }

    /// The sample that is translated next has members that its type here does not have.
    pub(super) fn more_members(&mut self, topic: &str) {
        self.lost.push(Lost::Members { topic: topic.to_owned() });
    }

    /// Forgets what was said on the bus of configurations' resources.
    pub(super) fn say_all_again(&mut self) {
        self.said.clear();
    }

    fn plain_to_older(&mut self, sample: &Sample, topic: &str) -> Result<Sample, Lost> {
        let value = self.converted(sample, &sample.topic, false)?;
        Ok(Sample { topic: topic.to_owned(), change: sample.change, value })
    }

    fn plain_to_newer(&mut self, sample: &Sample, type_name: &str) -> Result<Sample, Lost> {
        let value = self.converted(sample, type_name, true)?;
        Ok(Sample { topic: type_name.to_owned(), change: sample.change, value })
    }
}

impl Lost {
    /// The same without what differs from one sample to the next, so that each kind is told once.
    fn kind(&self) -> Self {
        match self.clone() {
            Self::TooLong { topic, member, bound, .. } => Self::TooLong { topic, member, length: 0, bound },
            other => other,
        }
    }
}

/// The topic of 5.2.1 that a topic of 6.0 belongs to: its own, or that of what it is an element of.
pub(super) fn older_topic(topic: &str) -> Option<&'static str> {
    if topic == v6_0::RESOURCES_ELEMENT { Some(resources::CONFIG) } else { topic_of_newer(topic) }
}

/// The topic of 5.2.1 whose type has the name of a topic of 6.0.
fn topic_of_newer(topic: &str) -> Option<&'static str> {
    umaa::topics().find(|info| info.type_name == topic).map(|info| info.name)
}
