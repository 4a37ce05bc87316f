//! Bad links between machines of a world.

use super::{Arrival, NodeHandle, World};
use crate::event::{Event, LinkEvent, LinkId, Place};
use crate::link::CarrierId;
use crate::sim::link::{Profile, Way};
use aldis_envelope::Monotonic;
use bytes::Bytes;
use std::collections::BTreeMap;

/// The links of a world, by the end that sends: machine, link, carrier.
#[derive(Debug, Default)]
pub(super) struct Links {
    ways: BTreeMap<(usize, LinkId, CarrierId), (usize, LinkId, Way)>,
    bytes: BTreeMap<(usize, LinkId), u64>,
}

impl World {
    /// Joins a link of one node to a link of another by a carrier.
    pub fn join(
        &mut self,
        a: (NodeHandle, LinkId),
        b: (NodeHandle, LinkId),
        carrier: CarrierId,
        profile: &Profile,
    ) {
        for (from, to) in [(a, b), (b, a)] {
            let way = Way::new(profile.clone(), self.random.u64(..));
            self.links.ways.insert((from.0.0, from.1, carrier), (to.0.0, to.1, way));
        }
        for (node, link) in [a, b] {
            self.give(node, Event::Link(link, LinkEvent::Up(carrier, profile.mtu)));
        }
    }

    /// Cuts or mends what a node sends by a link, or all that it sends and hears.
    pub fn cut(&mut self, node: NodeHandle, cut: bool) {
        for ((from, ..), (to, _, way)) in &mut self.links.ways {
            if *from == node.0 || *to == node.0 {
                way.cut = cut;
            }
        }
    }

    /// Bytes that a node has sent by a link.
    pub fn link_bytes(&self, node: NodeHandle, link: LinkId) -> u64 {
        self.links.bytes.get(&(node.0, link)).copied().unwrap_or(0)
    }

    /// A node begins a life: its carriers are there.
    pub(super) fn open_links(&mut self, place: usize) {
        let ends = self.links.ways.iter().filter(|((from, ..), _)| *from == place);
        let events = ends.map(|((_, link, carrier), (.., way))| {
            Event::Link(*link, LinkEvent::Up(*carrier, way.profile().mtu))
        });
        let events = events.collect();
        self.handle(place, events);
    }

    pub(super) fn transmit(&mut self, place: usize, link: LinkId, carrier: CarrierId, frame: Vec<u8>) {
        let now: Monotonic = self.now;
        *self.links.bytes.entry((place, link)).or_default() += frame.len() as u64;
        let Some((to, their, way)) = self.links.ways.get_mut(&(place, link, carrier)) else { return };
        let (to, their) = (*to, *their);
        let frame = Bytes::from(frame);
        for at in way.send(now, frame.len()) {
            let event = LinkEvent::Frame(carrier, Place(place as u64), frame.clone());
            self.put(at, to, Arrival::Event(Event::Link(their, event)));
        }
    }
}
