//! What the frames of a link go by.

use crate::config::bridge::in_range;
use crate::config::bus::{Bus, Mode};
use crate::config::error::Fault;
use crate::config::locator::Locator;
use aldis_services::link::{CarrierConfig, CarrierId, MTU_MIN};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

/// The kinds of carriers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum CarrierKind {
    /// Datagrams of UDP: `listen`, and `peer` unless the peer comes here.
    Udp,
    /// A serial device, such as a radio modem: `device` and `baud`.
    Serial,
    /// Best-effort puts over a Zenoh network that both ends join: `connect` or `listen_zenoh`.
    Zenoh,
}

/// One `[[link.carrier]]`. Both ends list their carriers in the same order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Carrier {
    /// What it is.
    pub(crate) kind: CarrierKind,
    /// Bytes a second that may be sent, counted from the first byte of a frame to its last.
    #[schemars(range(min = 50, max = 1_000_000_000))]
    pub(crate) rate_bytes_per_s: u64,
    /// The longest frame in bytes. Default: 1200, which passes nearly every network whole.
    #[serde(default = "mtu")]
    #[schemars(range(min = 128, max = 65_000))]
    pub(crate) mtu: u32,
    /// The round trip until one is measured, in milliseconds. Default: 200.
    #[serde(default = "round_trip_ms")]
    #[schemars(range(min = 1, max = 600_000))]
    pub(crate) round_trip_ms: u32,
    /// The percentage of frames lost until that is measured. Default: 5.
    #[serde(default = "loss_percent")]
    #[schemars(range(min = 0, max = 90))]
    pub(crate) loss_percent: u8,
    /// UDP: where datagrams are awaited. Several links may have the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    pub(crate) listen: Option<SocketAddr>,
    /// UDP: where the peer is; without it, it is found where its frames come from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    pub(crate) peer: Option<SocketAddr>,
    /// Serial: the device, such as "/dev/ttyUSB0".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) device: Option<PathBuf>,
    /// Serial: the speed of the line in bits a second.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) baud: Option<u32>,
    /// Zenoh: locators of routers or peers to join.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) connect: Vec<Locator>,
    /// Zenoh: locators on which others may join.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) listen_zenoh: Vec<Locator>,
}

fn mtu() -> u32 {
    1_200
}

fn round_trip_ms() -> u32 {
    200
}

fn loss_percent() -> u8 {
    5
}

impl Carrier {
    /// The carrier as the protocol is told.
    pub(super) fn config(&self, place: usize) -> CarrierConfig {
        CarrierConfig {
            id: CarrierId(place as u8),
            rate: self.rate_bytes_per_s,
            mtu: self.mtu as usize,
            round_trip: Duration::from_millis(self.round_trip_ms.into()),
            loss: f64::from(self.loss_percent) / 100.0,
        }
    }

    /// The Zenoh network of a carrier over Zenoh: a table of its own, because it is not the node's bus.
    pub(crate) fn network(&self) -> Option<Bus> {
        let mode = if self.listen_zenoh.is_empty() { Mode::Client } else { Mode::Peer };
        let (listen, connect) = (self.listen_zenoh.clone(), self.connect.clone());
        (self.kind == CarrierKind::Zenoh).then(|| Bus { mode, listen, connect, ..Bus::default() })
    }

    pub(super) fn check(&self) -> Result<(), Fault> {
        in_range("rate_bytes_per_s", self.rate_bytes_per_s, 50..=1_000_000_000, "bytes a second")?;
        in_range("mtu", self.mtu, MTU_MIN as u32..=65_000, "bytes")?;
        in_range("round_trip_ms", self.round_trip_ms, 1..=600_000, "milliseconds")?;
        in_range("loss_percent", self.loss_percent, 0..=90, "percent")?;
        let (zenoh, serial) =
            (!self.connect.is_empty() || !self.listen_zenoh.is_empty(), self.device.is_some());
        let udp = self.listen.is_some() || self.peer.is_some();
        let own = match self.kind {
            CarrierKind::Udp => (self.listen.is_some(), "listen = \"0.0.0.0:7500\""),
            CarrierKind::Serial => {
                (serial && self.baud.is_some(), "device = \"/dev/ttyUSB0\" and baud = 57600")
            }
            CarrierKind::Zenoh => (zenoh, "connect = [\"tcp/192.0.2.1:7447\"]"),
        };
        if !own.0 {
            return Err(Fault::new(
                "kind",
                "the carrier does not say where it goes",
                format!("add {}", own.1),
            ));
        }
        let foreign = match self.kind {
            CarrierKind::Udp => serial || self.baud.is_some() || zenoh,
            CarrierKind::Serial => udp || zenoh,
            CarrierKind::Zenoh => udp || serial || self.baud.is_some(),
        };
        if foreign {
            let help = "leave out what belongs to other kinds: `listen` and `peer` are for udp, `device` and `baud` for \
                        serial, `connect` and `listen_zenoh` for zenoh";
            return Err(Fault::new("kind", "the carrier has fields of another kind", help));
        }
        Ok(())
    }
}
