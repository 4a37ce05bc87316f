//! The node of Aldis and its services.
//!
//! Pure: no input or output, no clock, no randomness. Time, seeds and bytes come in as arguments; [`Node::handle`] turns
//! events into effects, and a shell (the gateway) or the simulator carries them out.

pub mod allow;
pub mod bridge;
pub mod calls;
pub mod conform;
pub mod counters;
pub mod dds;
pub mod destinations;
pub mod domain;
pub mod entities;
pub mod event;
pub mod health;
mod host;
pub mod journal;
mod labels;
pub mod link;
pub mod log;
pub mod manager;
pub mod map;
pub mod node;
pub mod notes;
pub mod plan;
pub mod player;
pub mod recorder;
pub mod registry;
pub mod service;
pub mod sim;
pub mod streams;
pub mod track;
pub mod umaa;
pub mod uxas;

pub use bridge::BridgeSpec;
pub use event::{
    BridgeEvent, BridgeId, Effect, Event, LinkEvent, LinkId, PeerEvent, PeerId, Place, PublisherId,
};
pub use node::{Node, NodeConfig};
pub use service::{Input, Outbox, Service, ServiceSpec};
