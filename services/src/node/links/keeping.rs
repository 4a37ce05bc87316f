//! What links keep goes the way of all that outlives the process: into the batches of the journal, as one with what services say.

use super::Node;
use crate::event::Effect;
use crate::journal::Refused;
use crate::link::{self, BatchId, Record, record_prefix};
use crate::service::Level;
use aldis_envelope::Now;
use bytes::Bytes;

impl Node {
    /// A record that the journal holds of a link. It is taken at once, because there may be very many.
    pub(in crate::node) fn link_read_back(&mut self, now: Now, key: Bytes, value: Bytes) {
        let of = |attached: &&mut super::Attached| key.starts_with(&record_prefix(attached.spec.link.peer));
        // What belongs to a link that is configured no more stays in the journal, in case it comes back.
        if let Some(attached) = self.links.all.iter_mut().find(of) {
            let mut wishes = Vec::new();
            attached.link.handle(now, &mut vec![link::Event::ReadBack { key, value }], &mut wishes);
            attached.wishes.extend(wishes);
        }
    }

    /// Links begin the life of their node.
    pub(in crate::node) fn start_links(&mut self, now: Now, effects: &mut Vec<Effect>) {
        let boot = self.config.boot;
        self.links.all.iter_mut().for_each(|attached| attached.link.set_boot(boot));
        for place in 0..self.links.all.len() {
            self.links.give(place, link::Event::ReadBackEnd);
            if !self.journaling.is_there() {
                let name = &self.links.all[place].spec.name;
                let text =
                    format!("{name}: without a journal, what waits to cross is lost when this node ends");
                self.say(now, Level::Information, &text.clone(), text, effects);
            }
        }
    }

    /// Has the links do what is due, until none has anything to do. What comes of a message that arrived is collected before the
    /// next is looked at, so that it stands in one batch however much arrives.
    pub(in crate::node) fn run_links(&mut self, now: Now, effects: &mut Vec<Effect>) {
        if self.journaling.is_opening() {
            return;
        }
        self.tell_services(now);
        while std::mem::take(&mut self.links.due) {
            while let Some(place) = self.links.all.iter().position(|link| !link.events.is_empty()) {
                self.run_link(now, place);
            }
            if self.keeping.has_much() {
                self.keeping.close();
            }
            while let Some((place, wish)) = self.links.next_wish() {
                let is_message = matches!(wish, link::Effect::Deliver(_));
                self.carry_out_for_link(now, place, wish, effects);
                if is_message {
                    self.links.due = true;
                    break;
                }
            }
        }
    }

    /// What a link wants written goes into the batch of this turn before anything else is done, all other wishes wait for their turn.
    fn run_link(&mut self, now: Now, place: usize) {
        let attached = &mut self.links.all[place];
        let mut events = std::mem::take(&mut attached.events);
        let is_ready = events.iter().any(|event| matches!(event, link::Event::ReadBackEnd));
        let mut wishes = Vec::new();
        attached.link.handle(now, &mut events, &mut wishes);
        if is_ready {
            attached.ready = true;
            attached.next_ticket = attached.next_ticket.max(attached.link.largest_ticket().0 + 1);
            let early = std::mem::take(&mut attached.early);
            attached.events.extend(early.into_iter().map(link::Event::Offer));
            self.links.due = true;
        }
        for wish in wishes {
            match wish {
                link::Effect::Persist(batch, records) => self.write_for_link(place, batch, records),
                other => self.links.all[place].wishes.push_back(other),
            }
        }
        self.links.due |= !self.links.all[place].wishes.is_empty();
    }

    pub(super) fn write_for_link(&mut self, place: usize, batch: BatchId, records: Vec<Record>) {
        if !self.journaling.is_there() {
            return self.links.give(place, link::Event::Written(batch));
        }
        let kept = match self.journaling.unusable() {
            Some(why) => Err(why.clone()),
            None => self.keeping.keep_of_links(records),
        };
        match kept {
            Ok(number) => self.links.writes.entry(number).or_default().push((place, batch)),
            Err(why) => self.links.give(place, link::Event::WriteFailed(batch, why.to_string())),
        }
    }

    /// All batches of the journal up to a number are on disk, but those that were refused.
    pub(in crate::node) fn links_written(&mut self, up_to: u64) {
        let later = self.links.writes.split_off(&(up_to + 1));
        for (place, batch) in std::mem::replace(&mut self.links.writes, later).into_values().flatten() {
            self.links.give(place, link::Event::Written(batch));
        }
    }

    /// Batches of the journal are refused.
    pub(in crate::node) fn links_refused(&mut self, from: u64, to: u64, why: &Refused) {
        let refused: Vec<_> = self.links.writes.range(from..=to).map(|(&number, _)| number).collect();
        for number in refused {
            for (place, batch) in self.links.writes.remove(&number).unwrap_or_default() {
                self.links.give(place, link::Event::WriteFailed(batch, why.to_string()));
            }
        }
    }
}

impl super::Links {
    fn next_wish(&mut self) -> Option<(usize, link::Effect)> {
        let wishing = |(place, attached): (usize, &mut super::Attached)| {
            attached.wishes.pop_front().map(|wish| (place, wish))
        };
        self.all.iter_mut().enumerate().find_map(wishing)
    }
}
