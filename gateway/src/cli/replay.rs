//! `aldis replay`: a recording, sent again.

use super::exit::Failure;
use super::member::{Join, Member, desk_service};
use super::print_line;
use crate::runtime;
use aldis_envelope::codec::recording::Reader;
use aldis_envelope::{Message, Monotonic, Now, Source, Wall};
use aldis_services::{Input, Outbox};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::mpsc;
use std::time::Duration;

/// How long after the session is up the first envelope is sent: subscribers must have heard of the publishers.
const LEAD: Duration = Duration::from_millis(500);

/// Send a recording again, each envelope as the source that sent it and at its time.
///
/// Calls are left out: nobody waits for their answers. Do not replay into a fleet whose own services are there.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis replay watch.aldis
  aldis replay watch.aldis --speed 10 --fleet rehearsal")]
pub(crate) struct Replay {
    /// The recording.
    file: PathBuf,
    /// How many times as fast as it was.
    #[arg(long, default_value_t = 1.0)]
    speed: f64,
    /// One JSON object at the end.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    join: Join,
}

/// What a recording holds.
struct Recorded {
    /// What each source has sent, and when after the first of all.
    by_source: BTreeMap<Source, Vec<(Duration, Message)>>,
    /// What is left out.
    skipped: u64,
    /// How long it takes.
    span: Duration,
}

/// Sends what one source has sent.
struct Sender {
    messages: std::vec::IntoIter<(Duration, Message)>,
    following: Option<(Duration, Message)>,
    start: Option<Monotonic>,
    done: mpsc::Sender<u64>,
    sent: u64,
}

impl super::member::Desk for Sender {
    fn take(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        if matches!(input, Input::Bus(true)) && self.start.is_none() {
            self.start = Some(now.monotonic + LEAD);
        }
        let Some(start) = self.start else { return };
        while let Some((_, message)) = self.following.take_if(|(at, _)| start + *at <= now.monotonic) {
            out.send(message);
            self.sent += 1;
            self.following = self.messages.next();
            if self.following.is_none() {
                // The command no longer listens where it has been cut off.
                let _ = self.done.send(self.sent);
            }
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.following.as_ref().zip(self.start).map(|((at, _), start)| start + *at)
    }
}

impl Replay {
    pub(crate) fn run(self) -> Result<(), Failure> {
        if !(self.speed.is_finite() && self.speed > 0.0) {
            return Err(Failure::Usage(format!("--speed {}: a number above 0", self.speed)));
        }
        let bytes = super::content::read_file(&self.file)?;
        let Recorded { by_source, skipped, span } = self.read(&bytes)?;
        let (done, is_done) = mpsc::channel();
        let config = self.join.load()?;
        let outside = runtime::outside(&config).map_err(|why| Failure::Usage(why.to_string()))?;
        let mut node = runtime::node_config(&config);
        node.reliable = false;
        node.bridges.clear();
        node.links.clear();
        node.services.clear();
        let count = by_source.len();
        for (source, messages) in by_source {
            if !node.entities.contains(&source.entity) {
                node.entities.push(source.entity);
            }
            let mut messages = messages.into_iter();
            let following = messages.next();
            let sender = Sender { messages, following, start: None, done: done.clone(), sent: 0 };
            node.services.push(desk_service(source, Vec::new(), sender));
        }
        let member = Member::start(node, outside)?;
        let mut sent = 0;
        let mut outcome = Ok(());
        for _ in 0..count {
            match is_done.recv_timeout(super::JOIN_WITHIN + LEAD + span) {
                Ok(of_source) => sent += of_source,
                Err(_) => outcome = Err(self.join.unreachable()),
            }
        }
        member.leave()?;
        outcome?;
        if self.json {
            print_line(json!({ "file": self.file, "sources": count, "sent": sent, "skipped": skipped }));
        } else {
            print_line(format_args!("{sent} envelopes of {count} sources sent, {skipped} left out"));
        }
        Ok(())
    }

    fn read(&self, bytes: &[u8]) -> Result<Recorded, Failure> {
        let wrong = |why: &dyn std::fmt::Display| Failure::Usage(format!("{}: {why}", self.file.display()));
        let reader = Reader::new(bytes).map_err(|why| wrong(&why))?;
        let mut by_source: BTreeMap<Source, Vec<_>> = BTreeMap::new();
        let (mut skipped, mut first, mut span) = (0, None, Duration::ZERO);
        for record in reader {
            let (received, envelope) = match record {
                Ok((received, envelope)) if envelope.message.call.is_none() => (received, envelope),
                Ok(_) => {
                    skipped += 1;
                    continue;
                }
                Err(why) => {
                    eprintln!("aldis: {}: {why}", self.file.display());
                    skipped += 1;
                    continue;
                }
            };
            let Wall(start) = *first.get_or_insert(received);
            let nanoseconds = u64::try_from(received.0.saturating_sub(start)).unwrap_or_default();
            let at = Duration::from_secs_f64(nanoseconds as f64 / 1e9 / self.speed);
            span = span.max(at);
            by_source.entry(envelope.message.label.source()).or_default().push((at, envelope.message));
        }
        Ok(Recorded { by_source, skipped, span })
    }
}
