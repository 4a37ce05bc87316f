//! Flow control and ResourceAllocation on a simulated bus, watched from outside.

pub(crate) mod asking;
pub(crate) mod bus;
mod nodes;
mod random;
pub(crate) mod sea;
pub(crate) mod vector;
