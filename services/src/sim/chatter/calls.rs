//! A call ends once: with answers, or with the reason why there are none.

use super::{CALL_WITHIN, ChatterFact, Target};
use crate::sim::observe::{Checker, Observation, Seen};
use crate::sim::options::Options;
use crate::sim::world::NodeHandle;
use aldis_envelope::{CallId, Monotonic, Source};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// A call that is open.
#[derive(Debug)]
struct Open {
    to: Target,
    begun: Monotonic,
    answered: BTreeSet<Source>,
}

/// Follows all calls.
#[derive(Debug)]
pub(super) struct Calls {
    open: BTreeMap<(NodeHandle, Source, CallId), Open>,
    /// How long after its begin a call may still be open: clocks drift, and machines stall.
    patience: Duration,
    /// How long after all faults have ended everybody is there for sure.
    settling: Duration,
    healed: Option<Monotonic>,
    answered_since: u64,
}

impl Calls {
    pub(super) fn new(options: &Options) -> Self {
        let stalls =
            if options.faults.stalls.is_some() { options.faults.lasts_at_most } else { Duration::ZERO };
        let patience = CALL_WITHIN + stalls + Duration::from_secs(1);
        let settling = Duration::from_secs(10) + 20 * options.disk_latency.1 + 4 * options.delay.1;
        Self { open: BTreeMap::new(), patience, settling, healed: None, answered_since: 0 }
    }

    fn has_settled(&self, at: Monotonic) -> bool {
        self.healed.is_some_and(|healed| at > healed + self.settling)
    }

    fn fact(&mut self, node: NodeHandle, at: Monotonic, fact: &ChatterFact) -> Result<(), String> {
        match fact {
            ChatterFact::Calls { caller, id, to } => {
                let open = Open { to: *to, begun: at, answered: BTreeSet::new() };
                let before = self.open.insert((node, *caller, *id), open);
                before.map_or(Ok(()), |_| Err(format!("{caller} opens {id:?} twice")))
            }
            ChatterFact::Answer { caller, id, from } => {
                let open = self.open.get_mut(&(node, *caller, *id));
                let open = open.ok_or_else(|| format!("{caller} hears of {id:?}, which is not open"))?;
                if open.answered.insert(*from) {
                    Ok(())
                } else {
                    Err(format!("{caller} hears two answers of {from} to {id:?}"))
                }
            }
            ChatterFact::CallEnds { caller, id, outcome } => {
                let open = self.open.remove(&(node, *caller, *id));
                let open = open.ok_or_else(|| format!("{caller}: {id:?} ends twice, or never began"))?;
                if outcome.is_ok() == open.answered.is_empty() {
                    return Err(format!("{caller}: {id:?} ends {outcome:?} after {:?}", open.answered));
                }
                let must_be_answered = matches!(open.to, Target::Echo(to) if to.entity != caller.entity)
                    && self.has_settled(open.begun);
                self.answered_since += u64::from(must_be_answered);
                match outcome {
                    Err(why) if must_be_answered => Err(format!(
                        "{caller}: all faults have ended, and {id:?} to {:?} ends: {why}",
                        open.to
                    )),
                    _ => Ok(()),
                }
            }
            ChatterFact::Tick { .. } => Ok(()),
        }
    }
}

impl Checker for Calls {
    fn name(&self) -> &'static str {
        "calls"
    }

    fn observe(&mut self, observation: &Observation<'_>) -> Result<(), String> {
        let (node, at) = (observation.node, observation.at);
        match &observation.seen {
            Seen::Ended(_) => self.open.retain(|(of, ..), _| *of != node),
            Seen::Healed => self.healed = Some(at),
            Seen::Fact(fact) => {
                if let Some(fact) = fact.downcast() {
                    self.fact(node, at, fact)?;
                }
            }
            _ => {}
        }
        let late = self.open.iter().find(|(_, open)| open.begun + self.patience < at);
        late.map_or(Ok(()), |((node, caller, id), open)| {
            Err(format!("{node}: {id:?} of {caller} to {:?} is open since {:?}", open.to, open.begun))
        })
    }

    fn finish(&mut self) -> Vec<String> {
        let none = self.answered_since == 0;
        none.then(|| "no call was answered after all faults had ended".to_owned()).into_iter().collect()
    }
}
