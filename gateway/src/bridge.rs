//! Bridges: shells that move bytes between peers and the node.

mod connection;
#[cfg(feature = "dds")]
pub(crate) mod dds;
pub(crate) mod outgoing;
mod peers;
mod stream;
pub(crate) mod uxas_serial;
pub(crate) mod uxas_tcp;
pub(crate) mod uxas_zmq;

pub(crate) use connection::Side;
pub(crate) use peers::Peers;
pub(crate) use stream::Limits;

use crate::runtime::Shared;
use aldis_services::BridgeId;
use tokio::sync::watch;

/// What a bridge opens.
#[derive(Debug, Clone)]
#[allow(clippy::enum_variant_names, reason = "what peers speak to is UxAS")]
pub(crate) enum Endpoint {
    /// The stream form over TCP.
    UxasTcp(uxas_tcp::Endpoint),
    /// The stream form on a serial device.
    UxasSerial(uxas_serial::Endpoint),
    /// ZeroMQ.
    UxasZmq(uxas_zmq::Endpoint),
}

/// Runs a bridge for the life of its node.
pub(crate) async fn serve(core: Shared, bridge: BridgeId, endpoint: Endpoint, paused: watch::Receiver<bool>) {
    match endpoint {
        Endpoint::UxasTcp(endpoint) => uxas_tcp::serve(core, bridge, endpoint, paused).await,
        Endpoint::UxasSerial(endpoint) => uxas_serial::serve(core, bridge, endpoint, paused).await,
        Endpoint::UxasZmq(endpoint) => uxas_zmq::serve(core, bridge, endpoint, paused).await,
    }
}
