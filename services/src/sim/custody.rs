//! Whole nodes on both sides of a bad link are killed at moments of chance, with what was not synced lost or torn: no accepted command
//! is lost, none is handled twice.
//!
//! On each side there is a gateway with a journal on a simulated disk and a service that keeps a ledger on a persistent topic; and a
//! console, a node of its own on the bus of its side, that calls the ledger of the other side and is told what becomes of each call. A
//! call counts as accepted when its console was told so.

mod parties;

use super::disk::DiskFaults;
use super::link::Profile;
use super::observe::{Checker, Observation, Seen};
use super::world::{NodeHandle, World};
use crate::event::LinkId;
use crate::journal::JournalConfig;
use crate::link::CarrierId;
use parties::{Entry, LedgerFact, Side};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// What many crashes came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CrashReport {
    /// Crashes.
    pub points: u64,
    /// Of those, with an operation of the disk under way.
    pub during_a_write: u64,
    /// Of those, where the power failed: what was not synced was lost, whole or in part.
    pub power_losses: u64,
    /// Commands that were told as accepted.
    pub accepted: u64,
    /// Accepted, and never handled.
    pub lost: u64,
    /// Handled more than once, by the ledger of the service.
    pub twice: u64,
}

/// About how many crashes there are in a run.
const IN_A_RUN: u64 = 10;
/// A run lasts so long.
const RUN: Duration = Duration::from_secs(60);
/// How long commands have to arrive when all is mended.
const SETTLE: Duration = Duration::from_secs(600);
/// How soon the others notice that a node is gone.
const NOTICE: Duration = Duration::from_millis(50);

/// Kills one end or the other, or both, at `points` moments.
///
/// # Errors
/// Why a configuration cannot be.
pub fn crash(points: u64, seed: u64) -> Result<CrashReport, String> {
    let mut report = CrashReport::default();
    let mut run = 0;
    while report.points < points {
        run += 1;
        let seed = seed.wrapping_mul(1_000_003).wrapping_add(run);
        one_run(seed, (points - report.points).min(IN_A_RUN), DiskFaults::default(), &mut report)?;
    }
    Ok(report)
}

/// What the consoles were told and the ledgers hold.
#[derive(Debug, Default)]
struct Tally {
    accepted: BTreeSet<Entry>,
    handled: BTreeSet<Entry>,
    /// Of each entry how often its ledger has handled it, as its last start found it on disk.
    ledger: BTreeMap<Entry, u64>,
}

struct Watch(Arc<Mutex<Tally>>);

impl Checker for Watch {
    fn name(&self) -> &'static str {
        "custody"
    }

    fn observe(&mut self, observation: &Observation<'_>) -> Result<(), String> {
        let Seen::Fact(fact) = observation.seen else { return Ok(()) };
        let mut tally = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match fact.downcast() {
            Some(LedgerFact::Accepted(entry)) => drop(tally.accepted.insert(*entry)),
            Some(LedgerFact::Handled(entry)) => drop(tally.handled.insert(*entry)),
            Some(LedgerFact::Held(entry, times)) => drop(tally.ledger.insert(*entry, *times)),
            None => {}
        }
        Ok(())
    }
}

struct Run {
    world: World,
    random: fastrand::Rng,
    gateways: [NodeHandle; 2],
    tally: Arc<Mutex<Tally>>,
}

/// A minute of commands both ways with about ten crashes.
fn one_run(seed: u64, points: u64, disk: DiskFaults, report: &mut CrashReport) -> Result<(), String> {
    let mut run = Run::begin(seed, disk)?;
    let gap = RUN / (points as u32 + 1);
    for _ in 0..points {
        let pause = gap.mul_f64(run.random.f64() * 2.0);
        run.world.run_for(pause);
        run.crash_some(report);
    }
    run.settle(report);
    Ok(())
}

impl Run {
    fn begin(seed: u64, disk: DiskFaults) -> Result<Self, String> {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut world = World::new(seed, (Duration::from_millis(1), Duration::from_millis(5)));
        let tally = Arc::new(Mutex::new(Tally::default()));
        world.watch(Box::new(Watch(tally.clone())));
        let profile = Profile {
            rate: 4_000,
            delay: Duration::from_millis(random.u64(1..150)),
            loss: random.f64() * 0.4,
            ..Profile::L1
        };
        // Operations of the disk are slow enough to be caught in, and quick enough to be through.
        let latency = (Duration::ZERO, Duration::from_millis(random.u64(1..40)));
        let mut gateways = Vec::new();
        for side in Side::BOTH {
            let journal = JournalConfig { segment_bytes: 1 << 14, ..JournalConfig::new(random.u64(..)) };
            let config = side.gateway(&profile, &world.facts())?;
            gateways.push(world.add_with_journal(config, journal, latency)?);
        }
        for side in Side::BOTH {
            let gap = Duration::from_millis(random.u64(150..600));
            world.add(side.console(gap, RUN, &world.facts())?)?;
        }
        let gateways = [gateways[0], gateways[1]];
        world.partition(&[0, 1, 0, 1], Duration::ZERO);
        for gateway in gateways {
            world.set_disk(gateway, disk, None);
            world.restart(gateway);
        }
        world.join((gateways[0], LinkId(0)), (gateways[1], LinkId(0)), CarrierId(0), &profile);
        Ok(Self { world, random, gateways, tally })
    }

    fn crash_some(&mut self, report: &mut CrashReport) {
        let first = usize::from(self.random.bool());
        // Sometimes both ends are down.
        let both = self.random.u8(0..5) == 0;
        let victims: Vec<_> = [first, 1 - first].into_iter().take(if both { 2 } else { 1 }).collect();
        report.points += 1;
        for &victim in &victims {
            let power_loss = self.random.u8(0..4) > 0;
            report.power_losses += u64::from(power_loss);
            report.during_a_write += u64::from(self.world.disk_is_busy(self.gateways[victim]));
            self.world.crash(self.gateways[victim], power_loss, NOTICE);
        }
        let down = Duration::from_millis(self.random.u64(0..3_000));
        self.world.run_for(down);
        victims.iter().for_each(|&victim| self.world.restart(self.gateways[victim]));
    }

    /// Until all that was accepted is handled, or clearly never will be; then the ledgers are read from the disks.
    fn settle(mut self, report: &mut CrashReport) {
        let lock = |tally: &Mutex<Tally>| {
            let tally = tally.lock().unwrap_or_else(PoisonError::into_inner);
            tally.accepted.is_subset(&tally.handled)
        };
        let end = self.world.now().monotonic + RUN + SETTLE;
        self.world.run_for(RUN);
        while self.world.now().monotonic < end && !lock(&self.tally) {
            self.world.run_for(Duration::from_secs(5));
        }
        self.world.run_for(Duration::from_secs(20));
        self.tally.lock().unwrap_or_else(PoisonError::into_inner).ledger.clear();
        for gateway in self.gateways {
            self.world.crash(gateway, true, NOTICE);
            self.world.restart(gateway);
        }
        self.world.run_for(Duration::from_secs(5));
        let tally = self.tally.lock().unwrap_or_else(PoisonError::into_inner);
        report.accepted += tally.accepted.len() as u64;
        report.lost += tally.accepted.iter().filter(|entry| !tally.ledger.contains_key(entry)).count() as u64;
        report.twice += tally.ledger.values().filter(|times| **times > 1).count() as u64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_accepted_is_lost_and_nothing_is_handled_twice() {
        let report = crash(20, 5).unwrap();
        assert_eq!((report.points, report.lost, report.twice), (20, 0, 0), "{report:?}");
        assert!(report.during_a_write > 1 && report.accepted > 100, "{report:?}");
    }

    #[test]
    fn a_disk_that_lies_is_found_out() {
        // The measure itself: where a disk says that it has synced and has not, commands are lost.
        let mut report = CrashReport::default();
        let lying = DiskFaults { syncs_lie: 0.5, ..DiskFaults::default() };
        for seed in 0..3 {
            one_run(seed, 10, lying, &mut report).unwrap();
        }
        assert!(report.lost + report.twice > 0, "{report:?}");
    }
}
