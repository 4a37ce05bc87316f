//! What every kind of bridge has.

use super::super::error::Fault;
use super::super::text::PlainName;
use super::{bridge_service, in_range};
use aldis_envelope::{Dialect, Prefix, ServiceId};
use std::time::Duration;

/// What every kind of bridge has.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Common {
    /// The name in logs and counters.
    pub(crate) name: PlainName,
    /// The service id of the bridge on the node's own entity.
    pub(crate) service: ServiceId,
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
    /// The one peer behind the bridge.
    pub(crate) peer: Option<PlainName>,
    /// Whether everything that enters becomes the bridge's own.
    pub(crate) self_generated: bool,
}

impl Common {
    /// How long a peer may take nothing before it is disconnected.
    pub(crate) fn stall_timeout(&self) -> Duration {
        Duration::from_millis(u64::from(self.stall_timeout_ms))
    }

    /// Checks what the types do not.
    pub(super) fn check(self) -> Result<Self, Fault> {
        bridge_service(self.service)?;
        in_range("message_bytes_max", self.message_bytes_max, 1024..=1 << 30, "bytes")?;
        in_range("queue_messages_max", self.queue_messages_max, 1..=1_000_000, "messages")?;
        in_range("stall_timeout_ms", self.stall_timeout_ms, 10..=600_000, "milliseconds")?;
        Ok(self)
    }
}

pub(super) fn message_bytes_max() -> u32 {
    16 << 20
}

pub(super) fn queue_messages_max() -> u32 {
    8192
}

pub(super) fn stall_timeout_ms() -> u32 {
    5000
}

/// Declares the table of a kind of bridge as it is written: its own keys, and those that every kind has. Serde could
/// flatten the common keys into it, but then it no longer refuses unknown ones.
macro_rules! bridge_table {
    ($(#[$about:meta])* $table:ident { $($(#[$of_field:meta])* $field:ident: $type:ty,)* }) => {
        $(#[$about])*
        #[derive(Debug, Clone, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub(crate) struct $table {
            /// The name in logs and counters, unique on the node.
            name: $crate::config::text::PlainName,
            /// The service id of the bridge on the node's own entity: 20 to 99, unique on the node.
            #[schemars(with = "crate::config::schema::BridgeServiceId")]
            service: aldis_envelope::ServiceId,
            $($(#[$of_field])* $field: $type,)*
            /// How ids are written towards the peer; both spellings are always read.
            #[serde(default)]
            #[schemars(with = "crate::config::schema::Dialect")]
            dialect: aldis_envelope::Dialect,
            /// Addresses taken from the peer into the fleet. Default: all.
            #[serde(default = "super::all")]
            #[schemars(with = "Vec<crate::config::schema::Prefix>")]
            import: Vec<aldis_envelope::Prefix>,
            /// Addresses given from the fleet to the peer. Default: all.
            #[serde(default = "super::all")]
            #[schemars(with = "Vec<crate::config::schema::Prefix>")]
            export: Vec<aldis_envelope::Prefix>,
            /// The largest message in bytes; what declares more is skipped and counted. Default: 16 MiB, above the largest
            /// plan seen from OpenUxAS and small enough that a hostile length costs little.
            #[serde(default = "super::common::message_bytes_max")]
            #[schemars(range(min = 1024, max = 1_073_741_824))]
            message_bytes_max: u32,
            /// How many messages wait for a peer that does not take them; at the limit the input is held back. Default:
            /// 8192, about 10 ms of the fastest stream; less makes bursts wait, more makes old telemetry.
            #[serde(default = "super::common::queue_messages_max")]
            #[schemars(range(min = 1, max = 1_000_000))]
            queue_messages_max: u32,
            /// How long a peer may take nothing before it is disconnected, in milliseconds. Default: 5000; less cuts off
            /// peers that stop to think, more holds the others back.
            #[serde(default = "super::common::stall_timeout_ms")]
            #[schemars(range(min = 10, max = 600_000))]
            stall_timeout_ms: u32,
            /// The name of the one peer that this bridge leads to. What came from it never returns to it, by any bridge of
            /// this node with the same `peer`. Default: none, every connection is a peer of its own.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            peer: Option<$crate::config::text::PlainName>,
            /// Whether everything that enters gets the bridge's own ids as its source: `ConsiderSelfGenerated` of
            /// OpenUxAS. Default: false, the origin's ids stay.
            #[serde(default)]
            self_generated: bool,
        }

        impl $table {
            fn common(&self) -> Result<super::Common, $crate::config::error::Fault> {
                super::Common {
                    name: self.name.clone(),
                    service: self.service,
                    dialect: self.dialect,
                    import: self.import.clone(),
                    export: self.export.clone(),
                    message_bytes_max: self.message_bytes_max,
                    queue_messages_max: self.queue_messages_max,
                    stall_timeout_ms: self.stall_timeout_ms,
                    peer: self.peer.clone(),
                    self_generated: self.self_generated,
                }
                .check()
            }

            fn from_common(common: super::Common, $($field: $type),*) -> Self {
                Self {
                    name: common.name,
                    service: common.service,
                    $($field,)*
                    dialect: common.dialect,
                    import: common.import,
                    export: common.export,
                    message_bytes_max: common.message_bytes_max,
                    queue_messages_max: common.queue_messages_max,
                    stall_timeout_ms: common.stall_timeout_ms,
                    peer: common.peer,
                    self_generated: common.self_generated,
                }
            }
        }
    };
}
pub(super) use bridge_table;
