//! Envelopes.

pub mod lmcp;
