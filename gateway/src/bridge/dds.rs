//! Real DDS: the readers and writers of the service that bridges a domain.

mod convert;
mod joined;
mod ports;

pub(crate) use ports::{Domains, Inbox};

use crate::runtime::Shared;
use aldis_dds::ParticipantConfig;
use aldis_envelope::Source;
use aldis_envelope::description::Library;
use aldis_services::Event;
use aldis_services::service::{Component, ComponentHealth, Condition};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long until a domain is joined again that could not be.
const RETRY: Duration = Duration::from_secs(2);
/// How often is looked whether the node ends.
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// A domain that a node joins.
#[derive(Debug, Clone)]
pub(crate) struct Endpoint {
    /// The ids of the service that bridges it.
    pub(crate) source: Source,
    pub(crate) participant: ParticipantConfig,
    pub(crate) types: Arc<Library>,
    /// How long readers that confirm nothing hold up others.
    pub(crate) stall_timeout: Duration,
}

/// Quality of service as services see it.
pub(crate) fn quality(qos: &aldis_dds::Qos) -> aldis_services::service::domain::Quality {
    convert::quality(qos)
}

/// Quality of service in words.
pub(crate) fn words(qos: &aldis_dds::Qos) -> String {
    aldis_services::map::dds::in_words(&quality(qos))
}

/// Takes part in a domain until the node ends. Blocks its thread: Cyclone DDS waits in places.
pub(crate) fn serve(core: &Shared, endpoint: &Endpoint) {
    let exited = core.lock().exited();
    let ended = || *exited.borrow();
    while !ended() {
        let why = match joined::Joined::open(core, endpoint) {
            Ok(mut joined) => {
                health(core, endpoint, Condition::Well, format!("in domain {}", endpoint.participant.domain));
                joined.run(&ended);
                core.lock().domains().remove(endpoint.source);
                return;
            }
            Err(why) => why.to_string(),
        };
        core.lock().domains().remove(endpoint.source);
        health(core, endpoint, Condition::Failed, why);
        let retry = Instant::now() + RETRY;
        while !ended() && Instant::now() < retry {
            std::thread::park_timeout(LOOK_EVERY);
        }
    }
}

fn health(core: &Shared, endpoint: &Endpoint, condition: Condition, status: String) {
    let component = Component::Service(endpoint.source);
    let health = ComponentHealth { component, condition, status };
    core.lock().handle(&mut vec![Event::Component(health)]);
}
