//! What the machines of a world do with what their links ask for.

use super::{Happening, LinkWorld, Port, Seen, What};
use crate::link::{BatchId, CarrierId, Delivery, Effect, Event, Offer, Record, Ticket};
use crate::sim::link::MachineId;
use aldis_envelope::Monotonic;
use bytes::Bytes;

/// What the links of a machine ask to be written in one turn: which link, its batch, its records.
type Writes = Vec<(usize, BatchId, Vec<Record>)>;

impl LinkWorld {
    /// All that the links of a machine ask to be written in one turn is written as one.
    pub(super) fn write(&mut self, machine: MachineId, writes: Writes) {
        if writes.is_empty() {
            return;
        }
        let batches = writes.iter().map(|(slot, batch, _)| (*slot, *batch)).collect();
        let records = writes.into_iter().flat_map(|(_, _, records)| records).collect();
        let m = &mut self.machines[machine.0];
        let (number, boot) = (m.disk.begin(records), m.boot);
        let at = self.now + self.write_time;
        self.later(at, Happening::Written(machine, boot, number, batches));
    }

    pub(super) fn later(&mut self, at: Monotonic, happening: Happening) {
        self.counter += 1;
        self.queue.insert((at, self.counter), happening);
    }

    pub(super) fn handle(&mut self, port: Port, mut events: Vec<Event>, writes: &mut Writes) {
        let now = self.clock(port.0);
        let mut effects = Vec::new();
        self.machines[port.0.0].links[port.1].link.handle(now, &mut events, &mut effects);
        for effect in effects {
            self.carry_out(port, effect, writes);
        }
    }

    fn carry_out(&mut self, port: Port, effect: Effect, writes: &mut Writes) {
        match effect {
            Effect::Transmit(carrier, frame) => self.send(port, carrier, frame),
            Effect::Persist(batch, records) => writes.push((port.1, batch, records)),
            Effect::Arm(at) => {
                self.machines[port.0.0].links[port.1].armed = Some(at);
                self.later(at, Happening::Deadline(port));
            }
            Effect::Deliver(delivery) => self.on_delivery(port, delivery, writes),
            Effect::Ticket(ticket, state) => {
                let what = What::Ticket(ticket, state);
                self.seen.push(Seen { at: self.now, port, what });
            }
            Effect::Peer(_) | Effect::Note(_) => {}
        }
    }

    fn send(&mut self, port: Port, carrier: CarrierId, frame: Vec<u8>) {
        let (now, trace) = (self.now, self.trace);
        let slot = &mut self.machines[port.0.0].links[port.1];
        slot.bytes += frame.len() as u64;
        if trace {
            slot.sent.push((now, frame.len()));
        }
        let peer = slot.peer;
        let way = slot.ways.iter_mut().find(|(id, _)| *id == carrier);
        let arrivals = way.map(|(_, way)| way.send(now, frame.len())).unwrap_or_default();
        let frame = Bytes::from(frame);
        if let Some(captured) = &mut self.captured {
            captured.push(frame.clone());
        }
        for at in arrivals {
            self.later(at, Happening::Frame(peer, carrier, frame.clone()));
        }
    }

    /// A message arrived: it goes on where it is for another machine, otherwise the service handles it, and what it does is
    /// written together with that it is done.
    fn on_delivery(&mut self, port: Port, delivery: Delivery, writes: &mut Writes) {
        let machine = &mut self.machines[port.0.0];
        let to = delivery.envelope.message.label.address.entity().filter(|to| *to != machine.entity);
        let on = to.and_then(|to| machine.routes.get(&to)).copied();
        let id = delivery.id;
        let mut with = Vec::new();
        if let Some(slot) = on {
            self.tickets += 1;
            let (ticket, envelope) = (Ticket(self.tickets), delivery.envelope.clone());
            let offer = Offer::new(ticket, envelope, delivery.class);
            self.handle(Port(port.0, slot), vec![Event::Offer(offer)], writes);
        } else if id.is_some() {
            let content = delivery.envelope.message.content.to_vec();
            let times = machine.handled.entry(content.clone()).or_default();
            *times += 1;
            with.push(Record::Put {
                key: [b"S", &content[..]].concat().into(),
                value: times.to_be_bytes().to_vec().into(),
            });
        }
        self.seen.push(Seen { at: self.now, port, what: What::Delivered(delivery) });
        if let Some(delivery) = id {
            self.handle(port, vec![Event::Done { delivery, with }], writes);
        }
    }
}
