//! From a configuration to a node and to what the shell has to open for it.

use super::bus_task::Joining;
use crate::bridge::{Endpoint, Limits, Side, uxas_serial, uxas_tcp, uxas_zmq};
use crate::bus::Congestion;
use crate::clock;
use crate::config::{self, Config, bus};
use aldis_envelope::codec::{stream, zmtp};
use aldis_envelope::{EntityId, Guids, Prefix, Source};
use aldis_services::manager::Maker;
use aldis_services::registry::{self, Kind};
use aldis_services::{BridgeSpec, NodeConfig, ServiceSpec};

/// What the shell opens for a node.
pub(crate) struct Outside {
    pub(super) bus: Joining,
    pub(super) bridges: Vec<Endpoint>,
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
    Ok(Outside { bus, bridges: config.bridges.iter().map(endpoint).collect() })
}

fn endpoint(bridge: &config::Bridge) -> Endpoint {
    let common = bridge.common();
    let (dialect, message_bytes_max) = (common.dialect, common.message_bytes_max as usize);
    match bridge {
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
    }
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

/// Makes a service from what a `CreateNewService` says: the beginning of an element of a UxAS configuration.
fn maker(own: EntityId, guids: &Guids) -> Maker {
    let guids = guids.clone();
    Maker::new(move |source, create| {
        let id = source.service.get();
        let service = config::uxas_file::service(&create.xml_configuration, own.get(), id)?;
        match &service {
            config::Service::SendMessages(_) => Err("files are read at the start of a node alone".to_owned()),
            service => Ok(configured(own, service, &guids)),
        }
    })
}

fn configured(own: EntityId, service: &config::Service, guids: &Guids) -> ServiceSpec {
    match service {
        config::Service::Track(track) => {
            registry::service(track.source(own), "track", Kind::Track(track.motion(own)), guids)
        }
        config::Service::ServiceManager(manager) => {
            let kind = Kind::Manager(maker(own, guids));
            registry::service(Source::new(own, manager.service), "service-manager", kind, guids)
        }
        config::Service::SendMessages(send) => {
            let kind = Kind::Player(send.scheduled.clone());
            registry::service(Source::new(own, send.service), "send-messages", kind, guids)
        }
    }
}

fn bridge_spec(own: EntityId, bridge: &config::Bridge) -> BridgeSpec {
    let common = bridge.common();
    let name = common.name.as_str().to_owned();
    // Whom a bridge subscribes to and whom it pushes to are one.
    let connects = matches!(
        bridge,
        config::Bridge::UxasZmq(zmq) if matches!(zmq.sockets, config::Sockets::SubscribePush { .. })
    );
    let peer = common.peer.as_ref().map(|peer| peer.as_str().to_owned());
    BridgeSpec {
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
    }
}
