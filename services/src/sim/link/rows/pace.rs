//! The pace: how long commands wait for it, that no more goes out than is allowed, and how little when there is nothing to say.

use super::{Pair, SHORE, Setting, VEHICLE};
use crate::link::{Class, Event, GONE_AFTER};
use crate::sim::link::load::{bulk, command, percentile, state};
use aldis_envelope::Monotonic;
use std::time::Duration;

/// G7: p99.9 of the seconds that a command waits before its first byte goes out, beside ten times the rate of all else, with frames
/// of at most `mtu` bytes.
pub(in crate::sim::link) fn queueing(setting: &Setting, count: u64, mtu: usize) -> f64 {
    let mut setting = setting.clone();
    setting.profile.mtu = mtu;
    let mut pair = setting.warm_pair();
    let mut random = fastrand::Rng::with_seed(setting.seed ^ 0x6737);
    let (mut waits, mut sequence) = (Vec::new(), 0);
    for number in 1..=count {
        fill(&mut pair, Duration::from_millis(random.u64(1_000..4_000)), &mut sequence);
        let at = pair.world.now();
        let copies = pair.world.link(pair.shore).counters().command_copies;
        let lifespan = Duration::from_secs(60);
        pair.world.offer(pair.shore, command(SHORE, VEHICLE, number, at.elapsed(), lifespan), Class::Command);
        while pair.world.link(pair.shore).counters().command_copies == copies {
            pair.world.run_for(Duration::from_millis(1));
        }
        waits.push((pair.world.now() - at).as_secs_f64());
    }
    percentile(&mut waits, 0.999)
}

fn fill(pair: &mut Pair, time: Duration, sequence: &mut u64) {
    let end = pair.world.now() + time;
    while pair.world.now() < end {
        *sequence += 1;
        let at = pair.world.now().elapsed();
        for instance in 0..10 {
            pair.world.offer(pair.shore, state(SHORE, instance, *sequence, at, 48), Class::State);
        }
        if pair.world.link(pair.shore).waiting().2 == 0 {
            pair.world.offer(pair.shore, bulk(SHORE, *sequence, at, 20_000), Class::Bulk);
        }
        pair.world.run_until(end.min(pair.world.now() + Duration::from_millis(150)));
    }
}

/// G12: the most bytes in any ten seconds against the rate, in bytes over it, and the part of the rate that is used under a backlog.
pub(in crate::sim::link) fn budget(setting: &Setting, seconds: u64) -> (i64, f64) {
    let mut pair = setting.pair();
    pair.world.trace = true;
    pair.world.run_for(Duration::from_secs(30));
    let mut sequence = 0;
    let start = pair.world.now();
    let before = pair.world.bytes(pair.shore);
    let mut number = 0;
    while pair.world.now() - start < Duration::from_secs(seconds) {
        number += 1;
        let at = pair.world.now().elapsed();
        let lifespan = Duration::from_secs(60);
        pair.world.offer(pair.shore, command(SHORE, VEHICLE, number, at, lifespan), Class::Command);
        fill(&mut pair, Duration::from_secs(1), &mut sequence);
    }
    let used = (pair.world.bytes(pair.shore) - before) as f64 / (setting.profile.rate * seconds) as f64;
    let frames = pair.world.sent(pair.shore);
    let allowed = 10 * setting.profile.rate as i64;
    let window = Duration::from_secs(10);
    let (mut sum, mut first, mut worst) = (0i64, 0, i64::MIN);
    for (at, bytes) in frames {
        sum += *bytes as i64;
        while *at - frames[first].0 >= window {
            sum -= frames[first].1 as i64;
            first += 1;
        }
        worst = worst.max(sum - allowed);
    }
    (worst, used)
}

/// What G11 measures.
#[derive(Debug, Clone, Copy)]
pub(in crate::sim::link) struct Idle {
    pub(in crate::sim::link) bytes_per_second: f64,
    pub(in crate::sim::link) frames_per_second: f64,
    pub(in crate::sim::link) false_alarms_per_hour: f64,
    /// Seconds until a cut is told, the most.
    pub(in crate::sim::link) detection: f64,
    pub(in crate::sim::link) silent_bytes: u64,
}

/// G11: hours in which nobody has anything to say, then a cut, then silent mode.
pub(in crate::sim::link) fn idle(setting: &Setting, hours: u64) -> Idle {
    let mut pair = setting.warm_pair();
    let (bytes, frames) = (pair.bytes(), pair.frames());
    let (mut alarms, mut heard) = (0, true);
    let step = Duration::from_millis(200);
    let start = pair.world.now();
    while pair.world.now() - start < Duration::from_secs(3_600 * hours) {
        pair.world.run_for(step);
        let now_heard = pair.world.link(pair.shore).is_heard();
        alarms += u64::from(heard && !now_heard);
        heard = now_heard;
    }
    let bytes_per_second = (pair.bytes() - bytes) as f64 / (3_600 * hours) as f64;
    let frames_per_second = (pair.frames() - frames) as f64 / (3_600 * hours) as f64;
    pair.world.cut_all(pair.shore, true);
    let cut: Monotonic = pair.world.now();
    while pair.world.link(pair.shore).is_heard() && pair.world.now() - cut < GONE_AFTER * 3 {
        pair.world.run_for(step);
    }
    let detection = (pair.world.now() - cut).as_secs_f64();
    pair.world.cut_all(pair.shore, false);
    for port in [pair.shore, pair.vehicle] {
        pair.world.give(port, vec![Event::Silent(true)]);
    }
    let before = pair.bytes();
    pair.world.run_for(Duration::from_secs(3_600));
    let silent_bytes = pair.bytes() - before;
    let false_alarms_per_hour = alarms as f64 / hours as f64;
    Idle { bytes_per_second, frames_per_second, false_alarms_per_hour, detection, silent_bytes }
}
