//! What a node knows of each label that it meets: who receives it here, and which stream it belongs to.
//!
//! Labels are shared by the messages of a stream, so that a pointer finds the entry: the hottest look-up of the node.

use crate::dds::Qos;
use crate::event::{BridgeId, LinkId, PublisherId};
use aldis_envelope::{EntityId, KeyHash, Label};
use std::collections::BTreeMap;
use std::sync::Arc;

/// How many labels are remembered; beyond it the memory is forgotten whole.
const LABELS_MAX: usize = 16_384;

/// What is known of a label.
#[derive(Debug)]
pub(crate) struct Entry {
    /// Kept, so that the pointer stays this label's.
    pub(crate) label: Arc<Label>,
    /// The services that receive it, by their place in the host.
    pub(crate) services: Vec<usize>,
    /// The bridges that export it.
    pub(crate) bridges: Vec<BridgeId>,
    /// The links whose rules name it, with the number of the rule.
    pub(crate) links: Vec<(LinkId, usize)>,
    /// Whether it goes out on the bus when it starts here.
    pub(crate) publish: bool,
    /// Whether it is taken when it comes from the bus.
    pub(crate) import: bool,
    /// What its topic promises; none is best effort.
    pub(crate) qos: Option<Qos>,
    /// Whether it is on disk before anybody has it.
    pub(crate) persistent: bool,
    /// Whether it is of what nodes tell one another.
    pub(crate) among_nodes: bool,
    /// Its place among the outgoing streams, once it was sent.
    pub(crate) outgoing: Option<usize>,
    /// Its place among the incoming streams of a node, once it was heard.
    pub(crate) incoming: Option<(EntityId, Option<usize>)>,
    /// The publisher of what has no instance, once there is one.
    pub(crate) publisher: Option<PublisherId>,
    /// What is known of the keys of its instances.
    pub(crate) publishers: BTreeMap<Option<KeyHash>, Standing>,
}

/// How the key of an instance stands.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Standing {
    /// It was put on so often, undeclared.
    Used(u32),
    /// It has a publisher.
    Declared(PublisherId),
}

impl Entry {
    /// An instance has ended: where its key has no publisher, the place of its count is free.
    pub(crate) fn forget_rare(&mut self, instance: Option<KeyHash>) {
        if let Some(Standing::Used(_)) = self.publishers.get(&instance) {
            self.publishers.remove(&instance);
        }
    }
}

/// All labels met.
#[derive(Debug, Default)]
pub(crate) struct Labels {
    places: BTreeMap<usize, usize>,
    entries: Vec<Entry>,
    last: (usize, usize),
}

impl Labels {
    /// The place of a label, if it is known.
    pub(crate) fn place(&mut self, label: &Arc<Label>) -> Option<usize> {
        let pointer = Arc::as_ptr(label) as usize;
        if self.last.0 == pointer {
            return Some(self.last.1);
        }
        let place = *self.places.get(&pointer)?;
        self.last = (pointer, place);
        Some(place)
    }

    /// Remembers a label.
    pub(crate) fn insert(&mut self, entry: Entry) -> usize {
        if self.entries.len() >= LABELS_MAX {
            self.forget();
        }
        self.places.insert(Arc::as_ptr(&entry.label) as usize, self.entries.len());
        self.entries.push(entry);
        self.entries.len() - 1
    }

    /// Forgets everything: subscriptions changed, or there is too much.
    pub(crate) fn forget(&mut self) {
        self.places.clear();
        self.entries.clear();
        self.last = (0, 0);
    }

    pub(crate) fn entry(&mut self, place: usize) -> &mut Entry {
        &mut self.entries[place]
    }
}
