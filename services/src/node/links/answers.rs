//! What service 1 answers about links and what waits for them.

use super::super::Node;
use super::{Attached, Links};
use crate::link;
use aldis_envelope::aldis::{self, link as told};
use aldis_envelope::{Envelope, Monotonic, Now};
use bytes::Bytes;

/// At most so many commands are told in one answer.
const LISTED_MAX: usize = 1_000;

impl Node {
    /// The answer to a request about links: its descriptor and content. None where it is no such request, or cannot be read.
    pub(in crate::node) fn answer_about_links(
        &mut self,
        now: Now,
        request: &Envelope,
    ) -> Option<(&'static str, Bytes)> {
        let content = &request.message.content;
        match request.message.label.descriptor() {
            told::LINK_QUERY => Some((told::LINK_STATUS, self.link_statuses(now))),
            told::QUEUE_QUERY => {
                let asked: told::QueueQuery = aldis::decode(content)?;
                Some((told::QUEUE_STATUS, aldis::encode(&self.queued(now, &asked)).into()))
            }
            told::QUEUE_CANCEL => {
                let asked: told::QueueCancel = aldis::decode(content)?;
                Some((told::QUEUE_CANCELLED, aldis::encode(&self.cancel(&asked)).into()))
            }
            told::LINK_SILENCE => {
                let asked: told::Silence = aldis::decode(content)?;
                for place in 0..self.links.all.len() {
                    let peer = self.links.all[place].spec.link.peer;
                    if asked.peer.is_none_or(|asked| asked == peer) {
                        self.links.give(place, link::Event::Silent(asked.silent));
                    }
                }
                Some((told::LINK_STATUS, self.link_statuses(now)))
            }
            _ => None,
        }
    }

    fn link_statuses(&self, now: Now) -> Bytes {
        aldis::encode(&self.links.statuses(now.monotonic, self.journaling.is_there())).into()
    }

    fn queued(&self, now: Now, asked: &told::QueueQuery) -> Vec<told::QueuedCommand> {
        let limit = (asked.limit as usize).min(LISTED_MAX);
        let links =
            self.links.all.iter().filter(|link| asked.peer.is_none_or(|peer| peer == link.spec.link.peer));
        links.flat_map(|link| link.link.queued(now.monotonic, asked.number, limit)).take(limit).collect()
    }

    /// Takes a command back; whether it was there.
    fn cancel(&mut self, asked: &told::QueueCancel) -> bool {
        let Some(place) = self.links.all.iter().position(|link| link.spec.link.peer == asked.peer) else {
            return false;
        };
        let ticket = self.links.all[place].link.ticket_of(asked.number).filter(|ticket| ticket.0 != 0);
        if let Some(ticket) = ticket {
            self.links.give(place, link::Event::Cancel(ticket));
        }
        ticket.is_some()
    }
}

impl Node {
    /// How many commands wait to cross the links of this node, and their bytes.
    pub fn queued_commands(&self) -> (usize, usize) {
        let links = self.links.all.iter().map(|attached| attached.link.commands());
        links.fold((0, 0), |(count, bytes), (more, of_them)| (count + more, bytes + of_them))
    }
}

/// The status of every link, filled in with what the node knows.
impl Links {
    fn statuses(&self, now: Monotonic, durable: bool) -> Vec<told::LinkStatus> {
        let status = |attached: &Attached| told::LinkStatus {
            name: attached.spec.name.clone(),
            behind: attached.spec.export.behind.iter().copied().collect(),
            durable,
            services: attached.services.iter().copied().collect(),
            ..attached.link.status(now)
        };
        self.all.iter().map(status).collect()
    }
}
