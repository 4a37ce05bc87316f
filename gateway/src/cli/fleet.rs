//! `aldis fleet`: who is there.

mod states;

use super::content::status_text;
use super::exit::Failure;
use super::member::{Desk, Join, Member};
use super::print_line;
use super::within::Within;
use aldis_envelope::aldis::{self, NodeStatus};
use aldis_envelope::{Address, CallId, ContentType, Descriptor, EntityId, Now, ServiceId, Source};
use aldis_services::{Input, Outbox};
use bytes::Bytes;
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::mpsc;
use std::time::Duration;

/// Show who is there: the services alive on each entity, and what their nodes say of themselves.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis fleet
  aldis fleet --json
  aldis fleet --states          where the vehicles are, and how old that is; asks every service of the kind `entity-states`")]
pub(crate) struct FleetArgs {
    /// Show the latest state of each vehicle, as services of the kind `entity-states` hold them, with its age.
    #[arg(long)]
    states: bool,
    /// How long to wait for the nodes' answers: `2s`, `500ms`.
    #[arg(long, default_value = "2s")]
    within: Within,
    /// One JSON object a node.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    join: Join,
}

#[derive(Default)]
struct Seen {
    alive: BTreeMap<EntityId, BTreeSet<ServiceId>>,
    status: BTreeMap<EntityId, NodeStatus>,
}

struct Survey {
    seen: Seen,
    waiting: BTreeSet<CallId>,
    within: Duration,
    tell: mpsc::Sender<Seen>,
}

impl Survey {
    fn ask_all(&mut self, out: &mut Outbox) {
        let Ok(query) = Descriptor::new(aldis::NODE_QUERY) else { return };
        for (&entity, services) in &self.seen.alive {
            if services.contains(&ServiceId::NODE) {
                let to = Address::Service(Source::new(entity, ServiceId::NODE));
                let id = out.call(to, ContentType::Aldis, query.clone(), Bytes::new(), self.within);
                self.waiting.insert(id);
            }
        }
        self.finish();
    }

    fn finish(&mut self) {
        if self.waiting.is_empty() {
            // The command no longer listens where it has been cut off.
            let _ = self.tell.send(std::mem::take(&mut self.seen));
        }
    }
}

impl Desk for Survey {
    fn take(&mut self, _: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            // Itself is not who it looks for.
            Input::Token(source, true) if source != out.source() => {
                self.seen.alive.entry(source.entity).or_default().insert(source.service);
            }
            Input::Bus(true) => self.ask_all(out),
            Input::Message(envelope) => {
                if let Some(status) = aldis::decode::<NodeStatus>(&envelope.message.content) {
                    self.seen.status.insert(status.node, status);
                }
            }
            Input::CallEnded(id, _) => {
                self.waiting.remove(&id);
                self.finish();
            }
            _ => {}
        }
    }
}

impl FleetArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        if self.states {
            return states::show(&self.join, self.within.0, self.json);
        }
        let (tell, told) = mpsc::channel();
        let survey = Survey { seen: Seen::default(), waiting: BTreeSet::new(), within: self.within.0, tell };
        let member = Member::join(&self.join, Vec::new(), survey)?;
        let seen = told.recv_timeout(super::JOIN_WITHIN + self.within.0).map_err(|_| self.join.unreachable());
        member.leave()?;
        let seen = seen?;
        for (&entity, services) in &seen.alive {
            match (seen.status.get(&entity), self.json) {
                (Some(status), true) => print_line(status_text(status)),
                (None, true) => {
                    print_line(json!({ "node": entity, "services_alive": services, "answers": false }))
                }
                (Some(status), false) => print_status(status),
                (None, false) => {
                    print_line(format_args!("entity {entity}: {} services, no answer", services.len()))
                }
            }
        }
        if seen.alive.is_empty() && !self.json {
            print_line("nobody is there");
        }
        Ok(())
    }
}

fn print_status(status: &NodeStatus) {
    let entities: Vec<_> = status.entities.iter().map(ToString::to_string).collect();
    let uptime = Duration::from_millis(status.uptime_ms);
    print_line(format_args!("entity {} (speaks for {}), up {uptime:.0?}", status.node, entities.join(", ")));
    for service in &status.services {
        print_line(format_args!(
            "  {:<16} {:<12} {}",
            service.source.to_string(),
            service.name,
            service.state
        ));
    }
    let counted: Vec<_> =
        status.counters.iter().filter(|(_, v)| *v > 0).map(|(n, v)| format!("{n} {v}")).collect();
    print_line(format_args!("  counted: {}", counted.join(", ")));
}
