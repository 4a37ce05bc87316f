//! The writing side of every peer of a node: effects become bytes out.

use super::outgoing::{Outgoing, Written};
use aldis_envelope::Label;
use aldis_envelope::codec::zmtp::{TopicError, Topics};
use aldis_envelope::codec::{stream, zmtp};
use aldis_services::{BridgeId, Event, PeerEvent, PeerId};
use bytes::Bytes;
use std::collections::BTreeMap;
use std::sync::Arc;
use tokio::net::TcpStream;
use tokio::sync::Notify;

/// How many bytes of content the node may have on their way to one peer.
pub(super) const CREDIT: usize = 256 * 1024;
/// Credit is given back in portions of this size: a quarter, so that the node never waits for it in vain.
const CREDIT_PORTION: usize = CREDIT / 4;

/// Where bytes go, without waiting.
pub(super) trait Sink: Send + Sync {
    /// Writes what is taken now.
    fn try_write(&self, bytes: &[u8]) -> std::io::Result<usize>;
}

impl Sink for TcpStream {
    fn try_write(&self, bytes: &[u8]) -> std::io::Result<usize> {
        Self::try_write(self, bytes)
    }
}

/// How messages are written to a peer.
pub(super) enum Form {
    /// The stream form.
    Stream(stream::Writer),
    /// ZeroMQ, to one that takes everything.
    Pushed(zmtp::Writer),
    /// ZeroMQ, to one that says what it wants.
    Published(zmtp::Writer, Topics),
}

impl Form {
    /// Appends one message, unless the peer does not want it. Says whether it was wanted.
    fn write(&mut self, label: &Arc<Label>, content: &[u8], out: &mut Vec<u8>) -> bool {
        match self {
            Self::Stream(writer) => {
                writer.write(label, content, out);
                true
            }
            Self::Pushed(writer) => writer.write(label, content, None, out),
            Self::Published(writer, topics) => writer.write(label, content, Some(topics), out),
        }
    }
}

/// The peers of all bridges of a node.
#[derive(Default)]
pub(crate) struct Peers {
    peers: BTreeMap<(BridgeId, PeerId), Peer>,
    dirty: Vec<(BridgeId, PeerId)>,
    next: u64,
}

struct Peer {
    sink: Arc<dyn Sink>,
    form: Form,
    outgoing: Outgoing,
    /// Wakes the task that waits until the peer takes more.
    blocked: Arc<Notify>,
    done: usize,
    unwanted: u64,
    is_dirty: bool,
    is_blocked: bool,
}

impl Peers {
    /// The number of a new peer, for one that only gives.
    pub(super) fn number(&mut self) -> PeerId {
        self.next += 1;
        PeerId(self.next)
    }

    pub(super) fn add(
        &mut self,
        bridge: BridgeId,
        sink: Arc<dyn Sink>,
        form: Form,
        blocked: Arc<Notify>,
    ) -> PeerId {
        let id = self.number();
        let outgoing = match form {
            Form::Stream(_) => Outgoing::default(),
            Form::Pushed(_) | Form::Published(..) => Outgoing::zeromq(),
        };
        let peer =
            Peer { sink, form, outgoing, blocked, done: 0, unwanted: 0, is_dirty: false, is_blocked: false };
        self.peers.insert((bridge, id), peer);
        id
    }

    pub(super) fn remove(&mut self, bridge: BridgeId, id: PeerId) {
        self.peers.remove(&(bridge, id));
    }

    /// Prepares a message for a peer; [`Self::flush`] writes it.
    pub(crate) fn send(&mut self, bridge: BridgeId, id: PeerId, label: &Arc<Label>, content: &Bytes) {
        let Some(peer) = self.peers.get_mut(&(bridge, id)) else { return };
        if peer.form.write(label, content, peer.outgoing.buffer()) {
            peer.outgoing.end_frame(content.len());
        } else {
            peer.done += content.len();
            peer.unwanted += 1;
        }
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
                peer.write();
            }
            peer.tell(bridge, id, events);
        }
    }

    /// The peer may take more again.
    pub(super) fn unblocked(&mut self, bridge: BridgeId, id: PeerId, events: &mut Vec<Event>) {
        if let Some(peer) = self.peers.get_mut(&(bridge, id)) {
            peer.is_blocked = false;
            peer.write();
            peer.tell(bridge, id, events);
        }
    }

    /// The peer wants what begins so, or no longer. One that takes everything is not asked.
    pub(super) fn subscribe(
        &mut self,
        bridge: BridgeId,
        id: PeerId,
        topic: &[u8],
        wanted: bool,
    ) -> Result<(), TopicError> {
        match self.peers.get_mut(&(bridge, id)).map(|peer| &mut peer.form) {
            Some(Form::Published(_, topics)) if wanted => topics.subscribe(topic),
            Some(Form::Published(_, topics)) => {
                topics.cancel(topic);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Writes bytes that are no message between the messages.
    pub(super) fn insert(&mut self, bridge: BridgeId, id: PeerId, bytes: &[u8]) {
        if let Some(peer) = self.peers.get_mut(&(bridge, id)) {
            peer.outgoing.buffer().extend_from_slice(bytes);
            peer.outgoing.end_frame(0);
            if !peer.is_blocked {
                peer.write();
            }
        }
    }
}

impl Peer {
    fn write(&mut self) {
        match self.outgoing.write_to(&mut TryWrite(&*self.sink), &mut self.done) {
            Ok(Written::All) => {}
            // A write that fails is noticed by the reading side too, which ends the connection.
            Ok(Written::Blocked) | Err(_) => {
                self.is_blocked = true;
                self.blocked.notify_one();
            }
        }
    }

    fn tell(&mut self, bridge: BridgeId, id: PeerId, events: &mut Vec<Event>) {
        if self.done >= CREDIT_PORTION {
            let ready = PeerEvent::Ready(std::mem::take(&mut self.done));
            events.push(Event::Peer(bridge, id, ready));
        }
        if self.unwanted > 0 {
            let unwanted = PeerEvent::Unwanted(std::mem::take(&mut self.unwanted));
            events.push(Event::Peer(bridge, id, unwanted));
        }
    }
}

struct TryWrite<'a>(&'a dyn Sink);

impl std::io::Write for TryWrite<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.try_write(bytes)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}
