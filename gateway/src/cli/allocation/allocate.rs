//! `aldis allocate`: takes control of a resource and holds it.

use super::super::exit::Failure;
use super::super::member::Join;
use super::super::print_line;
use super::super::within::Within;
use super::{News, ResourceName, ended_json, outcome_text, print_state, send};
use aldis_envelope::umaa::{CommandState, DurationSeconds, ResourceAllocationCommand};
use aldis_envelope::{DateTime, Guid, ServiceId};
use aldis_services::umaa::command::Outcome;
use std::sync::mpsc;
use std::time::Duration;

/// How long the arbiter may take until it has given control or refused it.
const ANSWER_WITHIN: Duration = Duration::from_secs(30);

/// Take control of a resource, and hold it until its time is over or this command is stopped.
///
/// The consumer is the service `--sid` of the entity `--as`: the arbiter must have it in the resource's priorities. A state
/// that the command comes into is a line. Stopping this command (SIGINT or SIGTERM) or `aldis release` gives control back.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis allocate 400:autopilot --for 30s              for thirty seconds
  aldis allocate 400:autopilot                        until it is stopped, released or taken over
  aldis allocate 400:autopilot --for 10s --renew      the same, and free ten seconds after a crash")]
pub(crate) struct Allocate {
    /// Entity and name, as in `400:autopilot`, or entity and GUID.
    resource: ResourceName,
    /// For how long. Default: without end.
    #[arg(long = "for")]
    span: Option<Within>,
    /// Ask again at half of the time, again and again: control goes on until this command is stopped, and ends by itself soon
    /// after it has crashed.
    #[arg(long, requires = "span")]
    renew: bool,
    /// The service of the entity that asks; its priority counts.
    #[arg(long, default_value = "100", value_name = "SID")]
    sid: ServiceId,
    /// One JSON object a line.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    join: Join,
}

enum Heard {
    News(News),
    Stop,
}

impl Allocate {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let guids = self.join.guids()?;
        let seconds = self.span.map(|span| DurationSeconds::new(span.0.as_secs_f64())).transpose();
        let command = ResourceAllocationCommand {
            duration: seconds.map_err(|why| Failure::Usage(why.to_string()))?,
            resource_id: self.resource.guid(&guids),
            time_stamp: DateTime::default(),
            source: Guid::default(),
            session_id: Guid::default(),
            destination: Guid::default(),
        };
        let (heard_from, heard) = mpsc::channel();
        let stop = heard_from.clone();
        super::super::run::watch_signals(move || {
            let _ = stop.send(Heard::Stop);
        })?;
        let renew_after = self.span.filter(|_| self.renew).map(|span| span.0 / 2);
        let arbiter = self.resource.arbiter(&guids);
        let (member, news) = send(&self.join, self.sid, arbiter, command, renew_after)?;
        std::thread::Builder::new()
            .name("news".into())
            .spawn(move || news.into_iter().try_for_each(|news| heard_from.send(Heard::News(news))))
            .map_err(|why| Failure::Failed(why.to_string()))?;
        let done = self.follow(&heard);
        member.leave()?;
        done
    }

    fn follow(&self, heard: &mpsc::Receiver<Heard>) -> Result<(), Failure> {
        let (mut asked, mut has_control) = (false, false);
        loop {
            let patience = match (asked, has_control) {
                (false, _) => super::super::JOIN_WITHIN * 2,
                (true, false) => ANSWER_WITHIN,
                (true, true) => Duration::MAX,
            };
            match heard.recv_timeout(patience) {
                Ok(Heard::News(News::Asked)) => asked = true,
                Ok(Heard::News(News::NotAsked(why))) => return Err(Failure::Failed(why.to_string())),
                Ok(Heard::News(News::State(state, text))) => {
                    has_control |= state == CommandState::Executing;
                    print_state(self.json, state, &text);
                }
                Ok(Heard::News(News::Ended(outcome))) => return self.ended(&outcome),
                Ok(Heard::Stop) => return Ok(()),
                Err(_) if asked => return Err(Failure::Failed("the arbiter does not decide".into())),
                Err(_) => return Err(self.join.unreachable()),
            }
        }
    }

    fn ended(&self, outcome: &Outcome) -> Result<(), Failure> {
        let text = outcome_text(outcome);
        if self.json {
            print_line(ended_json(outcome));
        } else {
            print_line(&text);
        }
        match outcome {
            Outcome::Completed | Outcome::Canceled => Ok(()),
            Outcome::Unanswered => Err(Failure::Refused(aldis_envelope::Refusal::NoAnswer)),
            Outcome::Failed { .. } | Outcome::Abandoned => Err(Failure::Failed(text)),
        }
    }
}
