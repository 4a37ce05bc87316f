//! After all faults have ended, what anybody reports of its health reaches all.

use super::HEALTH_PERIOD;
use crate::sim::observe::{Checker, Observation, Seen};
use crate::sim::options::Options;
use crate::sim::world::NodeHandle;
use aldis_envelope::umaa::{HealthReport, Topic};
use aldis_envelope::{KeyHash, Monotonic};
use std::collections::{BTreeMap, BTreeSet};

/// What is reported of health, and who hears it.
#[derive(Debug)]
pub(super) struct Health {
    nodes: usize,
    healed: Option<Monotonic>,
    /// Instances that are published after the healing, and by whom.
    published: BTreeMap<KeyHash, NodeHandle>,
    heard: BTreeSet<(NodeHandle, KeyHash)>,
}

impl Health {
    pub(super) fn new(options: &Options) -> Self {
        Self { nodes: options.nodes, healed: None, published: BTreeMap::new(), heard: BTreeSet::new() }
    }
}

impl Checker for Health {
    fn name(&self) -> &'static str {
        "health"
    }

    fn observe(&mut self, observation: &Observation<'_>) -> Result<(), String> {
        if let Seen::Healed = observation.seen {
            self.healed = Some(observation.at);
        }
        let Some(healed) = self.healed else { return Ok(()) };
        let (Seen::Published(envelope) | Seen::Arrived(envelope)) = &observation.seen else { return Ok(()) };
        let (true, Some(instance)) =
            (envelope.message.label.descriptor() == HealthReport::NAME, &envelope.message.instance)
        else {
            return Ok(());
        };
        let settled = healed + 4 * HEALTH_PERIOD;
        match observation.seen {
            Seen::Arrived(_) => {
                self.heard.insert((observation.node, instance.hash));
            }
            // One that is published just before the end may still be on its way.
            _ if observation.at < settled => {
                self.published.insert(instance.hash, observation.node);
            }
            _ => {}
        }
        Ok(())
    }

    fn finish(&mut self) -> Vec<String> {
        let mut missing = Vec::new();
        let reporters: BTreeSet<_> = self.published.values().collect();
        if reporters.len() < self.nodes {
            missing.push(format!("{} of {} nodes reported their health", reporters.len(), self.nodes));
        }
        let nodes: BTreeSet<NodeHandle> = self.published.values().copied().collect();
        for (instance, by) in &self.published {
            for node in nodes.iter().filter(|node| *node != by) {
                if !self.heard.contains(&(*node, *instance)) {
                    missing.push(format!("{node} never heard of resource {instance} of {by}"));
                }
            }
        }
        missing
    }
}
