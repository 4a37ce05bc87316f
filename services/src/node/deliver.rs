//! Where messages go: to services here, to peers of bridges, out on the bus.

use super::{Node, Origin, Passed, Work, sharing};
use crate::dds::{Durability, Step};
use crate::event::{BridgeId, Effect, PeerId};
use crate::labels::Entry;
use crate::service::{Input, Level, refusal};
use aldis_envelope::{
    Address, Call, Change, Envelope, Label, Now, Priority, Refusal, Role, ServiceId, Stamp, Wall, aldis,
};
use std::sync::Arc;

/// What is said of a message that waited for the disk.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kept {
    /// When its source sent it.
    pub(super) source_time: Wall,
    /// Its record in the journal; none where it only waited behind others.
    pub(super) record: Option<u64>,
}

impl Node {
    /// A message that starts here: it goes everywhere, once it is on disk where its topic says so.
    pub(super) fn route(&mut self, now: Now, work: Work, effects: &mut Vec<Effect>) {
        let place = self.label(&work.message.label);
        if self.labels.entry(place).persistent || self.keeping.is_waiting() {
            return self.keep(now, place, work, effects);
        }
        self.hand_on(now, place, work, None, effects);
    }

    /// Stamps a message that starts here and sends it everywhere.
    pub(super) fn hand_on(
        &mut self,
        now: Now,
        place: usize,
        work: Work,
        kept: Option<Kept>,
        effects: &mut Vec<Effect>,
    ) {
        let Work { origin, message, confirm, passed } = work;
        let (outgoing, publish) = self.outgoing(place);
        let (sequence, skipped) = self.outbound.next(outgoing);
        let (node, boot) = (self.entity(), self.config.boot);
        let before = passed.as_ref().and_then(|passed| Some((*passed.via.last()?, passed.before?)));
        let stamp = match passed {
            None => Stamp {
                node,
                boot,
                sequence,
                source_time: kept.map_or(now.wall, |kept| kept.source_time),
                lifespan_left_ms: None,
                priority: Priority::Data,
                skipped,
                via: Default::default(),
            },
            Some(passed) => {
                let Passed { delivery, source_time, lifespan_left_ms, priority, via, .. } = *passed;
                self.done_for_link(origin, delivery);
                Stamp { node, boot, sequence, source_time, lifespan_left_ms, priority, skipped, via }
            }
        };
        let envelope = Envelope { message, stamp };
        let qos = self.labels.entry(place).qos;
        if let Some(qos) = qos {
            self.counters.shed_retained += self.sharing.writers.wrote(now.monotonic, qos, publish, &envelope);
            if let Some(record) = kept.and_then(|kept| kept.record) {
                self.sharing.writers.recorded(&envelope, record);
            }
        }
        self.deliver_here(now, origin, place, &envelope, effects);
        let mut awaited = None;
        if let Some((number, within)) = confirm {
            let source = envelope.message.label.source();
            let deadline = now.monotonic + within;
            let beyond = self.ask_beyond(now, origin, place, &envelope, deadline);
            let at_once = self.sharing.writers.confirm((source, number), &envelope, &beyond, deadline);
            awaited = at_once.is_none().then(|| envelope.clone());
            self.tell_confirmed(now, at_once.into_iter().collect(), effects);
        }
        let came = match origin {
            Origin::Link(link) => before.map(|before| (link, before, envelope.clone())),
            _ => None,
        };
        if publish && !self.is_for_a_service_here(&envelope.message.label.address) {
            if self.bus_is_open {
                self.publish(place, envelope, effects);
                if let Some(sample) = awaited {
                    self.ask_for_confirmation(now, &sample, effects);
                }
            } else if qos.is_none() {
                self.outbound.held_back(outgoing, skipped);
                self.counters.held_back_offline += 1;
            }
        }
        if let Some((link, before, sample)) = came {
            self.came_by_link(now, link, before, place, &sample, effects);
        }
    }

    /// A message from the bus.
    pub(super) fn sample(&mut self, now: Now, envelope: &Envelope, effects: &mut Vec<Effect>) {
        self.counters.received += 1;
        if envelope.stamp.via.contains(&self.entity()) {
            self.counters.loops_stopped += 1;
            return;
        }
        let place = self.label(&envelope.message.label);
        let entry = self.labels.entry(place);
        if entry.among_nodes {
            self.stirred = true;
            self.told_by_node(now, envelope, effects);
            return;
        }
        if !entry.import {
            return;
        }
        if let Some(qos) = entry.qos.filter(|_| !entry.services.is_empty() || !entry.links.is_empty()) {
            let mut step = Step::default();
            self.stirred = true;
            self.sharing.reading.sample(now.monotonic, qos, envelope, &mut step);
            self.take_step(now, step, effects);
            return;
        }
        if !self.accept(now, place, envelope, effects) {
            return;
        }
        self.deliver_here(now, Origin::Bus, place, envelope, effects);
    }

    /// Looks at the sequence: false when the sample is old.
    fn accept(&mut self, now: Now, place: usize, envelope: &Envelope, effects: &mut Vec<Effect>) -> bool {
        let stamp = &envelope.stamp;
        let entry = self.labels.entry(place);
        let incoming = match entry.incoming {
            Some((node, incoming)) if node == stamp.node => incoming,
            _ => {
                let label = &envelope.message.label;
                let incoming = self.inbound.place(stamp, label.source(), &label.address);
                entry.incoming = Some((stamp.node, incoming));
                incoming
            }
        };
        let Some(incoming) = incoming else { return true };
        let Some(gap) = self.inbound.accept(incoming, stamp) else {
            self.counters.duplicates += 1;
            return false;
        };
        self.counters.lost += gap.lost;
        self.counters.skipped_told += gap.told;
        self.counters.missed_offline += gap.offline;
        if gap.lost > 0 {
            let label = &envelope.message.label;
            let text = format!("{} samples of {} from {} were lost", gap.lost, label.address, label.source());
            self.say(now, Level::Warning, "lost", text, effects);
        }
        true
    }

    /// Hands an envelope to the services and the bridges here that receive it.
    pub(super) fn deliver_here(
        &mut self,
        now: Now,
        origin: Origin,
        place: usize,
        envelope: &Envelope,
        effects: &mut Vec<Effect>,
    ) {
        let source = envelope.message.label.source();
        for i in 0..self.labels.entry(place).services.len() {
            let service = self.labels.entry(place).services[i];
            if origin != Origin::Service(service) && self.services[service].spec.source != source {
                self.deliver(now, service, envelope, effects);
            }
        }
        for i in 0..self.labels.entry(place).bridges.len() {
            let bridge = self.labels.entry(place).bridges[i];
            self.export(now, origin, bridge, envelope, effects);
        }
        for i in 0..self.labels.entry(place).links.len() {
            let link = self.labels.entry(place).links[i];
            self.export_by_link(now, origin, link, envelope, effects);
        }
    }

    fn deliver(&mut self, now: Now, service: usize, envelope: &Envelope, effects: &mut Vec<Effect>) {
        match envelope.message.call.as_deref() {
            None => {
                self.counters.delivered += 1;
                self.run(now, service, Input::Message(envelope), effects);
            }
            Some(call) => {
                self.stirred = true;
                match call.role {
                    Role::Request { .. } => self.request(now, service, envelope, effects),
                    _ => self.answer(now, service, envelope, call, effects),
                }
            }
        }
    }

    /// A request to a service here: asked for permission first. A ping is answered for every service.
    fn request(&mut self, now: Now, service: usize, request: &Envelope, effects: &mut Vec<Effect>) {
        let own = self.services[service].spec.source;
        let label = &request.message.label;
        if !self.services[service].is_running() {
            return;
        }
        if let Err(why) = self.allow.check(label.source().entity, own.service, label.descriptor()) {
            self.counters.calls_forbidden += 1;
            let text = format!("a call of {} to {own} is refused: {why}", label.source());
            self.say(now, Level::Warning, "forbidden", text, effects);
            let refused = refusal(own, request, Refusal::NotAllowed(why));
            self.work.extend(refused.map(|message| Work::new(Origin::Service(service), message)));
        } else if label.descriptor() == aldis::PING {
            let content = request.message.content.clone();
            self.reply_as_host(service, request, aldis::PONG, content);
        } else if own.service == ServiceId::NODE && label.descriptor() == aldis::NODE_QUERY {
            let status = aldis::encode(&self.status(now)).into();
            self.reply_as_host(service, request, aldis::NODE_STATUS, status);
        } else if own.service == ServiceId::NODE
            && let Some((descriptor, content)) = self.answer_about_links(now, request)
        {
            self.reply_as_host(service, request, descriptor, content);
        } else {
            self.counters.delivered += 1;
            self.run(now, service, Input::Message(request), effects);
        }
    }

    /// An answer goes to the one who called, if it still waits.
    fn answer(
        &mut self,
        now: Now,
        service: usize,
        envelope: &Envelope,
        call: &Call,
        effects: &mut Vec<Effect>,
    ) {
        let caller = self.services[service].spec.source;
        if envelope.message.label.address != Address::Service(caller) {
            return;
        }
        let from = envelope.message.label.source();
        let Some(ended) = self.calls.answer(caller.service, from, call) else {
            self.counters.replies_late += 1;
            return;
        };
        if matches!(call.role, Role::Reply { .. }) {
            self.counters.delivered += 1;
            self.run(now, service, Input::Message(envelope), effects);
        }
        if let Some(ended) = ended {
            self.call_ended(now, ended, effects);
        }
    }

    fn export(
        &mut self,
        now: Now,
        origin: Origin,
        bridge: BridgeId,
        envelope: &Envelope,
        effects: &mut Vec<Effect>,
    ) {
        let message = &envelope.message;
        if message.change != Change::Put {
            return;
        }
        if let Origin::Peer(from, _) = origin
            && self.bridges[from.0].leads_where(&self.bridges[bridge.0])
        {
            return;
        }
        for i in 0.. {
            let Some(peer) = self.bridges[bridge.0].taker(i) else { return };
            if origin != Origin::Peer(bridge, peer) {
                self.send_to_peer(now, bridge, peer, &message.label, &message.content, effects);
            }
        }
    }

    pub(super) fn send_to_peer(
        &mut self,
        now: Now,
        bridge: BridgeId,
        peer: PeerId,
        label: &Arc<Label>,
        content: &bytes::Bytes,
        effects: &mut Vec<Effect>,
    ) {
        use crate::bridge::Sent;
        match self.bridges[bridge.0].send(now.monotonic, peer, label, content) {
            Sent::Now => effects.push(Effect::Send(bridge, peer, label.clone(), content.clone())),
            Sent::Later => self.stirred = true,
            Sent::Shed => {
                let name = &self.bridges[bridge.0].spec.name;
                let text =
                    format!("{name}: messages for {} are dropped", self.bridges[bridge.0].peer_name(peer));
                self.say(now, Level::Warning, &text.clone(), text, effects);
            }
        }
    }

    pub(super) fn outgoing(&mut self, place: usize) -> (usize, bool) {
        let entry = self.labels.entry(place);
        let outgoing = match entry.outgoing {
            Some(outgoing) => outgoing,
            None => {
                let outgoing = self.outbound.place(entry.label.source(), &entry.label.address);
                entry.outgoing = Some(outgoing);
                outgoing
            }
        };
        (outgoing, entry.publish)
    }

    /// What is addressed to one service that runs here has arrived.
    fn is_for_a_service_here(&self, address: &Address) -> bool {
        let Address::Service(to) = address else { return false };
        self.services.iter().any(|hosted| hosted.spec.source == *to && hosted.is_running())
    }

    pub(super) fn label(&mut self, label: &Arc<Label>) -> usize {
        if std::mem::take(&mut self.labels_are_stale) {
            self.labels.forget();
        }
        if let Some(place) = self.labels.place(label) {
            return place;
        }
        let address = &label.address;
        let matches =
            |prefixes: &[aldis_envelope::Prefix]| prefixes.iter().any(|prefix| prefix.matches(address));
        let services = (0..self.services.len()).filter(|&i| self.services[i].receives(address)).collect();
        let bridges =
            (0..self.bridges.len()).filter(|&i| self.bridges[i].exports(label)).map(BridgeId).collect();
        let qos = self.sharing.topics.of(address).filter(|_| label.is_broadcast());
        let persistent =
            qos.is_some_and(|qos| qos.durability == Durability::Persistent) && self.journals(label.source());
        self.labels.insert(Entry {
            label: label.clone(),
            services,
            bridges,
            links: self.links.naming(label),
            publish: matches(&self.config.export),
            import: matches(&self.config.import),
            qos,
            persistent,
            among_nodes: sharing::is_among_nodes(label),
            outgoing: None,
            incoming: None,
            publisher: None,
            publishers: Default::default(),
        })
    }
}
