//! From a configuration to a node and to what the shell has to open for it.

use super::bus_task::Joining;
use crate::bridge::uxas_tcp::{Endpoint, Side};
use crate::bus::Congestion;
use crate::clock;
use crate::config::{self, Config, bus};
use aldis_envelope::{EntityId, Guids, Source};
use aldis_services::journal::JournalConfig;
use aldis_services::registry::{self, Kind};
use aldis_services::{BridgeSpec, NodeConfig, ServiceSpec};
use std::path::PathBuf;

/// What the shell opens for a node.
pub(crate) struct Outside {
    pub(super) bus: Joining,
    pub(super) bridges: Vec<Endpoint>,
    /// The directory of the journal and how it is kept.
    pub(super) journal: Option<(PathBuf, JournalConfig)>,
}

/// What the shell opens for a configuration.
///
/// # Errors
/// A file of the `[bus]` table that cannot be read, or what Zenoh refuses.
pub(crate) fn outside(config: &Config) -> Result<Outside, bus::BusError> {
    let congestion = match config.bus.congestion {
        bus::Congestion::Block => Congestion::Block,
        bus::Congestion::Drop => Congestion::Drop,
    };
    let bus = Joining { config: bus::zenoh_config(&config.bus)?, congestion };
    let bridges = config.bridges.iter().map(|config::Bridge::UxasTcp(bridge)| Endpoint {
        side: match bridge.endpoint {
            config::Endpoint::Listen(address) => Side::Listen(address),
            config::Endpoint::Connect(address) => Side::Connect(address),
        },
        message_bytes_max: bridge.message_bytes_max as usize,
    });
    let kept = |journal: &config::Journal| (journal.path.clone(), journal.config(crate::journal::seed()));
    Ok(Outside { bus, bridges: bridges.collect(), journal: config.journal.as_ref().map(kept) })
}

/// The node of a configuration, in a new life.
pub(crate) fn node_config(config: &Config) -> NodeConfig {
    let own = config.entities.own();
    let guids = Guids::new(&config.fleet, config.guid);
    let mut services = registry::built_in(own, &guids, config.health.report_period());
    services.extend(config.arbitration().map(|arbitration| registry::arbiter(own, &guids, arbitration)));
    services.extend(config.services.iter().map(|service| configured(own, service, &guids)));
    NodeConfig {
        fleet: config.fleet.clone(),
        entities: config.entities.iter().collect(),
        boot: clock::boot_id(),
        operators: config.operators.iter().collect(),
        allow: config.allow.iter().map(config::Allow::rule).collect(),
        import: config.routing.import.clone(),
        export: config.routing.export.clone(),
        topics: config.topics.iter().map(config::Topic::rule).collect(),
        reliable: true,
        services,
        bridges: config.bridges.iter().map(|bridge| bridge_spec(own, bridge)).collect(),
    }
}

fn configured(own: EntityId, service: &config::Service, guids: &Guids) -> ServiceSpec {
    let config::Service::Track(track) = service;
    registry::service(track.source(own), "track", Kind::Track(track.motion(own)), guids)
}

fn bridge_spec(own: EntityId, bridge: &config::Bridge) -> BridgeSpec {
    let config::Bridge::UxasTcp(tcp) = bridge;
    BridgeSpec {
        source: Source::new(own, tcp.service),
        name: tcp.name.as_str().to_owned(),
        dialect: tcp.dialect,
        import: tcp.import.clone(),
        export: tcp.export.clone(),
        queue_messages_max: tcp.queue_messages_max as usize,
        stall_timeout: tcp.stall_timeout(),
    }
}
