//! A DDS bus and the fleet's: samples as envelopes and back (spec: what bites). Pure; the gateway has the endpoints.

mod error;
mod newer;
mod qos;
mod rules;
mod sender;
#[cfg(test)]
mod tests;
mod topic;
mod version;

pub use error::{ExportError, ImportError};
pub use newer::{NewerBus, NewerError};
pub use qos::{Mismatch, in_words, mismatches, offered, requested};
pub use rules::{Glob, GlobError, QualityRule, Rules};
pub use sender::{Sender, address_of};
pub use topic::{Body, Given, Imported, Taken, TopicMap, Writer};
pub use version::{Lost, Outcome, Sample, Translator};
