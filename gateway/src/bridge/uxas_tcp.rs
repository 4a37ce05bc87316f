//! The UxAS stream form over TCP: as a server with several peers, or as a client of one.

use super::connection::{Patience, Side, bind, tell};
use super::stream::{self, Limits};
use crate::runtime::Shared;
use aldis_services::{BridgeEvent, BridgeId};
use std::net::SocketAddr;
use tokio::net::TcpStream;
use tokio::sync::watch;
use tokio::task::JoinSet;

/// How many peers a server takes at once; further ones are closed at once.
const PEERS_MAX: usize = 64;

/// Which side a bridge takes, and how it reads and writes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Endpoint {
    pub(crate) side: Side,
    pub(crate) limits: Limits,
}

/// Runs a bridge for the life of its node.
pub(crate) async fn serve(core: Shared, bridge: BridgeId, endpoint: Endpoint, paused: watch::Receiver<bool>) {
    match endpoint.side {
        Side::Listen(address) => listen(core, bridge, address, endpoint.limits, paused).await,
        Side::Connect(address) => connect(core, bridge, address, endpoint.limits, paused).await,
    }
}

async fn listen(
    core: Shared,
    bridge: BridgeId,
    address: SocketAddr,
    limits: Limits,
    paused: watch::Receiver<bool>,
) {
    let mut patience = Patience::new();
    let listener = bind(&core, bridge, address).await;
    let bound = listener.local_addr().unwrap_or(address);
    tell(&core, bridge, BridgeEvent::Working(format!("listening on {bound}")));
    let mut peers = JoinSet::new();
    loop {
        match listener.accept().await {
            Ok((_, from)) if peers.len() >= PEERS_MAX => {
                tracing::warn!("{from} is turned away: {PEERS_MAX} peers are there");
            }
            Ok((stream, from)) => {
                let peer = (prepared(stream), from.to_string());
                peers.spawn_local(stream::run(core.clone(), bridge, peer, limits, paused.clone()));
            }
            // One failed connection, or no descriptors left: either passes.
            Err(why) => patience.after(&core, bridge, format!("cannot accept: {why}")).await,
        }
        while peers.try_join_next().is_some() {}
    }
}

async fn connect(
    core: Shared,
    bridge: BridgeId,
    address: SocketAddr,
    limits: Limits,
    paused: watch::Receiver<bool>,
) {
    let mut patience = Patience::new();
    loop {
        match TcpStream::connect(address).await {
            Ok(stream) => {
                patience = Patience::new();
                tell(&core, bridge, BridgeEvent::Working(format!("connected to {address}")));
                let peer = (prepared(stream), address.to_string());
                stream::run(core.clone(), bridge, peer, limits, paused.clone()).await;
                patience.after(&core, bridge, format!("{address} closed the connection")).await;
            }
            Err(why) => patience.after(&core, bridge, format!("cannot connect to {address}: {why}")).await,
        }
    }
}

fn prepared(stream: TcpStream) -> TcpStream {
    // Without this a message waits for the acknowledgement of the one before it.
    let _ = stream.set_nodelay(true);
    stream
}
