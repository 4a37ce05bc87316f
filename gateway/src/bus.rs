//! The bus: the only place that knows Zenoh.

pub(crate) mod frames;
mod inbox;
mod outlet;
mod session;

pub(crate) use inbox::{Direct, Inbox};
pub(crate) use session::{Bus, BusError};
pub(crate) use zenoh::qos::CongestionControl as Congestion;
