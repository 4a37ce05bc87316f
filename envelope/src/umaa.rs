//! UMAA Support Operations types: members in the order of the wire, enumerations in their alphabetical order.
//!
//! A content of type `umaa` is one sample of a topic in postcard's format. What all versions share is here; the topics of a
//! version are in a module of its own, those of 5.2.1 are the default and stand here too.

mod collection;
mod command;
mod enumeration;
mod key;
mod number;
mod sequence;
mod structure;
#[cfg(test)]
mod tests;
mod text;
mod topics;
pub mod v5_2_1;
pub mod v6_0;

pub use collection::{LargeCollection, LargeListMetadata, LargeSetMetadata, ListElement, SetElement};
pub use command::{
    Command, CommandAckReport, CommandHeader, CommandStatus, ExecutionStatus, NoExecutionStatus,
};
pub use enumeration::{
    CommandState, CommandStatusReason, EnumerationError, ErrorCode, ErrorCondition, LogLevel,
};
pub use key::{CommandKey, ElementKey, HealthKey, Key, SessionKey, SourceKey};
pub use number::{DurationSeconds, LargeCollectionSize, OutOfRange, Quaternion};
pub use sequence::{Sequence, SequenceTooLong};
pub use structure::Described;
pub use text::{LongDescription, TextTooLong};
pub use topics::{JsonError, TopicInfo, topic, topics};
pub use v5_2_1::*;

use crate::change::Instance;
use crate::guid::Guid;
use crate::message::{Label, Message};
use crate::name::{ContentType, Name, NameError};
use crate::time::DateTime;
use crate::{Change, Source};
use bytes::Bytes;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt;
use std::sync::Arc;

/// A topic of UMAA by the type of its samples.
pub trait Topic:
    Serialize + DeserializeOwned + Clone + PartialEq + fmt::Debug + Send + Sync + 'static
{
    /// The topic's name: `UMAA::SO::<Service>::<Topic>`.
    const NAME: &'static str;
    /// The name of its type.
    const TYPE_NAME: &'static str;
    /// Its key.
    type Key: Key;

    /// The key of this sample.
    fn key(&self) -> Self::Key;

    /// The instance that this sample belongs to.
    fn instance(&self) -> Instance {
        self.key().instance()
    }
}

/// A message with the members that all have, those of large collections' elements excepted (tables 22 to 25).
pub trait Sourced: Topic {
    /// When the message was made (`UCSMDEInterfaceSet`, table 22).
    fn time_stamp(&self) -> DateTime;

    /// Who made it.
    fn source(&self) -> Guid;
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
    about_instance(label, Change::Dispose, sample.key())
}

/// A message about an instance without a sample: a dispose or an unregister.
pub fn about_instance(label: Arc<Label>, change: Change, key: impl Key) -> Message {
    let message = Message::new(label, Bytes::new()).of_instance(key.instance());
    Message { change, ..message }
}
