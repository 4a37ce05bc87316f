//! Holds the latest state of each vehicle that it hears of, and tells it with its age.

use crate::service::{Input, Level, Outbox, Service};
use aldis_envelope::aldis::entities::{EntityStates, HeldState, STATES, STATES_QUERY};
use aldis_envelope::lmcp::{self, cmasi::EntityState};
use aldis_envelope::{
    ContentType, EntityId, Envelope, Monotonic, Name, Now, Prefix, Refusal, Source, Wall, aldis,
};
use std::collections::BTreeMap;
use std::time::Duration;

/// How many vehicles are held; of more the log tells.
const VEHICLES_MAX: usize = 10_000;
/// How many states go into one answer.
const STATES_AT_ONCE: usize = 256;

/// A state, and when it came.
struct Held {
    state: HeldState,
    came: Monotonic,
    sent: Wall,
}

/// The service.
#[derive(Default)]
pub struct Entities {
    held: BTreeMap<i64, Held>,
}

impl Entities {
    fn state(&mut self, now: Now, envelope: &Envelope, out: &mut Outbox) {
        let label = &envelope.message.label;
        if label.attributes.content_type != ContentType::Lmcp {
            return;
        }
        let object = match lmcp::decode(&envelope.message.content) {
            Ok(object) => object,
            Err(why) => {
                let text = format!("{} of {} unread: {why}", label.descriptor(), label.source());
                return out.note(Level::Warning, text);
            }
        };
        let Some(state) = object.get::<EntityState>() else { return };
        if self.held.len() >= VEHICLES_MAX && !self.held.contains_key(&state.id) {
            let text = format!("{VEHICLES_MAX} vehicles are held: the state of {} is not", state.id);
            return out.note(Level::Warning, text);
        }
        let sent = envelope.stamp.source_time;
        // By another way an older state may come later.
        if self
            .held
            .get(&state.id)
            .is_some_and(|held| held.sent > sent && held.state.source == label.source())
        {
            return;
        }
        let state = held_state(state, object.type_info().full_name, label.source());
        self.held.insert(state.vehicle, Held { state, came: now.monotonic, sent });
    }

    fn answer(&self, now: Now, request: &Envelope, out: &mut Outbox) {
        let Ok(name) = Name::new(STATES) else { return };
        let held_by: EntityId = out.source().entity;
        let mut states: Vec<_> = self.held.values().map(|held| held.aged(now)).collect();
        loop {
            let rest = states.split_off(states.len().min(STATES_AT_ONCE));
            let last = rest.is_empty();
            let content = aldis::encode(&EntityStates { held_by, states }).into();
            out.reply(request, ContentType::Aldis, name.clone(), content, last);
            if last {
                return;
            }
            states = rest;
        }
    }
}

impl Held {
    fn aged(&self, now: Now) -> HeldState {
        let heard = now.monotonic - self.came;
        let sent = u64::try_from(now.wall.0.saturating_sub(self.sent.0)).unwrap_or_default();
        HeldState {
            heard_ms: u64::try_from(heard.as_millis()).unwrap_or(u64::MAX),
            // Clocks differ, but nothing is younger than its coming.
            age_ms: u64::try_from(heard.max(Duration::from_nanos(sent)).as_millis()).unwrap_or(u64::MAX),
            ..self.state.clone()
        }
    }
}

fn held_state(state: &EntityState, descriptor: &str, source: Source) -> HeldState {
    let location = state.location.get();
    HeldState {
        vehicle: state.id,
        descriptor: descriptor.to_owned(),
        source,
        heard_ms: 0,
        age_ms: 0,
        latitude_deg: location.map(|place| place.latitude),
        longitude_deg: location.map(|place| place.longitude),
        altitude_m: location.map(|place| place.altitude),
        heading_deg: state.heading,
        groundspeed_m_per_s: state.groundspeed,
        waypoint: state.current_waypoint,
        tasks: state.associated_tasks.clone(),
    }
}

impl Service for Entities {
    fn subscriptions(&self) -> Vec<Prefix> {
        let states = lmcp::descendants(<EntityState as lmcp::Struct>::TYPE).map(|info| info.full_name);
        states.chain([STATES_QUERY]).filter_map(|name| Prefix::new(name).ok()).collect()
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        let Input::Message(envelope) = input else { return };
        match envelope.message.label.descriptor() {
            STATES_QUERY => self.answer(now, envelope, out),
            other if envelope.message.call.is_some() => {
                out.refuse(envelope, Refusal::NotUnderstood(other.to_owned()));
            }
            _ => self.state(now, envelope, out),
        }
    }
}

#[cfg(test)]
mod tests;
