//! `aldis link emulate`: a bad link between two addresses of this machine.

use super::relay::Relay;
use crate::cli::exit::Failure;
use crate::cli::{print_line, run};
use aldis_services::sim::link::{Burst, Profile};
use serde_json::json;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Relay datagrams as a bad link would, until it is stopped (SIGINT or SIGTERM).
///
/// L1: 9.6 kbit/s, 600 ms, 30 % lost. L2: the same in bursts. L3: 2.4 kbit/s, 1.8 s, 10 %. L4: 1 Mbit/s, 60 ms, 2 %, with outages of
/// about 10 min. WiFi: 20 Mbit/s, 4 ms, 1 %. Both ways the same. What the profile says, options change.
#[derive(clap::Args)]
pub(super) struct Emulate {
    /// L1, L2, L3, L4 or WiFi.
    profile: String,
    /// Where datagrams are awaited.
    #[arg(long)]
    listen: SocketAddr,
    /// One end.
    #[arg(long)]
    a: SocketAddr,
    /// The other end. Default: whoever else sends something.
    #[arg(long)]
    b: Option<SocketAddr>,
    /// Draws the losses.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The percentage that is lost.
    #[arg(long)]
    loss: Option<f64>,
    /// Milliseconds from one end to the other.
    #[arg(long)]
    delay_ms: Option<u64>,
    /// Milliseconds that may be added to that: datagrams overtake one another.
    #[arg(long)]
    jitter_ms: Option<u64>,
    /// Bytes a second.
    #[arg(long)]
    rate: Option<u64>,
    /// The percentage that comes twice.
    #[arg(long)]
    twice: Option<f64>,
    /// The mean length of bursts of loss in milliseconds.
    #[arg(long)]
    burst_ms: Option<u64>,
    /// The mean length of outages in seconds; between two of them the link works as long.
    #[arg(long)]
    outage_s: Option<u64>,
    /// At the end, what passed as one JSON object.
    #[arg(long)]
    json: bool,
}

/// A profile by its name.
pub(in crate::cli) fn profile(name: &str) -> Result<Profile, Failure> {
    let names = Profile::ALL.map(|profile| profile.name).join(", ");
    Profile::named(name)
        .ok_or_else(|| Failure::Usage(format!("there is no link `{name}`: there are {names}")))
}

fn part(percent: f64, what: &str) -> Result<f64, Failure> {
    if (0.0..=100.0).contains(&percent) {
        return Ok(percent / 100.0);
    }
    Err(Failure::Usage(format!("--{what} {percent}: give a percentage from 0 to 100")))
}

impl Emulate {
    fn changed(&self) -> Result<Profile, Failure> {
        let mut profile = profile(&self.profile)?;
        profile.loss = self.loss.map_or(Ok(profile.loss), |percent| part(percent, "loss"))?;
        profile.twice = self.twice.map_or(Ok(profile.twice), |percent| part(percent, "twice"))?;
        profile.delay = self.delay_ms.map_or(profile.delay, Duration::from_millis);
        profile.jitter = self.jitter_ms.map_or(profile.jitter, Duration::from_millis);
        profile.rate = self.rate.unwrap_or(profile.rate).max(1);
        if let Some(mean) = self.burst_ms {
            profile.burst = Some(Burst { mean: Duration::from_millis(mean.max(1)) });
        }
        profile.outage = self.outage_s.map(Duration::from_secs).or(profile.outage);
        Ok(profile)
    }

    pub(super) fn run(self) -> Result<(), Failure> {
        let profile = self.changed()?;
        let failed = |why: std::io::Error| Failure::Failed(format!("the relay at {}: {why}", self.listen));
        let mut relay = Relay::new(&profile, self.seed, self.listen, (self.a, self.b)).map_err(failed)?;
        let passed = relay.passed();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = stop.clone();
        run::watch_signals(move || stop.store(true, Ordering::Relaxed))?;
        if !self.json {
            let at = relay.address().map_err(failed)?;
            print_line(format_args!("{} at {at}, seed {}", profile.name, self.seed));
        }
        relay.run(|| stopped.load(Ordering::Relaxed)).map_err(failed)?;
        let read = |numbers: &[std::sync::atomic::AtomicU64; 2]| {
            [0, 1].map(|end| numbers[end].load(Ordering::Relaxed))
        };
        print_line(json!({
            "profile": profile.name, "seed": self.seed, "datagrams": read(&passed.came), "bytes": read(&passed.bytes), "lost": read(&passed.lost),
        }));
        Ok(())
    }
}
