//! UxAS over ZeroMQ: a pair of sockets that binds (PUB and PULL) or one that connects (SUB and PUSH).

mod connection;

use super::connection::{Patience, bind, tell};
use crate::runtime::Shared;
use aldis_envelope::Dialect;
use aldis_envelope::codec::zmtp::{Framing, SocketType};
use aldis_services::{BridgeEvent, BridgeId};
use connection::Connection;
use std::net::SocketAddr;
use std::sync::Arc;
use tokio::net::TcpStream;
use tokio::sync::watch;
use tokio::task::JoinSet;

/// How many peers a socket takes at once; further ones are closed at once.
const PEERS_MAX: usize = 64;

/// Which sockets a bridge has, and how it reads and writes.
#[derive(Debug, Clone)]
pub(crate) struct Endpoint {
    pub(crate) sockets: Sockets,
    pub(crate) framing: Framing,
    pub(crate) dialect: Dialect,
    pub(crate) message_bytes_max: usize,
}

/// The two sockets of a bridge.
#[derive(Debug, Clone)]
pub(crate) enum Sockets {
    /// PUB and PULL, which others connect to.
    PublishPull { publish: SocketAddr, pull: SocketAddr },
    /// SUB and PUSH, which connect, and what is subscribed to.
    SubscribePush { subscribe: SocketAddr, push: SocketAddr, topics: Vec<String> },
}

/// Runs a bridge for the life of its node.
pub(crate) async fn serve(core: Shared, bridge: BridgeId, endpoint: Endpoint, paused: watch::Receiver<bool>) {
    let endpoint = Arc::new(endpoint);
    let new = |socket| Connection::new(core.clone(), bridge, socket, endpoint.clone(), paused.clone());
    match endpoint.sockets {
        Sockets::PublishPull { publish, pull } => {
            let of_pub = bind(&core, bridge, publish).await;
            let of_pull = bind(&core, bridge, pull).await;
            let at = |socket: &tokio::net::TcpListener, or| socket.local_addr().unwrap_or(or);
            let text = format!("publishing on {}, pulling on {}", at(&of_pub, publish), at(&of_pull, pull));
            tell(&core, bridge, BridgeEvent::Working(text));
            tokio::join!(
                listen(&core, bridge, of_pub, new(SocketType::Pub)),
                listen(&core, bridge, of_pull, new(SocketType::Pull)),
            );
        }
        Sockets::SubscribePush { subscribe, push, .. } => {
            tokio::join!(
                connect(&core, bridge, subscribe, new(SocketType::Sub)),
                connect(&core, bridge, push, new(SocketType::Push)),
            );
        }
    }
}

async fn listen(core: &Shared, bridge: BridgeId, listener: tokio::net::TcpListener, socket: Connection) {
    let mut patience = Patience::new();
    let mut peers = JoinSet::new();
    loop {
        match listener.accept().await {
            Ok((_, from)) if peers.len() >= PEERS_MAX => {
                tracing::warn!("{from} is turned away: {PEERS_MAX} peers are there");
            }
            Ok((stream, from)) => {
                let socket = socket.clone();
                peers.spawn_local(async move {
                    if let Err(why) = socket.run(stream, from).await {
                        tracing::warn!("{from} is turned away: {why}");
                    }
                });
            }
            // One failed connection, or no descriptors left: either passes.
            Err(why) => patience.after(core, bridge, format!("cannot accept: {why}")).await,
        }
        while peers.try_join_next().is_some() {}
    }
}

async fn connect(core: &Shared, bridge: BridgeId, address: SocketAddr, socket: Connection) {
    let mut patience = Patience::new();
    let name = socket.name();
    loop {
        let trouble = match TcpStream::connect(address).await {
            Ok(stream) => match socket.run(stream, address).await {
                Ok(why) => {
                    patience = Patience::new();
                    format!("{name} at {address}: {why}")
                }
                Err(why) => format!("{name} at {address}: {why}"),
            },
            Err(why) => format!("cannot connect {name} to {address}: {why}"),
        };
        patience.after(core, bridge, trouble).await;
    }
}
