//! Swarm options: which faults a run has and how strong they are, drawn from its seed.

use super::disk::DiskFaults;
use std::fmt;
use std::time::Duration;

/// What goes wrong in a run. None: never.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FaultOptions {
    /// A session drops about as often.
    pub session_drops: Option<Duration>,
    /// The bus is divided about as often.
    pub partitions: Option<Duration>,
    /// A node crashes about as often.
    pub crashes: Option<Duration>,
    /// The share of crashes in which the power is lost, from 0 to 1; in the others the process alone ends.
    pub power_losses: f64,
    /// A machine stalls about as often.
    pub stalls: Option<Duration>,
    /// A wall clock steps about as often.
    pub clock_steps: Option<Duration>,
    /// What the disks do wrong.
    pub disk: DiskFaults,
    /// The share of samples that the bus drops because somebody does not keep up.
    pub sample_loss: f64,
    /// The share of samples that the bus lets others overtake.
    pub reordering: f64,
    /// The share of samples that the bus delivers twice.
    pub duplication: f64,
    /// How long a fault lasts at the most.
    pub lasts_at_most: Duration,
}

/// What a run is like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// How many nodes there are.
    pub nodes: usize,
    /// Delays on the bus.
    pub delay: (Duration, Duration),
    /// How long a lost session or token stays unnoticed.
    pub notice: Duration,
    /// How long an operation of a disk takes.
    pub disk_latency: (Duration, Duration),
    /// How far wall clocks are wrong at the most.
    pub clock_offset_max: Duration,
    /// How much faster or slower clocks go at the most, in parts per million.
    pub drift_ppm_max: i64,
    /// What goes wrong.
    pub faults: FaultOptions,
    /// How long the phase with faults lasts.
    pub safety: Duration,
    /// How long everything may take to come right after it.
    pub liveness: Duration,
}

impl Options {
    /// A quiet run: everything works.
    pub fn quiet() -> Self {
        Self {
            nodes: 3,
            delay: (Duration::from_millis(1), Duration::from_millis(5)),
            notice: Duration::from_secs(1),
            disk_latency: (Duration::from_micros(100), Duration::from_millis(20)),
            clock_offset_max: Duration::ZERO,
            drift_ppm_max: 0,
            faults: FaultOptions::default(),
            safety: Duration::from_secs(60),
            liveness: Duration::from_secs(60),
        }
    }

    /// The options of a seed. Each fault is on in half of all runs: one that is always on would hide what others find.
    pub fn draw(seed: u64) -> Self {
        // Apart from the world's own chance, so that options may be overridden without changing it.
        let mut draw = Draw(fastrand::Rng::with_seed(seed ^ 0x6f70_7469_6f6e_7321));
        let slowest = draw.seconds(0.001, 0.5);
        let faults = FaultOptions {
            session_drops: draw.maybe(10.0, 200.0),
            partitions: draw.maybe(10.0, 200.0),
            crashes: draw.maybe(10.0, 200.0),
            power_losses: draw.0.f64(),
            stalls: draw.maybe(10.0, 200.0),
            clock_steps: draw.maybe(20.0, 200.0),
            disk: DiskFaults {
                sync_fails: draw.share(0.001, 0.1),
                write_fails: draw.share(0.001, 0.1),
                ..DiskFaults::default()
            },
            sample_loss: draw.share(0.0001, 0.05),
            reordering: 0.0,
            duplication: 0.0,
            lasts_at_most: draw.seconds(2.0, 60.0),
        };
        Self {
            nodes: draw.0.usize(2..=7),
            delay: (slowest / 20, slowest),
            notice: draw.seconds(0.05, 10.0),
            disk_latency: (Duration::from_micros(50), draw.seconds(0.0002, 0.2)),
            clock_offset_max: if draw.0.bool() { draw.seconds(0.1, 600.0) } else { Duration::ZERO },
            drift_ppm_max: if draw.0.bool() { draw.0.i64(1..=500) } else { 0 },
            faults,
            safety: Duration::from_secs(120),
            liveness: Duration::from_secs(90),
        }
    }
}

/// Draws numbers whose size is as uncertain as the number itself.
struct Draw(fastrand::Rng);

impl Draw {
    fn between(&mut self, least: f64, most: f64) -> f64 {
        least * (most / least).powf(self.0.f64())
    }

    /// Whole microseconds, so that a run can be told in words.
    fn seconds(&mut self, least: f64, most: f64) -> Duration {
        Duration::from_micros((self.between(least, most) * 1e6) as u64)
    }

    fn maybe(&mut self, least: f64, most: f64) -> Option<Duration> {
        let seconds = self.seconds(least, most);
        self.0.bool().then_some(seconds)
    }

    fn share(&mut self, least: f64, most: f64) -> f64 {
        let share = self.between(least, most);
        if self.0.bool() { share } else { 0.0 }
    }
}

/// In one line: what is on, and how strong.
impl fmt::Display for Options {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { nodes, delay, notice, disk_latency, clock_offset_max, drift_ppm_max, faults, .. } = self;
        write!(
            f,
            "nodes={nodes} delay={:.1?}..{:.1?} notice={notice:.1?} disk=..{:.1?}",
            delay.0, delay.1, disk_latency.1
        )?;
        for (name, every) in [
            ("session_drops", faults.session_drops),
            ("partitions", faults.partitions),
            ("crashes", faults.crashes),
            ("stalls", faults.stalls),
            ("clock_steps", faults.clock_steps),
        ] {
            if let Some(every) = every {
                write!(f, " {name}={every:.0?}")?;
            }
        }
        for (name, share) in [
            ("power_losses", faults.power_losses),
            ("sync_fails", faults.disk.sync_fails),
            ("write_fails", faults.disk.write_fails),
            ("sample_loss", faults.sample_loss),
            ("reordering", faults.reordering),
            ("duplication", faults.duplication),
        ] {
            if share > 0.0 {
                write!(f, " {name}={:.2}%", share * 100.0)?;
            }
        }
        if !clock_offset_max.is_zero() {
            write!(f, " clock_offset={clock_offset_max:.1?}")?;
        }
        if *drift_ppm_max > 0 {
            write!(f, " drift={drift_ppm_max}ppm")?;
        }
        write!(f, " lasts={:.0?}", faults.lasts_at_most)
    }
}
