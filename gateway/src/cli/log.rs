//! `aldis log`: what a node has heard of the fleet.

use super::exit::Failure;
use super::member::{Desk, Join, Member};
use super::print_line;
use super::within::Within;
use crate::clock;
use aldis_envelope::aldis::{self, LogQuery};
use aldis_envelope::umaa::{self, LogLevel, LogReport};
use aldis_envelope::{
    Address, ContentType, Descriptor, EntityId, Guid, Guids, Now, Refusal, ServiceId, Source, Wall,
};
use aldis_services::{Input, Outbox};
use serde_json::json;
use std::sync::mpsc;
use std::time::Duration;

/// Show the log that a node keeps of the fleet, oldest first.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis log                                       what the node of entity 1 has heard
  aldis log --level WARNING,ERROR --since 10m
  aldis log --at 400 --source eid400sid3 --last 20 --json")]
pub(crate) struct LogArgs {
    /// The node whose log it is, by its entity.
    #[arg(long, default_value = "1", value_name = "EID")]
    at: EntityId,
    /// Only these levels: ERROR, INFORMATION, WARNING.
    #[arg(long, value_delimiter = ',', value_name = "LEVEL")]
    level: Vec<LogLevel>,
    /// Only entries of this service: `eid400sid3` or its GUID.
    #[arg(long, value_name = "SOURCE")]
    source: Option<String>,
    /// Only entries made in this last span of time, by their writers' clocks.
    #[arg(long, value_name = "SPAN")]
    since: Option<Within>,
    /// Only the last so many of them.
    #[arg(long, value_name = "COUNT")]
    last: Option<u32>,
    /// How long to wait for the answer.
    #[arg(long, default_value = "5s")]
    within: Within,
    /// One JSON object an entry.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    join: Join,
}

enum Told {
    Asked,
    Entry(LogReport),
    Ended(Result<(), Refusal>),
}

struct Asking {
    to: Source,
    query: LogQuery,
    within: Duration,
    asked: bool,
    tell: mpsc::Sender<Told>,
}

impl Desk for Asking {
    fn take(&mut self, _: Now, input: Input<'_>, out: &mut Outbox) {
        let told = match input {
            Input::Bus(true) if !std::mem::replace(&mut self.asked, true) => {
                let Ok(request) = Descriptor::new(aldis::LOG_QUERY) else { return };
                let content = aldis::encode(&self.query).into();
                out.call(Address::Service(self.to), ContentType::Aldis, request, content, self.within);
                Told::Asked
            }
            Input::Message(envelope) => match umaa::decode(&envelope.message.content) {
                Ok(entry) => Told::Entry(entry),
                // The last answer is empty.
                Err(_) => return,
            },
            Input::CallEnded(_, outcome) => Told::Ended(outcome),
            _ => return,
        };
        // The command no longer listens where it has been cut off.
        let _ = self.tell.send(told);
    }
}

impl LogArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let guids = self.join.guids()?;
        let source = self.source.as_deref().map(|text| guid_of(&guids, text)).transpose()?;
        let since = self.since.map(|since| Wall(clock::wall().0.saturating_sub(since.0.as_nanos() as i64)));
        let query = LogQuery {
            levels: self.level.clone(),
            source,
            since: since.map(Into::into),
            last: self.last.unwrap_or(u32::MAX),
        };
        let (tell, told) = mpsc::channel();
        let to = Source::new(self.at, ServiceId::LOG);
        let asking = Asking { to, query, within: self.within.0, asked: false, tell };
        let member = Member::join(&self.join, Vec::new(), asking)?;
        let done = self.follow(&guids, &told);
        member.leave()?;
        done
    }

    fn follow(&self, guids: &Guids, told: &mpsc::Receiver<Told>) -> Result<(), Failure> {
        let mut patience = super::JOIN_WITHIN;
        loop {
            match told.recv_timeout(patience) {
                Ok(Told::Asked) => patience = self.within.0 + Duration::from_secs(1),
                Ok(Told::Entry(entry)) => self.print(guids, &entry),
                Ok(Told::Ended(outcome)) => return outcome.map_err(Failure::Refused),
                Err(_) => return Err(self.join.unreachable()),
            }
        }
    }

    fn print(&self, guids: &Guids, entry: &LogReport) {
        let source = guids.service(entry.source).map_or_else(|| entry.source.to_string(), |s| s.to_string());
        let time = Wall::from(entry.time_stamp);
        if self.json {
            print_line(json!({
                "time_stamp": time.to_string(), "level": entry.level, "source": source,
                "source_id": entry.source, "entry": entry.entry,
            }));
        } else {
            print_line(format_args!("{time} {:<11} {source}: {}", entry.level, entry.entry));
        }
    }
}

fn guid_of(guids: &Guids, text: &str) -> Result<Guid, Failure> {
    if let Ok(Address::Service(source)) = Address::new(text) {
        return Ok(guids.of_service(source));
    }
    let wrong = |_| Failure::Usage(format!("`{text}` is neither `eid…sid…` nor a GUID"));
    text.parse().map_err(wrong)
}
