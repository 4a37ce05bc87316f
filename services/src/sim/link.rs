//! The lossy link in virtual time: an emulator of bad links, machines with journals that crash, and the measure of the protocol.

mod bench;
mod curves;
mod disk;
mod emulator;
mod hostile;
mod load;
mod rows;
mod swarm;
mod world;

pub use bench::{Bench, Row, bench, row_names};
pub use curves::{Chart, curves};
pub use disk::Disk;
pub use emulator::{Burst, Profile, Way};
pub use hostile::{HostileReport, hostile};
pub use rows::cost;
pub use swarm::{SwarmReport, swarm, swarm_one, swarm_seed};
pub use world::{LinkWorld, Machine, MachineId, Port, Seen, What};
