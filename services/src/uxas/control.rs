//! Missions under control: a vehicle follows those alone whose sender holds its resource (ResourceAllocation, ICD 5.1.3).
//!
//! Ashore, [`ControlledMissions`] is a `WaypointPlanManager` that asks the vehicle's arbiter first:
//!
//! | state | what comes | what it does | next |
//! | --- | --- | --- | --- |
//! | free | a mission of the vehicle, from its own entity | keeps it, asks for control | asking |
//! | asking | control is given | serves the mission | in control |
//! | asking | control is refused, or nobody answers | drops the mission, says why | free |
//! | in control | a mission of the vehicle | serves it | in control |
//! | in control | half of the time is over | asks again | in control |
//! | in control | the vehicle stays at the mission's end | gives control back | free |
//! | in control | another takes over, the time is over, the arbiter is silent | drops the mission, says why | free |
//!
//! On the vehicle's side, [`GuardedVehicle`] is a simulated vehicle that believes the arbiter's report and nobody else:
//!
//! | state | what comes | what it does | next |
//! | --- | --- | --- | --- |
//! | any | a mission of who is in control | follows it | under way |
//! | any | a mission of another | refuses it, says why | the same |
//! | under way | its mission's sender is no longer in control, or no arbiter is heard | stops: aircraft circle, all others hold their place; says why | waiting |
//!
//! The ICD lets a command that runs go on when control ends without a successor. A mission does not: it is served in
//! segments, and nobody would serve the next one.

mod missions;
#[cfg(test)]
mod tests;
mod vehicle;

use crate::umaa::allocation::GuardSettings;
use aldis_envelope::lmcp::Header;
use aldis_envelope::{ContentType, EntityId, Envelope, Guid, Guids, ServiceId, Source};
pub use missions::ControlledMissions;
use std::time::Duration;
pub use vehicle::GuardedVehicle;

/// Which resource has to be controlled.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Control {
    /// The entity that it belongs to: the vehicle. Its arbiter is service 10 there.
    pub entity: EntityId,
    /// The resource's name.
    pub resource: String,
    /// For how long control is asked for at a time; it is renewed at half of it.
    pub duration: Duration,
}

impl Control {
    /// Control of a vehicle's resource, a minute at a time.
    pub fn of(entity: EntityId, resource: &str) -> Self {
        Self { entity, resource: resource.to_owned(), duration: Duration::from_secs(60) }
    }

    fn guid(&self, guids: &Guids) -> Guid {
        guids.of_resource(self.entity, &self.resource)
    }

    fn arbiter(&self) -> Source {
        Source::new(self.entity, ServiceId::ALLOCATION)
    }

    fn guard(&self, guids: &Guids) -> GuardSettings {
        GuardSettings::new(self.guid(guids))
    }
}

/// A text whose GUIDs are replaced by the services and the resource that they are, as far as they are known.
fn readable(text: &str, control: &Control, guids: &Guids) -> String {
    let resource = control.guid(guids);
    let word = |word: &str| {
        let bare = word.trim_end_matches([',', ':']);
        let name = match bare.parse::<Guid>() {
            Ok(guid) if guid == resource => format!("`{}`", control.resource),
            Ok(guid) => guids.service(guid).map_or(bare.to_owned(), |source| source.to_string()),
            Err(_) => bare.to_owned(),
        };
        name + &word[bare.len()..]
    };
    text.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// Whether an envelope is an LMCP message of this type, of those without descendants.
fn is_lmcp(envelope: &Envelope, full_name: &str) -> bool {
    let label = &envelope.message.label;
    label.attributes.content_type == ContentType::Lmcp
        && envelope.message.call.is_none()
        && Header::peek(&envelope.message.content)
            .ok()
            .and_then(|header| header.type_info().ok())
            .is_some_and(|info| info.full_name == full_name)
}
