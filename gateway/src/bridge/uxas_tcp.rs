//! The UxAS stream form over TCP: as a server with several peers, or as a client of one.

mod peer;

pub(crate) use peer::Peers;

use crate::runtime::Shared;
use aldis_services::{BridgeEvent, BridgeId, Event};
use std::net::SocketAddr;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;
use tokio::task::JoinSet;

/// The first wait before a bridge listens or connects again, doubled each time.
const RETRY_MIN: Duration = Duration::from_millis(100);
/// The longest wait.
const RETRY_MAX: Duration = Duration::from_secs(5);
/// How many peers a server takes at once; further ones are closed at once.
const PEERS_MAX: usize = 64;

/// Which side a bridge takes, and how large a message may be.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Endpoint {
    pub(crate) side: Side,
    pub(crate) message_bytes_max: usize,
}

/// Which side of a connection a bridge takes.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Side {
    Listen(SocketAddr),
    Connect(SocketAddr),
}

/// Runs a bridge for the life of its node.
pub(crate) async fn serve(core: Shared, bridge: BridgeId, endpoint: Endpoint, paused: watch::Receiver<bool>) {
    match endpoint.side {
        Side::Listen(address) => listen(core, bridge, address, endpoint.message_bytes_max, paused).await,
        Side::Connect(address) => connect(core, bridge, address, endpoint.message_bytes_max, paused).await,
    }
}

fn tell(core: &Shared, bridge: BridgeId, event: BridgeEvent) {
    core.lock().handle(&mut vec![Event::Bridge(bridge, event)]);
}

/// Waits longer each time; says a trouble only when it is another one than last time.
struct Patience {
    wait: Duration,
    said: Option<String>,
}

impl Patience {
    fn new() -> Self {
        Self { wait: RETRY_MIN, said: None }
    }

    async fn after(&mut self, core: &Shared, bridge: BridgeId, trouble: String) {
        if self.said.as_ref() != Some(&trouble) {
            tell(core, bridge, BridgeEvent::Failing(trouble.clone()));
            self.said = Some(trouble);
        }
        tokio::time::sleep(self.wait).await;
        self.wait = (self.wait * 2).min(RETRY_MAX);
    }
}

async fn listen(
    core: Shared,
    bridge: BridgeId,
    address: SocketAddr,
    max: usize,
    paused: watch::Receiver<bool>,
) {
    let mut patience = Patience::new();
    let listener = loop {
        match TcpListener::bind(address).await {
            Ok(listener) => break listener,
            Err(why) => patience.after(&core, bridge, format!("cannot listen on {address}: {why}")).await,
        }
    };
    let bound = listener.local_addr().unwrap_or(address);
    tell(&core, bridge, BridgeEvent::Working(format!("listening on {bound}")));
    let mut peers = JoinSet::new();
    loop {
        match listener.accept().await {
            Ok((_, from)) if peers.len() >= PEERS_MAX => {
                tracing::warn!("{from} is turned away: {PEERS_MAX} peers are there");
            }
            Ok((stream, from)) => {
                peers.spawn_local(peer::run(core.clone(), bridge, stream, from, max, paused.clone()));
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
    max: usize,
    paused: watch::Receiver<bool>,
) {
    let mut patience = Patience::new();
    loop {
        match TcpStream::connect(address).await {
            Ok(stream) => {
                patience = Patience::new();
                tell(&core, bridge, BridgeEvent::Working(format!("connected to {address}")));
                peer::run(core.clone(), bridge, stream, address, max, paused.clone()).await;
                patience.after(&core, bridge, format!("{address} closed the connection")).await;
            }
            Err(why) => patience.after(&core, bridge, format!("cannot connect to {address}: {why}")).await,
        }
    }
}
