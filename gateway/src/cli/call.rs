//! `aldis call`: a request and its answers.

use super::content::{content_text, content_type, descriptor, read_file};
use super::exit::Failure;
use super::member::{Desk, Join, Member};
use super::print_line;
use super::within::Within;
use aldis_envelope::aldis::link;
use aldis_envelope::{Address, ContentType, Descriptor, Envelope, Monotonic, Now, Refusal, Role, aldis};
use aldis_services::{Input, Outbox};
use bytes::Bytes;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::mpsc;
use std::time::Duration;

/// Call a service, a mailbox or all services of an entity.
///
/// Each answer is a line. With `--json` the last line is one object with `ok`, `answers` and, where it failed, `reason`.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis call eid400sid1 --ping             is it there, and how far away?
  aldis call eid400sid1 --ping --wait --within 30s    how a call across a lossy link gets on
  aldis call eid400sidall --ping           every service of vehicle 400
  aldis call eid400sid1 --request aldis.NodeQuery --json
  aldis call AircraftPathPlanner --request uxas.RoutePlanRequest --content-type lmcp --file request.lmcp")]
pub(crate) struct CallArgs {
    /// `eid400sid37`, `eid400sidall`, `eid400` or the name of a mailbox.
    address: Address,
    /// Ask whether it is there: every service answers.
    #[arg(long, conflicts_with_all = ["request", "text", "file"])]
    ping: bool,
    /// The descriptor of the request.
    #[arg(long, required_unless_present = "ping", value_parser = descriptor)]
    request: Option<Descriptor>,
    /// What the content is written in.
    #[arg(long, default_value = "aldis", value_parser = content_type)]
    content_type: ContentType,
    /// The content, as text.
    #[arg(long, conflicts_with = "file")]
    text: Option<String>,
    /// The content, as a file.
    #[arg(long)]
    file: Option<PathBuf>,
    /// How long to wait for answers: `2s`, `500ms`.
    #[arg(long, default_value = "2s")]
    within: Within,
    /// Say how the request gets on where it crosses a lossy link: accepted, on air, delivered.
    #[arg(long)]
    wait: bool,
    /// One JSON object a line.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    join: Join,
}

/// What the desk tells the command.
enum Told {
    Asked,
    Ticket(link::CallTicket),
    Answer(Value),
    Ended(Result<(), Refusal>),
}

struct Caller {
    address: Address,
    content_type: ContentType,
    request: Descriptor,
    content: Bytes,
    within: Duration,
    asked: Option<Monotonic>,
    tell: mpsc::Sender<Told>,
}

impl Desk for Caller {
    fn take(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        let told = match input {
            Input::Bus(true) if self.asked.is_none() => {
                self.asked = Some(now.monotonic);
                let (address, content) = (self.address.clone(), self.content.clone());
                out.call(address, self.content_type.clone(), self.request.clone(), content, self.within);
                Told::Asked
            }
            Input::Message(envelope) if is_reply(envelope) => {
                let elapsed = self.asked.map(|asked| now.monotonic - asked).unwrap_or_default();
                Told::Answer(answer(envelope, elapsed))
            }
            Input::Message(envelope) if envelope.message.label.descriptor() == link::TICKET => {
                match aldis::decode(&envelope.message.content) {
                    Some(ticket) => Told::Ticket(ticket),
                    None => return,
                }
            }
            Input::CallEnded(_, outcome) => Told::Ended(outcome),
            _ => return,
        };
        // The command no longer listens where it has been cut off.
        let _ = self.tell.send(told);
    }
}

fn is_reply(envelope: &Envelope) -> bool {
    envelope.message.call.as_ref().is_some_and(|call| matches!(call.role, Role::Reply { .. }))
}

fn answer(envelope: &Envelope, elapsed: Duration) -> Value {
    let message = &envelope.message;
    let mut answer = json!({
        "from": message.label.source().to_string(),
        "descriptor": message.label.descriptor(),
        "round_trip_ms": (elapsed.as_secs_f64() * 1e6).round() / 1e3,
    });
    if message.label.descriptor() != aldis::PONG {
        answer["content"] = content_text(&message.label, &message.content, true);
    }
    answer
}

fn ticket_text(state: &link::CallState) -> String {
    let seconds = |ms: &u64| *ms as f64 / 1e3;
    match state {
        link::CallState::Accepted(None) => "accepted".into(),
        link::CallState::Accepted(Some(ms)) => format!("accepted, takes about {:.1} s", seconds(ms)),
        link::CallState::OnAir(tries) => format!("on air, try {tries}"),
        link::CallState::Delivered(ms, tries) => {
            format!("delivered after {:.1} s, {tries} tries", seconds(ms))
        }
        link::CallState::Expired(tries) => format!("expired, {tries} tries"),
        link::CallState::Cancelled(tries) => format!("taken back, {tries} tries"),
        link::CallState::Refused(why) => format!("refused: {why}"),
    }
}

impl CallArgs {
    /// A request without content.
    pub(super) fn request(
        address: Address,
        request: &str,
        within: Within,
        json: bool,
        join: Join,
    ) -> Result<Self, Failure> {
        let request = Some(descriptor(request).map_err(Failure::Usage)?);
        let content_type = ContentType::Aldis;
        let (ping, wait, text, file) = (false, false, None, None);
        Ok(Self { address, ping, request, content_type, text, file, within, wait, json, join })
    }

    /// A ping that says how it gets on.
    pub(super) fn ping(address: Address, within: Within, json: bool, join: Join) -> Self {
        let (ping, wait, content_type) = (true, true, ContentType::Aldis);
        Self { address, ping, request: None, content_type, text: None, file: None, within, wait, json, join }
    }

    pub(crate) fn run(self) -> Result<(), Failure> {
        let content = match (&self.text, &self.file) {
            (Some(text), _) => Bytes::from(text.clone()),
            (None, Some(file)) => read_file(file)?,
            (None, None) => Bytes::new(),
        };
        let request = if self.ping { descriptor(aldis::PING).ok() } else { self.request.clone() };
        let request =
            request.ok_or_else(|| Failure::Usage("a request needs a descriptor: --request NAME".into()))?;
        let (tell, told) = mpsc::channel();
        let caller = Caller {
            address: self.address.clone(),
            content_type: self.content_type.clone(),
            request,
            content,
            within: self.within.0,
            asked: None,
            tell,
        };
        let member = Member::join(&self.join, Vec::new(), caller)?;
        let done = self.follow(&told);
        member.leave()?;
        done
    }

    fn follow(&self, told: &mpsc::Receiver<Told>) -> Result<(), Failure> {
        let mut answers = 0;
        let mut patience = super::JOIN_WITHIN;
        let ended = loop {
            match told.recv_timeout(patience) {
                Ok(Told::Asked) => patience = self.within.0 + Duration::from_secs(1),
                Ok(Told::Ticket(ticket)) => self.print_ticket(&ticket),
                Ok(Told::Answer(answer)) => {
                    answers += 1;
                    self.print(&answer);
                }
                Ok(Told::Ended(outcome)) => break outcome.map_err(Failure::Refused),
                Err(_) => break Err(self.join.unreachable()),
            }
        };
        if self.json {
            let reason = ended.as_ref().err().map(ToString::to_string);
            let mut last = json!({ "ok": ended.is_ok(), "address": self.address, "answers": answers });
            if let Some(reason) = reason {
                last["reason"] = reason.into();
            }
            print_line(last);
        }
        ended
    }

    fn print_ticket(&self, ticket: &link::CallTicket) {
        let text = ticket_text(&ticket.state);
        if self.wait && self.json {
            print_line(json!({ "ticket": text, "link": ticket.peer }));
        } else if self.wait {
            print_line(format_args!("link to {}: {text}", ticket.peer));
        }
    }

    fn print(&self, answer: &Value) {
        if self.json {
            print_line(answer);
            return;
        }
        let text = |key: &str| answer[key].as_str().unwrap_or_default();
        let head = format!("{}: {} in {} ms", text("from"), text("descriptor"), answer["round_trip_ms"]);
        match &answer["content"] {
            Value::Null => print_line(head),
            content => print_line(format_args!("{head}\n{content:#}")),
        }
    }
}
