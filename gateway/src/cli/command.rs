//! `aldis command`: the flow of UMAA commands as it happens, and a provider to try consumers against.

mod stand_in;

use super::exit::Failure;
use super::member::{Desk, Join, Member};
use super::print_line;
use super::subscribe::envelope_json;
use super::within::Within;
use aldis_envelope::{Change, ContentType, Envelope, Guid, Guids, Now, Prefix, umaa};
use aldis_services::conform::{Role, role_of};
use aldis_services::{Input, Outbox};
use serde_json::Value;
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// Follow UMAA commands.
#[derive(clap::Args)]
pub(crate) struct CommandArgs {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    /// Show commands, acknowledgements and statuses as they come, those that are open first.
    Watch(Watch),
    /// Stand in for a provider, and fail every command in the way that is told.
    StandIn(stand_in::StandIn),
}

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis command watch
  aldis command watch UMAA::SO::ResourceAllocation --for 1m --json")]
struct Watch {
    /// Beginnings of topics.
    #[arg(default_value = "UMAA::", value_parser = super::subscribe::prefix)]
    topics: Vec<Prefix>,
    /// End after so many lines.
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

enum Heard {
    Joined,
    Envelope(Box<Envelope>),
}

struct Watcher(mpsc::SyncSender<Heard>);

impl Desk for Watcher {
    fn take(&mut self, _: Now, input: Input<'_>, _: &mut Outbox) {
        let heard = match input {
            Input::Bus(true) => Heard::Joined,
            Input::Message(envelope) if role(envelope).is_some() => {
                Heard::Envelope(Box::new(envelope.clone()))
            }
            _ => return,
        };
        // Waits where printing is slower than the bus: no transition is left out.
        let _ = self.0.send(heard);
    }
}

/// Which part of a command's flow an envelope carries.
fn role(envelope: &Envelope) -> Option<Role> {
    role_of(envelope.message.label.descriptor())
}

impl CommandArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self.what {
            What::Watch(watch) => watch.run(),
            What::StandIn(stand_in) => stand_in.run(),
        }
    }
}

impl Watch {
    fn run(&self) -> Result<(), Failure> {
        let guids = self.join.guids()?;
        let (tell, heard) = mpsc::sync_channel(10_000);
        let member = Member::join(&self.join, self.topics.clone(), Watcher(tell))?;
        let done = self.follow(&guids, &heard);
        // The desk must not wait for a place while the node ends.
        drop(heard);
        member.leave()?;
        done
    }

    fn follow(&self, guids: &Guids, heard: &mpsc::Receiver<Heard>) -> Result<(), Failure> {
        let mut until = Instant::now() + super::JOIN_WITHIN;
        let (mut joined, mut count) = (false, 0);
        while self.count.is_none_or(|most| count < most) {
            let wait = match (joined, self.span) {
                (true, None) => Duration::MAX,
                _ => until.saturating_duration_since(Instant::now()),
            };
            match heard.recv_timeout(wait) {
                Ok(Heard::Joined) => {
                    joined = true;
                    until = Instant::now() + self.span.map_or(Duration::ZERO, |span| span.0);
                }
                Ok(Heard::Envelope(envelope)) => {
                    count += 1;
                    self.print(guids, &envelope);
                }
                Err(_) if !joined => return Err(self.join.unreachable()),
                Err(_) => return Ok(()),
            }
        }
        Ok(())
    }

    fn print(&self, guids: &Guids, envelope: &Envelope) {
        if self.json {
            print_line(envelope_json(envelope, true));
            return;
        }
        let message = &envelope.message;
        let (time, writer) = (envelope.stamp.source_time, message.label.source());
        let topic = message.label.descriptor().rsplit("::").next().unwrap_or_default();
        let what = match (message.change, role(envelope)) {
            (Change::Dispose, Some(Role::Command)) => "disposed: a cancel, or the end is known".to_owned(),
            (Change::Dispose, _) => "disposed".to_owned(),
            (Change::Unregister, _) => "unregistered".to_owned(),
            (Change::Put, role) => said(guids, role, envelope),
        };
        print_line(format_args!("{time} {writer} {topic} {} {what}", session(envelope)));
    }
}

/// A sample in JSON, where its topic is known.
fn sample(envelope: &Envelope) -> Option<Value> {
    let message = &envelope.message;
    let topic = umaa::topic(message.label.descriptor())?;
    match (message.change, &message.label.attributes.content_type) {
        (Change::Put, ContentType::Umaa) => topic.json(&message.content).ok(),
        _ => topic.key_json(message.instance.as_deref()?),
    }
}

/// The first digits of the session's id.
fn session(envelope: &Envelope) -> String {
    let session = sample(envelope).and_then(|sample| sample["sessionID"].as_str().map(str::to_owned));
    session.map_or_else(
        || "session ?".into(),
        |id| format!("session {}", id.split('-').next().unwrap_or_default()),
    )
}

fn said(guids: &Guids, role: Option<Role>, envelope: &Envelope) -> String {
    let Some(sample) = sample(envelope) else {
        return format!("{} B", envelope.message.content.len());
    };
    let text = |member: &str| sample[member].as_str().unwrap_or_default();
    match role {
        Some(Role::Status) => {
            let (state, reason, log) =
                (text("commandStatus"), text("commandStatusReason"), text("logMessage"));
            format!("{state} {reason} {log}").trim_end().to_owned()
        }
        Some(Role::Command) => {
            let to = text("destination");
            let service = to.parse::<Guid>().ok().and_then(|guid| guids.service(guid));
            format!("to {}", service.map_or_else(|| to.to_owned(), |service| service.to_string()))
        }
        Some(Role::Ack) => "acknowledged".to_owned(),
        Some(Role::ExecutionStatus) | None => sample.to_string(),
    }
}
