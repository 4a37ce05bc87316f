//! `kind = "uxas-tcp"`.

use super::super::error::Fault;
use super::common::{Common, bridge_table};
use super::reachable;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::net::SocketAddr;

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
    /// What every kind has.
    pub(crate) common: Common,
    /// Whether it waits for peers or connects to one.
    pub(crate) endpoint: Endpoint,
}

bridge_table! {
    /// The table as it is written.
    UxasTcpTable {
        /// Wait for peers on this address. Exactly one of `listen` and `connect` is given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<String>")]
        listen: Option<SocketAddr>,
        /// Connect to the peer at this address, again with back-off when it is absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<String>")]
        connect: Option<SocketAddr>,
    }
}

impl TryFrom<UxasTcpTable> for UxasTcp {
    type Error = Fault;

    fn try_from(table: UxasTcpTable) -> Result<Self, Fault> {
        let endpoint = endpoint(table.listen, table.connect)?;
        Ok(Self { common: table.common()?, endpoint })
    }
}

impl From<UxasTcp> for UxasTcpTable {
    fn from(bridge: UxasTcp) -> Self {
        let (listen, connect) = match bridge.endpoint {
            Endpoint::Listen(address) => (Some(address), None),
            Endpoint::Connect(address) => (None, Some(address)),
        };
        Self::from_common(bridge.common, listen, connect)
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
        (None, Some(address)) => Ok(Endpoint::Connect(reachable("connect", address)?)),
    }
}
