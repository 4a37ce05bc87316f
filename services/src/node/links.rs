//! The links of a node: what crosses them, and what all of them want written in one turn.
//!
//! A link is to the node what a bridge is: what comes by it is stamped anew and goes everywhere, so that late joiners, gaps
//! and confirmations on this side are this node's business. What crosses goes through the protocol in [`crate::link`].

mod answers;
mod arrivals;
mod confirming;
mod keeping;
mod services;
mod tickets;

use super::{Node, Origin};
use crate::destinations::{Destination, Destinations};
use crate::event::{Effect, LinkEvent, LinkId, Place};
use crate::link::{self, BatchId, CarrierId, Link, LinkSpec, Offer, Ticket, TicketState};
use crate::service::Level;
use aldis_envelope::{Address, CallId, EntityId, Envelope, Fleet, Label, Monotonic, Now, Prefix, Source};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

/// How many calls are followed by their tickets. The callers of others hear nothing until the answer.
const CALLERS_MAX: usize = 4_096;
/// What waits while the journal is read back. Beyond it, what comes is refused by the link itself.
const EARLY_MAX: usize = 65_536;

/// How long the tokens of the services behind a link stay after its peer was last known to be heard. On a bad link some silence is
/// chance, and calls that are under way end when a token goes.
const TOKENS_STAY: Duration = Duration::from_secs(20);

/// One link of the node.
struct Attached {
    spec: LinkSpec,
    link: Link,
    /// What it is to be told in this turn.
    events: Vec<link::Event>,
    /// What it wants done and is not done yet.
    wishes: VecDeque<link::Effect>,
    /// What was offered before its journal was read back.
    early: Vec<Offer>,
    ready: bool,
    armed: Option<Monotonic>,
    heard: bool,
    /// When the tokens of those behind it go.
    hide_at: Option<Monotonic>,
    /// Where the peer was last, by each carrier.
    places: BTreeMap<CarrierId, Place>,
    /// The services behind it, as the peer tells.
    services: BTreeSet<Source>,
    next_ticket: u64,
    /// Calls that cross.
    callers: BTreeMap<Ticket, Caller>,
}

/// Who called, and where.
#[derive(Debug, Clone)]
struct Caller {
    source: Source,
    call: CallId,
    to: Address,
    descriptor: aldis_envelope::Descriptor,
    /// Whether it is told how its call gets on: services here learn only how it ends.
    wants_word: bool,
}

/// All links of the node.
pub(super) struct Links {
    all: Vec<Attached>,
    /// Where commands go.
    destinations: Destinations,
    /// Some link has something to do.
    due: bool,
    /// The services here may have changed.
    services_changed: bool,
    /// What the peers were last told of them.
    told: Vec<Source>,
    told_times: u64,
    /// Who waits for readers beyond a link.
    confirming: confirming::Confirming,
    /// Batches on their way to the journal, by the journal's number.
    writes: BTreeMap<u64, Vec<(usize, BatchId)>>,
}

impl Links {
    pub(super) fn new(specs: &[LinkSpec], boot: aldis_envelope::BootId, fleet: &Fleet) -> Self {
        let attach = |spec: &LinkSpec| Attached {
            link: Link::new(spec.link.clone(), boot),
            spec: spec.clone(),
            events: Vec::new(),
            wishes: VecDeque::new(),
            early: Vec::new(),
            ready: false,
            armed: None,
            heard: false,
            hide_at: None,
            places: BTreeMap::new(),
            services: BTreeSet::new(),
            next_ticket: 1,
            callers: BTreeMap::new(),
        };
        Self {
            all: specs.iter().map(attach).collect(),
            destinations: Destinations::new(fleet),
            due: false,
            services_changed: !specs.is_empty(),
            told: Vec::new(),
            told_times: 0,
            confirming: Default::default(),
            writes: BTreeMap::new(),
        }
    }

    /// The links whose rules name a label.
    pub(super) fn naming(&self, label: &Label) -> Vec<(LinkId, usize)> {
        let named = |(place, attached): (usize, &Attached)| {
            attached.spec.export.rule_of(label).ok().map(|rule| (LinkId(place), rule))
        };
        self.all.iter().enumerate().filter_map(named).collect()
    }

    /// What must be subscribed to.
    pub(super) fn prefixes(&self) -> impl Iterator<Item = Prefix> + '_ {
        self.all.iter().flat_map(|attached| attached.spec.export.prefixes())
    }

    /// Whether some rule may name what is at an address.
    pub(super) fn reads(&self, address: &Address) -> bool {
        self.all.iter().any(|attached| attached.spec.export.prefixes().iter().any(|p| p.matches(address)))
    }

    /// Whether an entity is behind a link.
    pub(super) fn is_behind(&self, entity: EntityId) -> bool {
        self.all.iter().any(|attached| attached.spec.export.behind.contains(&entity))
    }

    /// Everything that links count, by their names.
    pub(super) fn counters(&self) -> impl Iterator<Item = (String, u64)> + '_ {
        self.all.iter().flat_map(|attached| {
            let list = attached.link.counters().list();
            list.into_iter().map(|(name, value)| (format!("{}.{name}", attached.spec.name), value))
        })
    }

    pub(super) fn next_deadline(&self) -> Option<Monotonic> {
        self.all.iter().flat_map(|attached| [attached.armed, attached.hide_at]).flatten().min()
    }

    pub(super) fn services_changed(&mut self) {
        self.services_changed = !self.all.is_empty();
    }

    fn give(&mut self, place: usize, event: link::Event) {
        self.all[place].events.push(event);
        self.due = true;
    }
}

impl Node {
    /// Something happened at a link.
    pub(super) fn link_event(&mut self, now: Now, id: LinkId, event: LinkEvent, effects: &mut Vec<Effect>) {
        let Some(attached) = self.links.all.get(id.0) else { return };
        match event {
            LinkEvent::Frame(carrier, place, bytes) => {
                let known = attached.places.get(&carrier) == Some(&place);
                self.links.give(id.0, link::Event::Frame(carrier, bytes));
                if !known {
                    self.heard_elsewhere(now, id, carrier, place, effects);
                }
            }
            LinkEvent::Up(carrier, mtu) => self.links.give(id.0, link::Event::CarrierUp(carrier, mtu)),
            LinkEvent::Down(carrier, why) => {
                let name = attached.spec.name.clone();
                self.links.give(id.0, link::Event::CarrierDown(carrier));
                let text = format!("{name}: carrier {} cannot be used: {why}", carrier.0);
                self.say(now, Level::Warning, &text.clone(), text, effects);
            }
            LinkEvent::Silent(silent) => self.links.give(id.0, link::Event::Silent(silent)),
        }
    }

    /// A frame came from a new place: if the link takes it for its peer's, the peer is there now.
    fn heard_elsewhere(
        &mut self,
        now: Now,
        id: LinkId,
        carrier: CarrierId,
        place: Place,
        effects: &mut Vec<Effect>,
    ) {
        let before = self.links.all[id.0].link.counters().frames_received;
        self.run_links(now, effects);
        let attached = &mut self.links.all[id.0];
        if attached.link.counters().frames_received > before {
            attached.places.insert(carrier, place);
            effects.push(Effect::Found(id, carrier, place));
        }
    }

    pub(super) fn links_due(&mut self, now: Now, effects: &mut Vec<Effect>) {
        for place in 0..self.links.all.len() {
            if self.links.all[place].hide_at.is_some_and(|at| at <= now.monotonic) {
                self.links.all[place].hide_at = None;
                self.show_services(place, effects);
            }
            if self.links.all[place].armed.is_some_and(|at| at <= now.monotonic) {
                self.links.all[place].armed = None;
                self.links.give(place, link::Event::Deadline);
            }
        }
    }

    /// A message that a link's rule names.
    pub(super) fn export_by_link(
        &mut self,
        now: Now,
        origin: Origin,
        (id, rule): (LinkId, usize),
        envelope: &Envelope,
        effects: &mut Vec<Effect>,
    ) {
        self.stirred = true;
        self.links.destinations.hear(&envelope.message);
        if origin == Origin::Link(id) {
            return;
        }
        let destination = self.links.destinations.of_message(&envelope.message);
        if let Destination::Unknown(guid) = destination {
            let kind = format!("unknown destination {guid}");
            let text = format!("a command to {guid}, which nobody has spoken as: it goes to every peer");
            self.say(now, Level::Information, &kind, text, effects);
        }
        let attached = &mut self.links.all[id.0];
        let Ok(treatment) = attached.spec.export.treat(rule, envelope, destination.entity()) else { return };
        let mut envelope = envelope.clone();
        envelope.stamp.lifespan_left_ms = treatment.lifespan_left_ms;
        let ticket = attached.ticket(origin, &envelope);
        let link::export::Treatment { class, interval, newest, rule, .. } = treatment;
        let share = attached.spec.export.rules.get(rule).map_or(100, |rule| rule.share);
        let offer = Offer { ticket, envelope, class, interval, newest, share: (rule as u32, share) };
        if attached.ready {
            self.links.give(id.0, link::Event::Offer(offer));
        } else if attached.early.len() < EARLY_MAX {
            attached.early.push(offer);
        } else {
            let refused = TicketState::Refused(link::Reason::NotReady);
            self.link_ticket(now, id.0, ticket, refused, effects);
        }
    }

    fn carry_out_for_link(&mut self, now: Now, place: usize, wish: link::Effect, effects: &mut Vec<Effect>) {
        match wish {
            link::Effect::Transmit(carrier, frame) => {
                effects.push(Effect::Transmit(LinkId(place), carrier, frame));
            }
            link::Effect::Persist(batch, records) => self.write_for_link(place, batch, records),
            link::Effect::Deliver(delivery) => self.arrived_by_link(now, place, delivery, effects),
            link::Effect::Ticket(ticket, state) => self.link_ticket(now, place, ticket, state, effects),
            link::Effect::Peer(heard) => self.link_peer(now, place, heard, effects),
            link::Effect::Note(text) => {
                let text = format!("{}: {text}", self.links.all[place].spec.name);
                self.say(now, Level::Warning, &text.clone(), text, effects);
            }
            link::Effect::Arm(at) => self.links.all[place].armed = Some(at),
        }
    }

    fn link_peer(&mut self, now: Now, place: usize, heard: bool, effects: &mut Vec<Effect>) {
        let attached = &mut self.links.all[place];
        attached.heard = heard;
        let (name, peer) = (attached.spec.name.clone(), attached.spec.link.peer);
        let text =
            if heard { format!("{name}: {peer} is heard") } else { format!("{name}: {peer} is silent") };
        let level = if heard { Level::Information } else { Level::Warning };
        self.say(now, level, &text.clone(), text, effects);
        let attached = &mut self.links.all[place];
        attached.hide_at = (!heard).then_some(now.monotonic + TOKENS_STAY);
        if heard {
            self.show_services(place, effects);
        }
    }
}
