//! A link that loses, delays, repeats and reorders, from a seed. The same model serves virtual time and a relay of datagrams.

use aldis_envelope::Monotonic;
use std::time::Duration;

/// Loss that comes in bursts: all is lost in them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Burst {
    /// How long a burst lasts on average.
    pub mean: Duration,
}

/// What a link does to datagrams, the same both ways.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Its name on the command line.
    pub name: &'static str,
    /// Bytes per second.
    pub rate: u64,
    /// From the end of a datagram at the sender to its end at the receiver.
    pub delay: Duration,
    /// The most that is added to the delay, drawn evenly. Datagrams overtake one another by it.
    pub jitter: Duration,
    /// The part that is lost.
    pub loss: f64,
    /// Whether the loss comes in bursts.
    pub burst: Option<Burst>,
    /// The part that comes twice.
    pub twice: f64,
    /// The longest datagram.
    pub mtu: usize,
    /// Bytes that wait for the link; what comes beyond is lost.
    pub queue: usize,
    /// How long the link's outages last, where it has them.
    pub outage: Option<Duration>,
}

const NONE: Duration = Duration::ZERO;

impl Profile {
    /// 9.6 kbit/s, 600 ms, 30 % lost one by one.
    pub const L1: Self = Self {
        name: "L1",
        rate: 1_200,
        delay: Duration::from_millis(300),
        jitter: NONE,
        loss: 0.3,
        burst: None,
        twice: 0.0,
        mtu: 256,
        queue: 4_096,
        outage: None,
    };
    /// As L1 with bursts of 2 s.
    pub const L2: Self = Self { name: "L2", burst: Some(Burst { mean: Duration::from_secs(2) }), ..Self::L1 };
    /// 2.4 kbit/s, 1.8 s, 10 %.
    pub const L3: Self =
        Self { name: "L3", rate: 300, delay: Duration::from_millis(900), loss: 0.1, ..Self::L1 };
    /// 1 Mbit/s, 60 ms, 2 %, with outages of 10 min.
    pub const L4: Self = Self {
        name: "L4",
        rate: 125_000,
        delay: Duration::from_millis(30),
        loss: 0.02,
        mtu: 1_200,
        queue: 65_536,
        outage: Some(Duration::from_secs(600)),
        ..Self::L1
    };
    /// 20 Mbit/s, 4 ms, 1 %.
    pub const WIFI: Self = Self {
        name: "WiFi",
        rate: 2_500_000,
        delay: Duration::from_millis(2),
        loss: 0.01,
        mtu: 1_400,
        queue: 262_144,
        ..Self::L1
    };
    /// All profiles.
    pub const ALL: [Self; 5] = [Self::L1, Self::L2, Self::L3, Self::L4, Self::WIFI];

    /// A profile by its name, in any case.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|profile| profile.name.eq_ignore_ascii_case(name))
    }

    /// The round trip without the datagrams' own length.
    pub fn round_trip(&self) -> Duration {
        self.delay * 2
    }
}

/// One direction of a link.
#[derive(Debug, Clone)]
pub struct Way {
    profile: Profile,
    random: fastrand::Rng,
    /// When the last datagram has left.
    busy_until: Monotonic,
    /// Whether the present time is in a burst, and until when.
    in_burst: bool,
    burst_until: Monotonic,
    /// Nothing passes.
    pub cut: bool,
    /// Datagrams that did not arrive.
    pub lost: u64,
}

impl Way {
    /// A direction of a link, drawn from a seed.
    pub fn new(profile: Profile, seed: u64) -> Self {
        let (random, start) = (fastrand::Rng::with_seed(seed), Monotonic::START);
        Self { profile, random, busy_until: start, in_burst: false, burst_until: start, cut: false, lost: 0 }
    }

    /// The profile that it follows.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// A datagram is sent; when it arrives, which may be never or twice.
    pub fn send(&mut self, now: Monotonic, bytes: usize) -> Vec<Monotonic> {
        let nanoseconds = bytes as u64 * 1_000_000_000 / self.profile.rate.max(1);
        let waiting = (self.busy_until - now).as_secs_f64() * self.profile.rate as f64;
        if waiting as usize + bytes > self.profile.queue || bytes > self.profile.mtu {
            self.lost += 1;
            return Vec::new();
        }
        self.busy_until = self.busy_until.max(now) + Duration::from_nanos(nanoseconds);
        let left = self.busy_until;
        if self.cut || self.loses(left) {
            self.lost += 1;
            return Vec::new();
        }
        let mut arrivals = vec![self.arrival(left)];
        if self.random.f64() < self.profile.twice {
            arrivals.push(self.arrival(left));
        }
        arrivals
    }

    fn arrival(&mut self, left: Monotonic) -> Monotonic {
        left + self.profile.delay + self.profile.jitter.mul_f64(self.random.f64())
    }

    fn loses(&mut self, at: Monotonic) -> bool {
        let Some(burst) = self.profile.burst else { return self.random.f64() < self.profile.loss };
        while self.burst_until <= at {
            self.in_burst = !self.in_burst;
            let loss = self.profile.loss.clamp(0.001, 0.999);
            let mean = if self.in_burst { burst.mean } else { burst.mean.mul_f64((1.0 - loss) / loss) };
            // Both kinds of time are drawn so that the past tells nothing of how long they go on.
            let drawn = mean.mul_f64(-(1.0 - self.random.f64()).ln());
            self.burst_until = self.burst_until + drawn.max(Duration::from_millis(1));
        }
        self.in_burst
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lost(profile: &Profile, seed: u64) -> (f64, f64) {
        let mut way = Way::new(profile.clone(), seed);
        let times = 40_000u64;
        let mut pairs = (0u64, 0u64);
        let mut before = false;
        for n in 0..times {
            let gone = way.send(Monotonic::since_start(Duration::from_millis(100 * n)), 60).is_empty();
            pairs.0 += u64::from(gone);
            pairs.1 += u64::from(gone && before);
            before = gone;
        }
        (pairs.0 as f64 / times as f64, pairs.1 as f64 / pairs.0 as f64)
    }

    #[test]
    fn losses_are_as_the_profile_says_and_bursts_hang_together() {
        let (part, after_a_loss) = lost(&Profile::L1, 1);
        assert!((part - 0.3).abs() < 0.01 && (after_a_loss - 0.3).abs() < 0.02, "{part} {after_a_loss}");
        let (part, after_a_loss) = lost(&Profile::L2, 1);
        assert!((part - 0.3).abs() < 0.05 && after_a_loss > 0.9, "{part} {after_a_loss}");
    }

    #[test]
    fn a_way_has_a_rate_a_queue_and_an_end() {
        let mut way = Way::new(Profile { loss: 0.0, ..Profile::L1 }, 7);
        let at = |milliseconds| Monotonic::since_start(Duration::from_millis(milliseconds));
        assert_eq!(way.send(at(0), 120), [at(400)]);
        assert_eq!(way.send(at(0), 120), [at(500)]);
        assert!(way.send(at(0), 257).is_empty());
        let kept = (0..100).filter(|_| !way.send(at(0), 240).is_empty()).count();
        assert_eq!(kept, (4_096 - 240) / 240);
        way.cut = true;
        assert!(way.send(at(60_000), 10).is_empty());
    }

    #[test]
    fn the_same_seed_draws_the_same_link() {
        let profile = Profile { jitter: Duration::from_millis(50), twice: 0.1, ..Profile::L2 };
        let run = |seed| {
            let mut way = Way::new(profile.clone(), seed);
            (0..500)
                .flat_map(|n| way.send(Monotonic::since_start(Duration::from_millis(90 * n)), 50))
                .collect::<Vec<_>>()
        };
        assert_eq!(run(5), run(5));
        assert_ne!(run(5), run(6));
    }
}
