//! Bridges: where another world is joined to the fleet.

use super::error::Fault;
use super::schema;
use super::text::PlainName;
use aldis_envelope::{Dialect, Prefix, ServiceId};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::net::SocketAddr;
use std::ops::RangeInclusive;
use std::time::Duration;

/// The service ids of bridges.
pub(crate) const BRIDGE_SERVICES: RangeInclusive<u32> = 20..=99;

/// One `[[bridge]]`, by its `kind`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub(crate) enum Bridge {
    /// The UxAS stream form over TCP.
    UxasTcp(UxasTcp),
}

impl Bridge {
    /// What may stand as `kind`.
    pub(crate) const KINDS: &[&str] = &["uxas-tcp"];

    /// The name, unique on the node.
    pub(crate) fn name(&self) -> &PlainName {
        match self {
            Self::UxasTcp(bridge) => &bridge.name,
        }
    }

    /// The service id, unique on the node.
    pub(crate) fn service(&self) -> ServiceId {
        match self {
            Self::UxasTcp(bridge) => bridge.service,
        }
    }

    /// The address that the bridge listens on, if it does.
    pub(crate) fn listen(&self) -> Option<SocketAddr> {
        match self {
            Self::UxasTcp(UxasTcp { endpoint: Endpoint::Listen(address), .. }) => Some(*address),
            Self::UxasTcp(_) => None,
        }
    }
}

/// Which side of a connection a bridge takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Endpoint {
    /// It waits for peers; several may come.
    Listen(SocketAddr),
    /// It connects to one peer, again and again.
    Connect(SocketAddr),
}

/// A bridge that speaks the UxAS stream form over TCP, as server or as client.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "UxasTcpTable", into = "UxasTcpTable")]
pub(crate) struct UxasTcp {
    /// The name in logs and counters.
    pub(crate) name: PlainName,
    /// The service id of the bridge on the node's own entity.
    pub(crate) service: ServiceId,
    /// Whether it waits for peers or connects to one.
    pub(crate) endpoint: Endpoint,
    /// How ids are written towards the peer; both spellings are read.
    pub(crate) dialect: Dialect,
    /// Addresses taken from the peer into the fleet.
    pub(crate) import: Vec<Prefix>,
    /// Addresses given from the fleet to the peer.
    pub(crate) export: Vec<Prefix>,
    /// The largest message, in bytes, in either direction.
    pub(crate) message_bytes_max: u32,
    /// How many messages wait for a peer that does not take them.
    pub(crate) queue_messages_max: u32,
    /// How long a peer may take nothing before it is disconnected, in milliseconds.
    pub(crate) stall_timeout_ms: u32,
}

impl UxasTcp {
    /// How long a peer may take nothing before it is disconnected.
    pub(crate) fn stall_timeout(&self) -> Duration {
        Duration::from_millis(u64::from(self.stall_timeout_ms))
    }
}

/// The table as it is written.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct UxasTcpTable {
    /// The name in logs and counters, unique on the node.
    name: PlainName,
    /// The service id of the bridge on the node's own entity: 20 to 99, unique on the node.
    #[schemars(with = "schema::BridgeServiceId")]
    service: ServiceId,
    /// Wait for peers on this address. Exactly one of `listen` and `connect` is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    listen: Option<SocketAddr>,
    /// Connect to the peer at this address, again with back-off when it is absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    connect: Option<SocketAddr>,
    /// How ids are written towards the peer; both spellings are always read.
    #[serde(default)]
    #[schemars(with = "schema::Dialect")]
    dialect: Dialect,
    /// Addresses taken from the peer into the fleet. Default: all.
    #[serde(default = "all")]
    #[schemars(with = "Vec<schema::Prefix>")]
    import: Vec<Prefix>,
    /// Addresses given from the fleet to the peer. Default: all.
    #[serde(default = "all")]
    #[schemars(with = "Vec<schema::Prefix>")]
    export: Vec<Prefix>,
    /// The largest message in bytes; what declares more is skipped and counted. Default: 16 MiB, above the largest
    /// plan seen from OpenUxAS and small enough that a hostile length costs little.
    #[serde(default = "message_bytes_max")]
    #[schemars(range(min = 1024, max = 1_073_741_824))]
    message_bytes_max: u32,
    /// How many messages wait for a peer that does not take them; at the limit the input is held back. Default:
    /// 8192, about 10 ms of the fastest stream; less makes bursts wait, more makes old telemetry.
    #[serde(default = "queue_messages_max")]
    #[schemars(range(min = 1, max = 1_000_000))]
    queue_messages_max: u32,
    /// How long a peer may take nothing before it is disconnected, in milliseconds. Default: 5000; less cuts off
    /// peers that stop to think, more holds the others back.
    #[serde(default = "stall_timeout_ms")]
    #[schemars(range(min = 10, max = 600_000))]
    stall_timeout_ms: u32,
}

pub(super) fn all() -> Vec<Prefix> {
    vec![Prefix::all()]
}

fn message_bytes_max() -> u32 {
    16 << 20
}

fn queue_messages_max() -> u32 {
    8192
}

fn stall_timeout_ms() -> u32 {
    5000
}

impl TryFrom<UxasTcpTable> for UxasTcp {
    type Error = Fault;

    fn try_from(table: UxasTcpTable) -> Result<Self, Fault> {
        let endpoint = endpoint(table.listen, table.connect)?;
        bridge_service(table.service)?;
        in_range("message_bytes_max", table.message_bytes_max, 1024..=1 << 30, "bytes")?;
        in_range("queue_messages_max", table.queue_messages_max, 1..=1_000_000, "messages")?;
        in_range("stall_timeout_ms", table.stall_timeout_ms, 10..=600_000, "milliseconds")?;
        Ok(Self {
            name: table.name,
            service: table.service,
            endpoint,
            dialect: table.dialect,
            import: table.import,
            export: table.export,
            message_bytes_max: table.message_bytes_max,
            queue_messages_max: table.queue_messages_max,
            stall_timeout_ms: table.stall_timeout_ms,
        })
    }
}

impl From<UxasTcp> for UxasTcpTable {
    fn from(bridge: UxasTcp) -> Self {
        let (listen, connect) = match bridge.endpoint {
            Endpoint::Listen(address) => (Some(address), None),
            Endpoint::Connect(address) => (None, Some(address)),
        };
        Self {
            name: bridge.name,
            service: bridge.service,
            listen,
            connect,
            dialect: bridge.dialect,
            import: bridge.import,
            export: bridge.export,
            message_bytes_max: bridge.message_bytes_max,
            queue_messages_max: bridge.queue_messages_max,
            stall_timeout_ms: bridge.stall_timeout_ms,
        }
    }
}

fn endpoint(listen: Option<SocketAddr>, connect: Option<SocketAddr>) -> Result<Endpoint, Fault> {
    match (listen, connect) {
        (Some(_), Some(_)) => Err(Fault::new(
            "connect",
            "the bridge has both `listen` and `connect`",
            "keep one: `listen` waits for peers, `connect` goes to one; for both, write two bridges",
        )),
        (None, None) => Err(Fault::new(
            "",
            "the bridge has neither `listen` nor `connect`",
            "add `listen = \"127.0.0.1:5556\"` to wait for peers, or `connect = …` to go to one",
        )),
        (Some(address), None) => Ok(Endpoint::Listen(address)),
        (None, Some(address)) if address.port() == 0 => Err(Fault::new(
            "connect",
            "nobody can be reached at port 0",
            "give the port on which the peer listens, such as \"127.0.0.1:5555\"",
        )),
        (None, Some(address)) => Ok(Endpoint::Connect(address)),
    }
}

fn bridge_service(service: ServiceId) -> Result<(), Fault> {
    if BRIDGE_SERVICES.contains(&service.get()) {
        return Ok(());
    }
    Err(Fault::new(
        "service",
        format!("service {service} is not a bridge's"),
        "bridges have 20 to 99; 1 to 19 are built in, 100 and up are for `[[service]]`",
    ))
}

/// Checks a limit; the schema says the same by its `range`.
pub(super) fn in_range<T: PartialOrd + std::fmt::Display>(
    key: &str,
    value: T,
    range: RangeInclusive<T>,
    unit: &str,
) -> Result<(), Fault> {
    if range.contains(&value) {
        return Ok(());
    }
    let (min, max) = range.into_inner();
    Err(Fault::new(key, format!("`{key}` = {value} is out of range"), format!("give {min} to {max} {unit}")))
}
