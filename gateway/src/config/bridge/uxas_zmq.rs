//! `kind = "uxas-zmq"`.

use super::super::error::Fault;
use super::common::{Common, bridge_table};
use super::reachable;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::net::SocketAddr;

/// The two sockets of a bridge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sockets {
    /// PUB and PULL, which others connect to.
    PublishPull {
        /// Where others subscribe.
        publish: SocketAddr,
        /// Where others push.
        pull: SocketAddr,
    },
    /// SUB and PUSH, which connect to those of one peer.
    SubscribePush {
        /// Where the peer publishes.
        subscribe: SocketAddr,
        /// Where the peer pulls.
        push: SocketAddr,
    },
}

/// How a message of UxAS stands in a message of ZeroMQ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Framing {
    /// One frame that holds the delimited form, as OpenUxAS sends it.
    #[default]
    Single,
    /// Seven frames, as the slides of UxAS show it.
    Multipart,
}

/// A bridge that speaks to UxAS over ZeroMQ: it binds PUB and PULL, or it connects SUB and PUSH.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "UxasZmqTable", into = "UxasZmqTable")]
pub(crate) struct UxasZmq {
    /// What every kind has.
    pub(crate) common: Common,
    /// Its sockets.
    pub(crate) sockets: Sockets,
    /// How messages stand in frames.
    pub(crate) framing: Framing,
}

bridge_table! {
    /// The table as it is written: `publish` and `pull`, or `subscribe` and `push`.
    UxasZmqTable {
        /// Publish on this address to all that subscribe: a PUB socket that binds.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<String>")]
        publish: Option<SocketAddr>,
        /// Take what others push on this address: a PULL socket that binds.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<String>")]
        pull: Option<SocketAddr>,
        /// Subscribe to the peer that publishes at this address: a SUB socket that connects.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<String>")]
        subscribe: Option<SocketAddr>,
        /// Push to the peer that pulls at this address: a PUSH socket that connects.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<String>")]
        push: Option<SocketAddr>,
        /// One frame a message (OpenUxAS) or seven (the slides); what comes in the other form is refused and counted.
        #[serde(default)]
        framing: Framing,
    }
}

impl TryFrom<UxasZmqTable> for UxasZmq {
    type Error = Fault;

    fn try_from(table: UxasZmqTable) -> Result<Self, Fault> {
        let sockets = sockets(&table)?;
        Ok(Self { common: table.common()?, sockets, framing: table.framing })
    }
}

impl From<UxasZmq> for UxasZmqTable {
    fn from(bridge: UxasZmq) -> Self {
        let [publish, pull, subscribe, push] = match bridge.sockets {
            Sockets::PublishPull { publish, pull } => [Some(publish), Some(pull), None, None],
            Sockets::SubscribePush { subscribe, push } => [None, None, Some(subscribe), Some(push)],
        };
        Self::from_common(bridge.common, publish, pull, subscribe, push, bridge.framing)
    }
}

fn sockets(table: &UxasZmqTable) -> Result<Sockets, Fault> {
    match (table.publish, table.pull, table.subscribe, table.push) {
        (Some(publish), Some(pull), None, None) if publish == pull && publish.port() != 0 => Err(Fault::new(
            "pull",
            format!("`publish` and `pull` are both {pull}"),
            "give each a port of its own",
        )),
        (Some(publish), Some(pull), None, None) => Ok(Sockets::PublishPull { publish, pull }),
        (None, None, Some(subscribe), Some(push)) => Ok(Sockets::SubscribePush {
            subscribe: reachable("subscribe", subscribe)?,
            push: reachable("push", push)?,
        }),
        (Some(_), None, None, None) => Err(missing("publish", "pull")),
        (None, Some(_), None, None) => Err(missing("pull", "publish")),
        (None, None, Some(_), None) => Err(missing("subscribe", "push")),
        (None, None, None, Some(_)) => Err(missing("push", "subscribe")),
        (None, None, None, None) => Err(Fault::new(
            "",
            "the bridge has no sockets",
            "add `publish` and `pull` to wait for peers, or `subscribe` and `push` to go to one",
        )),
        _ => Err(Fault::new(
            if table.subscribe.is_some() { "subscribe" } else { "push" },
            "the bridge both binds and connects",
            "keep `publish` and `pull`, or `subscribe` and `push`; for both, write two bridges",
        )),
    }
}

fn missing(found: &str, other: &str) -> Fault {
    Fault::new(
        found,
        format!("`{found}` without `{other}`"),
        format!("add {other} = \"127.0.0.1:5561\": messages go one way on each of the two sockets"),
    )
}
