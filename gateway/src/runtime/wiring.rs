//! From a configuration to a node and to what the shell has to open for it.

use super::bus_task::Joining;
use crate::bridge::uxas_tcp::{Endpoint, Side};
use crate::bus::Congestion;
use crate::bus::frames::Channel;
use crate::carrier::{serial, udp};
use crate::clock;
use crate::config::{self, Config, bus};
use aldis_envelope::{EntityId, Guids, Source};
use aldis_services::LinkId;
use aldis_services::journal::JournalConfig;
use aldis_services::link::{CarrierId, LinkKey};
use aldis_services::registry::{self, Kind};
use aldis_services::uxas::Core;
use aldis_services::{BridgeSpec, NodeConfig, ServiceSpec};
use std::path::PathBuf;

/// What the shell opens for a node.
pub(crate) struct Outside {
    pub(super) bus: Joining,
    pub(super) bridges: Vec<Endpoint>,
    /// The keys of each link.
    pub(super) link_keys: Vec<Vec<LinkKey>>,
    pub(super) udp: Vec<udp::Port>,
    pub(super) lines: Vec<serial::Line>,
    pub(super) channels: Vec<Channel>,
    /// The directory of the journal and how it is kept.
    pub(super) journal: Option<(PathBuf, JournalConfig)>,
}

impl Outside {
    /// Without the carriers of links that the node does not have: the command line takes the rest of a configuration, and none of
    /// its links.
    pub(super) fn for_links(mut self, links: usize) -> Self {
        self.udp.iter_mut().for_each(|port| port.ends.retain(|end| end.link.0 < links));
        self.udp.retain(|port| !port.ends.is_empty());
        self.lines.retain(|line| line.link.0 < links);
        self.channels.retain(|channel| channel.link.0 < links);
        self
    }
}

/// Why the outside of a configuration cannot be opened.
#[derive(Debug, thiserror::Error)]
pub(crate) enum OutsideError {
    /// The bus.
    #[error(transparent)]
    Bus(#[from] bus::BusError),
    /// A key of a link.
    #[error(transparent)]
    Key(#[from] config::KeyError),
}

/// What the shell opens for a configuration.
///
/// # Errors
/// A file of the `[bus]` table or a key that cannot be read, or what Zenoh refuses.
pub(crate) fn outside(config: &Config) -> Result<Outside, OutsideError> {
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
    let link_keys = config.links.iter().map(|link| link.keys.iter().map(config::KeyFile::read).collect());
    let link_keys = link_keys.collect::<Result<_, _>>()?;
    let (udp, lines) = carriers(config);
    let channels = channels(config)?;
    let kept = |journal: &config::Journal| (journal.path.clone(), journal.config(crate::journal::seed()));
    let journal = config.journal.as_ref().map(kept);
    Ok(Outside { bus, bridges: bridges.collect(), link_keys, udp, lines, channels, journal })
}

/// The carriers over Zenoh networks of their own.
fn channels(config: &Config) -> Result<Vec<Channel>, bus::BusError> {
    let mut channels = Vec::new();
    for (link, configured) in config.links.iter().enumerate() {
        for (place, carrier) in configured.carriers.iter().enumerate() {
            let Some(network) = carrier.network() else { continue };
            channels.push(Channel {
                link: LinkId(link),
                carrier: CarrierId(place as u8),
                fleet: config.fleet.clone(),
                own: config.entities.own(),
                peer: configured.peer,
                config: bus::zenoh_config(&network)?,
                mtu: carrier.mtu as usize,
            });
        }
    }
    Ok(channels)
}

/// The carriers of all links; those that listen at one address share a socket.
fn carriers(config: &Config) -> (Vec<udp::Port>, Vec<serial::Line>) {
    let (mut ports, mut lines): (Vec<udp::Port>, _) = (Vec::new(), Vec::new());
    for (link, configured) in config.links.iter().enumerate() {
        for (place, carrier) in configured.carriers.iter().enumerate() {
            let (link, id, mtu) = (LinkId(link), CarrierId(place as u8), carrier.mtu as usize);
            if let (config::CarrierKind::Udp, Some(listen)) = (carrier.kind, carrier.listen) {
                let end = udp::End { link, carrier: id, entity: configured.peer, address: carrier.peer, mtu };
                match ports.iter_mut().find(|port| port.listen == listen && listen.port() != 0) {
                    Some(port) => port.ends.push(end),
                    None => ports.push(udp::Port { listen, ends: vec![end] }),
                }
            }
            if let (Some(device), Some(baud)) = (&carrier.device, carrier.baud) {
                lines.push(serial::Line { link, carrier: id, device: device.clone(), baud, mtu });
            }
        }
    }
    (ports, lines)
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
        links: config.links.iter().map(|link| link.spec(own)).collect(),
        journaled: false,
    }
}

fn configured(own: EntityId, service: &config::Service, guids: &Guids) -> ServiceSpec {
    let source = Source::new(service.entity().unwrap_or(own), service.service());
    match service {
        config::Service::Track(track) => {
            registry::service(track.source(own), "track", Kind::Track(track.motion(own)), guids)
        }
        core => {
            // All that is no track is a core service.
            let core = core.core().map(|table| table.core(source.entity));
            let name = core.as_ref().map_or("none", Core::name);
            registry::service(source, name, core.map_or(Kind::Node, Kind::Core), guids)
        }
    }
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
