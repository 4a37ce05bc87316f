//! A DDS bus and the fleet's: samples as envelopes and back (spec: what bites). Pure; the gateway has the endpoints.

mod newer;
mod order;
mod qos;
mod rules;
#[cfg(test)]
mod tests;
mod topic;
mod version;

pub use newer::{NewerBus, NewerError};
pub use order::in_order;
pub use qos::{
    AccessScope, Durability, History, Mismatch, Ownership, Qos, Reliability, mismatches, offered, requested,
};
pub use rules::{Glob, GlobError, Rules};
pub use topic::{Body, ExportError, Given, ImportError, Imported, Taken, TopicMap, Writer};
pub use version::{Lost, Outcome, Sample, Translator};
