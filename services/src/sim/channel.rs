//! A way for datagrams as a radio is one: it loses, delays, reorders and doubles, one way, at a rate.

use aldis_envelope::Monotonic;
use bytes::Bytes;
use std::time::Duration;

/// How a channel does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Profile {
    /// Bits per second. None: as fast as one likes.
    pub bits_per_s: Option<u64>,
    /// How long a datagram is on its way after its last bit was sent.
    pub delay: Duration,
    /// How much longer it may be, drawn for each. More than the time between two reorders them.
    pub jitter: Duration,
    /// The share that is lost, from 0 to 1.
    pub loss: f64,
    /// How long a loss lasts on average. Zero: each datagram is lost for itself.
    pub burst: Duration,
    /// The share that arrives twice.
    pub duplicates: f64,
    /// The most bytes of a datagram: larger ones do not go.
    pub mtu: usize,
    /// How many bytes may wait to be sent; beyond it they are lost.
    pub queue_bytes: usize,
}

impl Profile {
    /// A radio far away: 9.6 kbit/s, 600 ms there and back, 30 % lost.
    pub const L1: Self = Self {
        bits_per_s: Some(9_600),
        delay: Duration::from_millis(300),
        jitter: Duration::ZERO,
        loss: 0.30,
        burst: Duration::ZERO,
        duplicates: 0.0,
        mtu: 256,
        queue_bytes: 4_096,
    };
    /// As L1, with losses that last two seconds on average.
    pub const L2: Self = Self { burst: Duration::from_secs(2), ..Self::L1 };
    /// A satellite: 2.4 kbit/s, 1.8 s there and back, 10 % lost.
    pub const L3: Self =
        Self { bits_per_s: Some(2_400), delay: Duration::from_millis(900), loss: 0.10, ..Self::L1 };
    /// A good radio: 1 Mbit/s, 60 ms there and back, 2 % lost. Its outages are for the one who runs it.
    pub const L4: Self = Self {
        bits_per_s: Some(1_000_000),
        delay: Duration::from_millis(30),
        loss: 0.02,
        mtu: 1_200,
        queue_bytes: 65_536,
        ..Self::L1
    };
    /// WiFi: 20 Mbit/s, 4 ms there and back, 1 % lost.
    pub const WIFI: Self =
        Self { bits_per_s: Some(20_000_000), delay: Duration::from_millis(2), loss: 0.01, ..Self::L4 };
}

/// A channel one way.
#[derive(Debug, Clone)]
pub struct Channel {
    /// How it does; it may be changed at any time.
    pub profile: Profile,
    /// Nothing arrives while it is cut.
    pub is_cut: bool,
    random: fastrand::Rng,
    /// When the last bit of what waits has been sent.
    free_at: Monotonic,
    /// Whether a burst of losses is on, and until when that holds.
    burst: (bool, Monotonic),
}

impl Channel {
    /// A channel with its own chance.
    pub fn new(profile: Profile, seed: u64) -> Self {
        let random = fastrand::Rng::with_seed(seed);
        Self { profile, is_cut: false, random, free_at: Monotonic::START, burst: (false, Monotonic::START) }
    }

    /// When it has nothing to send any more.
    pub fn free_at(&self) -> Monotonic {
        self.free_at
    }

    /// Sends a datagram: when it arrives; never, once, or twice.
    pub fn send(&mut self, now: Monotonic, datagram: &Bytes) -> Vec<Monotonic> {
        let profile = self.profile;
        let begin = self.free_at.max(now);
        let takes = |bytes: usize| match profile.bits_per_s {
            Some(rate) => Duration::from_nanos(bytes as u64 * 8_000_000_000 / rate.max(1)),
            None => Duration::ZERO,
        };
        if datagram.len() > profile.mtu || begin - now > takes(profile.queue_bytes) {
            return Vec::new();
        }
        self.free_at = begin + takes(datagram.len());
        if self.is_cut || self.is_lost(self.free_at) {
            return Vec::new();
        }
        let copies = 1 + usize::from(self.random.f64() < profile.duplicates);
        (0..copies).map(|_| self.free_at + profile.delay + self.draw(profile.jitter)).collect()
    }

    fn draw(&mut self, most: Duration) -> Duration {
        Duration::from_nanos(self.random.u64(0..=most.as_nanos() as u64))
    }

    /// Bursts and the quiet between them have lengths drawn from exponential distributions, so that on average the share
    /// that is lost is as the profile says.
    fn is_lost(&mut self, at: Monotonic) -> bool {
        let Profile { loss, burst, .. } = self.profile;
        if burst.is_zero() || loss <= 0.0 || loss >= 1.0 {
            return self.random.f64() < loss;
        }
        while self.burst.1 <= at {
            let is_on = !self.burst.0;
            let mean = if is_on { burst } else { burst.mul_f64((1.0 - loss) / loss) };
            let length = mean.mul_f64(-(1.0 - self.random.f64()).ln());
            self.burst = (is_on, self.burst.1 + length.max(Duration::from_nanos(1)));
        }
        self.burst.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(milliseconds: u64) -> Monotonic {
        Monotonic::since_start(Duration::from_millis(milliseconds))
    }

    /// Sends one datagram each 300 ms and says which arrive.
    fn arrivals(profile: Profile, count: u64) -> Vec<Vec<Monotonic>> {
        let mut channel = Channel::new(profile, 1);
        let datagram = Bytes::from(vec![0; 256]);
        (0..count).map(|n| channel.send(at(n * 300), &datagram)).collect()
    }

    #[test]
    fn a_datagram_takes_its_bits_and_the_way() {
        let mut channel = Channel::new(Profile { loss: 0.0, ..Profile::L1 }, 1);
        let datagram = Bytes::from(vec![0; 120]);
        assert_eq!(channel.send(at(0), &datagram), [at(100 + 300)]);
        assert_eq!(channel.send(at(10), &datagram), [at(200 + 300)], "behind the first");
        assert_eq!(channel.free_at(), at(200));
        assert_eq!(channel.send(at(300), &Bytes::from(vec![0; 257])), [], "too large");
        let sent = (0..100).filter(|_| !channel.send(at(300), &datagram).is_empty()).count();
        assert_eq!(sent, 4096 / 120 + 1, "the queue holds so many");
        channel.is_cut = true;
        assert_eq!(channel.send(at(60_000), &datagram), []);
    }

    #[test]
    fn losses_come_as_often_as_said_alone_and_in_bursts() {
        for (profile, changes) in [(Profile::L1, 0.42), (Profile::L2, 0.06)] {
            let arrived = arrivals(profile, 100_000);
            let lost = arrived.iter().filter(|arrivals| arrivals.is_empty()).count() as f64 / 1e5;
            assert!((lost - 0.30).abs() < 0.02, "{lost}");
            let changed =
                arrived.windows(2).filter(|w| w[0].is_empty() != w[1].is_empty()).count() as f64 / 1e5;
            assert!((changed - changes).abs() < 0.03, "{changed}");
        }
    }

    #[test]
    fn jitter_reorders_and_some_come_twice() {
        let profile = Profile {
            bits_per_s: None,
            loss: 0.0,
            jitter: Duration::from_secs(1),
            duplicates: 0.1,
            ..Profile::L1
        };
        let arrived = arrivals(profile, 10_000);
        let twice = arrived.iter().filter(|arrivals| arrivals.len() == 2).count();
        assert!((900..1100).contains(&twice), "{twice}");
        assert!(arrived.windows(2).any(|w| w[1][0] < w[0][0]));
    }
}
