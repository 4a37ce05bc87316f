//! Every service that a node can run, by its kind. A new service is one line here.

use crate::entities::Entities;
use crate::health::Health;
use crate::log::Log;
use crate::manager::{Maker, Manager};
use crate::player::{Player, Scheduled};
use crate::recorder::{Recorder, Recording};
use crate::service::{Input, Outbox, Service, ServiceSpec};
use crate::track::{Track, TrackConfig};
use crate::umaa::allocation::{Arbiter, Arbitration};
use crate::uxas::Core;
use aldis_envelope::{EntityId, Guids, Now, ServiceId, Source};
use std::sync::Arc;
use std::time::Duration;

/// A kind of service with its settings.
#[derive(Debug, Clone)]
pub enum Kind {
    /// Service 1, the node: the host answers for it.
    Node,
    /// Service 2.
    Health {
        /// How often what it reports is repeated.
        period: Duration,
    },
    /// Service 3.
    Log,
    /// Service 10, where an entity has resources: gives control of them to one consumer at a time.
    Arbiter(Arbitration),
    /// A vehicle that moves along a simple track and tells where it is.
    Track(TrackConfig),
    /// A core service of UxAS.
    Core(Core),
    /// Starts and ends services when it is asked to.
    Manager(Maker),
    /// Sends prepared messages.
    Player(Vec<Scheduled>),
    /// Keeps what comes by in files.
    Recorder(Recording),
    /// Holds the latest state of each vehicle that it hears of.
    Entities,
}

/// Stands where the host answers for itself: for the node at service 1, and for each bridge.
struct StandIn;

impl Service for StandIn {
    fn handle(&mut self, _: Now, input: Input<'_>, out: &mut Outbox) {
        if let Input::Message(envelope) = input {
            let what = envelope.message.label.descriptor().to_owned();
            out.refuse(envelope, aldis_envelope::Refusal::NotUnderstood(what));
        }
    }
}

/// The services that every node has. Health and log start first, so that they hear of the others.
pub fn built_in(entity: EntityId, guids: &Guids, health_period: Duration) -> Vec<ServiceSpec> {
    vec![
        service(
            Source::new(entity, ServiceId::HEALTH),
            "health",
            Kind::Health { period: health_period },
            guids,
        ),
        service(Source::new(entity, ServiceId::LOG), "log", Kind::Log, guids),
        service(Source::new(entity, ServiceId::NODE), "node", Kind::Node, guids),
    ]
}

/// The arbiter of an entity's resources.
pub fn arbiter(entity: EntityId, guids: &Guids, arbitration: Arbitration) -> ServiceSpec {
    service(Source::new(entity, ServiceId::ALLOCATION), "arbiter", Kind::Arbiter(arbitration), guids)
}

/// The service that answers pings for a bridge, which is no service itself.
pub(crate) fn stand_in(source: Source, name: &str) -> ServiceSpec {
    ServiceSpec { source, name: name.to_owned(), factory: Arc::new(|| Box::new(StandIn)) }
}

/// A service to run.
pub fn service(source: Source, name: &str, kind: Kind, guids: &Guids) -> ServiceSpec {
    let guids = guids.clone();
    let factory = Arc::new(move || -> Box<dyn Service> {
        match &kind {
            Kind::Node => Box::new(StandIn),
            Kind::Health { period } => Box::new(Health::new(source.entity, guids.clone(), *period)),
            Kind::Log => Box::new(Log::new(source.entity, &guids)),
            Kind::Arbiter(arbitration) => Box::new(Arbiter::new(source, &guids, arbitration.clone())),
            Kind::Manager(maker) => Box::new(Manager::new(source, maker.clone())),
            Kind::Player(messages) => Box::new(Player::new(source, messages.clone())),
            Kind::Recorder(recording) => Box::new(Recorder::new(recording.clone())),
            Kind::Entities => Box::new(Entities::default()),
            Kind::Track(track) => Box::new(Track::new(source, track.clone())),
            Kind::Core(core) => core.service(source, &guids),
        }
    });
    ServiceSpec { source, name: name.to_owned(), factory }
}
