//! A DDS bus and the fleet's: samples as envelopes and back (spec: what bites). Pure; the gateway has the endpoints.

mod newer;
mod qos;
mod rules;
#[cfg(test)]
mod tests;
mod topic;
mod version;

pub use newer::{NewerBus, NewerError};
pub use qos::{Mismatch, in_words, mismatches, offered, requested};
pub use rules::{Glob, GlobError, QualityRule, Rules};
pub use topic::{Body, ExportError, Given, ImportError, Imported, Sender, Taken, TopicMap, Writer};
pub use topic::{address_of, topic_of};
pub use version::{Lost, Outcome, Sample, Translator};
