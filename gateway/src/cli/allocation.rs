//! `aldis allocate`, `release` and `priority`: who commands what (UMAA ResourceAllocation).

mod allocate;
mod priority;
mod release;

pub(super) use allocate::Allocate;
pub(super) use priority::Priority;
pub(super) use release::Release;

use super::exit::Failure;
use super::member::{Desk, Join, Member};
use super::print_line;
use aldis_envelope::umaa::{Command, CommandState};
use aldis_envelope::{EntityId, Guid, Guids, Monotonic, Now, Prefix, ServiceId, Source};
use aldis_services::umaa::command::{Consumer, ConsumerError, Outcome, Told};
use aldis_services::{Input, Outbox};
use serde_json::{Value, json};
use std::str::FromStr;
use std::sync::mpsc;
use std::time::Duration;

/// Asks a running `aldis allocate` to give its resource back.
const RELEASE: &str = "aldis.Release";

/// A resource on the command line: `400:autopilot`, or with a GUID in place of the name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ResourceName {
    entity: EntityId,
    name: String,
}

impl FromStr for ResourceName {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let (entity, name) = text
            .split_once(':')
            .filter(|(_, name)| !name.is_empty())
            .ok_or_else(|| format!("`{text}` is no resource: write entity and name, as in 400:autopilot"))?;
        let entity = entity.parse().map_err(|why| format!("`{text}`: {why}"))?;
        Ok(Self { entity, name: name.to_owned() })
    }
}

impl ResourceName {
    /// The GUID of the resource.
    fn guid(&self, guids: &Guids) -> Guid {
        self.name.parse().unwrap_or_else(|_| guids.of_resource(self.entity, &self.name))
    }

    /// The arbiter that gives control of it.
    fn arbiter(&self, guids: &Guids) -> Guid {
        guids.of_service(Source::new(self.entity, ServiceId::ALLOCATION))
    }
}

/// What a consumer's desk tells its command.
enum News {
    /// It is out.
    Asked,
    /// It cannot go out.
    NotAsked(ConsumerError),
    /// It has come into a state.
    State(CommandState, String),
    /// It has ended.
    Ended(Outcome),
}

/// Sends one command, once what the fleet retains is known, and follows it to its end.
struct OneCommand<C: Command> {
    consumer: Consumer<C>,
    destination: Guid,
    command: C,
    session: Option<Guid>,
    /// How long after each time that it is executed it is asked for again.
    renew_after: Option<Duration>,
    renew_at: Option<Monotonic>,
    tell: mpsc::Sender<News>,
}

impl<C: Command> OneCommand<C> {
    fn news(&mut self, now: Now, input: &Input<'_>, out: &mut Outbox) {
        let told = self.consumer.handle(now, input, out);
        if let Input::HistoryComplete(_) = input
            && self.session.is_none()
        {
            let started = self.consumer.start(now, self.destination, self.command.clone(), out);
            self.session = started.as_ref().ok().copied();
            // The command line no longer listens where it has been cut off; so below.
            let _ = self.tell.send(started.map_or_else(News::NotAsked, |_| News::Asked));
        }
        for told in told {
            let news = match told {
                Told::State { session, state, text, .. } if self.session == Some(session) => {
                    let is_executed = state == CommandState::Executing;
                    self.renew_at =
                        self.renew_after.filter(|_| is_executed).map(|after| now.monotonic + after);
                    News::State(state, text)
                }
                Told::Ended { session, outcome } if self.session == Some(session) => {
                    self.renew_at = None;
                    News::Ended(outcome)
                }
                _ => continue,
            };
            let _ = self.tell.send(news);
        }
        self.renew(now, out);
    }

    /// Asks again for the same, by an update of the session (ICD 4.1.4.2, 5.1.3).
    fn renew(&mut self, now: Now, out: &mut Outbox) {
        if self.renew_at.is_some_and(|at| at <= now.monotonic)
            && let Some(session) = self.session
        {
            self.renew_at = None;
            // Where it is not open any more, its end is about to be told.
            let _ = self.consumer.update(now, session, self.command.clone(), out);
        }
    }
}

impl<C: Command> Desk for OneCommand<C> {
    fn take(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        if let Input::Message(envelope) = &input
            && envelope.message.label.descriptor() == RELEASE
        {
            if let Some(session) = self.session {
                self.consumer.cancel(now, session, out);
            }
            let descriptor = envelope.message.label.attributes.descriptor.as_str();
            if let Ok(name) = aldis_envelope::Name::new(descriptor) {
                out.reply(envelope, aldis_envelope::ContentType::Aldis, name, Default::default(), true);
            }
            return;
        }
        self.news(now, &input, out);
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        [self.consumer.next_deadline(), self.renew_at].into_iter().flatten().min()
    }
}

/// Joins the fleet as a consumer with one command, and asks for it again so long after each time that it is executed.
fn send<C: Command>(
    join: &Join,
    service: ServiceId,
    destination: Guid,
    command: C,
    renew_after: Option<Duration>,
) -> Result<(Member, mpsc::Receiver<News>), Failure> {
    let source = Source::new(join.own()?, service);
    let consumer = Consumer::new(source, join.guids()?, Default::default());
    let prefixes: Vec<Prefix> = consumer.subscriptions();
    let (tell, told) = mpsc::channel();
    let (session, renew_at) = (None, None);
    let desk = OneCommand { consumer, destination, command, session, renew_after, renew_at, tell };
    Ok((Member::join_as(join, service, prefixes, desk)?, told))
}

/// How a command ended, for people.
fn outcome_text(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Completed => "COMPLETED".into(),
        Outcome::Canceled => "CANCELED".into(),
        Outcome::Failed { reason, text } if text.is_empty() => format!("FAILED, {reason}"),
        Outcome::Failed { reason, text } => format!("FAILED, {reason}: {text}"),
        Outcome::Unanswered => "no answer".into(),
        Outcome::Abandoned => "given up by its provider".into(),
    }
}

fn state_json(state: CommandState, text: &str) -> Value {
    json!({ "event": "state", "state": state, "text": text })
}

fn ended_json(outcome: &Outcome) -> Value {
    let ok = matches!(outcome, Outcome::Completed | Outcome::Canceled);
    json!({ "event": "ended", "ok": ok, "outcome": outcome_text(outcome) })
}

/// A state of the command, as a line.
fn print_state(json: bool, state: CommandState, text: &str) {
    match (json, text.is_empty()) {
        (true, _) => print_line(state_json(state, text)),
        (false, true) => print_line(state),
        (false, false) => print_line(format_args!("{state}: {text}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resource_is_an_entity_and_a_name_or_guid() {
        let guids =
            Guids::new(&aldis_envelope::Fleet::new("blue").unwrap(), aldis_envelope::GuidForm::Readable);
        let resource: ResourceName = "400:autopilot".parse().unwrap();
        let entity = EntityId::new(400).unwrap();
        assert_eq!(resource.guid(&guids), guids.of_resource(entity, "autopilot"));
        let guid = resource.guid(&guids);
        let by_guid: ResourceName = format!("400:{guid}").parse().unwrap();
        assert_eq!(by_guid.guid(&guids), guid);
        for wrong in ["autopilot", "400:", "0:autopilot", ":autopilot"] {
            assert!(wrong.parse::<ResourceName>().is_err(), "{wrong}");
        }
    }
}
