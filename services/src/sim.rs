//! The simulator: whole fleets of real nodes over a simulated bus, in virtual time, from a seed.

mod disk;
mod network;
mod world;

pub use disk::{DiskFaults, SimDisk};
pub use network::meets;
pub use world::{NodeHandle, World};
