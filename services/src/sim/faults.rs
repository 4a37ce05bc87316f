//! Brings faults over a world as the options say, and ends them again.

use super::options::Options;
use super::world::{NodeHandle, World};
use aldis_envelope::Monotonic;
use std::collections::BTreeMap;
use std::time::Duration;

/// Something that begins or ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fault {
    SessionDrops,
    SessionOpens(NodeHandle),
    Partition,
    PartitionHeals,
    Crash,
    Restart(NodeHandle),
    Stall,
    StallEnds(NodeHandle),
    ClockStep,
}

/// What is to come.
pub(super) struct Faults {
    options: Options,
    random: fastrand::Rng,
    agenda: BTreeMap<(Monotonic, u64), Fault>,
    counter: u64,
}

impl Faults {
    /// The faults of a run.
    pub(super) fn new(options: Options, seed: u64) -> Self {
        let random = fastrand::Rng::with_seed(seed ^ 0x6661_756c_7473_2121);
        let mut faults = Self { options, random, agenda: BTreeMap::new(), counter: 0 };
        for fault in [Fault::SessionDrops, Fault::Partition, Fault::Crash, Fault::Stall, Fault::ClockStep] {
            faults.plan_next(Monotonic::START, fault);
        }
        faults
    }

    /// When the next one begins or ends.
    pub(super) fn next(&self) -> Option<Monotonic> {
        self.agenda.keys().next().map(|(at, _)| *at)
    }

    /// Does what is due.
    pub(super) fn act(&mut self, now: Monotonic, world: &mut World) {
        while let Some(first) = self.agenda.first_entry()
            && first.key().0 <= now
        {
            let fault = first.remove();
            self.plan_next(now, fault);
            self.carry_out(now, fault, world);
        }
    }

    /// Faults of a kind come as calls come to an exchange: the time between two is drawn from an exponential distribution.
    fn plan_next(&mut self, now: Monotonic, fault: Fault) {
        let faults = &self.options.faults;
        let every = match fault {
            Fault::SessionDrops => faults.session_drops,
            Fault::Partition => faults.partitions,
            Fault::Crash => faults.crashes,
            Fault::Stall => faults.stalls,
            Fault::ClockStep => faults.clock_steps,
            _ => None,
        };
        if let Some(every) = every {
            let wait = every.mul_f64(-(1.0 - self.random.f64()).ln());
            self.plan(now + wait, fault);
        }
    }

    fn plan(&mut self, at: Monotonic, fault: Fault) {
        self.counter += 1;
        self.agenda.insert((at, self.counter), fault);
    }

    fn lasts(&mut self) -> Duration {
        self.options.faults.lasts_at_most.mul_f64(self.random.f64())
    }

    fn carry_out(&mut self, now: Monotonic, fault: Fault, world: &mut World) {
        let nodes: Vec<_> = world.nodes().collect();
        let node = nodes[self.random.usize(0..nodes.len())];
        let end = now + self.lasts();
        let notice = self.options.notice;
        match fault {
            Fault::SessionDrops if world.is_running(node) && !world.is_deaf(node) => {
                world.drop_session(node, notice);
                self.plan(end.max(now + notice), Fault::SessionOpens(node));
            }
            Fault::Partition => {
                let sides: Vec<_> = nodes.iter().map(|_| self.random.u32(0..2)).collect();
                world.partition(&sides, notice);
                self.plan(end, Fault::PartitionHeals);
            }
            Fault::Crash if world.is_running(node) => {
                let power_loss = self.random.f64() < self.options.faults.power_losses;
                world.crash(node, power_loss, notice);
                self.plan(end, Fault::Restart(node));
            }
            Fault::Stall => {
                world.stall(node);
                self.plan(end, Fault::StallEnds(node));
            }
            Fault::ClockStep => {
                let offset = self.clock_offset();
                world.set_clock(node, offset);
            }
            Fault::SessionOpens(node) if world.is_deaf(node) => world.open_bus(node),
            Fault::PartitionHeals => world.partition(&vec![0; nodes.len()], notice),
            Fault::Restart(node) => world.restart(node),
            Fault::StallEnds(node) => world.resume(node),
            Fault::SessionDrops | Fault::SessionOpens(_) | Fault::Crash => {}
        }
    }

    /// How far a wall clock is wrong, in nanoseconds.
    pub(super) fn clock_offset(&mut self) -> i64 {
        let most = self.options.clock_offset_max.as_nanos() as i64;
        self.random.i64(-most..=most)
    }

    /// How much faster a clock goes, in parts per million.
    pub(super) fn drift(&mut self) -> i64 {
        let most = self.options.drift_ppm_max;
        self.random.i64(-most..=most)
    }
}
