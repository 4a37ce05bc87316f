//! `aldis priority`: who may control which resource, who does, and who goes before whom.

use super::super::exit::Failure;
use super::super::member::Join;
use super::super::print_line;
use super::super::retained::Retained;
use super::{News, ResourceName, ended_json, outcome_text, print_state, send};
use crate::config::Party;
use aldis_envelope::umaa::{
    self, ResourceAllocationPriorityCommand, ResourceAllocationPriorityReport, ResourceAllocationReport,
    Sequence, Topic,
};
use aldis_envelope::{DateTime, Guid, Guids, ServiceId, Wall};
use aldis_services::umaa::command::Outcome;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::time::Duration;

/// How long the arbiter may take.
const ANSWER_WITHIN: Duration = Duration::from_secs(30);

/// Show who controls which resource and who may, or set who may.
///
/// Without arguments every resource of the fleet is shown. With a resource and consumers, from low to high priority, its arbiter
/// is told; control that is held does not move.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis priority
  aldis priority 400:autopilot eid9000sid100 eid1sid100")]
pub(crate) struct Priority {
    /// Entity and name, as in `400:autopilot`, or entity and GUID. None: show all.
    resource: Option<ResourceName>,
    /// The consumers, from low to high: services such as `eid1sid100`, or GUIDs.
    #[arg(requires = "resource")]
    consumers: Vec<Party>,
    /// The service of the entity that commands.
    #[arg(long, default_value = "101", value_name = "SID")]
    sid: ServiceId,
    /// One JSON object a line.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    join: Join,
}

/// What is known of a resource.
#[derive(Default)]
struct Known {
    arbiter: String,
    holder: Option<(Guid, Option<Wall>)>,
    priorities: Vec<Guid>,
}

impl Priority {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let guids = self.join.guids()?;
        match &self.resource {
            Some(resource) if !self.consumers.is_empty() => self.set(&guids, resource),
            _ => self.show(&guids),
        }
    }

    fn set(&self, guids: &Guids, resource: &ResourceName) -> Result<(), Failure> {
        let consumers = self.consumers.iter().map(|party| party.guid(guids)).collect::<Vec<_>>();
        let command = ResourceAllocationPriorityCommand {
            priorities: Sequence::new(consumers).map_err(|why| Failure::Usage(why.to_string()))?,
            resource_id: resource.guid(guids),
            time_stamp: DateTime::default(),
            source: Guid::default(),
            session_id: Guid::default(),
            destination: Guid::default(),
        };
        let (member, news) = send(&self.join, self.sid, resource.arbiter(guids), command, None)?;
        let ended = loop {
            match news.recv_timeout(ANSWER_WITHIN) {
                Ok(News::Asked) => {}
                Ok(News::NotAsked(why)) => break Err(Failure::Failed(why.to_string())),
                Ok(News::State(state, text)) => print_state(self.json, state, &text),
                Ok(News::Ended(outcome)) => break Ok(outcome),
                Err(_) => break Err(self.join.unreachable()),
            }
        };
        member.leave()?;
        let outcome = ended?;
        if self.json {
            print_line(ended_json(&outcome));
        } else {
            print_line(outcome_text(&outcome));
        }
        match outcome {
            Outcome::Completed => Ok(()),
            Outcome::Unanswered => Err(Failure::Refused(aldis_envelope::Refusal::NoAnswer)),
            other => Err(Failure::Failed(outcome_text(&other))),
        }
    }

    fn show(&self, guids: &Guids) -> Result<(), Failure> {
        let topics = [ResourceAllocationReport::NAME, ResourceAllocationPriorityReport::NAME];
        let retained = Retained::read(&self.join, &topics)?;
        let mut known: BTreeMap<Guid, Known> = BTreeMap::new();
        for envelope in retained.samples() {
            let arbiter = envelope.message.label.source().to_string();
            let content = &envelope.message.content;
            if let Ok(report) = umaa::decode::<ResourceAllocationReport>(content) {
                for info in report.control_info.iter() {
                    let resource = known.entry(info.resource_id).or_default();
                    resource.arbiter.clone_from(&arbiter);
                    resource.holder = info
                        .control_session
                        .map(|session| (session.controlling_consumer, session.end_time.map(Wall::from)));
                }
            } else if let Ok(report) = umaa::decode::<ResourceAllocationPriorityReport>(content) {
                for info in report.priorities.iter() {
                    let resource = known.entry(info.resource_id).or_default();
                    resource.arbiter.clone_from(&arbiter);
                    resource.priorities = info.priorities.iter().copied().collect();
                }
            }
        }
        let wanted = self.resource.as_ref().map(|resource| resource.guid(guids));
        for (id, resource) in known.iter().filter(|(id, _)| wanted.is_none_or(|wanted| wanted == **id)) {
            self.print(guids, *id, resource);
        }
        if known.is_empty() && !self.json {
            print_line("no arbiter reports a resource");
        }
        Ok(())
    }

    fn print(&self, guids: &Guids, id: Guid, resource: &Known) {
        let named = |guid: &Guid| guids.service(*guid).map_or_else(|| guid.to_string(), |s| s.to_string());
        let priorities: Vec<String> = resource.priorities.iter().map(named).collect();
        let holder = resource.holder.as_ref().map(|(holder, end)| (named(holder), *end));
        if self.json {
            let until = holder.as_ref().and_then(|(_, end)| end.map(|end| end.to_string()));
            print_line(json!({
                "resource_id": id, "arbiter": resource.arbiter, "priorities": priorities,
                "holder": holder.as_ref().map_or(Value::Null, |(holder, _)| holder.clone().into()), "until": until,
            }));
            return;
        }
        let held = match holder {
            None => "nobody".to_owned(),
            Some((holder, None)) => holder,
            Some((holder, Some(end))) => format!("{holder} until {end} by the arbiter's clock"),
        };
        let may = if priorities.is_empty() { "nobody".to_owned() } else { priorities.join(" < ") };
        print_line(format_args!("{id} of {}: held by {held}; may: {may}", resource.arbiter));
    }
}
