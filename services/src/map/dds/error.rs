//! Why samples do not enter, and envelopes do not leave.

use aldis_envelope::KeyHash;
use aldis_envelope::codec::cdr::CdrError;

/// Why a sample does not enter.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ImportError {
    /// Its bytes are no sample of the type.
    #[error("a sample of {topic} is malformed: {why}")]
    Malformed {
        /// The topic.
        topic: String,
        /// What is wrong.
        why: Box<CdrError>,
    },
    /// An instance ends of which the key was never told.
    #[error(
        "an instance of {topic} ends, of which only the key hash {hash} is told: have its writer send serialized keys"
    )]
    UnknownKey {
        /// The topic.
        topic: String,
        /// The hash.
        hash: KeyHash,
    },
    /// The type is not known, so that its keys cannot be read.
    #[error(
        "the type of {topic} is not known: give its IDL by `idl`, or have its writer send type information"
    )]
    UnknownType {
        /// The topic.
        topic: String,
    },
}

/// Why an envelope does not leave.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ExportError {
    /// Its content is not of the topic's type.
    #[error("a content is no sample of {topic}: {why}")]
    NoSample {
        /// The topic.
        topic: String,
        /// What is wrong.
        why: Box<CdrError>,
    },
    /// Its content is in no form that a topic has.
    #[error("a content of type {found} on {topic}: `umaa` and `cdr` are written")]
    OtherContent {
        /// The topic.
        topic: String,
        /// The type.
        found: String,
    },
    /// An instance ends of which the key is not known.
    #[error("an instance of {topic} ends, of which only the key hash {hash} is known")]
    UnknownKey {
        /// The topic.
        topic: String,
        /// The hash; of no instance where there is none.
        hash: KeyHash,
    },
    /// Writing it anew would lose what its type has more.
    #[error(
        "a sample of {topic} has other members than its type here, so it leaves in its own representation alone"
    )]
    OtherVersion {
        /// The topic.
        topic: String,
    },
    /// The type is not known.
    #[error("the type of {topic} is not known here, so its samples leave only as they came")]
    UnknownType {
        /// The topic.
        topic: String,
    },
}

/// Says of which topic a sample is malformed.
pub(super) fn malformed(topic: &str) -> impl Fn(Box<CdrError>) -> ImportError {
    move |why| ImportError::Malformed { topic: topic.to_owned(), why }
}
