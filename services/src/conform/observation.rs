//! What the monitor is told.

use aldis_envelope::umaa::{TopicInfo, topics};
use aldis_envelope::{Change, ContentType, Envelope, KeyHash, Monotonic, Source};
use serde_json::Value;
use std::collections::BTreeMap;

/// Something that was seen on the bus.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// When it was received.
    pub at: Monotonic,
    /// Who wrote it.
    pub writer: Source,
    /// The topic's name.
    pub topic: String,
    /// The name of its type, where the bus tells one.
    pub type_name: Option<String>,
    /// The instance.
    pub instance: KeyHash,
    /// The key members by their names in the IDL, where more than a hash is told.
    pub key: Option<Value>,
    /// Whether it is history: a retained sample, read by one who joins late. It is taken in, and not judged by what came before.
    pub retained: bool,
    /// What happened.
    pub observed: Observed,
}

/// What happened to an instance.
#[derive(Debug, Clone, PartialEq)]
pub enum Observed {
    /// A sample.
    Put(Content),
    /// It was disposed.
    Dispose,
    /// Its writer no longer speaks for it.
    Unregister,
    /// Nobody does: contact is lost, which obliges nobody and excuses who is gone.
    NoWriters,
}

/// A sample.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// Its members by their names in the IDL: GUIDs as text, enumerations by name, absent optional members null or left out.
    Sample(Value),
    /// It is none of its type: why.
    Unreadable(String),
    /// Its type is not known here, and it is not looked into.
    Unknown,
}

/// Reads envelopes as observations.
#[derive(Debug, Clone)]
pub struct Decoder {
    topics: BTreeMap<&'static str, TopicInfo>,
}

impl Decoder {
    /// Reads the topics of Support Operations, and those.
    pub fn new(more: impl IntoIterator<Item = TopicInfo>) -> Self {
        let topics = topics().copied().chain(more).map(|topic| (topic.name, topic)).collect();
        Self { topics }
    }

    /// The observation of an envelope; none where it is keyless, and so no sample of a topic.
    pub fn observation(&self, at: Monotonic, envelope: &Envelope) -> Option<Observation> {
        let message = &envelope.message;
        let instance = message.instance.as_ref()?;
        let topic = self.topics.get(message.label.descriptor());
        let observed = match message.change {
            Change::Put => Observed::Put(match topic {
                Some(topic) if message.label.attributes.content_type == ContentType::Umaa => {
                    match topic.json(&message.content) {
                        Ok(value) => Content::Sample(value),
                        Err(why) => Content::Unreadable(why.to_string()),
                    }
                }
                _ => Content::Unknown,
            }),
            Change::Dispose => Observed::Dispose,
            Change::Unregister => Observed::Unregister,
        };
        Some(Observation {
            at,
            writer: message.label.source(),
            topic: message.label.descriptor().to_owned(),
            type_name: None,
            instance: instance.hash,
            key: topic.and_then(|topic| topic.key_json(instance)),
            retained: false,
            observed,
        })
    }
}
