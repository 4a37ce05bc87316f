//! `aldis sub`: messages as they come.

use super::content::content_text;
use super::exit::Failure;
use super::member::{Desk, Join, Member};
use super::print_line;
use super::within::Within;
use aldis_envelope::{Change, Envelope, Now, Prefix};
use aldis_services::{Input, Outbox};
use serde_json::{Value, json};
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// Show messages as they come.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis sub                             everything
  aldis sub afrl.cmasi UMAA::SO         what begins so
  aldis sub afrl.cmasi --decode         the fields of LMCP messages too
  aldis sub eid400 --json --count 3     what is addressed to vehicle 400 and its services, three messages")]
pub(crate) struct Subscribe {
    /// Beginnings of addresses, or ids, matched whole. None: everything.
    #[arg(value_parser = prefix)]
    prefixes: Vec<Prefix>,
    /// End after so many messages.
    #[arg(long)]
    count: Option<u64>,
    /// End after so long.
    #[arg(long = "for")]
    span: Option<Within>,
    /// Show the content too; of LMCP the fields. With `--json` the content is there anyway, of LMCP as hexadecimal.
    #[arg(long)]
    decode: bool,
    /// One JSON object a message.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    join: Join,
}

/// A prefix as an argument.
pub(super) fn prefix(text: &str) -> Result<Prefix, String> {
    Prefix::new(text).map_err(|why| why.to_string())
}

enum Heard {
    Joined,
    Envelope(Box<Envelope>),
}

struct Listener(mpsc::SyncSender<Heard>);

impl Desk for Listener {
    fn take(&mut self, _: Now, input: Input<'_>, _: &mut Outbox) {
        let heard = match input {
            Input::Bus(true) => Heard::Joined,
            Input::Message(envelope) => Heard::Envelope(Box::new(envelope.clone())),
            _ => return,
        };
        // Waits where printing is slower than the bus: nothing is left out.
        let _ = self.0.send(heard);
    }
}

impl Subscribe {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let prefixes = if self.prefixes.is_empty() { vec![Prefix::all()] } else { self.prefixes.clone() };
        let (tell, heard) = mpsc::sync_channel(10_000);
        let member = Member::join(&self.join, prefixes, Listener(tell))?;
        let done = self.follow(&heard);
        // The desk must not wait for a place while the node ends.
        drop(heard);
        member.leave()?;
        done
    }

    fn follow(&self, heard: &mpsc::Receiver<Heard>) -> Result<(), Failure> {
        let mut until = None;
        let mut count = 0;
        let mut joined = false;
        while self.count.is_none_or(|most| count < most) {
            let wait = match until {
                _ if !joined => super::JOIN_WITHIN,
                Some(until) => Instant::saturating_duration_since(&until, Instant::now()),
                None => Duration::from_secs(3600),
            };
            match heard.recv_timeout(wait) {
                Ok(Heard::Joined) => {
                    joined = true;
                    until = self.span.map(|span| Instant::now() + span.0);
                }
                Ok(Heard::Envelope(envelope)) => {
                    count += 1;
                    self.print(&envelope);
                }
                Err(mpsc::RecvTimeoutError::Timeout) if !joined => return Err(self.join.unreachable()),
                Err(mpsc::RecvTimeoutError::Timeout) if until.is_none() => {}
                Err(_) => return Ok(()),
            }
        }
        Ok(())
    }

    fn print(&self, envelope: &Envelope) {
        let Envelope { message, stamp } = envelope;
        if self.json {
            print_line(envelope_json(envelope, self.decode));
            return;
        }
        let label = &message.label;
        let what = if label.is_broadcast() { String::new() } else { format!(" {}", label.descriptor()) };
        let change = match message.change {
            Change::Put => "",
            Change::Dispose => " disposed",
            Change::Unregister => " unregistered",
        };
        let (source, address, bytes) = (label.source(), &label.address, message.content.len());
        print_line(format_args!("{} {source} -> {address}{what}{change} {bytes} B", stamp.source_time));
        if self.decode && bytes > 0 {
            print_line(format_args!("{:#}", content_text(label, &message.content, true)));
        }
    }
}

/// A message for machines.
pub(super) fn envelope_json(envelope: &Envelope, decode: bool) -> Value {
    let Envelope { message, stamp } = envelope;
    let attributes = &message.label.attributes;
    json!({
        "address": message.label.address,
        "content_type": attributes.content_type,
        "descriptor": attributes.descriptor,
        "source_group": attributes.source_group,
        "source_entity": attributes.source.entity,
        "source_service": attributes.source.service,
        "change": message.change,
        "instance": message.instance.as_ref().map(|instance| instance.hash.to_string()),
        "node": stamp.node,
        "boot": stamp.boot,
        "sequence": stamp.sequence,
        "source_time": stamp.source_time.to_string(),
        "skipped": stamp.skipped,
        "content": content_text(&message.label, &message.content, decode),
    })
}
