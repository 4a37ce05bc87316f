//! Confirmations across links: who waits until all readers have a sample waits for those beyond a link too.
//!
//! The end where somebody waits asks the other end, which answers once the readers on its side have the sample, and those beyond its
//! own further links. Where they have not in time, the one who waits hears that the peer is missing. A peer that refuses what its source
//! says has no readers of it, and says so at once.

use super::super::{Node, Origin};
use super::EARLY_MAX;
use crate::dds::{Participant, name_of};
use crate::event::{Effect, LinkId};
use crate::link::export::Newest;
use crate::link::{self, Class, Offer, Ticket};
use aldis_envelope::aldis::dds::StreamName;
use aldis_envelope::aldis::{self, link as told};
use aldis_envelope::{
    BootId, ContentType, EntityId, Envelope, Label, Message, Monotonic, Name, Now, Priority, ServiceId,
    Source, Stamp,
};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// How many questions may be open, each way. Who asks beyond that waits in vain.
const ASKS_MAX: usize = 4_096;
/// Of how many streams that come by links it is known how far they have come.
const STREAMS_MAX: usize = 16_384;
/// How long an answer is worth carrying, and a question that does not tell its time.
const WORD_LASTS: Duration = Duration::from_secs(60);

/// A stream as a peer stamps it.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Theirs {
    link: usize,
    node: EntityId,
    boot: BootId,
    stream: StreamName,
}

/// How far a stream has come, in its numbers there and here, and by which links it went on.
#[derive(Debug)]
struct Came {
    there: u64,
    here: u64,
    on: Vec<usize>,
}

/// What a peer was asked.
#[derive(Debug)]
struct Asked {
    link: usize,
    stream: StreamName,
    sequence: u64,
    until: Monotonic,
}

/// What a peer asks.
#[derive(Debug)]
struct Ask {
    /// Its number there.
    number: u64,
    of: Theirs,
    sequence: u64,
    until: Monotonic,
    /// The sample is here: its readers are waited for.
    waits: bool,
}

/// Confirmations that are under way.
#[derive(Debug, Default)]
pub(super) struct Confirming {
    asked: BTreeMap<u64, Asked>,
    asks: BTreeMap<u64, Ask>,
    came: BTreeMap<Theirs, Came>,
    last: u64,
}

impl Confirming {
    fn number(&mut self) -> u64 {
        self.last += 1;
        self.last
    }
}

impl Node {
    /// In whose name the node waits for its own readers because a link's peer asks.
    pub(in crate::node) fn waits_for_links(&self) -> Source {
        Source::new(self.entity(), ServiceId::NODE)
    }

    /// Asks the peers of the links by which a sample crosses. Who is waited for.
    pub(in crate::node) fn ask_beyond(
        &mut self,
        now: Now,
        origin: Origin,
        place: usize,
        sample: &Envelope,
        until: Monotonic,
    ) -> Vec<Participant> {
        let Some(stream) = name_of(sample) else { return Vec::new() };
        let links = self.crossed(origin, place, sample);
        links
            .into_iter()
            .map(|link| self.ask_peer(now, link, &stream, sample.stamp.sequence, until))
            .collect()
    }

    /// The links by which a sample crosses as more than a recording.
    fn crossed(&mut self, origin: Origin, place: usize, sample: &Envelope) -> Vec<usize> {
        let named = self.labels.entry(place).links.clone();
        let destination = self.links.destinations.of_message(&sample.message);
        let crosses = |(id, rule): &(LinkId, usize)| {
            let export = &self.links.all[id.0].spec.export;
            let treated = export.treat(*rule, sample, destination.entity());
            origin != Origin::Link(*id) && treated.is_ok_and(|treatment| treatment.class != Class::Bulk)
        };
        named.into_iter().filter(crosses).map(|(id, _)| id.0).collect()
    }

    fn ask_peer(
        &mut self,
        now: Now,
        link: usize,
        stream: &StreamName,
        sequence: u64,
        until: Monotonic,
    ) -> Participant {
        let confirming = &mut self.links.confirming;
        confirming.asked.retain(|_, asked| asked.until > now.monotonic);
        if confirming.asked.len() < ASKS_MAX {
            let number = confirming.number();
            confirming.asked.insert(number, Asked { link, stream: stream.clone(), sequence, until });
            let ask = told::ConfirmAsk { number, stream: stream.clone(), boot: self.config.boot, sequence };
            self.tell_peer(now, link, told::CONFIRM_ASK, aldis::encode(&ask), until - now.monotonic);
        }
        self.beyond(link)
    }

    /// Who stands for all readers beyond a link. No life of a node has the number 0.
    fn beyond(&self, link: usize) -> Participant {
        Participant { node: self.links.all[link].spec.link.peer, boot: BootId(0) }
    }

    fn tell_peer(&mut self, now: Now, link: usize, what: &str, content: Vec<u8>, lasts: Duration) {
        let Ok(name) = Name::new(what) else { return };
        let label = Label::broadcast(ContentType::Aldis, name, self.waits_for_links());
        let message = Message::new(Arc::new(label), content.into());
        let stamp = Stamp {
            node: self.entity(),
            boot: self.config.boot,
            sequence: self.links.confirming.number(),
            source_time: now.wall,
            lifespan_left_ms: Some(u32::try_from(lasts.as_millis()).unwrap_or(u32::MAX)),
            priority: Priority::Data,
            skipped: 0,
            via: Default::default(),
        };
        let offer = Offer {
            ticket: Ticket::default(),
            envelope: Envelope { message, stamp },
            class: Class::Command,
            interval: Duration::ZERO,
            newest: Newest::Instance,
            share: (u32::MAX, 100),
        };
        if self.links.all[link].ready {
            self.links.give(link, link::Event::Offer(offer));
        } else if self.links.all[link].early.len() < EARLY_MAX {
            self.links.all[link].early.push(offer);
        }
    }

    /// A message that came by a link stands here now under a number of its own: what was asked about it can be looked after.
    pub(in crate::node) fn came_by_link(
        &mut self,
        now: Now,
        LinkId(link): LinkId,
        (node, (boot, there)): (EntityId, (BootId, u64)),
        place: usize,
        sample: &Envelope,
        effects: &mut Vec<Effect>,
    ) {
        let Some(stream) = name_of(sample) else { return };
        // Where there is one link, nothing goes on.
        let on = match self.links.all.len() {
            1 => Vec::new(),
            _ => self.crossed(Origin::Link(LinkId(link)), place, sample),
        };
        let of = Theirs { link, node, boot, stream };
        let came = &mut self.links.confirming.came;
        let far = Came { there, here: sample.stamp.sequence, on };
        match came.get_mut(&of) {
            // The last states of two instances may overtake each other.
            Some(came) if came.there > there => {}
            Some(came) => *came = far,
            None => {
                // Of a node's former life nothing is asked any more.
                came.retain(|known, _| known.boot >= boot || (known.link, known.node) != (link, node));
                if came.len() < STREAMS_MAX {
                    came.insert(of.clone(), far);
                }
            }
        }
        let open = self.links.confirming.asks.iter().filter(|(_, ask)| !ask.waits && ask.of == of);
        for number in open.map(|(&number, _)| number).collect::<Vec<_>>() {
            self.look_after(now, number, effects);
        }
    }

    /// A word of a peer about confirmations.
    pub(super) fn told_of_confirmation(
        &mut self,
        now: Now,
        link: usize,
        envelope: &Envelope,
        effects: &mut Vec<Effect>,
    ) {
        let content = &envelope.message.content;
        if envelope.message.label.descriptor() == told::CONFIRMED {
            let number = aldis::decode::<u64>(content);
            let asked = &mut self.links.confirming.asked;
            let number = number.filter(|number| asked.get(number).is_some_and(|asked| asked.link == link));
            let Some(Asked { stream, sequence, .. }) = number.and_then(|number| asked.remove(&number)) else {
                return;
            };
            let from = self.beyond(link);
            let confirmed = self.sharing.writers.confirmed_beyond(from, &stream, sequence);
            self.tell_confirmed(now, confirmed, effects);
            return;
        }
        let Some(ask) = aldis::decode::<told::ConfirmAsk>(content) else { return };
        if !self.links.all[link].spec.export.behind.contains(&ask.stream.source.entity) {
            return self.tell_peer(now, link, told::CONFIRMED, aldis::encode(&ask.number), WORD_LASTS);
        }
        let lasts =
            envelope.stamp.lifespan_left_ms.map_or(WORD_LASTS, |left| Duration::from_millis(left.into()));
        let confirming = &mut self.links.confirming;
        confirming.asks.retain(|_, ask| ask.until > now.monotonic);
        if confirming.asks.len() < ASKS_MAX {
            let of = Theirs { link, node: envelope.stamp.node, boot: ask.boot, stream: ask.stream };
            let (sequence, until) = (ask.sequence, now.monotonic + lasts);
            let number = confirming.number();
            confirming.asks.insert(number, Ask { number: ask.number, of, sequence, until, waits: false });
            self.look_after(now, number, effects);
        }
    }

    /// Once the sample that a peer asks about is here, its readers are waited for.
    fn look_after(&mut self, now: Now, number: u64, effects: &mut Vec<Effect>) {
        let confirming = &mut self.links.confirming;
        let Some(ask) = confirming.asks.get_mut(&number) else { return };
        let Some(came) = confirming.came.get(&ask.of).filter(|came| came.there >= ask.sequence) else {
            return;
        };
        ask.waits = true;
        let (stream, until, here, on) = (ask.of.stream.clone(), ask.until, came.here, came.on.clone());
        let beyond: Vec<_> =
            on.into_iter().map(|link| self.ask_peer(now, link, &stream, here, until)).collect();
        let waits = (self.waits_for_links(), number);
        let upto = (stream.clone(), here);
        match self.sharing.writers.confirm_upto(waits, upto, &beyond, until) {
            Some(_) => self.confirmed_for_link(now, number, true),
            None => self.ask_readers(now, &stream, here, effects),
        }
    }

    /// The readers here have what a peer has asked about, or have not in time: then it hears nothing.
    pub(in crate::node) fn confirmed_for_link(&mut self, now: Now, number: u64, all_have_it: bool) {
        if let Some(ask) = self.links.confirming.asks.remove(&number)
            && all_have_it
        {
            self.tell_peer(now, ask.of.link, told::CONFIRMED, aldis::encode(&ask.number), WORD_LASTS);
        }
    }
}
