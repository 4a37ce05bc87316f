//! `aldis record`: what comes by, into a file.

use super::exit::Failure;
use super::member::{Desk, Join, Member};
use super::print_line;
use super::within::Within;
use aldis_envelope::codec::recording::Writer;
use aldis_envelope::{Envelope, Now, Prefix, Wall};
use aldis_services::{Input, Outbox};
use serde_json::json;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// How many envelopes may wait for the disk: then the bus waits too.
const WAITING_MAX: usize = 10_000;
/// How often what was recorded is handed to the operating system.
const FLUSH_EVERY: Duration = Duration::from_millis(500);

/// Record envelopes, with the times when they came.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis record watch.aldis                         everything, until it is stopped
  aldis record watch.aldis UMAA::SO --for 10m      what begins so, for ten minutes
  aldis replay watch.aldis                         the same again")]
pub(crate) struct Record {
    /// The file to write; it must not exist.
    file: PathBuf,
    /// Beginnings of addresses, or ids, matched whole. None: everything.
    #[arg(value_parser = super::subscribe::prefix)]
    prefixes: Vec<Prefix>,
    /// End after so many envelopes.
    #[arg(long)]
    count: Option<u64>,
    /// End after so long.
    #[arg(long = "for")]
    span: Option<Within>,
    /// One JSON object at the end.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    join: Join,
}

enum Heard {
    Joined,
    Envelope(Wall, Box<Envelope>),
    Stop,
}

struct Listener(mpsc::SyncSender<Heard>);

impl Desk for Listener {
    fn take(&mut self, now: Now, input: Input<'_>, _: &mut Outbox) {
        let heard = match input {
            Input::Bus(true) => Heard::Joined,
            Input::Message(envelope) => Heard::Envelope(now.wall, Box::new(envelope.clone())),
            _ => return,
        };
        // Waits where the disk is slower than the bus: nothing is left out.
        let _ = self.0.send(heard);
    }
}

impl Record {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let wrong = |why| Failure::Failed(format!("cannot write {}: {why}", self.file.display()));
        let (writer, head) = Writer::new(&self.join.fleet()?);
        let mut file = BufWriter::new(File::create_new(&self.file).map_err(wrong)?);
        file.write_all(&head).map_err(wrong)?;
        let prefixes = if self.prefixes.is_empty() { vec![Prefix::all()] } else { self.prefixes.clone() };
        let (tell, heard) = mpsc::sync_channel(WAITING_MAX);
        let stop = tell.clone();
        super::run::watch_signals(move || drop(stop.send(Heard::Stop)))?;
        let member = Member::join(&self.join, prefixes, Listener(tell))?;
        let done = self.write(&heard, &writer, &mut file);
        // The desk must not wait for a place while the node ends.
        drop(heard);
        member.leave()?;
        file.flush().map_err(wrong)?;
        let count = done?;
        if self.json {
            print_line(json!({ "file": self.file, "envelopes": count }));
        } else {
            print_line(format_args!("{count} envelopes in {}", self.file.display()));
        }
        Ok(())
    }

    fn write(
        &self,
        heard: &mpsc::Receiver<Heard>,
        writer: &Writer,
        file: &mut impl Write,
    ) -> Result<u64, Failure> {
        let wrong = |why| Failure::Failed(format!("cannot write {}: {why}", self.file.display()));
        let (mut count, mut until, mut joined) = (0, None, false);
        let started = Instant::now();
        while self.count.is_none_or(|most| count < most) {
            let left =
                until.map_or(FLUSH_EVERY, |until: Instant| until.saturating_duration_since(Instant::now()));
            match heard.recv_timeout(left.min(FLUSH_EVERY)) {
                Ok(Heard::Joined) => {
                    joined = true;
                    until = until.or_else(|| self.span.map(|span| Instant::now() + span.0));
                }
                Ok(Heard::Envelope(received, envelope)) => {
                    count += 1;
                    file.write_all(&writer.record(received, &envelope)).map_err(wrong)?;
                }
                Err(mpsc::RecvTimeoutError::Timeout) => {
                    file.flush().map_err(wrong)?;
                    if !joined && started.elapsed() > super::JOIN_WITHIN {
                        return Err(self.join.unreachable());
                    }
                    if until.is_some_and(|until| until <= Instant::now()) {
                        return Ok(count);
                    }
                }
                Ok(Heard::Stop) | Err(mpsc::RecvTimeoutError::Disconnected) => return Ok(count),
            }
        }
        Ok(count)
    }
}
