//! A start has a larger number than those before it, or its envelopes would be taken for old ones.

use crate::journal::JournalEvent;
use crate::sim::observe::{Checker, Observation, Seen};
use crate::sim::world::NodeHandle;
use aldis_envelope::BootId;
use std::collections::BTreeMap;

/// The numbers that machines have had.
#[derive(Debug, Default)]
pub(super) struct Boots {
    last: BTreeMap<NodeHandle, BootId>,
    /// The last boot id of each, and whether what it is counted from is on disk.
    boots: BTreeMap<NodeHandle, (BootId, bool)>,
    /// Whether the number of the present start is on disk.
    kept: BTreeMap<NodeHandle, bool>,
}

impl Checker for Boots {
    fn name(&self) -> &'static str {
        "boots"
    }

    fn observe(&mut self, observation: &Observation<'_>) -> Result<(), String> {
        let node = observation.node;
        match &observation.seen {
            Seen::Journal(JournalEvent::RecoveredAll(recovered)) => {
                let was_kept = self.kept.insert(node, recovered.is_kept).unwrap_or(true);
                let last = self.last.insert(node, BootId(recovered.start)).unwrap_or(BootId(0));
                if recovered.start <= last.0 && (was_kept || recovered.start < last.0) {
                    return Err(format!("{node} starts with {} after {last:?}", recovered.start));
                }
            }
            Seen::Journal(JournalEvent::Resumed) => {
                self.kept.insert(node, true);
            }
            Seen::Journal(JournalEvent::Unusable(why)) => return Err(format!("{node}: {why}")),
            Seen::Journal(JournalEvent::Written { .. }) => {
                self.boots.entry(node).and_modify(|(_, is_counted)| *is_counted = true);
            }
            Seen::Started(boot) => {
                let (last, is_counted) = self.boots.get(&node).copied().unwrap_or((BootId(0), false));
                if is_counted && *boot < last {
                    return Err(format!("{node} starts as {boot:?} after {last:?}"));
                }
                self.boots.insert(node, (*boot, is_counted));
            }
            _ => {}
        }
        Ok(())
    }
}
