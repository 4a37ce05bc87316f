//! Carriers of links: they move frames between the node and the world, and know nothing of what is in them.

pub(crate) mod serial;
pub(crate) mod udp;

use aldis_services::link::CarrierId;
use aldis_services::{LinkId, Place};
use std::collections::BTreeMap;

/// Sends frames by one carrier. What cannot be sent now is dropped: the protocol repairs it.
pub(crate) trait Outgoing: Send {
    /// Sends a frame.
    fn send(&mut self, frame: &[u8]);
    /// The peer is at a place that frames came from.
    fn found(&mut self, _place: Place) {}
}

/// The sending sides of all carriers of a node.
#[derive(Default)]
pub(crate) struct Carriers(BTreeMap<(LinkId, CarrierId), Box<dyn Outgoing>>);

impl Carriers {
    /// A carrier can be used.
    pub(crate) fn set(&mut self, link: LinkId, carrier: CarrierId, outgoing: Box<dyn Outgoing>) {
        self.0.insert((link, carrier), outgoing);
    }

    /// A carrier cannot be used any more.
    pub(crate) fn remove(&mut self, link: LinkId, carrier: CarrierId) {
        self.0.remove(&(link, carrier));
    }

    pub(crate) fn send(&mut self, link: LinkId, carrier: CarrierId, frame: &[u8]) {
        if let Some(outgoing) = self.0.get_mut(&(link, carrier)) {
            outgoing.send(frame);
        }
    }

    pub(crate) fn found(&mut self, link: LinkId, carrier: CarrierId, place: Place) {
        if let Some(outgoing) = self.0.get_mut(&(link, carrier)) {
            outgoing.found(place);
        }
    }
}
