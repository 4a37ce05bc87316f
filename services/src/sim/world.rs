//! A world of nodes that share a bus: ordered and reliable between open sessions, with delays drawn from the seed.

use super::network::meets;
use crate::event::{BridgeId, Effect, Event, PeerEvent, PeerId, PublisherId};
use crate::node::{Node, NodeConfig};
use aldis_envelope::codec::native::{Decoder, encode_variable};
use aldis_envelope::{Change, Envelope, Keys, Label, Monotonic, Now, Source, Wall};
use bytes::Bytes;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

/// A node of the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct NodeHandle(usize);

/// The wall clock at the start of every world: 2026-11-22, in nanoseconds.
const EPOCH: i64 = 1_795_305_600_000_000_000;

struct Machine {
    node: Node,
    keys: Keys,
    decoder: Decoder,
    open: bool,
    subscriptions: Vec<String>,
    publishers: BTreeMap<PublisherId, (String, Vec<u8>)>,
    tokens: BTreeSet<Source>,
    armed: Option<Monotonic>,
    sent: Vec<(BridgeId, PeerId, Arc<Label>, Bytes)>,
    exited: bool,
}

/// What is on its way to a node.
enum Arrival {
    Sample { key: String, deleted: bool, header: Vec<u8>, content: Bytes },
    Event(Event),
    Deadline,
}

/// A simulated world.
pub struct World {
    now: Monotonic,
    random: fastrand::Rng,
    machines: Vec<Machine>,
    arrivals: BTreeMap<(Monotonic, u64), (usize, Arrival)>,
    counter: u64,
    /// When the last sample on a way arrives: ways keep their order.
    last_arrival: BTreeMap<(usize, usize), Monotonic>,
    delay: (Duration, Duration),
}

impl World {
    /// A world drawn from a seed, with delays on the bus between two bounds.
    pub fn new(seed: u64, delay: (Duration, Duration)) -> Self {
        Self {
            now: Monotonic::START,
            random: fastrand::Rng::with_seed(seed),
            machines: Vec::new(),
            arrivals: BTreeMap::new(),
            counter: 0,
            last_arrival: BTreeMap::new(),
            delay,
        }
    }

    /// Adds a node and starts it; its session opens at once.
    ///
    /// # Errors
    /// Why the configuration cannot be.
    pub fn add(&mut self, config: NodeConfig) -> Result<NodeHandle, String> {
        let keys = Keys::new(&config.fleet);
        let decoder = Decoder::new(keys.clone());
        self.machines.push(Machine {
            node: Node::new(config)?,
            keys,
            decoder,
            open: false,
            subscriptions: Vec::new(),
            publishers: BTreeMap::new(),
            tokens: BTreeSet::new(),
            armed: None,
            sent: Vec::new(),
            exited: false,
        });
        let place = self.machines.len() - 1;
        self.handle(place, Vec::new());
        self.open_bus(NodeHandle(place));
        Ok(NodeHandle(place))
    }

    /// The time of the world.
    pub fn now(&self) -> Now {
        let wall = Wall(EPOCH + i64::try_from(self.now.elapsed().as_nanos()).unwrap_or(i64::MAX - EPOCH));
        Now { monotonic: self.now, wall }
    }

    /// A node of the world.
    pub fn node(&self, of: NodeHandle) -> &Node {
        &self.machines[of.0].node
    }

    /// What a node has written to peers of its bridges since the last time.
    pub fn sent(&mut self, of: NodeHandle) -> Vec<(BridgeId, PeerId, Arc<Label>, Bytes)> {
        std::mem::take(&mut self.machines[of.0].sent)
    }

    /// Whether a node has ended.
    pub fn has_exited(&self, node: NodeHandle) -> bool {
        self.machines[node.0].exited
    }

    /// Opens the session of a node: it hears the tokens that are there.
    pub fn open_bus(&mut self, of: NodeHandle) {
        self.machines[of.0].open = true;
        self.handle(of.0, vec![Event::BusOpened]);
        let others = self.machines.iter().enumerate().filter(|(i, m)| *i != of.0 && m.open);
        let tokens: Vec<_> = others.flat_map(|(_, m)| m.tokens.iter().copied()).collect();
        for token in tokens {
            self.arrive(of.0, of.0, Arrival::Event(Event::Alive(token, true)));
        }
        self.arrive(of.0, of.0, Arrival::Event(Event::AliveKnown));
    }

    /// Closes the session of a node: it is silent and deaf until it opens again.
    pub fn close_bus(&mut self, of: NodeHandle) {
        self.machines[of.0].open = false;
        let tokens: Vec<_> = std::mem::take(&mut self.machines[of.0].tokens).into_iter().collect();
        for token in tokens {
            self.tell_token(of.0, token, false);
        }
        self.handle(of.0, vec![Event::BusClosed("the simulator closed it".into())]);
    }

    /// Gives a node an event now.
    pub fn give(&mut self, to: NodeHandle, event: Event) {
        self.handle(to.0, vec![event]);
    }

    /// Gives a node a message from a peer of its first bridge.
    pub fn give_message(&mut self, to: NodeHandle, peer: u64, message: &'static [u8]) {
        let message = PeerEvent::Message(Bytes::from_static(message));
        self.give(to, Event::Peer(BridgeId(0), PeerId(peer), message));
    }

    /// Lets time pass.
    pub fn run_for(&mut self, time: Duration) {
        let end = self.now + time;
        while let Some(first) = self.arrivals.first_entry()
            && first.key().0 <= end
        {
            let ((at, _), (place, arrival)) = first.remove_entry();
            self.now = at;
            self.take(place, arrival);
        }
        self.now = end;
    }

    fn take(&mut self, place: usize, arrival: Arrival) {
        let machine = &mut self.machines[place];
        let event = match arrival {
            Arrival::Deadline => {
                if machine.armed != Some(self.now) {
                    return;
                }
                Event::Deadline
            }
            Arrival::Event(event) => event,
            Arrival::Sample { key, deleted, header, content } => {
                if !machine.open {
                    return;
                }
                match machine.decoder.decode(&key, deleted, &header, content) {
                    Ok(envelope) => Event::Sample(envelope),
                    Err(why) => Event::SampleRefused(why),
                }
            }
        };
        self.handle(place, vec![event]);
    }

    fn handle(&mut self, place: usize, mut events: Vec<Event>) {
        let now = self.now();
        let mut effects = Vec::new();
        self.machines[place].node.handle(now, &mut events, &mut effects);
        for effect in effects {
            self.carry_out(place, effect);
        }
    }

    fn carry_out(&mut self, place: usize, effect: Effect) {
        let machine = &mut self.machines[place];
        match effect {
            Effect::Subscribe(expressions) => machine.subscriptions = expressions,
            Effect::Declare { publisher, key, constant, .. } => {
                machine.publishers.insert(publisher, (key, constant));
            }
            Effect::Publish(publisher, envelope) => {
                let (key, mut header) = machine.publishers[&publisher].clone();
                encode_variable(&envelope.message, &envelope.stamp, &mut header);
                self.publish(place, key, header, &envelope);
            }
            Effect::PublishOn(key, envelope) => {
                let mut header = Vec::new();
                aldis_envelope::codec::native::encode(&envelope, &mut header);
                self.publish(place, key, header, &envelope);
            }
            Effect::Token(source, true) if machine.tokens.insert(source) => {
                self.tell_token(place, source, true)
            }
            Effect::Token(source, false) if machine.tokens.remove(&source) => {
                self.tell_token(place, source, false)
            }
            Effect::Send(bridge, peer, label, content) => machine.sent.push((bridge, peer, label, content)),
            Effect::Job(source, number, job) => {
                let done = Event::Job(source, number, Ok(job()));
                self.arrive(place, place, Arrival::Event(done));
            }
            Effect::Arm(at) => {
                machine.armed = Some(at);
                self.counter += 1;
                self.arrivals.insert((at.max(self.now), self.counter), (place, Arrival::Deadline));
                machine.armed = Some(at.max(self.now));
            }
            Effect::Exit => machine.exited = true,
            Effect::Token(..) | Effect::PauseInput(_) | Effect::Say(_) => {}
        }
    }

    fn publish(&mut self, from: usize, key: String, header: Vec<u8>, envelope: &Envelope) {
        if !self.machines[from].open {
            return;
        }
        let deleted = envelope.message.change == Change::Dispose;
        for to in 0..self.machines.len() {
            let machine = &self.machines[to];
            if to != from && machine.open && machine.subscriptions.iter().any(|e| meets(e, &key)) {
                let (key, header, content) = (key.clone(), header.clone(), envelope.message.content.clone());
                self.arrive(from, to, Arrival::Sample { key, deleted, header, content });
            }
        }
    }

    fn tell_token(&mut self, from: usize, source: Source, alive: bool) {
        let told: Vec<_> = (0..self.machines.len()).filter(|&i| i != from && self.machines[i].open).collect();
        for to in told {
            self.arrive(from, to, Arrival::Event(Event::Alive(source, alive)));
        }
    }

    /// Something arrives after a delay from the seed, in order on its way.
    fn arrive(&mut self, from: usize, to: usize, arrival: Arrival) {
        let (least, most) = (self.delay.0.as_micros() as u64, self.delay.1.as_micros() as u64);
        let delay = Duration::from_micros(self.random.u64(least..=most.max(least)));
        let way = self.last_arrival.entry((from, to)).or_default();
        *way = (self.now + delay).max(*way);
        self.counter += 1;
        self.arrivals.insert((*way, self.counter), (to, arrival));
    }

    /// The keys of a node's fleet.
    pub fn keys(&self, of: NodeHandle) -> &Keys {
        &self.machines[of.0].keys
    }
}
