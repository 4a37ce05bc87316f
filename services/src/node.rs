//! The node: one pure object a machine. Events go in, effects come out; the shell does the rest.

mod administration;
mod bridges;
mod deliver;
mod journaling;
mod keeping;
mod life;
mod links;
mod publishing;
mod running;
mod sharing;
mod turn;

use crate::allow::{Allow, AllowRule};
use crate::bridge::{Bridge, BridgeSpec};
use crate::calls::{Alive, Calls};
use crate::counters::Counters;
use crate::dds::{TopicRule, Topics};
use crate::event::{BridgeId, Effect, Event, LinkId, PeerId, PublisherId};
use crate::host::Hosted;
use crate::labels::Labels;
use crate::link::{DeliveryId, LinkSpec};
use crate::notes::Notes;
use crate::registry;
use crate::service::{Action, Component, ComponentHealth, Condition, Input, Level, ServiceSpec};
use crate::streams::{Inbound, Outbound};
use aldis_envelope::{
    Address, BootId, EntityId, Fleet, KeyHash, Keys, Label, Message, Monotonic, Now, Prefix, Priority,
    ServiceId, Space, Via, Wall,
};
use journaling::Journaling;
use keeping::Keeping;
use links::Links;
use sharing::Sharing;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Duration;

/// What a node is.
#[derive(Debug, Clone)]
pub struct NodeConfig {
    /// The fleet whose key space it uses.
    pub fleet: Fleet,
    /// The entities that it speaks for, its own first.
    pub entities: Vec<EntityId>,
    /// This life of it.
    pub boot: BootId,
    /// The entities that may administer it, beside its own.
    pub operators: Vec<EntityId>,
    /// Further rules about who may call what.
    pub allow: Vec<AllowRule>,
    /// Which addresses are taken from the bus.
    pub import: Vec<Prefix>,
    /// Which addresses go out on the bus.
    pub export: Vec<Prefix>,
    /// What topics promise, where it is not what the patterns of UMAA say.
    pub topics: Vec<TopicRule>,
    /// Whether others wait for its readers when a delivery is to be confirmed.
    pub reliable: bool,
    /// The services, built-in ones too, in the order of their start.
    pub services: Vec<ServiceSpec>,
    /// The bridges.
    pub bridges: Vec<BridgeSpec>,
    /// The links across which other entities are reached.
    pub links: Vec<LinkSpec>,
}

/// Where a message came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Origin {
    Service(usize),
    Peer(BridgeId, PeerId),
    Link(LinkId),
    Bus,
}

/// What the stamp keeps of a message that came by a link.
#[derive(Debug, Clone)]
struct Passed {
    /// Its number in the link, where it is to be answered.
    delivery: Option<DeliveryId>,
    /// The life of the node that stamped it before, and its number in its stream there; none where it is not from a link.
    before: Option<(BootId, u64)>,
    source_time: Wall,
    lifespan_left_ms: Option<u32>,
    priority: Priority,
    via: Via,
}

/// A message that waits inside the node.
struct Work {
    origin: Origin,
    message: Message,
    /// The number and the bound where its sender wants to know that all readers have it.
    confirm: Option<(u64, Duration)>,
    /// Where it came by a link.
    passed: Option<Box<Passed>>,
}

impl Work {
    fn new(origin: Origin, message: Message) -> Self {
        Self { origin, message, confirm: None, passed: None }
    }
}

/// How many messages may wait inside a node while one event is handled: more is a loop between services.
const WORK_MAX: usize = 65_536;

/// A node. [`Node::handle`] is all that a shell needs.
pub struct Node {
    config: NodeConfig,
    keys: Keys,
    allow: Allow,
    services: Vec<Hosted>,
    bridges: Vec<Bridge>,
    labels: Labels,
    outbound: Outbound,
    inbound: Inbound,
    calls: Calls,
    alive: Alive,
    publishers: BTreeMap<(Arc<Label>, Option<KeyHash>), PublisherId>,
    counters: Counters,
    notes: Notes,
    work: VecDeque<Work>,
    sharing: Sharing,
    links: Links,
    keeping: Keeping,
    journaling: Journaling,
    /// Requests that wait until the tokens are told: before that, nobody knows where they can go.
    waiting_calls: Vec<(usize, Message)>,
    /// Services with wishes in their outboxes.
    awake: VecDeque<usize>,
    /// Kept for its memory.
    actions: Vec<Action>,
    /// Who receives what has changed: the labels are to be judged anew before the next message.
    labels_are_stale: bool,
    subscriptions: Vec<String>,
    bus_is_open: bool,
    input_is_paused: bool,
    armed: Option<Monotonic>,
    /// Whether this turn may have left more to do than its effects: a sample that a service took without a word has not, and nearly
    /// all that comes is of this kind.
    stirred: bool,
    started: Option<Monotonic>,
    ending: bool,
}

impl Node {
    /// A node that has not started yet: it starts with the first [`Node::handle`].
    ///
    /// # Errors
    /// Why the configuration cannot be: no entity, or two parts with one service id.
    pub fn new(config: NodeConfig) -> Result<Self, String> {
        let Some(&own) = config.entities.first() else {
            return Err("a node needs at least one entity".into());
        };
        let mut sources: Vec<_> = config.services.iter().map(|spec| spec.source).collect();
        sources.extend(config.bridges.iter().map(|spec| spec.source));
        sources.sort();
        if let Some(pair) = sources.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(format!("two services or bridges have the id {}", pair[0]));
        }
        if let Some(foreign) = sources.iter().find(|source| !config.entities.contains(&source.entity)) {
            return Err(format!("{foreign} is of an entity that node {own} does not speak for"));
        }
        let stand_ins = config.bridges.iter().map(|bridge| registry::stand_in(bridge.source, &bridge.name));
        Ok(Self {
            keys: Keys::new(&config.fleet),
            allow: Allow::new(&config.entities, &config.operators, config.allow.clone()),
            services: config.services.iter().cloned().chain(stand_ins).map(Hosted::new).collect(),
            bridges: config.bridges.iter().map(|spec| Bridge::new(spec.clone(), &config.entities)).collect(),
            sharing: Sharing::new(Topics::new(config.topics.clone())),
            links: Links::new(&config.links, config.boot, &config.fleet),
            config,
            keeping: Keeping::default(),
            journaling: Journaling::default(),
            labels: Labels::default(),
            outbound: Outbound::default(),
            inbound: Inbound::default(),
            calls: Calls::default(),
            alive: Alive::default(),
            publishers: BTreeMap::new(),
            counters: Counters::default(),
            notes: Notes::default(),
            work: VecDeque::new(),
            waiting_calls: Vec::new(),
            awake: VecDeque::new(),
            actions: Vec::new(),
            labels_are_stale: false,
            subscriptions: Vec::new(),
            bus_is_open: false,
            input_is_paused: false,
            armed: None,
            stirred: true,
            started: None,
            ending: false,
        })
    }

    /// The node's own entity.
    pub fn entity(&self) -> EntityId {
        self.config.entities[0]
    }

    /// Everything counted so far.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Handles events in their order and appends what is to be done. The first call starts the node.
    pub fn handle(&mut self, now: Now, events: &mut Vec<Event>, effects: &mut Vec<Effect>) {
        if self.started.is_none() {
            self.started = Some(now.monotonic);
            if !self.journaling.is_opening() {
                self.start(now, effects);
            }
        }
        if self.journaling.is_opening() {
            self.stirred = true;
            self.before_start(now, events, effects);
        }
        for event in events.drain(..) {
            self.stirred |= !matches!(event, Event::Sample(_));
            self.event(now, event, effects);
            self.end_event(now, effects);
        }
        self.end_turn(now, effects);
    }

    fn event(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        match event {
            Event::Sample(envelope) => self.sample(now, &envelope, effects),
            Event::Peer(bridge, peer, event) => self.peer(now, bridge, peer, event, effects),
            Event::Deadline => self.deadline(now, effects),
            Event::Alive(source, alive) => {
                self.alive.set(source, alive);
                self.links.services_changed();
                self.tokens_changed(now, effects);
                self.token(now, source, alive, effects);
                self.tell_followers(now, || Input::Token(source, alive), effects);
            }
            Event::AliveKnown => {
                self.alive.set_known(true);
                self.show_all_services(effects);
                self.tokens_changed(now, effects);
                self.send_waiting_calls();
                self.joined(now, effects);
                self.tell_followers(now, || Input::Bus(true), effects);
            }
            Event::BusOpened => self.bus_opened(now, effects),
            Event::BusClosed(why) => self.bus_closed(now, &why, effects),
            Event::SampleRefused(why) => {
                self.counters.refused_headers += 1;
                self.say(now, Level::Warning, "refused header", format!("sample refused: {why}"), effects);
            }
            Event::SamplesShed(count) => {
                self.counters.shed_from_bus += count;
                let text = format!("{count} samples from the bus dropped: this node does not keep up");
                self.say(now, Level::Warning, "shed from bus", text, effects);
            }
            Event::Bridge(bridge, event) => self.bridge(now, bridge, event, effects),
            Event::Link(id, event) => self.link_event(now, id, event, effects),
            Event::Job(source, number, result) => self.job_done(now, source, number, result, effects),
            Event::Domain(source, event) => self.domain_event(now, source, event, effects),
            Event::Component(health) => self.component(now, &health),
            Event::Journal(event) => self.journal(now, event, effects),
            Event::Shutdown => self.shutdown(now, effects),
        }
    }

    fn start(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.start_links(now, effects);
        for place in 0..self.services.len() {
            self.start_service(now, place, effects);
        }
        self.settle(now, effects);
    }

    fn bus_opened(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.bus_is_open = true;
        self.subscriptions.clear();
        self.subscribe(now, effects);
        let publishers: Vec<_> = self.publishers.iter().map(|(key, &id)| (key.clone(), id)).collect();
        for ((label, instance), publisher) in publishers {
            effects.push(self.declare(&label, instance, publisher));
        }
        let running: Vec<_> = self.sources_running().collect();
        effects.extend(running.into_iter().map(|source| Effect::Token(source, true)));
        self.bus_health(now, Condition::Well, "the session is up".into());
    }

    fn bus_closed(&mut self, now: Now, why: &str, effects: &mut Vec<Effect>) {
        if std::mem::take(&mut self.bus_is_open) {
            self.inbound.went_offline();
            self.sharing.went_offline();
            self.alive.set_known(false);
            self.tell_followers(now, || Input::Bus(false), effects);
        }
        self.bus_health(now, Condition::Failed, why.to_owned());
        self.say(now, Level::Warning, "bus", format!("no session on the bus: {why}"), effects);
    }

    fn bus_health(&mut self, now: Now, condition: Condition, status: String) {
        self.component(now, &ComponentHealth { component: Component::Resource("bus"), condition, status });
    }

    /// The ids of everything that is alive here.
    fn sources_running(&self) -> impl Iterator<Item = aldis_envelope::Source> + '_ {
        let services =
            self.services.iter().filter(|hosted| hosted.is_running()).map(|hosted| hosted.spec.source);
        services.chain(self.bridges.iter().map(|bridge| bridge.spec.source))
    }

    /// Has the shell subscribe to all that somebody here receives.
    fn subscribe(&mut self, now: Now, effects: &mut Vec<Effect>) {
        let mut prefixes: Vec<Prefix> =
            self.config.entities.iter().map(|&entity| Prefix::Id(Address::Entity(entity))).collect();
        prefixes.extend(self.services.iter().flat_map(Hosted::prefixes));
        prefixes.extend(self.bridges.iter().flat_map(|bridge| bridge.spec.export.iter().cloned()));
        prefixes.extend(self.links.prefixes());
        let mut expressions = self.keys.cover(Space::Data, &prefixes);
        expressions.extend(self.keys.cover(Space::Writer, &prefixes));
        let (to_node, to_nodes) = sharing::subscriptions(self.entity());
        expressions.push(self.keys.subscription(Space::State, &to_node));
        expressions.extend(to_nodes.iter().map(|prefix| self.keys.subscription(Space::Ack, prefix)));
        if self.bus_is_open && expressions != self.subscriptions {
            self.subscriptions.clone_from(&expressions);
            effects.push(Effect::Subscribe(expressions));
        }
        self.labels_are_stale = true;
        self.readers_changed(now, effects);
    }

    fn declare(&self, label: &Label, instance: Option<KeyHash>, publisher: PublisherId) -> Effect {
        let instance = instance.map(|hash| aldis_envelope::Instance { hash, key: None });
        let key = self.keys.envelope(Space::Data, label, instance.as_ref());
        let mut constant = Vec::new();
        let priority = Priority::Data;
        let (node, boot) = (self.entity(), self.config.boot);
        aldis_envelope::codec::native::encode_constant(label, node, boot, priority, &mut constant);
        Effect::Declare { publisher, key, constant, priority }
    }

    /// Says something to people, at a bounded rate: to the shell, and as the node's own log entry.
    fn say(&mut self, now: Now, level: Level, kind: &str, text: String, effects: &mut Vec<Effect>) {
        if let Some(note) = self.notes.say(now.monotonic, level, kind, text) {
            self.note(now, note, effects);
        }
    }

    fn service_at(&self, service: ServiceId) -> Option<usize> {
        let own = self.entity();
        self.services.iter().position(|h| h.spec.source.service == service && h.spec.source.entity == own)
    }
}

#[cfg(test)]
mod tests;
