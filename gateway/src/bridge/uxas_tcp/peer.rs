//! One TCP connection in stream form: bytes in become events, effects become bytes out.

use crate::bridge::outgoing::{Outgoing, Written};
use crate::runtime::Shared;
use aldis_envelope::codec::stream::{Item, Reader, Writer};
use aldis_envelope::{Dialect, Label};
use aldis_services::{BridgeId, Event, PeerEvent, PeerId};
use bytes::Bytes;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::net::TcpStream;
use tokio::sync::{Notify, watch};

/// How many bytes of content the node may have on their way to one peer.
const CREDIT: usize = 256 * 1024;
/// Credit is given back in portions of this size: a quarter, so that the node never waits for it in vain.
const CREDIT_PORTION: usize = CREDIT / 4;
/// How much is read at once.
const READ_BYTES: usize = 64 * 1024;
/// A frame unfinished for so long gives way where whole frames stand behind its head.
const UNFINISHED_AFTER: Duration = Duration::from_secs(2);

/// The writing side of every connection of a node.
pub(crate) struct Peers {
    dialects: Vec<Dialect>,
    peers: BTreeMap<(BridgeId, PeerId), Peer>,
    dirty: Vec<(BridgeId, PeerId)>,
    next: u64,
}

struct Peer {
    stream: Arc<TcpStream>,
    writer: Writer,
    outgoing: Outgoing,
    /// Wakes the task that waits until the peer takes more.
    blocked: Arc<Notify>,
    done: usize,
    is_dirty: bool,
    is_blocked: bool,
}

impl Peers {
    pub(crate) fn new(dialects: Vec<Dialect>) -> Self {
        Self { dialects, peers: BTreeMap::new(), dirty: Vec::new(), next: 0 }
    }

    fn add(&mut self, bridge: BridgeId, stream: Arc<TcpStream>, blocked: Arc<Notify>) -> PeerId {
        self.next += 1;
        let id = PeerId(self.next);
        let writer = Writer::new(self.dialects.get(bridge.0).copied().unwrap_or_default());
        let outgoing = Outgoing::default();
        let peer = Peer { stream, writer, outgoing, blocked, done: 0, is_dirty: false, is_blocked: false };
        self.peers.insert((bridge, id), peer);
        id
    }

    /// Prepares a message for a peer; [`Self::flush`] writes it.
    pub(crate) fn send(&mut self, bridge: BridgeId, id: PeerId, label: &Arc<Label>, content: &Bytes) {
        let Some(peer) = self.peers.get_mut(&(bridge, id)) else { return };
        peer.writer.write(label, content, peer.outgoing.buffer());
        peer.outgoing.end_frame(content.len());
        if !std::mem::replace(&mut peer.is_dirty, true) {
            self.dirty.push((bridge, id));
        }
    }

    /// Whether anything is prepared.
    pub(crate) fn has_output(&self) -> bool {
        !self.dirty.is_empty()
    }

    /// Writes what was prepared. Tells the node what credit came back.
    pub(crate) fn flush(&mut self, events: &mut Vec<Event>) {
        for (bridge, id) in self.dirty.drain(..) {
            let Some(peer) = self.peers.get_mut(&(bridge, id)) else { continue };
            peer.is_dirty = false;
            if !peer.is_blocked {
                peer.write(bridge, id, events);
            }
        }
    }

    /// The peer may take more again.
    fn unblocked(&mut self, bridge: BridgeId, id: PeerId, events: &mut Vec<Event>) {
        if let Some(peer) = self.peers.get_mut(&(bridge, id)) {
            peer.is_blocked = false;
            peer.write(bridge, id, events);
        }
    }
}

impl Peer {
    fn write(&mut self, bridge: BridgeId, id: PeerId, events: &mut Vec<Event>) {
        let mut out = TryWrite(&self.stream);
        match self.outgoing.write_to(&mut out, &mut self.done) {
            Ok(Written::All) => {}
            // A write that fails is noticed by the reading side too, which ends the connection.
            Ok(Written::Blocked) | Err(_) => {
                self.is_blocked = true;
                self.blocked.notify_one();
            }
        }
        if self.done >= CREDIT_PORTION {
            let ready = PeerEvent::Ready(std::mem::take(&mut self.done));
            events.push(Event::Peer(bridge, id, ready));
        }
    }
}

struct TryWrite<'a>(&'a TcpStream);

impl std::io::Write for TryWrite<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.try_write(bytes)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Serves one connection until it ends.
pub(super) async fn run(
    core: Shared,
    bridge: BridgeId,
    stream: TcpStream,
    from: SocketAddr,
    message_bytes_max: usize,
    paused: watch::Receiver<bool>,
) {
    // Without this a message waits for the acknowledgement of the one before it.
    let _ = stream.set_nodelay(true);
    let (stream, blocked) = (Arc::new(stream), Arc::new(Notify::new()));
    let id = {
        let mut core = core.lock();
        let id = core.peers().add(bridge, stream.clone(), blocked.clone());
        core.handle(&mut vec![Event::Peer(bridge, id, PeerEvent::Up(from.to_string(), CREDIT))]);
        id
    };
    let mut reading =
        Reading { core: core.clone(), bridge, id, reader: Reader::new(message_bytes_max), paused };
    let why = tokio::select! {
        why = reading.run(&stream) => why,
        why = writing(&core, bridge, id, &stream, &blocked) => why,
    };
    let mut core = core.lock();
    core.peers().peers.remove(&(bridge, id));
    core.handle(&mut vec![Event::Peer(bridge, id, PeerEvent::Down(why))]);
}

/// Waits, whenever writing was blocked, until it is not.
async fn writing(
    core: &Shared,
    bridge: BridgeId,
    id: PeerId,
    stream: &TcpStream,
    blocked: &Notify,
) -> String {
    loop {
        blocked.notified().await;
        if let Err(why) = stream.writable().await {
            return why.to_string();
        }
        let mut events = Vec::new();
        let mut core = core.lock();
        core.peers().unblocked(bridge, id, &mut events);
        core.handle(&mut events);
    }
}

struct Reading {
    core: Shared,
    bridge: BridgeId,
    id: PeerId,
    reader: Reader,
    paused: watch::Receiver<bool>,
}

impl Reading {
    /// Reads until the connection ends; why it did.
    async fn run(&mut self, stream: &TcpStream) -> String {
        let mut events = Vec::new();
        let mut progress = Instant::now();
        loop {
            if self.paused.wait_for(|paused| !*paused).await.is_err() {
                return "the node ends".into();
            }
            let readable = tokio::time::timeout(UNFINISHED_AFTER, stream.readable()).await;
            if let Ok(Err(why)) = readable {
                return why.to_string();
            }
            let read = if readable.is_ok() { self.read(stream) } else { Ok(None) };
            match read {
                Ok(Some(0)) => return "it closed the connection".into(),
                Ok(_) => {}
                Err(why) => return why.to_string(),
            }
            self.take_items(&mut events);
            if events.is_empty() && progress.elapsed() >= UNFINISHED_AFTER && self.reader.is_inside_a_frame()
            {
                events.extend(self.reader.abandon_unfinished().map(|item| self.event(item)));
                self.take_items(&mut events);
                progress = Instant::now();
            }
            if !events.is_empty() {
                progress = Instant::now();
                self.core.lock().handle(&mut events);
            }
        }
    }

    /// Reads what is there; none when there is nothing after all.
    fn read(&mut self, stream: &TcpStream) -> std::io::Result<Option<usize>> {
        let buffer = self.reader.buffer();
        buffer.reserve(READ_BYTES);
        match stream.try_read_buf(buffer) {
            Ok(count) => Ok(Some(count)),
            Err(e) if e.kind() == ErrorKind::WouldBlock => Ok(None),
            Err(e) => Err(e),
        }
    }

    fn take_items(&mut self, events: &mut Vec<Event>) {
        while let Some(item) = self.reader.next_item() {
            let event = self.event(item);
            events.push(event);
        }
    }

    fn event(&self, item: Item) -> Event {
        let event = match item {
            Item::Message(message) => PeerEvent::Message(message),
            Item::Bad(error) => PeerEvent::Bad(error),
        };
        Event::Peer(self.bridge, self.id, event)
    }
}
