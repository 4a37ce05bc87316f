//! What a link says of itself to people.

use super::{Link, Ticket};
use aldis_envelope::aldis::link::{CarrierStatus, LinkStatus, QueuedCommand};
use aldis_envelope::{Monotonic, Source};
use std::time::Duration;

fn milliseconds(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

fn permille(part: f64) -> u16 {
    (part.clamp(0.0, 1.0) * 1_000.0).round() as u16
}

impl Link {
    /// How the link does. What its owner knows of it, it fills in itself.
    pub fn status(&self, now: Monotonic) -> LinkStatus {
        let active = self.active(now);
        let carriers = self.paths.iter().enumerate().map(|(index, path)| CarrierStatus {
            id: path.config.id.0,
            up: path.up,
            in_use: path.up && active == Some(index),
            heard_ms_ago: path.last_heard.map(|heard| milliseconds(now - heard)),
            round_trip_ms: milliseconds(path.round_trip()) as u32,
            loss_out_permille: permille(path.loss_out),
            loss_in_permille: permille(path.received.loss()),
            rate: path.config.rate,
            mtu: path.config.mtu as u32,
        });
        LinkStatus {
            name: String::new(),
            peer: self.config.peer,
            behind: Vec::new(),
            heard: self.heard,
            silent: self.silent,
            durable: false,
            keyed: !self.config.keys.is_empty(),
            carriers: carriers.collect(),
            commands: self.outbox.len() as u64,
            states: self.states.waiting() as u64,
            bulk_bytes: self.bulk_out.bytes() as u64,
            services: Vec::<Source>::new(),
            counters: self.counters.list().into_iter().map(|(name, n)| (name.to_owned(), n)).collect(),
        }
    }

    /// Commands that wait or are on the air, by number; all or one. The link's own words to its peer are not among them.
    pub fn queued(&self, now: Monotonic, number: Option<u64>, limit: usize) -> Vec<QueuedCommand> {
        let numbers = match number {
            Some(number) => vec![number],
            None => self.outbox.numbers(),
        };
        numbers.into_iter().filter_map(|number| self.queued_one(now, number)).take(limit).collect()
    }

    fn queued_one(&self, now: Monotonic, number: u64) -> Option<QueuedCommand> {
        let entry = self.outbox.entry(number).filter(|entry| entry.stream != 0)?;
        let label = &self.names.labels.get(&entry.stream)?.label;
        let tries = self.outbox.tries(number);
        Some(QueuedCommand {
            peer: self.config.peer,
            number,
            source: label.source(),
            descriptor: label.descriptor().to_owned(),
            address: label.address.to_string(),
            bytes: entry.body.len() as u32,
            age_ms: milliseconds(now - entry.accepted),
            left_ms: entry.expires.map(|expires| milliseconds(expires - now)),
            tries: tries.unwrap_or(0),
            why: self.why(now, number, tries),
        })
    }

    /// Why a command is still here.
    fn why(&self, now: Monotonic, number: u64, tries: Option<u32>) -> String {
        let peer = self.config.peer;
        if self.silent {
            return "the link is silent until it is told otherwise".into();
        }
        if !self.paths.iter().any(|path| path.up) {
            return "no carrier of the link can be used".into();
        }
        if !self.heard {
            return format!("{peer} is not heard; the link looks for it");
        }
        if !self.outbox.is_safe(number) {
            return "it is being written to the journal".into();
        }
        match tries {
            Some(tries) => format!("sent {tries} times, and {peer} has not acknowledged it yet"),
            None => {
                let ahead = self.outbox.waiting_before(number);
                let time = self.estimate(now, 0).map(|time| format!(", about {:.1} s", time.as_secs_f64()));
                format!("{ahead} commands go before it{}", time.unwrap_or_default())
            }
        }
    }

    /// The ticket of a command that waits or is on the air.
    pub fn ticket_of(&self, number: u64) -> Option<Ticket> {
        self.outbox.entry(number).map(|entry| entry.ticket)
    }

    /// The largest ticket of all commands that wait: what the journal brought back is told apart from what comes.
    pub fn largest_ticket(&self) -> Ticket {
        self.outbox.largest_ticket()
    }
}
