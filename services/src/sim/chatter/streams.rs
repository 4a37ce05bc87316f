//! Streams come in order, gaps are told, and services hear just what is new.

use super::{ChatterFact, TICK};
use crate::sim::observe::{Checker, Observation, Seen};
use crate::sim::options::Options;
use crate::sim::world::NodeHandle;
use aldis_envelope::{Address, BootId, EntityId, Envelope, Monotonic, Source, Wall};
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// What a node must think of a stream.
#[derive(Debug)]
struct Follow {
    boot: BootId,
    last: u64,
    /// When it last heard of it.
    heard: Monotonic,
}

type Stream = (EntityId, Source, Address);

/// What was heard of a ticker: its life, and its last number.
type Ticks = BTreeMap<(Source, Source), (Wall, u64)>;

/// What one node hears.
#[derive(Debug, Default)]
struct Hearer {
    streams: BTreeMap<Stream, Follow>,
    /// Samples that are missing, by our own count.
    missing: u64,
    /// Samples that were old.
    old: u64,
    /// Ticks that reached it and are to be heard by its service: source, and whether samples are missing before.
    ticks_due: VecDeque<(Source, bool)>,
    ticks: Ticks,
}

/// Follows the streams of all nodes.
#[derive(Debug)]
pub(super) struct Streams {
    hearers: BTreeMap<NodeHandle, Hearer>,
    healed: Option<Monotonic>,
    settling: Duration,
}

impl Streams {
    pub(super) fn new(options: &Options) -> Self {
        let settling = Duration::from_secs(10) + 20 * options.disk_latency.1 + 4 * options.delay.1;
        Self { hearers: BTreeMap::new(), healed: None, settling }
    }

    fn arrived(&mut self, node: NodeHandle, at: Monotonic, envelope: &Envelope) -> Result<(), String> {
        let (stamp, label) = (&envelope.stamp, &envelope.message.label);
        if label.descriptor().starts_with("aldis.dds.") {
            // What nodes tell one another is no stream: it is numbered all together.
            return Ok(());
        }
        let hearer = self.hearers.entry(node).or_default();
        let stream = (stamp.node, label.source(), label.address.clone());
        let mut missing = 0;
        match hearer.streams.get_mut(&stream) {
            Some(follow) if (stamp.boot, stamp.sequence) <= (follow.boot, follow.last) => {
                hearer.old += 1;
                return Ok(());
            }
            Some(follow) => {
                if follow.boot == stamp.boot {
                    missing = stamp.sequence - follow.last - 1;
                }
                let since = self.healed.is_some_and(|healed| follow.heard > healed + self.settling);
                // What is addressed to one node is numbered for it, but a session may be up on one side before the other.
                if missing > 0 && since {
                    return Err(format!(
                        "{node} misses {missing} of {stream:?} though all faults have ended"
                    ));
                }
                *follow = Follow { boot: stamp.boot, last: stamp.sequence, heard: at };
            }
            None => {
                let follow = Follow { boot: stamp.boot, last: stamp.sequence, heard: at };
                hearer.streams.insert(stream, follow);
            }
        }
        hearer.missing += missing;
        if label.descriptor() == TICK {
            hearer.ticks_due.push_back((label.source(), missing > 0));
        }
        Ok(())
    }

    fn tick(
        &mut self,
        node: NodeHandle,
        by: Source,
        from: Source,
        life: Wall,
        number: u64,
    ) -> Result<(), String> {
        let hearer = self.hearers.entry(node).or_default();
        let Some((due, is_gap)) = hearer.ticks_due.pop_front() else {
            return Err(format!("{by} hears a tick of {from} that was not new"));
        };
        if due != from {
            return Err(format!("{by} hears a tick of {from}, one of {due} came first"));
        }
        let before = hearer.ticks.insert((by, from), (life, number));
        match before {
            Some((same, last)) if same == life && number != last + 1 && !(is_gap && number > last) => {
                Err(format!("{by} hears tick {number} of {from} after {last}, and no gap was told"))
            }
            _ => Ok(()),
        }
    }
}

impl Checker for Streams {
    fn name(&self) -> &'static str {
        "streams"
    }

    fn observe(&mut self, observation: &Observation<'_>) -> Result<(), String> {
        let node = observation.node;
        match &observation.seen {
            Seen::Healed => self.healed = Some(observation.at),
            Seen::Arrived(envelope) => return self.arrived(node, observation.at, envelope),
            Seen::Fact(fact) => {
                if let Some(ChatterFact::Tick { by, from, life, number }) = fact.downcast() {
                    return self.tick(node, *by, *from, *life, *number);
                }
            }
            Seen::Ended(counters) => {
                let hearer = self.hearers.remove(&node).unwrap_or_default();
                let told = counters.lost + counters.skipped_told + counters.missed_offline;
                if (told, counters.duplicates) != (hearer.missing, hearer.old) {
                    return Err(format!(
                        "{node} counts {told} missing and {} old samples, {} and {} were",
                        counters.duplicates, hearer.missing, hearer.old
                    ));
                }
                if !hearer.ticks_due.is_empty() {
                    return Err(format!("{node}: {:?} were not heard by its service", hearer.ticks_due));
                }
            }
            _ => {}
        }
        Ok(())
    }
}
