//! A world of machines in virtual time. Within a site the bus is ordered and reliable while it is up, as Zenoh's is; what fails
//! is told by `world/faults`.

mod bus;
mod faults;
mod links;
mod storage;

use super::machine::{Clocks, Machine};
use super::observe::{Checker, Facts, Observation, Seen, Violation};
use super::trace::Trace;
use crate::event::{BridgeId, Effect, Event, PeerEvent, PeerId};
use crate::node::{Node, NodeConfig};
use aldis_envelope::{Keys, Label, Monotonic, Now};
use bus::BusFaults;
use bytes::Bytes;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// A node of the world, by its machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct NodeHandle(usize);

impl NodeHandle {
    pub(super) fn place(self) -> usize {
        self.0
    }
}

impl fmt::Display for NodeHandle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "node {}", self.0)
    }
}

/// What is on its way to a machine.
enum Arrival {
    Sample {
        from: usize,
        key: String,
        deleted: bool,
        header: Vec<u8>,
        content: Bytes,
    },
    Event(Event),
    Deadline,
    /// The disk is done.
    Disk,
    /// The journal wants to try its disk again.
    JournalDeadline,
    /// The loss of the session is noticed, by the machine and by the others.
    SessionLost,
    /// The others notice which tokens are there.
    Tokens,
}

/// A simulated world.
pub struct World {
    now: Monotonic,
    random: fastrand::Rng,
    machines: Vec<Machine>,
    arrivals: BTreeMap<(Monotonic, u64), (usize, Arrival)>,
    counter: u64,
    /// Which machines subscribe to a key, found once for each.
    routes: BTreeMap<String, Vec<usize>>,
    /// When the last sample on a way arrives: ways keep their order.
    last_arrival: BTreeMap<(usize, usize), Monotonic>,
    delay: (Duration, Duration),
    links: links::Links,
    /// The shares of samples that the bus drops, lets others overtake and delivers twice.
    bus_faults: BusFaults,
    facts: Facts,
    checkers: Vec<Box<dyn Checker>>,
    violations: Vec<Violation>,
    trace: Trace,
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
            routes: BTreeMap::new(),
            last_arrival: BTreeMap::new(),
            delay,
            links: links::Links::default(),
            bus_faults: BusFaults::default(),
            facts: Facts::default(),
            checkers: Vec::new(),
            violations: Vec::new(),
            trace: Trace::default(),
        }
    }

    /// Has a checker watch from now on.
    pub fn watch(&mut self, checker: Box<dyn Checker>) {
        self.checkers.push(checker);
    }

    /// Where services tell facts; it is given to them before they are added.
    pub fn facts(&self) -> Facts {
        self.facts.clone()
    }

    /// Adds a machine without a disk and starts its node; its session opens at once.
    ///
    /// # Errors
    /// Why the configuration cannot be.
    pub fn add(&mut self, config: NodeConfig) -> Result<NodeHandle, String> {
        let node = Node::new(config.clone())?;
        self.machines.push(Machine::new(config, Clocks { born: self.now, ..Clocks::default() }));
        let place = self.machines.len() - 1;
        self.start(place, node, Vec::new());
        Ok(NodeHandle(place))
    }

    /// The node of a machine begins a life, with what its journal has told.
    fn start(&mut self, place: usize, mut node: Node, mut events: Vec<Event>) {
        let machine = &mut self.machines[place];
        machine.clocks.born = self.now;
        let mut effects = Vec::new();
        node.handle(machine.clocks.at(self.now), &mut events, &mut effects);
        machine.config.boot = node.boot();
        let boot = node.boot();
        machine.node = Some(node);
        self.observe(place, Seen::Started(boot));
        self.took_place(place, effects);
        self.open_links(place);
        self.open_bus(NodeHandle(place));
    }

    /// Starts the node of a machine again, with a new boot id where no journal gives it one.
    fn start_again(&mut self, place: usize, told: Option<Vec<Event>>) {
        self.machines[place].config.boot.0 += 1;
        match (Node::new(self.machines[place].config.clone()), told) {
            (Ok(node), None) => self.start(place, node, Vec::new()),
            (Ok(node), Some(told)) => self.start(place, node.with_journal(), told),
            (Err(why), _) => self.violate("the world", format!("{}: {why}", NodeHandle(place))),
        }
    }

    /// The true time of the world, on clocks that are right.
    pub fn now(&self) -> Now {
        Clocks::default().at(self.now)
    }

    /// All machines.
    pub fn nodes(&self) -> impl Iterator<Item = NodeHandle> + use<> {
        (0..self.machines.len()).map(NodeHandle)
    }

    /// Whether a node runs.
    pub fn is_running(&self, node: NodeHandle) -> bool {
        self.machines[node.0].node.is_some()
    }

    /// A node of the world.
    ///
    /// # Panics
    /// When it does not run.
    pub fn node(&self, of: NodeHandle) -> &Node {
        self.machines[of.0].node.as_ref().expect("the node runs")
    }

    /// What a node has written to peers of its bridges since the last time.
    pub fn sent(&mut self, of: NodeHandle) -> Vec<(BridgeId, PeerId, Arc<Label>, Bytes)> {
        std::mem::take(&mut self.machines[of.0].sent)
    }

    /// Whether a node has ended.
    pub fn has_exited(&self, node: NodeHandle) -> bool {
        self.machines[node.0].exited
    }

    /// The keys of a node's fleet.
    pub fn keys(&self, of: NodeHandle) -> &Keys {
        &self.machines[of.0].keys
    }

    /// What must not be and was seen.
    pub fn violations(&self) -> &[Violation] {
        &self.violations
    }

    /// How much has happened, and a hash of all of it.
    pub fn trace(&self) -> (u64, u64) {
        (self.trace.count(), self.trace.hash())
    }

    /// The end of what has happened, for people.
    pub fn print_trace(&self) -> String {
        self.trace.print()
    }

    /// Ends all lives and asks the checkers what is missing.
    pub fn finish(&mut self) {
        for place in 0..self.machines.len() {
            self.end(place);
        }
        for mut checker in std::mem::take(&mut self.checkers) {
            for what in checker.finish() {
                self.violate(checker.name(), what);
            }
        }
    }

    /// Gives a node an event now.
    pub fn give(&mut self, to: NodeHandle, event: Event) {
        self.deliver(to.0, event);
    }

    /// Gives a node a message from a peer of its first bridge.
    pub fn give_message(&mut self, to: NodeHandle, peer: u64, message: &'static [u8]) {
        let message = PeerEvent::Message(Bytes::from_static(message));
        self.give(to, Event::Peer(BridgeId(0), PeerId(peer), message));
    }

    /// Lets time pass; stops early where something is seen that must not be.
    pub fn run_for(&mut self, time: Duration) {
        let end = self.now + time;
        while let Some(first) = self.arrivals.first_entry()
            && first.key().0 <= end
            && self.violations.is_empty()
        {
            let ((at, _), (place, arrival)) = first.remove_entry();
            self.now = at;
            self.take(place, arrival);
        }
        self.now = end;
    }

    fn take(&mut self, place: usize, arrival: Arrival) {
        match arrival {
            Arrival::Deadline => self.take_deadline(place),
            Arrival::Event(event) => self.deliver(place, event),
            Arrival::Sample { key, deleted, header, content, .. } => {
                let event = match self.machines[place].decoder.decode(&key, deleted, &header, content) {
                    Ok(envelope) => Event::Sample(envelope),
                    Err(why) => Event::SampleRefused(why),
                };
                self.deliver(place, event);
            }
            Arrival::Disk => self.disk_is_done(place),
            Arrival::JournalDeadline => self.journal_deadline(place),
            Arrival::SessionLost => self.session_is_lost(place),
            Arrival::Tokens => self.tell_tokens(),
        }
    }

    fn take_deadline(&mut self, place: usize) {
        let machine = &mut self.machines[place];
        let Some(armed) = machine.armed else { return };
        if machine.clocks.at(self.now).monotonic >= armed {
            machine.armed = None;
            self.deliver(place, Event::Deadline);
        }
    }

    /// Something reaches a node, which may be stalled.
    fn deliver(&mut self, place: usize, event: Event) {
        let machine = &mut self.machines[place];
        if machine.node.is_none() {
            return;
        }
        if let Some(stalled) = &mut machine.stalled {
            return stalled.push(event);
        }
        match &event {
            Event::Sample(envelope) => self.observe(place, Seen::Arrived(envelope)),
            Event::BusOpened => self.observe(place, Seen::BusUp),
            Event::BusClosed(_) => self.observe(place, Seen::BusDown),
            _ => {}
        }
        self.handle(place, vec![event]);
    }

    fn handle(&mut self, place: usize, mut events: Vec<Event>) {
        let machine = &mut self.machines[place];
        let Some(node) = &mut machine.node else { return };
        let mut effects = Vec::new();
        node.handle(machine.clocks.at(self.now), &mut events, &mut effects);
        self.took_place(place, effects);
    }

    /// What came of a node's turn.
    fn took_place(&mut self, place: usize, effects: Vec<Effect>) {
        for fact in self.facts.take() {
            self.observe(place, Seen::Fact(&*fact));
        }
        for effect in effects {
            self.carry_out(place, effect);
        }
    }

    fn carry_out(&mut self, place: usize, effect: Effect) {
        let machine = &mut self.machines[place];
        match effect {
            Effect::Subscribe(..)
            | Effect::Declare { .. }
            | Effect::Publish(..)
            | Effect::PublishOn(..)
            | Effect::Token(..) => self.carry_out_on_bus(place, effect),
            Effect::Send(bridge, peer, label, content) => machine.sent.push((bridge, peer, label, content)),
            Effect::Job(source, number, job) => {
                let done = Event::Job(source, number, Ok(job()));
                self.arrive(place, place, Arrival::Event(done));
            }
            Effect::Arm(at) => {
                machine.armed = Some(at);
                // A nanosecond is lost in turning one clock into the other.
                let when = machine.clocks.when(at) + Duration::from_nanos(2);
                self.put(when.max(self.now), place, Arrival::Deadline);
            }
            Effect::Append(number, batch) => self.append(place, number, &batch),
            Effect::Exit => machine.exited = true,
            Effect::Say(note) => self.observe(place, Seen::Said(&note)),
            Effect::Transmit(link, carrier, frame) => self.transmit(place, link, carrier, frame),
            // The simulator joins no domain.
            Effect::PauseInput(_) | Effect::Found(..) | Effect::Domain(..) => {}
        }
    }

    /// Something arrives after a delay from the seed, in order on its way.
    fn arrive(&mut self, from: usize, to: usize, arrival: Arrival) {
        let delay = self.draw(self.delay);
        let way = self.last_arrival.entry((from, to)).or_default();
        *way = (self.now + delay).max(*way);
        let at = *way;
        self.put(at, to, arrival);
    }

    fn put(&mut self, at: Monotonic, to: usize, arrival: Arrival) {
        self.counter += 1;
        self.arrivals.insert((at, self.counter), (to, arrival));
    }

    fn draw(&mut self, (least, most): (Duration, Duration)) -> Duration {
        let (least, most) = (least.as_micros() as u64, most.as_micros() as u64);
        Duration::from_micros(self.random.u64(least..=most.max(least)))
    }

    fn observe(&mut self, place: usize, seen: Seen<'_>) {
        let clocks = self.machines[place].clocks.at(self.now);
        let observation = Observation { at: self.now, clocks, node: NodeHandle(place), seen };
        self.trace.record(&observation);
        for checker in &mut self.checkers {
            if let Err(what) = checker.observe(&observation) {
                self.violations.push(Violation { checker: checker.name(), at: self.now, what });
            }
        }
    }

    fn violate(&mut self, checker: &'static str, what: String) {
        self.violations.push(Violation { checker, at: self.now, what });
    }
}
