//! UMAA over whole fleets: an arbiter, guarded and nested providers and one without a guard, consumers that contend, on nodes
//! whose bus and machines fail.
//!
//! What must hold: states follow figure 5; one consumer controls the resource; nobody acts on a report that is older than one
//! that all have confirmed; what is read comes in order; every clause of the monitor. After all faults have ended every command
//! ends and is cleaned up, every reader holds the same, and what consumers ask for is done.
//!
//! A [`Campaign`] runs many seeds and adds up what was seen.

mod act;
mod actors;
mod arrangement;
mod campaign;
pub(crate) mod commands;
mod control;
mod fleet;
pub(crate) mod flow;
mod illegal;
mod makers;
mod mirror;
mod outside;
mod saboteur;
pub(crate) mod scripted;
mod tally;
mod tamper;
mod tampered;
#[cfg(test)]
mod tests;
mod violation;
mod watch;
mod wrote;

pub use campaign::{Campaign, Recorded};
pub use fleet::{Planted, UmaaFleet, options};
pub use illegal::{IllegalCount, reject_all_illegal};
pub use tally::Tally;
pub use violation::{Finding, Violation, violations};
