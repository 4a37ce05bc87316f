//! Keeps a session on the bus, and hands what comes from it to the node.

use super::Shared;
use crate::bus::Congestion;
use crate::bus::{Bus, BusError, Inbox};
use aldis_envelope::Keys;
use aldis_services::Event;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{Notify, watch};

/// The first wait before a session is opened again, doubled each time.
const RETRY_MIN: Duration = Duration::from_millis(200);
/// The longest wait.
const RETRY_MAX: Duration = Duration::from_secs(10);
/// How soon is asked again who is there, where nobody seems to be.
const ASK_AGAIN: Duration = Duration::from_millis(100);
/// How often a session is asked whether it still lives: it dies by itself only when Zenoh gives up.
const CHECK_EVERY: Duration = Duration::from_secs(1);

/// How a node joins the bus.
pub(crate) struct Joining {
    /// Zenoh's configuration.
    pub(crate) config: zenoh::Config,
    /// What a stream does when the bus does not take its messages.
    pub(crate) congestion: Congestion,
}

/// Opens the session, again where it fails, closes it while silenced and at the end.
pub(super) async fn keep(
    core: Shared,
    inbox: Arc<Inbox>,
    keys: Keys,
    joining: Joining,
    mut silenced: watch::Receiver<bool>,
    closed: watch::Sender<bool>,
) {
    let mut exited = core.lock().exited();
    let mut wait = RETRY_MIN;
    while !*exited.borrow() {
        tokio::select! {
            Ok(_) = silenced.wait_for(|silenced| !*silenced) => {}
            _ = exited.wait_for(|exited| *exited) => break,
        }
        let opening = Bus::open(joining.config.clone(), keys.clone(), joining.congestion, inbox.clone());
        let opened = tokio::select! {
            opened = opening => opened,
            _ = exited.wait_for(|exited| *exited) => break,
        };
        let again = Arc::new(Notify::new());
        match opened.and_then(|bus| install(&core, bus, &again)) {
            Ok(()) => wait = RETRY_MIN,
            Err(why) => {
                core.lock().handle(&mut vec![Event::BusClosed(why.to_string())]);
                tokio::select! {
                    () = tokio::time::sleep(wait) => {}
                    _ = exited.wait_for(|exited| *exited) => break,
                }
                wait = (wait * 2).min(RETRY_MAX);
                continue;
            }
        }
        tokio::select! {
            Ok(_) = silenced.wait_for(|silenced| *silenced) => {
                core.lock().handle(&mut vec![Event::BusClosed("silenced".into())]);
            }
            _ = exited.wait_for(|exited| *exited) => {}
            () = until_closed(&core) => {}
            () = ask_again(&core, &again) => {}
        }
        let bus = core.lock().set_bus(None);
        if let Some(bus) = bus {
            bus.close().await;
        }
    }
    closed.send_replace(true);
}

/// The node has a session. What it declares goes out before the tokens are asked for, so that answers find their way.
fn install(core: &Shared, bus: Bus, again: &Arc<Notify>) -> Result<(), BusError> {
    let mut core = core.lock();
    core.set_bus(Some(bus));
    core.handle(&mut vec![Event::BusOpened]);
    match core.bus() {
        Some(bus) => bus.follow_tokens(again),
        None => Ok(()),
    }
}

/// Asks again who is there, as long as nobody seems to be. It ends with the session alone.
async fn ask_again(core: &Shared, again: &Arc<Notify>) {
    loop {
        again.notified().await;
        tokio::time::sleep(ASK_AGAIN).await;
        let asked = core.lock().bus().map_or(Ok(()), |bus| bus.ask_for_tokens(again));
        if let Err(why) = asked {
            tracing::warn!("bus: {why}");
        }
    }
}

async fn until_closed(core: &Shared) {
    loop {
        tokio::time::sleep(CHECK_EVERY).await;
        let mut core = core.lock();
        match core.bus() {
            Some(bus) if bus.is_closed() => {
                core.handle(&mut vec![Event::BusClosed("Zenoh closed the session".into())]);
                return;
            }
            Some(_) => {}
            None => return,
        }
    }
}

/// Hands what Zenoh's threads left in the inbox to the node, unless input is paused.
pub(super) async fn drain(core: Shared, inbox: Arc<Inbox>, mut paused: watch::Receiver<bool>) {
    let mut events = Vec::new();
    loop {
        inbox.filled().await;
        if paused.wait_for(|paused| !*paused).await.is_err() {
            return;
        }
        // Locked before the inbox is emptied: no event of a callback may pass those that waited.
        let mut core = core.lock();
        let learned = inbox.take(&mut events);
        core.handle(&mut events);
        if let Some(bus) = core.bus() {
            bus.declare_learned(learned);
        }
    }
}
