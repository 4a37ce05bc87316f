//! `aldis pub` and `aldis sub`: messages in and out of the fleet.

use super::content::{content_text, content_type, descriptor, read_file};
use super::exit::Failure;
use super::member::{Desk, Join, Member};
use super::print_line;
use super::within::Within;
use aldis_envelope::{
    Address, Change, ContentType, Descriptor, Envelope, Label, Message, Monotonic, Now, Prefix,
};
use aldis_services::{Input, Outbox};
use bytes::Bytes;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

/// Publish a message.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis pub afrl.cmasi.KeyValuePair --file pair.lmcp
  aldis pub eid400sid37 --descriptor afrl.cmasi.KeyValuePair --file pair.lmcp
  aldis pub weather --content-type text --text calm --count 10 --rate 2")]
pub(crate) struct Publish {
    /// Where to: a message type (broadcast), a mailbox, `eid400sid37`, `eid400sidall` or `eid400`.
    address: Address,
    /// What it is; by default the address.
    #[arg(long, value_parser = descriptor)]
    descriptor: Option<Descriptor>,
    /// What the content is written in.
    #[arg(long, default_value = "lmcp", value_parser = content_type)]
    content_type: ContentType,
    /// The content, as text.
    #[arg(long, conflicts_with = "file", required_unless_present = "file")]
    text: Option<String>,
    /// The content, as a file.
    #[arg(long)]
    file: Option<PathBuf>,
    /// How many times.
    #[arg(long, default_value_t = 1)]
    count: u64,
    /// How often, per second.
    #[arg(long, default_value_t = 10.0)]
    rate: f64,
    /// One JSON object at the end.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    join: Join,
}

struct Publisher {
    content_type: ContentType,
    address: Address,
    descriptor: Descriptor,
    content: Bytes,
    left: u64,
    period: Duration,
    next: Option<Monotonic>,
    done: mpsc::Sender<()>,
}

impl Desk for Publisher {
    fn take(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        let due = self.next.is_some_and(|next| next <= now.monotonic);
        if self.left == 0 || !(matches!(input, Input::Bus(true)) || due) {
            return;
        }
        let (address, descriptor) = (self.address.clone(), self.descriptor.clone());
        let label = Label::limitedcast(address, self.content_type.clone(), descriptor, out.source());
        out.send(Message::new(Arc::new(label), self.content.clone()));
        self.left -= 1;
        self.next = (self.left > 0).then(|| now.monotonic + self.period);
        if self.left == 0 {
            let _ = self.done.send(());
        }
    }
    fn next_deadline(&self) -> Option<Monotonic> {
        self.next
    }
}

impl Publish {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let period = Duration::try_from_secs_f64(1.0 / self.rate)
            .map_err(|_| Failure::Usage(format!("--rate {}: a number above 0", self.rate)))?;
        let content = match (&self.text, &self.file) {
            (Some(text), _) => Bytes::from(text.clone()),
            (None, Some(file)) => read_file(file)?,
            (None, None) => Bytes::new(),
        };
        let named = || descriptor(&self.address.to_string()).map_err(Failure::Usage);
        let descriptor = self.descriptor.clone().map_or_else(named, Ok)?;
        let (done, is_done) = mpsc::channel();
        let bytes = content.len();
        let publisher = Publisher {
            content_type: self.content_type,
            address: self.address.clone(),
            descriptor,
            content,
            left: self.count,
            period,
            next: None,
            done,
        };
        let member = Member::join(&self.join, Vec::new(), publisher)?;
        let patience =
            super::JOIN_WITHIN + period.saturating_mul(u32::try_from(self.count).unwrap_or(u32::MAX));
        let published = is_done.recv_timeout(patience).map_err(|_| self.join.unreachable());
        member.leave()?;
        published?;
        if self.json {
            print_line(json!({ "address": self.address, "published": self.count, "bytes": bytes }));
        }
        Ok(())
    }
}

/// Show messages as they come.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis sub                             everything
  aldis sub afrl.cmasi UMAA::SO         what begins so
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
            print_line(envelope_json(envelope));
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
    }
}

/// A message for machines.
pub(super) fn envelope_json(envelope: &Envelope) -> Value {
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
        "content": content_text(&message.label, &message.content),
    })
}
