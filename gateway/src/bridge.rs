//! Bridges: shells that move bytes between peers and the node.

pub(crate) mod outgoing;
pub(crate) mod uxas_tcp;
