//! Cyclone DDS as far as a bridge needs it: participants, types made at run time, samples as the CDR bytes that travel, quality
//! of service, discovery.
//!
//! All of the project's `unsafe` is in this crate, each with its argument. What Cyclone DDS promises of threads is used
//! throughout: every call may come from any thread, an entity's deletion waits for its callbacks, and no entity is created or
//! deleted from within a callback.

#![allow(non_upper_case_globals, reason = "constants are named as Cyclone DDS names them")]

mod cache;
mod discovery;
mod domain;
mod entity;
mod error;
mod listener;
mod participant;
mod qos;
mod qos_read;
mod reader;
#[cfg(test)]
mod tests;
mod topic;
mod types;
mod writer;

pub use cache::{Arrival, Incoming, Receive};
pub use discovery::{Change, Discovery, Endpoint, Guid, Side, TypeInformation};
pub use error::DdsError;
pub use listener::Mismatch;
pub use participant::{Participant, ParticipantConfig};
pub use qos::{Access, Durability, History, Limits, Liveliness, Policy, Presentation, Qos, Representation};
pub use reader::Reader;
pub use topic::{Topic, TypeSource};
pub use writer::{Sending, Writer};
