//! How bridges come to their connections.

use crate::runtime::Shared;
use aldis_services::{BridgeEvent, BridgeId, Event};
use std::net::SocketAddr;
use std::time::Duration;
use tokio::net::TcpListener;

/// The first wait before a bridge listens or connects again, doubled each time.
const RETRY_MIN: Duration = Duration::from_millis(100);
/// The longest wait.
const RETRY_MAX: Duration = Duration::from_secs(5);

/// Which side of a connection a bridge takes.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Side {
    Listen(SocketAddr),
    Connect(SocketAddr),
}

pub(super) fn tell(core: &Shared, bridge: BridgeId, event: BridgeEvent) {
    core.lock().handle(&mut vec![Event::Bridge(bridge, event)]);
}

/// Waits longer each time; says a trouble only when it is another one than last time.
pub(super) struct Patience {
    wait: Duration,
    said: Option<String>,
}

impl Patience {
    pub(super) fn new() -> Self {
        Self { wait: RETRY_MIN, said: None }
    }

    pub(super) async fn after(&mut self, core: &Shared, bridge: BridgeId, trouble: String) {
        if self.said.as_ref() != Some(&trouble) {
            tell(core, bridge, BridgeEvent::Failing(trouble.clone()));
            self.said = Some(trouble);
        }
        tokio::time::sleep(self.wait).await;
        self.wait = (self.wait * 2).min(RETRY_MAX);
    }
}

/// Listens, as soon as the address can be had.
pub(super) async fn bind(core: &Shared, bridge: BridgeId, address: SocketAddr) -> TcpListener {
    let mut patience = Patience::new();
    loop {
        match TcpListener::bind(address).await {
            Ok(listener) => return listener,
            Err(why) => patience.after(core, bridge, format!("cannot listen on {address}: {why}")).await,
        }
    }
}
