//! All topics by name: contents as JSON for people, and back. Enumerations are their names in the IDL, GUIDs are text.

use super::{
    ContentError, HealthReport, Key, LogReport, ResourceAllocationCommand,
    ResourceAllocationCommandAckReport, ResourceAllocationCommandStatus, ResourceAllocationConfigReport,
    ResourceAllocationPriorityCommand, ResourceAllocationPriorityCommandAckReport,
    ResourceAllocationPriorityCommandStatus, ResourceAllocationPriorityReport, ResourceAllocationReport,
    Topic, decode, encode,
};
use crate::change::Instance;
use crate::guid::Guid;
use bytes::Bytes;
use serde_json::Value;

/// A topic whose type is known here.
#[derive(Debug, Clone, Copy)]
pub struct TopicInfo {
    /// The topic's name.
    pub name: &'static str,
    /// The name of its type.
    pub type_name: &'static str,
    /// The names of its key members.
    pub key_members: &'static [&'static str],
    json_of: fn(&[u8]) -> Result<Value, ContentError>,
    key_of: fn(&[u8]) -> Result<Bytes, ContentError>,
    key_json_of: fn(&Instance) -> Option<Value>,
    sample_of: fn(&str) -> Result<(Bytes, Instance), JsonError>,
}

/// The text is not the JSON form of a sample.
#[derive(Debug, thiserror::Error)]
#[error("not a {topic} in JSON: {why}")]
pub struct JsonError {
    topic: &'static str,
    why: serde_json::Error,
}

static TOPICS: [TopicInfo; 11] = [
    TopicInfo::of::<HealthReport>(),
    TopicInfo::of::<LogReport>(),
    TopicInfo::of::<ResourceAllocationCommand>(),
    TopicInfo::of::<ResourceAllocationCommandStatus>(),
    TopicInfo::of::<ResourceAllocationCommandAckReport>(),
    TopicInfo::of::<ResourceAllocationReport>(),
    TopicInfo::of::<ResourceAllocationConfigReport>(),
    TopicInfo::of::<ResourceAllocationPriorityCommand>(),
    TopicInfo::of::<ResourceAllocationPriorityCommandStatus>(),
    TopicInfo::of::<ResourceAllocationPriorityCommandAckReport>(),
    TopicInfo::of::<ResourceAllocationPriorityReport>(),
];

/// All topics of Support Operations in version 5.2.1.
pub fn topics() -> impl Iterator<Item = &'static TopicInfo> {
    TOPICS.iter()
}

/// The topic of that name.
pub fn topic(name: &str) -> Option<&'static TopicInfo> {
    TOPICS.iter().find(|topic| topic.name == name)
}

impl TopicInfo {
    /// What is known of a topic by its type.
    pub const fn of<T: Topic>() -> Self {
        Self {
            name: T::NAME,
            type_name: T::TYPE_NAME,
            key_members: T::Key::MEMBERS,
            json_of: json_of::<T>,
            key_of: |content| decode::<T>(content).map(|sample| sample.key().to_bytes()),
            key_json_of: |instance| {
                T::Key::of_instance(instance).and_then(|key| serde_json::to_value(key).ok())
            },
            sample_of: sample_of::<T>,
        }
    }

    /// A content in JSON.
    ///
    /// # Errors
    /// [`ContentError`] when the content is not exactly one sample of the topic.
    pub fn json(&self, content: &[u8]) -> Result<Value, ContentError> {
        (self.json_of)(content)
    }

    /// The serialized key of a content.
    ///
    /// # Errors
    /// [`ContentError`] when the content is not exactly one sample of the topic, each value in its range.
    pub fn key(&self, content: &[u8]) -> Result<Bytes, ContentError> {
        (self.key_of)(content)
    }

    /// Who made a sample, by its content; none for elements of large collections.
    pub fn source(&self, content: &[u8]) -> Option<Guid> {
        self.key_guid(content, "source")
    }

    /// Who a command is for, by its content; none for what is no command.
    pub fn destination(&self, content: &[u8]) -> Option<Guid> {
        self.key_guid(content, "destination")
    }

    fn key_guid(&self, content: &[u8], member: &str) -> Option<Guid> {
        let place = self.key_members.iter().position(|name| *name == member)?;
        let key = self.key(content).ok()?;
        key.get(16 * place..)?.first_chunk().copied().map(Guid)
    }

    /// The key members of an instance in JSON, for what has no content; none where only a digest of them is known.
    pub fn key_json(&self, instance: &Instance) -> Option<Value> {
        (self.key_json_of)(instance)
    }

    /// The content and the instance of a sample in JSON.
    ///
    /// # Errors
    /// [`JsonError`] for what is no JSON, lacks a member, has one too many, or holds a value outside its range.
    pub fn sample(&self, json: &str) -> Result<(Bytes, Instance), JsonError> {
        (self.sample_of)(json)
    }
}

fn json_of<T: Topic>(content: &[u8]) -> Result<Value, ContentError> {
    let unwritable =
        |why: serde_json::Error| ContentError::Unreadable { topic: T::NAME, why: why.to_string() };
    serde_json::to_value(decode::<T>(content)?).map_err(unwritable)
}

fn sample_of<T: Topic>(json: &str) -> Result<(Bytes, Instance), JsonError> {
    let sample: T = serde_json::from_str(json).map_err(|why| JsonError { topic: T::NAME, why })?;
    Ok((encode(&sample), sample.instance()))
}
