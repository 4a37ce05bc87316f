//! Who is alive on the other side: each end tells the other, and shows the tokens of what it was told while the peer is heard.

use super::super::Node;
use super::Attached;
use crate::event::Effect;
use crate::link::export::Newest;
use crate::link::{self, Class, Offer, Ticket};
use crate::service::Input;
use aldis_envelope::aldis::{self, link as told};
use aldis_envelope::{ContentType, Envelope, Label, Message, Name, Now, Priority, ServiceId, Source, Stamp};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

impl Node {
    /// Tells the other ends which services are alive here, where that has changed.
    pub(super) fn tell_services(&mut self, now: Now) {
        if !std::mem::take(&mut self.links.services_changed) {
            return;
        }
        let own = |source: &Source| self.config.entities.contains(&source.entity);
        let alive: BTreeSet<Source> = self.sources_running().chain(self.alive.all().filter(own)).collect();
        let alive: Vec<_> = alive.into_iter().collect();
        let Ok(name) = Name::new(told::SERVICES) else { return };
        if alive == self.links.told {
            return;
        }
        self.links.told_times += 1;
        let label = Label::broadcast(ContentType::Aldis, name, Source::new(self.entity(), ServiceId::NODE));
        let message = Message::new(Arc::new(label), aldis::encode(&alive).into());
        let stamp = Stamp {
            node: self.entity(),
            boot: self.config.boot,
            sequence: self.links.told_times,
            source_time: now.wall,
            lifespan_left_ms: None,
            priority: Priority::Data,
            skipped: 0,
            via: Default::default(),
        };
        self.links.told = alive;
        let envelope = Envelope { message, stamp };
        for place in 0..self.links.all.len() {
            let offer = Offer {
                ticket: Ticket::default(),
                envelope: envelope.clone(),
                class: Class::State,
                interval: Duration::from_secs(1),
                newest: Newest::Instance,
                share: (u32::MAX, 100),
            };
            if self.links.all[place].ready {
                self.links.give(place, link::Event::Offer(offer));
            } else {
                self.links.all[place].early.push(offer);
            }
        }
    }

    /// The peer tells which services are alive behind it.
    pub(super) fn services_told(
        &mut self,
        now: Now,
        place: usize,
        envelope: &Envelope,
        effects: &mut Vec<Effect>,
    ) {
        let attached = &mut self.links.all[place];
        let Some(told) = aldis::decode::<Vec<Source>>(&envelope.message.content) else { return };
        let behind = &attached.spec.export.behind;
        let told: BTreeSet<_> = told.into_iter().filter(|source| behind.contains(&source.entity)).collect();
        let before = std::mem::replace(&mut attached.services, told.clone());
        let (came, went) = (told.difference(&before), before.difference(&told));
        let changes: Vec<_> = came.map(|s| (*s, true)).chain(went.map(|s| (*s, false))).collect();
        let heard = attached.heard;
        for (source, alive) in changes {
            self.alive.set(source, alive);
            if self.bus_is_open && (heard || !alive) {
                effects.push(Effect::Token(source, alive));
            }
            self.tell_followers(now, || Input::Token(source, alive), effects);
        }
        self.tokens_changed(now, effects);
    }

    /// Shows the tokens of the services behind a link, or withdraws them: a token of who is not heard would be a lie. This node
    /// itself still takes what is for them, and keeps it while it waits.
    pub(super) fn show_services(&mut self, place: usize, effects: &mut Vec<Effect>) {
        if self.bus_is_open {
            let Attached { services, heard, .. } = &self.links.all[place];
            effects.extend(services.iter().map(|source| Effect::Token(*source, *heard)));
        }
    }

    /// The session on the bus is up: what it forgot is told again.
    pub(in crate::node) fn show_all_services(&mut self, effects: &mut Vec<Effect>) {
        for place in 0..self.links.all.len() {
            for source in self.links.all[place].services.clone() {
                self.alive.set(source, true);
            }
            if self.links.all[place].heard {
                self.show_services(place, effects);
            }
        }
    }
}
