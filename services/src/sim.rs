//! The simulator: whole fleets of real nodes over a simulated bus and simulated disks, in virtual time, from a seed.
//!
//! - [`World`] holds machines: nodes with clocks of their own, sessions on the bus, and disks with journals. Faults are its methods:
//!   sessions that drop, partitions, crashes with torn writes, restarts, stalls, clocks that step.
//! - [`link`] carries datagrams as a radio does: loss in bursts, delay, reordering, duplicates, a rate, a queue.
//! - [`custody`] kills gateways on both sides of such a link and counts what was lost and what came twice.
//! - [`Options`] are drawn from a seed: which faults there are, and how strong.
//! - A [`Workload`] says which nodes there are and what they do; its [`Checker`]s watch from outside.
//! - [`run()`] runs a seed: a safety phase with faults, then a liveness phase in which all faults have ended and everything
//!   must come right. The same seed gives the same trace, byte for byte; [`Report`] holds its hash and, with a violation, its end.

pub mod chatter;
pub mod custody;
mod disk;
mod faults;
pub mod link;
mod machine;
pub mod mission;
mod network;
mod observe;
pub mod offline;
mod options;
mod run;
mod trace;
pub mod umaa;
mod world;

pub use disk::{DiskFaults, SimDisk};
pub use network::meets;
pub use observe::{Checker, Fact, Facts, Observation, Seen, Violation};
pub use options::{FaultOptions, Options};
pub use run::{Report, Workload, run};
pub use world::{NodeHandle, World};
