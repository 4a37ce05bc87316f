//! The harness of the whole-system tests: it builds the `aldis` program, runs nodes as real processes with the project's
//! own configurations on free ports, and speaks to them as a UxAS and as an operator would.
//!
//! Everything waits for an event, within a bound; nothing outlives its test.

mod aldis;
mod directory;
mod frame;
mod log;
mod node;
mod peer;
mod ports;
mod project;
pub mod python;
mod site;
mod wait;

pub use aldis::{Done, aldis, program};
pub use directory::Directory;
pub use frame::{delimited, frame, sentinels};
pub use log::Log;
pub use node::Node;
pub use peer::{Peer, Received};
pub use ports::free_port;
pub use project::{root, shared};
pub use site::Site;
pub use wait::{PATIENCE, until};
