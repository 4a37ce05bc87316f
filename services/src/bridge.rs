//! A bridge as the node sees it: what enters, what leaves, and how much its peers can take.

use crate::counters::counters;
use crate::event::PeerId;
use crate::map::uxas::{Imported, Importer, Refused};
use aldis_envelope::{ContentType, Dialect, EntityId, Label, Monotonic, Prefix, Source};
use bytes::Bytes;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Duration;

/// What a bridge is configured to do.
#[derive(Debug, Clone)]
pub struct BridgeSpec {
    /// Its ids: the node's own entity, and a service id of 20 to 99.
    pub source: Source,
    /// Its name, for people.
    pub name: String,
    /// How it writes ids.
    pub dialect: Dialect,
    /// Which addresses enter.
    pub import: Vec<Prefix>,
    /// Which addresses leave.
    pub export: Vec<Prefix>,
    /// How many messages may wait for one peer; over half of it the node stops reading.
    pub queue_messages_max: usize,
    /// How long a peer that takes nothing holds up others.
    pub stall_timeout: Duration,
    /// The one peer that this bridge leads to, where it has a name: what came from it by any bridge never returns to it.
    pub peer: Option<String>,
    /// Whether everything that enters becomes the bridge's own, as OpenUxAS has it by default.
    pub self_generated: bool,
}

counters! {
    /// What a bridge counts.
    BridgeCounters {
    /// Messages that entered.
    imported,
    /// Messages written to peers, one for each peer.
    exported,
    /// Messages whose source `0|0` was assigned.
    sources_assigned,
    /// Messages whose source was replaced by the bridge's own.
    sources_rewritten,
    /// Messages refused because they are malformed.
    refused_malformed,
    /// Messages refused because of a source that this node does not speak for.
    refused_foreign_entity,
    /// Messages that no import prefix matches.
    filtered,
    /// Stretches of a stream that were no message.
    frames_bad,
    /// Bytes outside frames.
    bytes_skipped,
    /// Messages of one frame where seven are spoken, or of several where one is.
    framing_wrong,
    /// Messages over the limit.
    too_large,
    /// Messages that were not written to a peer because it had not subscribed to them.
    not_subscribed,
    /// Messages for a peer that took nothing for too long.
    shed_stalled,
    /// Messages for a peer whose queue was full.
    shed_full,
    /// Peers that came.
    peers_seen,
    }
}

#[derive(Debug, Default)]
struct Peer {
    name: String,
    gives_alone: bool,
    credit: usize,
    queue: VecDeque<(Arc<Label>, Bytes)>,
    waiting_since: Option<Monotonic>,
    stalled: bool,
}

/// A message of a peer as it came.
#[derive(Debug)]
pub(crate) enum Incoming {
    Delimited(Bytes),
    Parts(Vec<Bytes>),
}

/// What became of a message for a peer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sent {
    Now,
    Later,
    Shed,
}

/// The state of a bridge.
#[derive(Debug)]
pub(crate) struct Bridge {
    pub(crate) spec: BridgeSpec,
    pub(crate) counters: BridgeCounters,
    pub(crate) state: String,
    importer: Importer,
    peers: BTreeMap<PeerId, Peer>,
    /// Those of the peers that take messages, in their order.
    takers: Vec<PeerId>,
}

impl Bridge {
    pub(crate) fn new(spec: BridgeSpec, entities: &[EntityId]) -> Self {
        let importer = Importer::new(spec.source, entities.to_vec(), spec.import.clone());
        let importer = if spec.self_generated { importer.self_generated() } else { importer };
        let state = "starting".to_owned();
        let (counters, peers) = (BridgeCounters::default(), BTreeMap::new());
        Self { spec, counters, state, importer, peers, takers: Vec::new() }
    }

    /// Whether messages with this label leave here: UxAS reads nothing but `lmcp`.
    pub(crate) fn exports(&self, label: &Label) -> bool {
        label.attributes.content_type == ContentType::Lmcp
            && self.spec.export.iter().any(|prefix| prefix.matches(&label.address))
    }

    pub(crate) fn peer_up(&mut self, peer: PeerId, name: String, credit: usize) {
        self.counters.peers_seen += 1;
        self.peers.insert(peer, Peer { name, credit, ..Peer::default() });
        self.see_takers();
    }

    /// A peer that takes nothing.
    pub(crate) fn giver_up(&mut self, peer: PeerId, name: String) {
        self.counters.peers_seen += 1;
        self.peers.insert(peer, Peer { name, gives_alone: true, ..Peer::default() });
        self.see_takers();
    }

    pub(crate) fn peer_down(&mut self, peer: PeerId) -> Option<String> {
        let gone = self.peers.remove(&peer)?;
        self.see_takers();
        self.counters.shed_stalled += gone.queue.len() as u64;
        Some(gone.name)
    }

    pub(crate) fn peer_name(&self, peer: PeerId) -> &str {
        self.peers.get(&peer).map_or("a former peer", |peer| &peer.name)
    }

    /// One after the other of those that take messages.
    pub(crate) fn taker(&self, place: usize) -> Option<PeerId> {
        self.takers.get(place).copied()
    }

    fn see_takers(&mut self) {
        self.takers = self.peers.iter().filter(|(_, peer)| !peer.gives_alone).map(|(&id, _)| id).collect();
    }

    /// Whether both lead to one peer.
    pub(crate) fn leads_where(&self, other: &Self) -> bool {
        self.spec.peer.is_some() && self.spec.peer == other.spec.peer
    }

    /// So many messages counted as exported were not wanted by their peer.
    pub(crate) fn unwanted(&mut self, count: u64) {
        self.counters.exported = self.counters.exported.saturating_sub(count);
        self.counters.not_subscribed += count;
    }

    pub(crate) fn status(&self) -> String {
        match self.peers.len() {
            0 => self.state.clone(),
            1 => format!("{}, 1 peer", self.state),
            n => format!("{}, {n} peers", self.state),
        }
    }

    /// Reads a message of a peer and counts what becomes of it.
    pub(crate) fn import(&mut self, message: Incoming) -> Result<Imported, Refused> {
        let read = match message {
            Incoming::Delimited(message) => self.importer.read(message),
            Incoming::Parts(frames) => self.importer.read_parts(&frames),
        };
        match &read {
            Ok(imported) => {
                self.counters.imported += 1;
                self.counters.sources_assigned += u64::from(imported.assigned);
                self.counters.sources_rewritten += u64::from(imported.rewritten);
            }
            Err(Refused::Malformed(_) | Refused::Parts(_)) => self.counters.refused_malformed += 1,
            Err(Refused::ForeignEntity(_)) => self.counters.refused_foreign_entity += 1,
            Err(Refused::Filtered) => self.counters.filtered += 1,
        }
        read
    }

    /// Sends a message to a peer, now or when it can take it.
    pub(crate) fn send(&mut self, now: Monotonic, to: PeerId, label: &Arc<Label>, content: &Bytes) -> Sent {
        let Some(peer) = self.peers.get_mut(&to) else { return Sent::Shed };
        if peer.credit > 0 && peer.queue.is_empty() {
            peer.credit = peer.credit.saturating_sub(content.len());
            self.counters.exported += 1;
            return Sent::Now;
        }
        if peer.stalled {
            self.counters.shed_stalled += 1;
            return Sent::Shed;
        }
        if peer.queue.len() >= self.spec.queue_messages_max {
            self.counters.shed_full += 1;
            return Sent::Shed;
        }
        peer.waiting_since.get_or_insert(now);
        peer.queue.push_back((label.clone(), content.clone()));
        Sent::Later
    }

    /// The peer can take more: what waits for it goes out.
    pub(crate) fn ready(&mut self, now: Monotonic, of: PeerId, bytes: usize) -> Vec<(Arc<Label>, Bytes)> {
        let Some(peer) = self.peers.get_mut(&of) else { return Vec::new() };
        peer.credit = peer.credit.saturating_add(bytes);
        peer.stalled = false;
        let mut out = Vec::new();
        while peer.credit > 0
            && let Some((label, content)) = peer.queue.pop_front()
        {
            peer.credit = peer.credit.saturating_sub(content.len());
            out.push((label, content));
        }
        peer.waiting_since = (!peer.queue.is_empty()).then_some(now);
        self.counters.exported += out.len() as u64;
        out
    }

    /// Whether a peer that is not given up has so much waiting that reading must stop.
    pub(crate) fn is_congested(&self) -> bool {
        self.peers.values().any(|peer| peer.queue.len() * 2 > self.spec.queue_messages_max)
    }

    /// When a waiting peer is to be given up, if nothing changes.
    pub(crate) fn next_deadline(&self) -> Option<Monotonic> {
        self.peers
            .values()
            .filter_map(|peer| peer.waiting_since)
            .min()
            .map(|since| since + self.spec.stall_timeout)
    }

    /// Gives up peers that took nothing for too long: what waits for them is shed. Returns their names and how much.
    pub(crate) fn give_up_stalled(&mut self, now: Monotonic) -> Vec<(String, usize)> {
        let mut given_up = Vec::new();
        for peer in self.peers.values_mut() {
            if peer.waiting_since.is_some_and(|since| now - since >= self.spec.stall_timeout) {
                self.counters.shed_stalled += peer.queue.len() as u64;
                given_up.push((peer.name.clone(), peer.queue.len()));
                peer.queue.clear();
                peer.waiting_since = None;
                peer.stalled = true;
            }
        }
        given_up
    }
}
