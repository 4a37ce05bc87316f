//! A machine: a node with its clocks, its session on the bus and its disk.

use super::disk::SimDisk;
use crate::event::{BridgeId, Event, PeerId, PublisherId};
use crate::journal::{DiskEffect, Journal, JournalConfig};
use crate::node::{Node, NodeConfig};
use aldis_envelope::codec::native::Decoder;
use aldis_envelope::{Keys, Label, Monotonic, Now, Source, Wall};
use bytes::Bytes;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

/// The wall clock at the start of every world: 2026-11-22, in nanoseconds.
const EPOCH: i64 = 1_795_305_600_000_000_000;

/// The clocks of a machine, against the world's true time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Clocks {
    /// When the monotonic clock showed zero.
    pub(super) born: Monotonic,
    /// How far the wall clock is wrong, in nanoseconds.
    pub(super) offset_ns: i64,
    /// How much faster both go, in parts per million.
    pub(super) drift_ppm: i64,
}

impl Clocks {
    /// What they show.
    pub(super) fn at(&self, now: Monotonic) -> Now {
        let drifted = |from: Monotonic| {
            let nanoseconds = i128::try_from((now - from).as_nanos()).unwrap_or(i128::MAX / 2_000_000);
            i64::try_from(nanoseconds * (1_000_000 + i128::from(self.drift_ppm)) / 1_000_000)
                .unwrap_or(i64::MAX / 2)
        };
        let monotonic = drifted(self.born).max(0) as u64;
        Now {
            monotonic: Monotonic::since_start(Duration::from_nanos(monotonic)),
            wall: Wall(EPOCH + drifted(Monotonic::START) + self.offset_ns),
        }
    }

    /// The true time at which the monotonic clock shows `local`, or a little before: one asks again then.
    pub(super) fn when(&self, local: Monotonic) -> Monotonic {
        let local = i128::try_from(local.elapsed().as_nanos()).unwrap_or(i128::MAX / 2_000_000);
        let elapsed = local * 1_000_000 / (1_000_000 + i128::from(self.drift_ppm));
        self.born + Duration::from_nanos(u64::try_from(elapsed).unwrap_or(u64::MAX))
    }
}

/// A disk with the journal on it.
pub(super) struct Storage {
    pub(super) disk: SimDisk,
    pub(super) config: JournalConfig,
    pub(super) journal: Journal,
    /// What the disk is doing.
    pub(super) under_way: Option<DiskEffect>,
    /// Operations take so long.
    pub(super) latency: (Duration, Duration),
    /// What the journal has told before the node starts.
    pub(super) told: Vec<Event>,
}

pub(super) struct Machine {
    pub(super) config: NodeConfig,
    /// None while it is down.
    pub(super) node: Option<Node>,
    pub(super) keys: Keys,
    pub(super) decoder: Decoder,
    pub(super) clocks: Clocks,
    pub(super) storage: Option<Storage>,
    /// Whether the power is on. The node starts when the journal is read back.
    pub(super) is_on: bool,
    /// Whether the bus carries anything to and from it.
    pub(super) is_connected: bool,
    /// Whether its node takes the session for up.
    pub(super) is_open: bool,
    /// Only machines on one side hear each other.
    pub(super) side: u32,
    pub(super) subscriptions: Vec<String>,
    pub(super) publishers: BTreeMap<PublisherId, (String, Vec<u8>)>,
    pub(super) tokens: BTreeSet<Source>,
    /// The tokens of others that it has been told of.
    pub(super) seen: BTreeSet<Source>,
    /// When it wants its deadline, by its own clock.
    pub(super) armed: Option<Monotonic>,
    pub(super) sent: Vec<(BridgeId, PeerId, Arc<Label>, Bytes)>,
    pub(super) exited: bool,
    /// What came while it was stalled.
    pub(super) stalled: Option<Vec<Event>>,
}

impl Machine {
    pub(super) fn new(config: NodeConfig, clocks: Clocks) -> Self {
        let keys = Keys::new(&config.fleet);
        Self {
            decoder: Decoder::new(keys.clone()),
            keys,
            config,
            node: None,
            clocks,
            storage: None,
            is_on: true,
            is_connected: false,
            is_open: false,
            side: 0,
            subscriptions: Vec::new(),
            publishers: BTreeMap::new(),
            tokens: BTreeSet::new(),
            seen: BTreeSet::new(),
            armed: None,
            sent: Vec::new(),
            exited: false,
            stalled: None,
        }
    }

    /// Whether samples pass between two machines.
    pub(super) fn hears(&self, other: &Self) -> bool {
        self.is_connected && other.is_connected && self.side == other.side
    }

    /// Nothing that the process held is left.
    pub(super) fn forget(&mut self) {
        let Self { config, clocks, storage, side, .. } =
            std::mem::replace(self, Self::new(self.config.clone(), self.clocks));
        self.is_on = false;
        (self.config, self.clocks, self.storage, self.side) = (config, clocks, storage, side);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_drift_and_deadlines_follow() {
        let at = |seconds| Monotonic::since_start(Duration::from_secs(seconds));
        for drift_ppm in [0, 200, -200] {
            let clocks = Clocks { born: at(10), offset_ns: 5_000_000_000, drift_ppm };
            let now = clocks.at(at(1010));
            let expected = 1_000_000_000_000 + 1_000_000 * drift_ppm;
            assert_eq!(now.monotonic.elapsed().as_nanos() as i64, expected);
            assert_eq!(now.wall.0, EPOCH + 1_015_000_000_000 + 1_010_000 * drift_ppm);
            let back = clocks.when(now.monotonic).elapsed().as_nanos().abs_diff(1_010_000_000_000);
            assert!(back < 1000, "{back}");
        }
    }
}
