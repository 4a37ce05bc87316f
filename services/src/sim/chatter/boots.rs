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
            Seen::Started(boot) if self.last.get(&node) != Some(boot) => {
                return Err(format!(
                    "{node} starts as {boot:?}, its journal said {:?}",
                    self.last.get(&node)
                ));
            }
            _ => {}
        }
        Ok(())
    }
}
