//! What a subscriber wants.

use bytes::Bytes;
use std::collections::BTreeMap;

/// How many topics a subscriber may have: OpenUxAS has one a letter or one a message type.
const TOPICS_MAX: usize = 4_096;
/// The longest topic; an address has at most 512 bytes.
const TOPIC_BYTES_MAX: usize = 1_024;

/// Why a subscription is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TopicError {
    /// There are too many.
    #[error("more than {TOPICS_MAX} subscriptions")]
    TooMany,
    /// It is too long.
    #[error("a subscription of {0} bytes, at most {TOPIC_BYTES_MAX} are allowed")]
    TooLong(usize),
}

/// The topics of one subscriber. ZeroMQ matches them against the first frame of a message, byte by byte.
#[derive(Debug, Default)]
pub struct Topics {
    /// How often each was subscribed to: it must be cancelled as often.
    topics: BTreeMap<Bytes, u64>,
}

impl Topics {
    /// Adds one.
    ///
    /// # Errors
    /// [`TopicError`]: there are too many, or it is too long.
    pub fn subscribe(&mut self, topic: &[u8]) -> Result<(), TopicError> {
        if topic.len() > TOPIC_BYTES_MAX {
            return Err(TopicError::TooLong(topic.len()));
        }
        if let Some(times) = self.topics.get_mut(topic) {
            *times = times.saturating_add(1);
        } else if self.topics.len() >= TOPICS_MAX {
            return Err(TopicError::TooMany);
        } else {
            self.topics.insert(Bytes::copy_from_slice(topic), 1);
        }
        Ok(())
    }

    /// Takes one back; one that is not there does nothing.
    pub fn cancel(&mut self, topic: &[u8]) {
        let Some(times) = self.topics.get_mut(topic) else { return };
        *times -= 1;
        if *times == 0 {
            self.topics.remove(topic);
        }
    }

    /// Whether a first frame that consists of these two pieces is wanted.
    pub fn want(&self, begin: &[u8], rest: &[u8]) -> bool {
        self.topics.keys().any(|topic| match topic.split_at_checked(begin.len()) {
            Some((first, second)) => first == begin && rest.starts_with(second),
            None => begin.starts_with(topic),
        })
    }
}
