//! The simulator: whole fleets of real nodes over a simulated bus, in virtual time, from a seed.

pub mod link;
mod network;
mod world;

pub use network::meets;
pub use world::{NodeHandle, World};
