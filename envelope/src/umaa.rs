//! UMAA Support Operations types, version 5.2.1: members in the order of the wire, enums in their alphabetical order.
//!
//! A content of type `umaa` is one of these in postcard's format.

mod health_report;
mod log_report;
mod text;

pub use health_report::{ErrorCode, ErrorCondition, HealthReport};
pub use log_report::{LogLevel, LogReport};
pub use text::{LongDescription, TextTooLong};

use crate::change::{Instance, KeyWidth};
use crate::message::{Label, Message};
use crate::name::{ContentType, Name, NameError};
use crate::{Change, Source};
use bytes::Bytes;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::sync::Arc;

/// A topic of UMAA: its name, its key and its content.
pub trait Topic: Serialize + DeserializeOwned {
    /// The topic's name, `UMAA::SO::<Service>::<Topic>`.
    const NAME: &'static str;
    /// Whether the topic's keys fit a key hash.
    const KEY_WIDTH: KeyWidth;

    /// The serialized key: big-endian CDR of the key members.
    fn key(&self) -> Bytes;

    /// The instance that this sample belongs to.
    fn instance(&self) -> Instance {
        Instance::of_key(self.key(), Self::KEY_WIDTH)
    }
}

/// Why a content is not a sample of a topic.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ContentError {
    /// Postcard cannot read it, or a value is outside its range.
    #[error("not a {topic}: {why}")]
    Unreadable {
        /// The topic's name.
        topic: &'static str,
        /// What is wrong.
        why: String,
    },
    /// Bytes are left at the end.
    #[error("not a {topic}: {left} bytes follow its end")]
    Trailing {
        /// The topic's name.
        topic: &'static str,
        /// How many.
        left: usize,
    },
}

/// Reads the content of a sample.
///
/// # Errors
/// [`ContentError`] when the content is not exactly one sample of the topic.
pub fn decode<T: Topic>(content: &[u8]) -> Result<T, ContentError> {
    let unreadable = |why: postcard::Error| ContentError::Unreadable { topic: T::NAME, why: why.to_string() };
    match postcard::take_from_bytes(content).map_err(unreadable)? {
        (sample, []) => Ok(sample),
        (_, rest) => Err(ContentError::Trailing { topic: T::NAME, left: rest.len() }),
    }
}

/// The content of a sample.
pub fn encode<T: Topic>(sample: &T) -> Bytes {
    // Postcard fails on a growing buffer only for types without a length, which no topic has.
    postcard::to_allocvec(sample).unwrap_or_default().into()
}

/// The label of a topic's broadcasts.
///
/// # Errors
/// [`NameError`] when the topic's name is no name, which a test of each topic rules out.
pub fn label<T: Topic>(source: Source) -> Result<Arc<Label>, NameError> {
    Ok(Arc::new(Label::broadcast(ContentType::Umaa, Name::new(T::NAME)?, source)))
}

/// A message with a new sample.
pub fn put<T: Topic>(label: Arc<Label>, sample: &T) -> Message {
    Message::new(label, encode(sample)).of_instance(sample.instance())
}

/// A message that disposes a sample's instance.
pub fn dispose<T: Topic>(label: Arc<Label>, sample: &T) -> Message {
    let message = Message::new(label, Bytes::new()).of_instance(sample.instance());
    Message { change: Change::Dispose, ..message }
}
