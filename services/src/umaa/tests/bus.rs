//! A bus with the semantics that services are promised: each writer's samples in their order and once, retained samples for
//! those who come later, what a former life retained, liveliness, confirmations. Delays, crashes and silent links come from
//! the test; everything else from the seed.

use crate::service::{Action, Input, Outbox, Service, Unconfirmed};
use crate::sim::umaa::flow::Flow;
use aldis_envelope::{
    BootId, Change, EntityId, Envelope, Fleet, GuidForm, Guids, KeyHash, Message, Monotonic, Now, Prefix,
    Priority, ServiceId, Source, Stamp, Wall,
};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

/// How long a node that is silent stays in the set of readers, and its token alive.
pub(crate) const LEASE: Duration = Duration::from_secs(10);
/// The wall clock of a node whose clock is right, at the start.
const EPOCH: i64 = 1_795_305_600_000_000_000;

pub(crate) type Factory = Arc<dyn Fn() -> Box<dyn Service> + Send + Sync>;

pub(crate) fn source(entity: u64, service: u64) -> Source {
    Source::new(EntityId::new(entity).unwrap(), ServiceId::new(service).unwrap())
}

pub(crate) fn guids() -> Guids {
    Guids::new(&Fleet::new("blue").unwrap(), GuidForm::Readable)
}

enum Arrival {
    Message(Source, Envelope),
    Token(Source, bool),
    /// A sample with this number has reached a reader.
    Acknowledged(Source, u64),
    GiveUp(u64),
    Deadline(Monotonic),
    LeaveReaders,
}

struct Running {
    service: Box<dyn Service>,
    outbox: Outbox,
    prefixes: Vec<Prefix>,
}

struct Machine {
    factory: Factory,
    running: Option<Running>,
    clock_offset: i64,
    /// Own samples by topic and instance: what a late joiner gets, and the next life.
    retained: BTreeMap<(String, KeyHash), Envelope>,
    /// When it became silent, where it has not left the set of readers.
    silent_since: Option<Monotonic>,
    /// Whether it counts as a reader and its token is alive.
    is_known: bool,
    lives: u64,
    /// When its deadline is to come.
    armed: Option<Monotonic>,
    /// What it has heard in this life, by writer and sequence.
    heard: BTreeSet<(Source, u64)>,
}

/// A sample that waits for its readers.
struct Confirming {
    writer: Source,
    number: u64,
    missing: BTreeSet<Source>,
}

pub(crate) struct Bus {
    now: Monotonic,
    pub(crate) random: fastrand::Rng,
    delay_max: Duration,
    machines: BTreeMap<Source, Machine>,
    arrivals: BTreeMap<(Monotonic, u64), (Source, Arrival)>,
    counter: u64,
    last_arrival: BTreeMap<(Source, Source), Monotonic>,
    /// What waits behind a silent link.
    held_back: BTreeMap<(Source, Source), Vec<Arrival>>,
    silent: BTreeSet<(Source, Source)>,
    confirming: BTreeMap<u64, Confirming>,
    pub(crate) checker: Flow,
    pub(crate) notes: Vec<String>,
}

impl Bus {
    pub(crate) fn new(seed: u64, delay_max: Duration) -> Self {
        Self {
            now: Monotonic::START,
            random: fastrand::Rng::with_seed(seed),
            delay_max,
            machines: BTreeMap::new(),
            arrivals: BTreeMap::new(),
            counter: 0,
            last_arrival: BTreeMap::new(),
            held_back: BTreeMap::new(),
            silent: BTreeSet::new(),
            confirming: BTreeMap::new(),
            checker: Flow::default(),
            notes: Vec::new(),
        }
    }

    fn now(&self, of: Source) -> Now {
        let offset = self.machines[&of].clock_offset;
        let elapsed = i64::try_from(self.now.elapsed().as_nanos()).unwrap();
        Now { monotonic: self.now, wall: Wall(EPOCH + offset + elapsed) }
    }

    /// Adds a service whose wall clock is wrong by so many nanoseconds, and starts it.
    pub(crate) fn add(&mut self, source: Source, clock_offset: i64, factory: Factory) {
        let (retained, silent_since, is_known, lives) = (BTreeMap::new(), None, false, 0);
        let (running, armed, heard) = (None, None, BTreeSet::new());
        let machine =
            Machine { factory, running, clock_offset, retained, silent_since, is_known, lives, armed, heard };
        self.machines.insert(source, machine);
        self.start(source);
    }

    /// Starts a service, again after a crash: all that is retained comes before anything new.
    pub(crate) fn start(&mut self, source: Source) {
        let machine = self.machines.get_mut(&source).unwrap();
        let service = (machine.factory)();
        let prefixes = service.subscriptions();
        machine.running = Some(Running { service, outbox: Outbox::new(source), prefixes });
        (machine.silent_since, machine.is_known, machine.lives) = (None, true, machine.lives + 1);
        machine.armed = None;
        machine.heard.clear();
        let own: Vec<_> = machine.retained.values().cloned().collect();
        self.arrivals.retain(|_, (to, _)| *to != source);
        self.held_back.retain(|(_, to), _| *to != source);
        self.give(source, Input::Started);
        own.iter().for_each(|envelope| self.give(source, Input::Recovered(envelope)));
        let others: Vec<_> = self.machines.keys().copied().filter(|other| *other != source).collect();
        let mut all_is_told = true;
        for other in others {
            if self.machines[&other].running.is_none() {
                continue;
            }
            if self.silent.contains(&(other, source)) {
                all_is_told = false;
                continue;
            }
            self.give_token(source, other, true);
            for told in self.unheard(other, source) {
                self.hear(source, other, &told);
            }
        }
        self.give(source, Input::HistoryComplete(all_is_told));
        self.tell_all(source, true);
        // What it retains reaches those who came while it was away.
        let others: Vec<_> = self.machines.keys().copied().filter(|other| *other != source).collect();
        for other in others {
            for told in self.unheard(source, other) {
                self.arrive(source, other, Arrival::Message(source, told));
            }
        }
    }

    /// What one retains that another has not heard, in the order of its writing.
    fn unheard(&self, from: Source, to: Source) -> Vec<Envelope> {
        let heard = &self.machines[&to].heard;
        let retained = self.machines[&from].retained.values();
        let unheard = retained.filter(|told| !heard.contains(&(from, told.stamp.sequence)));
        let mut unheard: Vec<_> = unheard.filter(|told| self.receives(to, told)).cloned().collect();
        unheard.sort_by_key(|told| told.stamp.sequence);
        unheard
    }

    /// A sample reaches a service, once.
    fn hear(&mut self, to: Source, from: Source, envelope: &Envelope) {
        let sequence = envelope.stamp.sequence;
        if self.receives(to, envelope) && self.machines.get_mut(&to).unwrap().heard.insert((from, sequence)) {
            self.give(to, Input::Message(envelope));
            if self.confirming.contains_key(&sequence) {
                self.arrive(to, from, Arrival::Acknowledged(to, sequence));
            }
        }
    }

    /// A service is gone without a word. What is journaled stays, what is on its way too.
    pub(crate) fn crash(&mut self, source: Source) {
        let machine = self.machines.get_mut(&source).unwrap();
        machine.running = None;
        machine.silent_since = Some(self.now);
        self.arrivals.retain(|_, (to, _)| *to != source);
        self.confirming.retain(|_, confirming| confirming.writer != source);
        self.at(self.now + LEASE, source, Arrival::LeaveReaders);
    }

    /// A service crashes and loses what it had retained too.
    pub(crate) fn crash_with_its_disk(&mut self, source: Source) {
        self.crash(source);
        let lost = std::mem::take(&mut self.machines.get_mut(&source).unwrap().retained);
        lost.values().for_each(|envelope| self.checker.lost(envelope));
    }

    pub(crate) fn shut_down(&mut self, source: Source) {
        self.give(source, Input::Shutdown);
        let machine = self.machines.get_mut(&source).unwrap();
        (machine.running, machine.is_known) = (None, false);
        self.arrivals.retain(|_, (to, _)| *to != source);
        self.tell_all(source, false);
    }

    /// Nothing passes between two services until the link is heard again.
    pub(crate) fn silence(&mut self, one: Source, other: Source) {
        self.silent.extend([(one, other), (other, one)]);
        self.at(self.now + LEASE, one, Arrival::Token(other, false));
        self.at(self.now + LEASE, other, Arrival::Token(one, false));
    }

    /// The link is heard again: what waited comes, in its order.
    pub(crate) fn heal(&mut self, one: Source, other: Source) {
        for (from, to) in [(one, other), (other, one)] {
            if self.silent.remove(&(from, to)) {
                self.arrive(from, to, Arrival::Token(from, true));
                for arrival in self.held_back.remove(&(from, to)).unwrap_or_default() {
                    self.arrive(from, to, arrival);
                }
                for told in self.unheard(from, to) {
                    self.arrive(from, to, Arrival::Message(from, told));
                }
            }
        }
    }

    /// Wakes a service, so that it does what the test wishes.
    pub(crate) fn wake(&mut self, source: Source) {
        self.give(source, Input::Deadline);
    }

    /// Puts a message in the name of a service, whatever the service thinks of it.
    pub(crate) fn put(&mut self, message: Message) {
        self.publish(message.label.source(), message, None);
    }

    pub(crate) fn run_for(&mut self, time: Duration) {
        let end = self.now + time;
        while let Some(first) = self.arrivals.first_entry()
            && first.key().0 <= end
        {
            let ((at, _), (to, arrival)) = first.remove_entry();
            self.now = at;
            self.take(to, arrival);
        }
        self.now = end;
    }

    /// What a service retains on the bus of one topic.
    pub(crate) fn retained(&self, topic: &str) -> Vec<&Envelope> {
        let all = self.machines.values().flat_map(|machine| &machine.retained);
        all.filter(|((name, _), _)| name == topic).map(|(_, envelope)| envelope).collect()
    }

    fn take(&mut self, to: Source, arrival: Arrival) {
        match arrival {
            Arrival::Message(from, envelope) => self.hear(to, from, &envelope),
            Arrival::Acknowledged(reader, sequence) => {
                if let Some(waiting) = self.confirming.get_mut(&sequence) {
                    waiting.missing.remove(&reader);
                }
                self.confirm_if_all_have(sequence);
            }
            Arrival::GiveUp(sequence) => {
                if let Some(waiting) = self.confirming.remove(&sequence) {
                    let missing = waiting.missing.iter().map(|reader| reader.entity).collect();
                    self.give(
                        waiting.writer,
                        Input::Confirmed(waiting.number, Err(Unconfirmed::Missing { missing })),
                    );
                }
            }
            Arrival::Token(other, alive) if alive != self.silent.contains(&(other, to)) => {
                self.give_token(to, other, alive);
            }
            Arrival::Token(..) => {}
            Arrival::Deadline(at) => {
                let armed = &mut self.machines.get_mut(&to).unwrap().armed;
                if *armed == Some(at) {
                    *armed = None;
                    self.give(to, Input::Deadline);
                }
            }
            Arrival::LeaveReaders => self.leave_readers(to),
        }
    }

    fn give_token(&mut self, to: Source, of: Source, alive: bool) {
        if self.machines[&to].running.as_ref().is_some_and(|running| running.service.follows_bus()) {
            self.give(to, Input::Token(of, alive));
        }
    }

    fn leave_readers(&mut self, source: Source) {
        let machine = self.machines.get_mut(&source).unwrap();
        if machine.silent_since.is_none_or(|since| self.now - since < LEASE) {
            return;
        }
        (machine.silent_since, machine.is_known) = (None, false);
        self.tell_all(source, false);
        let sequences: Vec<u64> = self.confirming.keys().copied().collect();
        for sequence in sequences {
            self.confirming.get_mut(&sequence).map(|waiting| waiting.missing.remove(&source));
            self.confirm_if_all_have(sequence);
        }
    }

    fn confirm_if_all_have(&mut self, sequence: u64) {
        let done = self.confirming.get(&sequence).is_some_and(|waiting| waiting.missing.is_empty());
        if done && let Some(waiting) = self.confirming.remove(&sequence) {
            self.give(waiting.writer, Input::Confirmed(waiting.number, Ok(())));
        }
    }

    fn tell_all(&mut self, source: Source, alive: bool) {
        let others: Vec<_> = self.machines.keys().copied().filter(|other| *other != source).collect();
        for other in others {
            self.arrive(source, other, Arrival::Token(source, alive));
        }
    }

    fn receives(&self, to: Source, envelope: &Envelope) -> bool {
        let receives = |running: &Running| {
            running.prefixes.iter().any(|prefix| prefix.matches(&envelope.message.label.address))
        };
        self.machines[&to].running.as_ref().is_some_and(receives)
    }

    fn give(&mut self, to: Source, input: Input<'_>) {
        let now = self.now(to);
        let Some(running) = self.machines.get_mut(&to).unwrap().running.as_mut() else { return };
        running.service.handle(now, input, &mut running.outbox);
        self.settle(to);
    }

    fn settle(&mut self, source: Source) {
        let running = self.machines.get_mut(&source).unwrap().running.as_mut().unwrap();
        let deadline = running.service.next_deadline();
        let actions: Vec<_> = running.outbox.drain().collect();
        for action in actions {
            match action {
                Action::Send(message) => self.publish(source, message, None),
                Action::SendConfirmed(message, number, within) => {
                    self.publish(source, message, Some((number, within)));
                }
                Action::Note(note) => self.notes.push(note.text),
                _ => panic!("{source} wants something that this bus does not have"),
            }
        }
        let machine = self.machines.get_mut(&source).unwrap();
        let deadline = deadline.map(|at| at.max(self.now));
        if machine.armed != deadline {
            machine.armed = deadline;
            if let Some(at) = deadline {
                self.at(at, source, Arrival::Deadline(at));
            }
        }
    }

    fn publish(&mut self, from: Source, message: Message, confirm: Option<(u64, Duration)>) {
        assert_eq!(message.label.source(), from);
        self.counter += 1;
        let stamp = Stamp {
            node: from.entity,
            boot: BootId(self.machines[&from].lives),
            sequence: self.counter,
            source_time: self.now(from).wall,
            lifespan_left_ms: None,
            priority: Priority::Data,
            skipped: 0,
            via: Default::default(),
        };
        let envelope = Envelope { message, stamp };
        self.checker.published(&envelope);
        if let Some(instance) = &envelope.message.instance {
            let key = (envelope.message.label.descriptor().to_owned(), instance.hash);
            let retained = &mut self.machines.get_mut(&from).unwrap().retained;
            match envelope.message.change {
                Change::Put => retained.insert(key, envelope.clone()),
                Change::Dispose | Change::Unregister => retained.remove(&key),
            };
        }
        let others = self.machines.keys().copied().filter(|other| *other != from);
        let readers: Vec<_> = others.collect();
        if let Some((number, within)) = confirm {
            let counts = |reader: &&Source| {
                let machine = &self.machines[*reader];
                machine.is_known && (machine.running.is_none() || self.receives(**reader, &envelope))
            };
            let missing = readers.iter().filter(counts).copied().collect();
            let sequence = envelope.stamp.sequence;
            self.confirming.insert(sequence, Confirming { writer: from, number, missing });
            self.at(self.now + within, from, Arrival::GiveUp(sequence));
            // Where nobody reads, everybody has it.
            self.at(self.now, from, Arrival::Acknowledged(from, sequence));
        }
        for reader in readers {
            self.arrive(from, reader, Arrival::Message(from, envelope.clone()));
        }
    }

    /// Something arrives after a delay from the seed, in order on its way.
    fn arrive(&mut self, from: Source, to: Source, arrival: Arrival) {
        if self.silent.contains(&(from, to)) {
            self.held_back.entry((from, to)).or_default().push(arrival);
            return;
        }
        let delay = Duration::from_micros(self.random.u64(0..=self.delay_max.as_micros() as u64));
        let way = self.last_arrival.entry((from, to)).or_default();
        *way = (self.now + delay).max(*way);
        let at = *way;
        self.at(at, to, arrival);
    }

    fn at(&mut self, at: Monotonic, to: Source, arrival: Arrival) {
        self.counter += 1;
        self.arrivals.insert((at, self.counter), (to, arrival));
    }
}
