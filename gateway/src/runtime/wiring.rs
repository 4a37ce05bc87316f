//! From a configuration to a node and to what the shell has to open for it.

mod domain;

use super::bus_task::Joining;
use crate::bridge::{Endpoint, Limits, Side, uxas_serial, uxas_tcp, uxas_zmq};
use crate::bus::Congestion;
use crate::bus::frames::Channel;
use crate::carrier::{serial, udp};
use crate::clock;
use crate::config::{self, Config, bus};
use aldis_envelope::codec::{stream, zmtp};
use aldis_envelope::{EntityId, Fleet, Guids, Prefix, Source};
use aldis_services::LinkId;
use aldis_services::journal::JournalConfig;
use aldis_services::link::{CarrierId, LinkKey};
use aldis_services::manager::Maker;
use aldis_services::recorder::Recording;
use aldis_services::registry::{self, Kind};
use aldis_services::uxas::Core;
use aldis_services::{BridgeSpec, NodeConfig, ServiceSpec};
use std::path::PathBuf;

/// What the shell opens for a node.
pub(crate) struct Outside {
    pub(super) bus: Joining,
    pub(super) bridges: Vec<Endpoint>,
    #[cfg(feature = "dds")]
    pub(super) domains: Vec<crate::bridge::dds::Endpoint>,
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

#[cfg(feature = "dds")]
impl Outside {
    /// Without the domains of services that the node does not have.
    pub(super) fn for_services(mut self, services: &[Source]) -> Self {
        self.domains.retain(|domain| services.contains(&domain.source));
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
    /// A configuration of Cyclone DDS.
    #[cfg(feature = "dds")]
    #[error("{}: {why}", path.display())]
    CycloneDds {
        /// Its file.
        path: PathBuf,
        /// What the system says.
        why: std::io::Error,
    },
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
    let link_keys = config.links.iter().map(|link| link.keys.iter().map(config::KeyFile::read).collect());
    let link_keys = link_keys.collect::<Result<_, _>>()?;
    let (udp, lines) = carriers(config);
    let channels = channels(config)?;
    let kept = |journal: &config::Journal| (journal.path.clone(), journal.config(crate::journal::seed()));
    let journal = config.journal.as_ref().map(kept);
    Ok(Outside {
        bus,
        bridges: config.bridges.iter().filter_map(endpoint).collect(),
        #[cfg(feature = "dds")]
        domains: domain::endpoints(config)?,
        link_keys,
        udp,
        lines,
        channels,
        journal,
    })
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

/// What is opened for a bridge; none where it is a domain, which has a service of its own.
fn endpoint(bridge: &config::Bridge) -> Option<Endpoint> {
    let common = bridge.common();
    let (dialect, message_bytes_max) = (common.dialect, common.message_bytes_max as usize);
    Some(match bridge {
        config::Bridge::UxasTcp(bridge) => Endpoint::UxasTcp(uxas_tcp::Endpoint {
            side: match bridge.endpoint {
                config::Endpoint::Listen(address) => Side::Listen(address),
                config::Endpoint::Connect(address) => Side::Connect(address),
            },
            limits: Limits { dialect, message_bytes_max, check: stream::Check::Sum },
        }),
        config::Bridge::UxasSerial(bridge) => {
            let check = match bridge.check {
                config::Check::Sum => stream::Check::Sum,
                config::Check::Crc => stream::Check::Crc,
            };
            let limits = Limits { dialect, message_bytes_max, check };
            let (device, baud) = (bridge.device.clone(), bridge.baud);
            Endpoint::UxasSerial(uxas_serial::Endpoint { device, baud, limits })
        }
        config::Bridge::UxasZmq(bridge) => Endpoint::UxasZmq(uxas_zmq::Endpoint {
            sockets: match bridge.sockets {
                config::Sockets::PublishPull { publish, pull } => {
                    uxas_zmq::Sockets::PublishPull { publish, pull }
                }
                config::Sockets::SubscribePush { subscribe, push } => {
                    let topics = common.import.iter().map(topic).collect();
                    uxas_zmq::Sockets::SubscribePush { subscribe, push, topics }
                }
            },
            framing: match bridge.framing {
                config::Framing::Single => zmtp::Framing::Single,
                config::Framing::Multipart => zmtp::Framing::Multipart,
            },
            dialect,
            message_bytes_max,
        }),
        config::Bridge::Dds(_) => return None,
    })
}

/// What is subscribed to for a prefix: at least what it matches, in either dialect.
fn topic(prefix: &Prefix) -> String {
    match prefix {
        Prefix::Text(text) => text.to_string(),
        Prefix::Id(id) => id.entity().map(|entity| format!("eid{entity}")).unwrap_or_default(),
    }
}

/// The node of a configuration, in a new life.
pub(crate) fn node_config(config: &Config) -> NodeConfig {
    let own = config.entities.own();
    let guids = Guids::new(&config.fleet, config.guid);
    let mut services = registry::built_in(own, &guids, config.health.report_period());
    services.extend(config.arbitration().map(|arbitration| registry::arbiter(own, &guids, arbitration)));
    services.extend(domain::services(config));
    services.extend(config.services.iter().map(|service| configured(&config.fleet, own, service, &guids)));
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
        bridges: config.bridges.iter().filter_map(|bridge| bridge_spec(own, bridge)).collect(),
        links: config.links.iter().map(|link| link.spec(own)).collect(),
    }
}

/// Makes a service from what a `CreateNewService` says: the beginning of an element of a UxAS configuration.
fn maker(fleet: &Fleet, own: EntityId, guids: &Guids) -> Maker {
    let (fleet, guids) = (fleet.clone(), guids.clone());
    Maker::new(move |source, create| {
        let id = source.service.get();
        let service = config::uxas_file::service(&create.xml_configuration, own.get(), id)?;
        match &service {
            config::Service::SendMessages(_) | config::Service::OsmPlanner(_) => {
                Err("files are read at the start of a node alone".to_owned())
            }
            service => Ok(configured(&fleet, own, service, &guids)),
        }
    })
}

fn configured(fleet: &Fleet, own: EntityId, service: &config::Service, guids: &Guids) -> ServiceSpec {
    let source = Source::new(service.entity().unwrap_or(own), service.service());
    match service {
        config::Service::Track(track) => {
            registry::service(track.source(own), "track", Kind::Track(track.motion(own)), guids)
        }
        config::Service::ServiceManager(manager) => {
            let kind = Kind::Manager(maker(fleet, own, guids));
            registry::service(Source::new(own, manager.service), "service-manager", kind, guids)
        }
        config::Service::SendMessages(send) => {
            let kind = Kind::Player(send.scheduled.clone());
            registry::service(Source::new(own, send.service), "send-messages", kind, guids)
        }
        config::Service::Recorder(recorder) => {
            let kind = Kind::Recorder(Recording {
                fleet: fleet.clone(),
                addresses: recorder.addresses.clone(),
                messages_per_file: recorder.messages_per_file,
                write: crate::recording::writer(&recorder.directory),
            });
            registry::service(source, "recorder", kind, guids)
        }
        config::Service::OsmPlanner(roads) => {
            // A configuration without its files was refused.
            let core = roads.roads.clone().map(Core::Roads);
            let name = core.as_ref().map_or("none", Core::name);
            registry::service(source, name, core.map_or(Kind::Node, Kind::Core), guids)
        }
        config::Service::EntityStates(_) => registry::service(source, "entity-states", Kind::Entities, guids),
        core => {
            // All others are core services.
            let core = core.core().map(|table| table.core(source.entity));
            let name = core.as_ref().map_or("none", Core::name);
            registry::service(source, name, core.map_or(Kind::Node, Kind::Core), guids)
        }
    }
}

fn bridge_spec(own: EntityId, bridge: &config::Bridge) -> Option<BridgeSpec> {
    if matches!(bridge, config::Bridge::Dds(_)) {
        return None;
    }
    let common = bridge.common();
    let name = common.name.as_str().to_owned();
    // Whom a bridge subscribes to and whom it pushes to are one.
    let connects = matches!(
        bridge,
        config::Bridge::UxasZmq(zmq) if matches!(zmq.sockets, config::Sockets::SubscribePush { .. })
    );
    let peer = common.peer.as_ref().map(|peer| peer.as_str().to_owned());
    Some(BridgeSpec {
        source: Source::new(own, common.service),
        dialect: common.dialect,
        import: common.import.clone(),
        export: common.export.clone(),
        queue_messages_max: common.queue_messages_max as usize,
        stall_timeout: common.stall_timeout(),
        // A name that no configuration can give.
        peer: peer.or_else(|| connects.then(|| format!("bridge {name}"))),
        self_generated: common.self_generated,
        name,
    })
}
