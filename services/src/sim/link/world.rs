//! Machines that are joined by bad links, in virtual time.

mod effects;

use super::disk::Disk;
use super::emulator::{Profile, Way};
use crate::link::{
    BatchId, CarrierConfig, CarrierId, Class, Delivery, Event, Link, LinkConfig, LinkKey, Offer, Ticket,
    TicketState, record_prefix,
};
use aldis_envelope::{BootId, EntityId, Envelope, Monotonic, Now, Wall};
use bytes::Bytes;
use std::collections::BTreeMap;
use std::time::Duration;

/// The wall clock at the start of every world: 2026-11-22, in nanoseconds.
const EPOCH: i64 = 1_795_305_600_000_000_000;

/// A machine of the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct MachineId(pub usize);

/// One end of a link at a machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Port(pub MachineId, pub usize);

/// Something that a link said.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// When.
    pub at: Monotonic,
    /// At which end.
    pub port: Port,
    /// What.
    pub what: What,
}

/// What a link said.
#[derive(Debug, Clone, PartialEq)]
pub enum What {
    /// A message arrived.
    Delivered(Delivery),
    /// Word of a ticket.
    Ticket(Ticket, TicketState),
}

/// A machine: its links, its journal, its clock.
#[derive(Debug)]
pub struct Machine {
    entity: EntityId,
    /// Its journal.
    pub disk: Disk,
    boot: u64,
    running: bool,
    clock: i64,
    links: Vec<Slot>,
    /// Commands that its service has handled: by their content, how often. In the journal under `S`.
    handled: BTreeMap<Vec<u8>, u64>,
    /// Messages for other machines go on by these ports.
    pub routes: BTreeMap<EntityId, usize>,
}

#[derive(Debug)]
struct Slot {
    config: LinkConfig,
    link: Link,
    peer: Port,
    armed: Option<Monotonic>,
    /// The way of each carrier to the peer.
    ways: Vec<(CarrierId, Way)>,
    /// When and how many bytes went out.
    sent: Vec<(Monotonic, usize)>,
    bytes: u64,
}

#[derive(Debug)]
enum Happening {
    Frame(Port, CarrierId, Bytes),
    Deadline(Port),
    /// A write of a machine's life is done, for these links.
    Written(MachineId, u64, u64, Vec<(usize, BatchId)>),
}

/// The world.
#[derive(Debug)]
pub struct LinkWorld {
    now: Monotonic,
    random: fastrand::Rng,
    machines: Vec<Machine>,
    queue: BTreeMap<(Monotonic, u64), Happening>,
    counter: u64,
    seen: Vec<Seen>,
    /// How long a write takes.
    pub write_time: Duration,
    /// Whether each frame is noted with its time.
    pub trace: bool,
    /// Frames that were sent, where they are to be kept: for those who would send them again, or change them.
    pub captured: Option<Vec<Bytes>>,
    tickets: u64,
}

impl LinkWorld {
    /// A world drawn from a seed.
    pub fn new(seed: u64) -> Self {
        Self {
            now: Monotonic::START,
            random: fastrand::Rng::with_seed(seed),
            machines: Vec::new(),
            queue: BTreeMap::new(),
            counter: 0,
            seen: Vec::new(),
            write_time: Duration::from_millis(2),
            trace: false,
            captured: None,
            tickets: 0,
        }
    }

    /// Adds a machine that speaks for an entity, with a clock that is off by so much.
    pub fn machine(&mut self, entity: u64, clock_off: i64) -> MachineId {
        let entity = EntityId::new(entity).unwrap_or(EntityId::new(1).unwrap_or_else(|_| unreachable!()));
        self.machines.push(Machine {
            entity,
            disk: Disk::default(),
            boot: 1,
            running: true,
            clock: clock_off,
            links: Vec::new(),
            handled: BTreeMap::new(),
            routes: BTreeMap::new(),
        });
        MachineId(self.machines.len() - 1)
    }

    /// Joins two machines by links with these carriers, the preferred one first. `change` has the last word on each end.
    pub fn join(
        &mut self,
        a: MachineId,
        b: MachineId,
        carriers: &[Profile],
        keys: &[LinkKey],
        change: impl Fn(&mut LinkConfig),
    ) -> (Port, Port) {
        let ports = (Port(a, self.machines[a.0].links.len()), Port(b, self.machines[b.0].links.len()));
        for (own, peer, to) in [(a, b, ports.1), (b, a, ports.0)] {
            let configured = carriers.iter().enumerate().map(|(id, profile)| CarrierConfig {
                id: CarrierId(id as u8),
                rate: profile.rate,
                mtu: profile.mtu,
                round_trip: profile.round_trip(),
                loss: 0.1,
            });
            let (own_entity, peer_entity) = (self.machines[own.0].entity, self.machines[peer.0].entity);
            let mut config = LinkConfig::new(own_entity, peer_entity, configured.collect());
            config.keys = keys.to_vec();
            change(&mut config);
            let ways = carriers
                .iter()
                .enumerate()
                .map(|(id, profile)| (CarrierId(id as u8), Way::new(profile.clone(), self.random.u64(..))));
            let ways = ways.collect();
            let link = Link::new(config.clone(), BootId(self.machines[own.0].boot));
            let slot = Slot { config, link, peer: to, armed: None, ways, sent: Vec::new(), bytes: 0 };
            self.machines[own.0].links.push(slot);
        }
        for port in [ports.0, ports.1] {
            self.open(port);
        }
        ports
    }

    /// The time of the world.
    pub fn now(&self) -> Monotonic {
        self.now
    }

    fn clock(&self, machine: MachineId) -> Now {
        let nanoseconds = i64::try_from(self.now.elapsed().as_nanos()).unwrap_or(i64::MAX - EPOCH);
        Now { monotonic: self.now, wall: Wall(EPOCH + nanoseconds + self.machines[machine.0].clock) }
    }

    /// A machine of the world.
    pub fn of(&mut self, machine: MachineId) -> &mut Machine {
        &mut self.machines[machine.0]
    }

    /// A link of the world.
    pub fn link(&self, port: Port) -> &Link {
        &self.machines[port.0.0].links[port.1].link
    }

    /// Bytes that an end has sent.
    pub fn bytes(&self, port: Port) -> u64 {
        self.machines[port.0.0].links[port.1].bytes
    }

    /// The frames that an end has sent since tracing began: when, how long.
    pub fn sent(&self, port: Port) -> &[(Monotonic, usize)] {
        &self.machines[port.0.0].links[port.1].sent
    }

    /// Cuts or mends the way of a carrier from an end.
    pub fn cut(&mut self, port: Port, carrier: usize, cut: bool) {
        if let Some((_, way)) = self.machines[port.0.0].links[port.1].ways.get_mut(carrier) {
            way.cut = cut;
        }
    }

    /// Cuts or mends all carriers of a link both ways.
    pub fn cut_all(&mut self, port: Port, cut: bool) {
        let peer = self.machines[port.0.0].links[port.1].peer;
        for port in [port, peer] {
            for carrier in 0..self.machines[port.0.0].links[port.1].ways.len() {
                self.cut(port, carrier, cut);
            }
        }
    }

    /// What links have said since this was last asked.
    pub fn take_seen(&mut self) -> Vec<Seen> {
        std::mem::take(&mut self.seen)
    }

    /// How often the machine's service has handled each command, as the journal has it.
    pub fn handled(&self, machine: MachineId) -> BTreeMap<Vec<u8>, u64> {
        read_handled(&self.machines[machine.0].disk)
    }

    /// Offers a message to a link; its ticket.
    pub fn offer(&mut self, port: Port, envelope: Envelope, class: Class) -> Ticket {
        self.tickets += 1;
        let ticket = Ticket(self.tickets);
        self.offer_as(port, ticket, envelope, class);
        ticket
    }

    fn offer_as(&mut self, port: Port, ticket: Ticket, envelope: Envelope, class: Class) {
        let offer = Offer::new(ticket, envelope, class);
        self.give(port, vec![Event::Offer(offer)]);
    }

    /// Gives events to a link.
    pub fn give(&mut self, port: Port, events: Vec<Event>) {
        let mut writes = Vec::new();
        self.handle(port, events, &mut writes);
        self.write(port.0, writes);
    }

    /// A machine dies without warning. Of the writes on their way a number from the seed survives.
    pub fn kill(&mut self, machine: MachineId) {
        let pending = self.machines[machine.0].disk.pending();
        let survivors = self.random.usize(..=pending);
        let machine = &mut self.machines[machine.0];
        machine.disk.crash(survivors);
        machine.running = false;
    }

    /// A dead machine is started again.
    pub fn restart(&mut self, machine: MachineId) {
        let place = machine.0;
        let m = &mut self.machines[place];
        (m.boot, m.running) = (m.boot + 1, true);
        m.handled = read_handled(&m.disk);
        for slot in &mut m.links {
            slot.link = Link::new(slot.config.clone(), BootId(m.boot));
            slot.armed = None;
        }
        for slot in 0..self.machines[place].links.len() {
            self.open(Port(machine, slot));
        }
    }

    fn open(&mut self, port: Port) {
        let machine = &self.machines[port.0.0];
        let slot = &machine.links[port.1];
        let prefix = record_prefix(slot.config.peer);
        let mut events: Vec<_> = machine
            .disk
            .read(&prefix)
            .into_iter()
            .map(|(key, value)| Event::ReadBack { key, value })
            .collect();
        events.push(Event::ReadBackEnd);
        events.extend(slot.ways.iter().map(|(id, way)| Event::CarrierUp(*id, way.profile().mtu)));
        self.give(port, events);
    }

    /// Lets time pass until a moment.
    pub fn run_until(&mut self, end: Monotonic) {
        while let Some(first) = self.queue.first_entry().filter(|first| first.key().0 <= end) {
            let ((at, _), happening) = first.remove_entry();
            self.now = at;
            self.happen(happening);
        }
        self.now = self.now.max(end);
    }

    /// Lets time pass.
    pub fn run_for(&mut self, time: Duration) {
        self.run_until(self.now + time);
    }

    fn happen(&mut self, happening: Happening) {
        match happening {
            Happening::Frame(port, carrier, frame) => {
                if self.machines[port.0.0].running {
                    self.give(port, vec![Event::Frame(carrier, frame)]);
                }
            }
            Happening::Deadline(port) => {
                let machine = &mut self.machines[port.0.0];
                let slot = &mut machine.links[port.1];
                if machine.running && slot.armed == Some(self.now) {
                    slot.armed = None;
                    self.give(port, vec![Event::Deadline]);
                }
            }
            Happening::Written(machine, boot, number, batches) => {
                let m = &mut self.machines[machine.0];
                if m.running && m.boot == boot {
                    m.disk.finish(number);
                    for (slot, batch) in batches {
                        self.give(Port(machine, slot), vec![Event::Written(batch)]);
                    }
                }
            }
        }
    }
}

fn read_handled(disk: &Disk) -> BTreeMap<Vec<u8>, u64> {
    let counted = disk.read(b"S").into_iter();
    counted
        .map(|(key, value)| (key[1..].to_vec(), value.iter().fold(0, |n, b| n << 8 | u64::from(*b))))
        .collect()
}
