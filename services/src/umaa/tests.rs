//! Flow control and ResourceAllocation on a simulated bus, watched from outside.

pub(crate) mod bus;
pub(crate) mod checker;
pub(crate) mod vector;
