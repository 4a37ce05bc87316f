//! Bad links between machines of a world, and what their nodes keep for them.

use super::{Arrival, NodeHandle, World};
use crate::event::{Event, LinkEvent, LinkId, Place};
use crate::link::{CarrierId, Record};
use crate::sim::link::{Disk, Profile, Way};
use aldis_envelope::Monotonic;
use bytes::Bytes;
use std::collections::BTreeMap;
use std::time::Duration;

/// How long a write takes.
const WRITE_TIME: Duration = Duration::from_millis(2);

/// The links of a world, by the end that sends: machine, link, carrier.
#[derive(Debug, Default)]
pub(super) struct Links {
    ways: BTreeMap<(usize, LinkId, CarrierId), (usize, LinkId, Way)>,
    disks: BTreeMap<usize, Disk>,
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

    /// A node begins a life: its carriers are there, and what its links kept is told.
    pub(super) fn open_links(&mut self, place: usize) {
        if self.machines[place].config.journaled {
            let kept = self.links.disks.entry(place).or_default().read(b"L").into_iter();
            let records = kept.map(|(key, value)| Event::ReadBack(Record::Put { key, value }));
            let events = records.chain([Event::ReadBackEnd]).collect();
            self.handle(place, events);
        }
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

    pub(super) fn persist(&mut self, place: usize, number: u64, records: Vec<Record>) {
        // What is on its way when the machine ends is written all the same: torn writes are the business of `sim::link`.
        let disk = self.links.disks.entry(place).or_default();
        let write = disk.begin(records);
        disk.finish(write);
        self.put(self.now + WRITE_TIME, place, Arrival::Event(Event::Persisted(number)));
    }
}
