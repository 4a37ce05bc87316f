//! Bridges: where another world is joined to the fleet.

mod common;
mod dds;
mod uxas_serial;
mod uxas_tcp;
mod uxas_zmq;

pub(crate) use common::Common;
pub(super) use dds::DdsTable;
#[cfg(feature = "dds")]
pub(crate) use dds::{BENCH_TYPE, bench_types, dds_types};
pub(crate) use dds::{Dds, DdsVersion};
pub(super) use uxas_serial::UxasSerialTable;
pub(crate) use uxas_serial::{Check, UxasSerial};
pub(super) use uxas_tcp::UxasTcpTable;
pub(crate) use uxas_tcp::{Endpoint, UxasTcp};
pub(super) use uxas_zmq::UxasZmqTable;
pub(crate) use uxas_zmq::{Framing, Sockets, UxasZmq};

use super::error::Fault;
use aldis_envelope::{Prefix, ServiceId};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::net::SocketAddr;
use std::ops::RangeInclusive;

/// The service ids of bridges.
pub(crate) const BRIDGE_SERVICES: RangeInclusive<u32> = 20..=99;

/// One `[[bridge]]`, by its `kind`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub(crate) enum Bridge {
    /// The UxAS stream form over TCP.
    UxasTcp(UxasTcp),
    /// The UxAS stream form on a serial device.
    UxasSerial(UxasSerial),
    /// UxAS over ZeroMQ.
    UxasZmq(UxasZmq),
    /// A DDS domain.
    Dds(Dds),
}

impl Bridge {
    /// What may stand as `kind`.
    pub(crate) const KINDS: &[&str] = &["uxas-tcp", "uxas-serial", "uxas-zmq", "dds"];

    /// What every kind has.
    pub(crate) fn common(&self) -> &Common {
        match self {
            Self::UxasTcp(bridge) => &bridge.common,
            Self::UxasSerial(bridge) => &bridge.common,
            Self::UxasZmq(bridge) => &bridge.common,
            Self::Dds(bridge) => &bridge.common,
        }
    }

    /// The addresses that the bridge listens on, each with its key.
    pub(crate) fn listens(&self) -> Vec<(&'static str, SocketAddr)> {
        match self {
            Self::UxasTcp(UxasTcp { endpoint: Endpoint::Listen(address), .. }) => vec![("listen", *address)],
            Self::UxasZmq(UxasZmq { sockets: Sockets::PublishPull { publish, pull }, .. }) => {
                vec![("publish", *publish), ("pull", *pull)]
            }
            Self::UxasTcp(_) | Self::UxasSerial(_) | Self::UxasZmq(_) | Self::Dds(_) => Vec::new(),
        }
    }
}

pub(super) fn all() -> Vec<Prefix> {
    vec![Prefix::all()]
}

/// Nobody can be reached at port 0.
fn reachable(key: &str, address: SocketAddr) -> Result<SocketAddr, Fault> {
    if address.port() != 0 {
        return Ok(address);
    }
    Err(Fault::new(
        key,
        "nobody can be reached at port 0",
        "give the port on which the peer listens, such as \"127.0.0.1:5555\"",
    ))
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

#[cfg(test)]
mod tests;
