//! Pure translation between envelopes and what bridges speak.

pub mod uxas;
