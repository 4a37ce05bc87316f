//! Runs a seed: first with faults, then without, and says what was wrong.

use super::faults::Faults;
use super::observe::{Checker, Facts, Violation};
use super::options::Options;
use super::world::{NodeHandle, World};
use crate::journal::JournalConfig;
use crate::node::NodeConfig;
use std::fmt;
use std::time::Duration;

/// Which nodes there are, what they do, and what must hold.
pub trait Workload {
    /// Its name.
    fn name(&self) -> &'static str;

    /// The nodes of a run. Their services tell facts, where checkers need them; `random` is this workload's own chance.
    fn nodes(&self, options: &Options, facts: &Facts, random: &mut fastrand::Rng) -> Vec<NodeConfig>;

    /// Who watches the run.
    fn checkers(&self, options: &Options) -> Vec<Box<dyn Checker>>;

    /// Called when all machines are there, before anything happens: for bridges' peers and the like.
    fn begin(&self, _world: &mut World, _nodes: &[NodeHandle]) {}
}

/// What came of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// What it was drawn from.
    pub seed: u64,
    /// What it was like.
    pub options: Options,
    /// What must not be and was seen.
    pub violations: Vec<Violation>,
    /// The time that passed in the world.
    pub lasted: Duration,
    /// How much happened.
    pub events: u64,
    /// A hash of everything that happened and of when it did: the same for the same seed, options and program.
    pub hash: u64,
    /// The end of what happened, where something was wrong.
    pub trace: String,
}

/// The seed with what it was like, and what was wrong.
impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "seed {}: {}", self.seed, self.options)?;
        self.violations.iter().try_for_each(|violation| write!(f, "\n  {violation}"))
    }
}

/// Runs a workload with the options of a seed, or with others.
///
/// # Errors
/// Why a configuration of the workload cannot be.
pub fn run(workload: &dyn Workload, seed: u64, options: Options) -> Result<Report, String> {
    let mut world = World::new(seed, options.delay);
    let mut faults = Faults::new(options, seed);
    let mut random = fastrand::Rng::with_seed(seed ^ 0x776f_726b_6c6f_6164);
    workload.checkers(&options).into_iter().for_each(|checker| world.watch(checker));
    let configs = workload.nodes(&options, &world.facts(), &mut random);
    let mut nodes = Vec::new();
    for config in configs {
        let journal = JournalConfig { segment_bytes: 1 << 14, ..JournalConfig::new(random.u64(..)) };
        let node = world.add_with_journal(config, journal, options.disk_latency)?;
        world.set_drift(node, faults.drift());
        let offset = faults.clock_offset();
        world.set_clock(node, offset);
        world.set_disk(node, options.faults.disk, None);
        nodes.push(node);
    }
    workload.begin(&mut world, &nodes);
    nodes.iter().for_each(|&node| world.restart(node));
    let faulty = &options.faults;
    world.set_bus_faults(faulty.sample_loss, faulty.reordering, faulty.duplication);
    safety(&mut world, &mut faults, options.safety);
    if world.violations().is_empty() {
        world.heal();
        world.run_for(options.liveness);
    }
    let trace = if world.violations().is_empty() { None } else { Some(world.print_trace()) };
    if world.violations().is_empty() {
        world.finish();
    }
    let (events, hash) = world.trace();
    let violations = world.violations().to_vec();
    let trace =
        if violations.is_empty() { String::new() } else { trace.unwrap_or_else(|| world.print_trace()) };
    let lasted = world.now().monotonic.elapsed();
    Ok(Report { seed, options, violations, lasted, events, hash, trace })
}

/// The phase with faults.
fn safety(world: &mut World, faults: &mut Faults, lasts: Duration) {
    let end = world.now().monotonic + lasts;
    while world.violations().is_empty() {
        let now = world.now().monotonic;
        let next = faults.next().map_or(end, |at| at.min(end));
        world.run_for(next - now);
        if next == end {
            return;
        }
        faults.act(next, world);
    }
}
