//! What shore knows of the fleet: the numbers behind the table and the result.

use super::linked::Linked;
use super::missions::Progress;
use aldis_envelope::aldis::NodeStatus;
use aldis_envelope::umaa::ErrorCondition;
use aldis_envelope::{EntityId, Monotonic};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// The boats.
pub(super) const BOATS: [u64; 3] = [401, 402, 403];
/// The one that is silenced for a while.
pub(super) const SILENCED: u64 = 403;

/// The one whose autopilot is contended for.
pub(super) const CONTENDED: u64 = 401;
/// The one whose arbiter crashes.
pub(super) const CRASHING: u64 = 402;

/// How control of an autopilot goes.
#[derive(Debug, Clone, Default)]
pub(super) struct Control {
    /// Who holds it, and until when by the boat's clock, as its arbiter reports.
    pub(super) holder: Option<(String, Option<String>)>,
    /// Times that control was given.
    pub(super) given: u64,
    /// Times that it ended because its time was over.
    pub(super) expired: u64,
    /// Times that somebody of higher priority took it.
    pub(super) taken_over: u64,
    /// Times that it was refused because somebody of higher priority held it.
    pub(super) rejected: u64,
    /// Times that it ended in any other way.
    pub(super) otherwise: u64,
    /// Times that it went on to its end over a crash of its arbiter.
    pub(super) recovered: u64,
}

/// What shore knows of one boat.
#[derive(Debug, Default)]
pub(super) struct Boat {
    pub(super) heard: Option<Monotonic>,
    pub(super) states: u64,
    /// States at the last drawing, and when that was: for the rate.
    pub(super) drawn: (u64, Duration),
    pub(super) rate: f64,
    pub(super) latitude: f64,
    pub(super) longitude: f64,
    pub(super) reports: u64,
    pub(super) worst: Option<ErrorCondition>,
    pub(super) calls_ok: u64,
    pub(super) calls_failed: u64,
    pub(super) round_trip: Option<Duration>,
    pub(super) last_failure: String,
}

/// What shore knows.
#[derive(Debug, Default)]
pub(super) struct Board {
    pub(super) now: Monotonic,
    pub(super) boats: BTreeMap<EntityId, Boat>,
    /// Who controls the autopilot that is contended for.
    pub(super) control: Control,
    /// Who controls the one whose arbiter crashes.
    pub(super) recovery: Control,
    /// How often it has.
    pub(super) crashes: Arc<AtomicU64>,
    /// The boat that is silenced now.
    pub(super) silenced: Option<u64>,
    /// What is known of bad links, where the boats are behind some.
    pub(super) linked: Linked,
    /// How far the missions are.
    pub(super) missions: Progress,
    /// Calls that failed though the boat was not silenced when they were made.
    pub(super) failed_elsewhere: u64,
}

/// How the demo went.
#[derive(Debug)]
pub(super) struct Outcome {
    pub(super) entities: usize,
    pub(super) delivered: u64,
    pub(super) lost: u64,
    pub(super) skipped_told: u64,
    pub(super) calls_ok: u64,
    pub(super) calls_failed: u64,
    pub(super) calls_failed_elsewhere: u64,
    pub(super) control: Control,
    pub(super) linked: Linked,
    pub(super) recovery: Control,
    pub(super) missions: Progress,
    pub(super) crashes: u64,
    pub(super) ran: Duration,
}

impl Board {
    /// How control of a boat's autopilot goes; none where nobody asks for it.
    pub(super) fn control_of(&mut self, boat: EntityId) -> Option<&mut Control> {
        match boat.get() {
            CONTENDED => Some(&mut self.control),
            CRASHING => Some(&mut self.recovery),
            _ => None,
        }
    }

    /// The result, from what shore saw and what the nodes counted.
    pub(super) fn result(&self, statuses: &[NodeStatus], ran: Duration) -> Outcome {
        let counted = |name: &str| {
            let of =
                |status: &NodeStatus| status.counters.iter().find(|(n, _)| n == name).map_or(0, |(_, v)| *v);
            statuses.iter().map(of).sum()
        };
        Outcome {
            entities: statuses.len(),
            delivered: counted("delivered"),
            lost: counted("lost") + counted("shed_from_bus"),
            skipped_told: counted("skipped_told"),
            calls_ok: self.boats.values().map(|boat| boat.calls_ok).sum(),
            calls_failed: self.boats.values().map(|boat| boat.calls_failed).sum(),
            calls_failed_elsewhere: self.failed_elsewhere,
            control: self.control.clone(),
            linked: self.linked.clone(),
            recovery: self.recovery.clone(),
            missions: self.missions.clone(),
            crashes: self.crashes.load(Ordering::Relaxed),
            ran,
        }
    }
}
