//! The node's part in DDS-shaped semantics: it speaks for its writers and its readers to other nodes.

use super::{Node, Origin};
use crate::dds::{Confirmed, Participant, Reading, Step, Topics, Writers, name_of};
use crate::event::Effect;
use crate::service::{Input, Level};
use aldis_envelope::aldis::{self, dds};
use aldis_envelope::{
    Address, ContentType, EntityId, Envelope, Label, Message, Monotonic, Name, Now, Prefix, Priority,
    ServiceId, Source, Space, Stamp,
};
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// How often readers are announced again, so that they keep their lease.
const ANNOUNCE_EVERY: Duration = Duration::from_millis(2_500);
/// How soon they are announced again to those that have not answered.
const ANNOUNCE_AGAIN: Duration = Duration::from_millis(500);
/// How long readers count without being heard.
const LEASE: Duration = Duration::from_secs(10);
/// How long a service waits for what others retain.
const HISTORY_WITHIN: Duration = Duration::from_secs(5);
/// How much of it for programs that are no node, such as the command line's: foreign ones may never tell.
const PROGRAMS_WITHIN: Duration = Duration::from_secs(1);

/// A service that waits for what others retain.
#[derive(Debug, Clone, Copy)]
struct Starting {
    place: usize,
    /// The first announcement that speaks for it.
    number: u64,
    deadline: Monotonic,
    /// Until when programs that are no node are waited for; none where they are not any more.
    programs_by: Option<Monotonic>,
}

/// What a node keeps for its writers and readers.
#[derive(Debug, Default)]
pub(super) struct Sharing {
    pub(super) topics: Topics,
    pub(super) writers: Writers,
    pub(super) reading: Reading,
    prefixes: Vec<Prefix>,
    number: u64,
    announce_at: Option<Monotonic>,
    answered: BTreeMap<EntityId, u64>,
    starting: Vec<Starting>,
    sent: u64,
}

impl Sharing {
    pub(super) fn new(topics: Topics) -> Self {
        Self { topics, ..Self::default() }
    }

    /// The session is down: who answered may be gone when it is up again.
    pub(super) fn went_offline(&mut self) {
        self.answered.clear();
    }

    pub(super) fn next_deadline(&self) -> Option<Monotonic> {
        let due = |starting: &Starting| starting.programs_by.unwrap_or(starting.deadline);
        let starting = self.starting.iter().map(due).min();
        let others = [self.writers.next_deadline(), self.reading.next_deadline(), self.announce_at, starting];
        others.into_iter().flatten().min()
    }
}

/// What nodes tell one another is addressed to service 1, and the announcements to all.
pub(super) fn subscriptions(own: EntityId) -> (Prefix, Vec<Prefix>) {
    let to_node = Prefix::Id(Address::Service(Source::new(own, ServiceId::NODE)));
    (to_node.clone(), vec![to_node, Prefix::Text(dds::READERS.into())])
}

/// Whether a label is of what nodes tell one another.
pub(super) fn is_among_nodes(label: &Label) -> bool {
    label.attributes.content_type == ContentType::Aldis && label.descriptor().starts_with("aldis.dds.")
}

impl Node {
    /// A service has started: it hears who is alive, gets what is kept of what it reads, and waits for what others retain.
    pub(super) fn catch_up(&mut self, now: Now, place: usize, effects: &mut Vec<Effect>) {
        let own = self.services[place].spec.source;
        let hosted = &self.services[place];
        if !hosted.is_running() {
            return;
        }
        let mut kept: Vec<Envelope> = Vec::new();
        let wanted = |address: &Address| hosted.receives(address);
        let former = self.former(place);
        for (address, history) in self.sharing.writers.histories() {
            if wanted(address) {
                kept.extend(history.samples().filter(|s| s.message.label.source() != own).cloned());
            }
        }
        for (address, history) in self.sharing.reading.histories() {
            if wanted(&address) {
                kept.extend(history.samples().cloned());
            }
        }
        let follows_bus = hosted.follows_bus();
        for envelope in &former {
            self.run(now, place, Input::Recovered(envelope), effects);
        }
        if follows_bus && self.alive.is_known() {
            for source in self.alive.all().collect::<Vec<_>>() {
                self.run(now, place, Input::Token(source, true), effects);
            }
            self.run(now, place, Input::Bus(true), effects);
        }
        for envelope in &kept {
            self.run(now, place, Input::Message(envelope), effects);
        }
        let (number, deadline) = (self.sharing.number, now.monotonic + HISTORY_WITHIN);
        let programs_by = Some(now.monotonic + PROGRAMS_WITHIN);
        self.sharing.starting.retain(|starting| starting.place != place);
        self.sharing.starting.push(Starting { place, number, deadline, programs_by });
    }

    /// Who reads what has changed, or who is on the bus: all are told.
    pub(super) fn readers_changed(&mut self, now: Now, effects: &mut Vec<Effect>) {
        let mut prefixes: Vec<Prefix> = self.services.iter().flat_map(|h| h.subscribed().cloned()).collect();
        // What crosses a link is read here for the far side.
        prefixes.extend(self.links.prefixes().filter(|prefix| !matches!(prefix, Prefix::Id(_))));
        prefixes.sort();
        prefixes.dedup();
        if prefixes == self.sharing.prefixes {
            return;
        }
        let (services, links) = (&self.services, &self.links);
        let is_read = |address: &Address| {
            services.iter().any(|hosted| hosted.receives(address)) || links.reads(address)
        };
        self.sharing.reading.retain(is_read);
        self.sharing.prefixes = prefixes;
        self.sharing.number += 1;
        self.announce(now, None, effects);
    }

    /// The session is up and knows who is there.
    pub(super) fn joined(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.sharing.number += 1;
        self.announce(now, None, effects);
    }

    /// A node that appears is told what is read here, before it is its turn.
    pub(super) fn token(&mut self, now: Now, of: Source, alive: bool, effects: &mut Vec<Effect>) {
        if alive && of.service == ServiceId::NODE && of.entity != self.entity() && self.alive.is_known() {
            self.announce(now, Some(of.entity), effects);
        }
    }

    /// Tells all, or one node, what is read here.
    fn announce(&mut self, now: Now, to: Option<EntityId>, effects: &mut Vec<Effect>) {
        if !self.bus_is_open || (self.sharing.prefixes.is_empty() && self.sharing.number == 0) {
            return;
        }
        let readers = dds::Readers {
            number: self.sharing.number,
            reliable: self.config.reliable,
            lease_ms: LEASE.as_millis() as u32,
            prefixes: if self.ending { Vec::new() } else { self.sharing.prefixes.clone() },
        };
        self.tell(now, Space::Ack, to, dds::READERS, &readers, effects);
        if to.is_none() {
            let wait =
                if self.everybody_answered(self.sharing.number) { ANNOUNCE_EVERY } else { ANNOUNCE_AGAIN };
            self.sharing.announce_at = Some(now.monotonic + wait);
        }
    }

    /// Nobody here reads any more.
    pub(super) fn leave(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.sharing.number += 1;
        self.announce(now, None, effects);
    }

    /// Whether all nodes that are alive have answered an announcement. A node that knows of no other may be about to: a peer
    /// has its session before it has its connections.
    fn everybody_answered(&self, number: u64) -> bool {
        let own = self.entity();
        let answered = |node| self.sharing.answered.get(&node).is_some_and(|&answered| answered >= number);
        let mut others = self.alive.nodes().filter(|node| *node != own).peekable();
        self.alive.is_known() && others.peek().is_some() && others.all(answered)
    }

    /// Whether all others that show a token have answered an announcement: programs that are no node, too.
    fn programs_answered(&self, number: u64) -> bool {
        let answered = |node| self.sharing.answered.get(&node).is_some_and(|&answered| answered >= number);
        let others = self.alive.all().map(|source| source.entity);
        others.filter(|entity| !self.config.entities.contains(entity)).all(answered)
    }

    /// Something that another node tells this one.
    pub(super) fn told_by_node(&mut self, now: Now, envelope: &Envelope, effects: &mut Vec<Effect>) {
        let stamp = &envelope.stamp;
        if envelope.message.label.source().entity != stamp.node {
            self.counters.refused_among_nodes += 1;
            return;
        }
        let from = Participant { node: stamp.node, boot: stamp.boot };
        let content = &envelope.message.content;
        let mut step = Step::default();
        let understood = match envelope.message.label.descriptor() {
            dds::READERS => aldis::decode(content).map(|readers| self.announced(now, from, readers, effects)),
            dds::STREAMS => aldis::decode(content).map(|told| self.streams(now, from, told, &mut step)),
            dds::ASK => aldis::decode(content).map(|ask: dds::Ask| self.asked(now, from, &ask, effects)),
            dds::HISTORY => aldis::decode(content).map(|told: dds::History| {
                if told.to == self.config.boot {
                    self.sharing.reading.told(now.monotonic, from, told, &mut step);
                }
            }),
            dds::CONFIRM => aldis::decode(content).map(|confirm: dds::Confirm| {
                if confirm.to == self.config.boot {
                    let confirmed = self.sharing.writers.confirmed(now.monotonic, from, &confirm);
                    self.tell_confirmed(now, confirmed, effects);
                }
            }),
            _ => None,
        };
        if understood.is_none() {
            self.counters.refused_among_nodes += 1;
        }
        self.take_step(now, step, effects);
    }

    fn announced(&mut self, now: Now, from: Participant, readers: dds::Readers, effects: &mut Vec<Effect>) {
        let is_new = !self.sharing.writers.knows(from);
        let (answers, confirmed) = self.sharing.writers.announced(now.monotonic, from, readers);
        for answer in answers {
            self.tell(now, Space::State, Some(from.node), dds::STREAMS, &answer, effects);
        }
        if is_new && self.sharing.writers.knows(from) {
            self.announce(now, Some(from.node), effects);
        }
        self.tell_confirmed(now, confirmed, effects);
    }

    fn streams(&mut self, now: Now, from: Participant, told: dds::Streams, step: &mut Step) {
        if told.to != self.config.boot {
            return;
        }
        let (services, links, topics) = (&self.services, &self.links, &self.sharing.topics);
        let qos = |address: &Address| {
            let is_read = services.iter().any(|hosted| hosted.receives(address)) || links.reads(address);
            topics.of(address).filter(|_| is_read)
        };
        self.sharing.reading.ends(now.monotonic, from, &told.ends, qos, step);
        if let Some(number) = told.answers {
            self.sharing.answered.insert(from.node, number);
        }
    }

    fn asked(&mut self, now: Now, from: Participant, ask: &dds::Ask, effects: &mut Vec<Effect>) {
        if ask.to != self.config.boot {
            return;
        }
        if let Some(told) = self.sharing.writers.asked(now.monotonic, from, ask) {
            self.counters.retold += told.samples.len() as u64;
            self.tell(now, Space::State, Some(from.node), dds::HISTORY, &told, effects);
        }
    }

    /// Carries out what came of an input to the readers.
    pub(super) fn take_step(&mut self, now: Now, step: Step, effects: &mut Vec<Effect>) {
        self.counters.lost += step.lost;
        self.counters.duplicates += step.duplicates;
        if step.lost > 0 {
            let text = format!("{} retained samples are gone with those that wrote them", step.lost);
            self.say(now, Level::Warning, "lost retained", text, effects);
        }
        for envelope in step.deliver {
            let place = self.label(&envelope.message.label);
            self.deliver_here(now, Origin::Bus, place, &envelope, effects);
        }
        for (writer, ask) in step.ask {
            self.counters.asked += 1;
            self.tell(now, Space::Ack, Some(writer.node), dds::ASK, &ask, effects);
        }
    }

    /// A service waits until all have a sample: its readers are asked to say so at once.
    pub(super) fn ask_for_confirmation(&mut self, now: Now, sample: &Envelope, effects: &mut Vec<Effect>) {
        if let Some(stream) = name_of(sample) {
            self.ask_readers(now, &stream, sample.stamp.sequence, effects);
        }
    }

    /// The readers of a stream that are waited for are asked to confirm it up to a sequence at once.
    pub(super) fn ask_readers(
        &mut self,
        now: Now,
        stream: &dds::StreamName,
        sequence: u64,
        effects: &mut Vec<Effect>,
    ) {
        if !self.bus_is_open {
            return;
        }
        for (reader, ends) in self.sharing.writers.awaited(stream, sequence) {
            self.tell(now, Space::State, Some(reader.node), dds::STREAMS, &ends, effects);
        }
    }

    pub(super) fn tell_confirmed(&mut self, now: Now, confirmed: Vec<Confirmed>, effects: &mut Vec<Effect>) {
        for Confirmed { source, number, outcome } in confirmed {
            if source == self.waits_for_links() {
                self.confirmed_for_link(now, number, outcome.is_ok());
            } else if let Some(place) = self.services.iter().position(|hosted| hosted.spec.source == source) {
                self.run(now, place, Input::Confirmed(number, outcome), effects);
            }
        }
    }

    /// Does what is due by time.
    pub(super) fn sharing_due(&mut self, now: Now, effects: &mut Vec<Effect>) {
        let (reminders, confirmed) = self.sharing.writers.due(now.monotonic);
        for (reader, ends) in reminders {
            self.tell(now, Space::State, Some(reader.node), dds::STREAMS, &ends, effects);
        }
        self.tell_confirmed(now, confirmed, effects);
        let mut step = Step::default();
        self.sharing.reading.due(now.monotonic, self.bus_is_open, &mut step);
        self.take_step(now, step, effects);
        if self.sharing.announce_at.is_some_and(|at| at <= now.monotonic) {
            self.sharing.announce_at = None;
            self.announce(now, None, effects);
        }
    }

    /// Confirms what was handed over, and tells services that have all there is.
    pub(super) fn finish_sharing(&mut self, now: Now, effects: &mut Vec<Effect>) {
        for (writer, confirm) in self.sharing.reading.confirmations(now.monotonic, self.bus_is_open) {
            self.tell(now, Space::Ack, Some(writer.node), dds::CONFIRM, &confirm, effects);
        }
        let starting = std::mem::take(&mut self.sharing.starting);
        for mut service in starting {
            service.programs_by = service.programs_by.filter(|by| *by > now.monotonic);
            let prefixes: Vec<_> = self.services[service.place].subscribed().cloned().collect();
            let complete = prefixes.is_empty()
                || self.bus_is_open
                    && self.everybody_answered(service.number)
                    && (service.programs_by.is_none() || self.programs_answered(service.number))
                    && self.sharing.reading.is_complete(&prefixes);
            if complete || service.deadline <= now.monotonic {
                self.run(now, service.place, Input::HistoryComplete(complete), effects);
            } else {
                self.sharing.starting.push(service);
            }
        }
        self.settle(now, effects);
    }

    /// Tells something to all nodes, or to one.
    fn tell<T: Serialize>(
        &mut self,
        now: Now,
        space: Space,
        to: Option<EntityId>,
        descriptor: &str,
        content: &T,
        effects: &mut Vec<Effect>,
    ) {
        let Ok(name) = Name::new(descriptor) else { return };
        if !self.bus_is_open {
            return;
        }
        let own = Source::new(self.entity(), ServiceId::NODE);
        let label = match to {
            None => Label::broadcast(ContentType::Aldis, name, own),
            Some(node) => {
                let to = Address::Service(Source::new(node, ServiceId::NODE));
                Label::limitedcast(to, ContentType::Aldis, name.into(), own)
            }
        };
        self.sharing.sent += 1;
        let stamp = Stamp {
            node: own.entity,
            boot: self.config.boot,
            sequence: self.sharing.sent,
            source_time: now.wall,
            lifespan_left_ms: None,
            priority: Priority::Data,
            skipped: 0,
            via: Default::default(),
        };
        let key = self.keys.envelope(space, &label, None);
        let message = Message::new(Arc::new(label), aldis::encode(content).into());
        effects.push(Effect::PublishOn(key, Box::new(Envelope { message, stamp })));
    }
}
