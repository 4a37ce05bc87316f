//! `aldis fleet --states`: where the vehicles are, with the age of what is known.

use super::super::exit::Failure;
use super::super::member::{Desk, Join, Member};
use super::super::print_line;
use aldis_envelope::aldis::entities::{EntityStates, HeldState, STATES_QUERY};
use aldis_envelope::{Address, ContentType, Descriptor, Name, Now, aldis};
use aldis_services::{Input, Outbox};
use bytes::Bytes;
use serde_json::json;
use std::sync::mpsc;
use std::time::Duration;

/// Asks all that hold states, through their mailbox.
struct Asking {
    within: Duration,
    held: Vec<EntityStates>,
    tell: mpsc::Sender<Vec<EntityStates>>,
}

impl Desk for Asking {
    fn take(&mut self, _: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Bus(true) => {
                let names = (Name::new(STATES_QUERY), Descriptor::new(STATES_QUERY));
                if let (Ok(mailbox), Ok(query)) = names {
                    out.call(Address::Name(mailbox), ContentType::Aldis, query, Bytes::new(), self.within);
                }
            }
            Input::Message(envelope) => self.held.extend(aldis::decode(&envelope.message.content)),
            // The command no longer listens where it has been cut off.
            Input::CallEnded(..) => drop(self.tell.send(std::mem::take(&mut self.held))),
            _ => {}
        }
    }
}

/// Asks for so long and prints what was told.
pub(super) fn show(join: &Join, within: Duration, as_json: bool) -> Result<(), Failure> {
    let (tell, told) = mpsc::channel();
    let member = Member::join(join, Vec::new(), Asking { within, held: Vec::new(), tell })?;
    let held = told.recv_timeout(super::super::JOIN_WITHIN + within).map_err(|_| join.unreachable());
    member.leave()?;
    let held = held?;
    if held.is_empty() {
        let text = "no service holds states: configure one with `[[service]] kind = \"entity-states\"`";
        return Err(Failure::Failed(text.into()));
    }
    for answer in &held {
        for state in &answer.states {
            if as_json {
                print_line(as_object(answer, state));
            } else {
                print_line(in_words(answer, state));
            }
        }
    }
    Ok(())
}

fn as_object(answer: &EntityStates, state: &HeldState) -> serde_json::Value {
    json!({
        "held_by": answer.held_by, "vehicle": state.vehicle, "descriptor": state.descriptor,
        "source": state.source.to_string(), "heard_ms": state.heard_ms, "age_ms": state.age_ms,
        "latitude_deg": state.latitude_deg, "longitude_deg": state.longitude_deg, "altitude_m": state.altitude_m,
        "heading_deg": state.heading_deg, "groundspeed_m_per_s": state.groundspeed_m_per_s,
        "waypoint": state.waypoint, "tasks": state.tasks,
    })
}

fn in_words(answer: &EntityStates, state: &HeldState) -> String {
    let place = match (state.latitude_deg, state.longitude_deg) {
        (Some(latitude), Some(longitude)) => format!("{latitude:10.6} {longitude:11.6}"),
        _ => format!("{:>22}", "nowhere"),
    };
    let age = Duration::from_millis(state.age_ms).as_secs_f64();
    format!(
        "{:>6} at {place} heading {:5.1} deg, {:5.1} m/s, {age:.1} s old, held by {}",
        state.vehicle, state.heading_deg, state.groundspeed_m_per_s, answer.held_by
    )
}
