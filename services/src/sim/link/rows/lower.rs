//! States and bulk: how old what is held is, how soon it is whole again after an outage, how fast a recording passes.

use super::{SHORE, Setting, VEHICLE};
use crate::link::Class;
use crate::sim::link::load::{bulk as bulk_message, command, mean, percentile, state};
use crate::sim::link::world::What;
use aldis_envelope::Monotonic;
use std::collections::BTreeMap;
use std::time::Duration;

/// What G5 measures.
#[derive(Debug, Clone, Copy)]
pub(in crate::sim::link) struct Resync {
    pub(in crate::sim::link) seconds: f64,
    /// Seconds until the sender has heard the peer again.
    pub(in crate::sim::link) heard: f64,
    /// Bytes forward until the last sample arrived.
    pub(in crate::sim::link) until_last: f64,
    pub(in crate::sim::link) forward: f64,
    pub(in crate::sim::link) both: f64,
}

/// G5: 400 instances of 24 bytes; the part `changed` of them changes during ten minutes without a link.
pub(in crate::sim::link) fn resync(setting: &Setting, changed: f64) -> Resync {
    let mut pair = setting.warm_pair();
    let mut random = fastrand::Rng::with_seed(setting.seed ^ 0x6735);
    let mut sequences: BTreeMap<i64, u64> = BTreeMap::new();
    let mut sequence = 0;
    let mut offer = |pair: &mut super::Pair, instance: i64, sequences: &mut BTreeMap<i64, u64>| {
        sequence += 1;
        sequences.insert(instance, sequence);
        let at = pair.world.now().elapsed();
        // Ten vehicles, each a node with a stream of its own, whose numbers its forty instances share.
        let vehicle = 400 + instance as u64 / 40;
        pair.world.offer(pair.vehicle, state(vehicle, instance, sequence / 10 + 1, at, 24), Class::State);
    };
    for instance in 0..400 {
        offer(&mut pair, instance, &mut sequences);
    }
    while !pair.world.link(pair.vehicle).is_settled() {
        pair.world.run_for(Duration::from_secs(1));
    }
    pair.world.run_for(Duration::from_secs(20));
    pair.world.cut_all(pair.shore, true);
    let mut moments: Vec<(u64, i64)> =
        (0..400).map(|instance| (random.u64(5_000..590_000), instance)).collect();
    moments.truncate((400.0 * changed) as usize);
    moments.sort_unstable();
    let cut = pair.world.now();
    for (moment, instance) in moments {
        pair.world.run_until(cut + Duration::from_millis(moment));
        offer(&mut pair, instance, &mut sequences);
    }
    pair.world.run_until(cut + Duration::from_millis(600_000 + random.u64(0..2_000)));
    pair.world.cut_all(pair.shore, false);
    pair.world.take_seen();
    let (there, back) = (pair.world.bytes(pair.vehicle), pair.world.bytes(pair.shore));
    let start = pair.world.now();
    let (mut last, mut heard, mut until_last) = (start, None, 0);
    let mut settled = start;
    let mut bytes = (0, 0);
    while pair.world.now() - start < Duration::from_secs(120) {
        pair.world.run_for(Duration::from_millis(50));
        for seen in pair.world.take_seen() {
            if seen.port == pair.shore && matches!(&seen.what, What::Delivered(d) if d.class == Class::State)
            {
                (last, until_last) = (seen.at, pair.world.bytes(pair.vehicle) - there);
            }
        }
        if pair.world.link(pair.vehicle).is_heard() {
            heard.get_or_insert(pair.world.now() - start);
        }
        if pair.world.link(pair.vehicle).is_settled() && pair.world.link(pair.shore).is_heard() {
            settled = pair.world.now();
            bytes = (pair.world.bytes(pair.vehicle) - there, pair.world.bytes(pair.shore) - back);
            break;
        }
    }
    let seconds = if changed > 0.0 { last - start } else { settled - start };
    Resync {
        seconds: seconds.as_secs_f64(),
        heard: heard.unwrap_or_default().as_secs_f64(),
        until_last: until_last as f64,
        forward: bytes.0 as f64,
        both: (bytes.0 + bytes.1) as f64,
    }
}

/// G6: mean and p99 age in seconds of what the receiver holds of ten instances of 48 bytes, offered at ten times the rate.
pub(in crate::sim::link) fn overload(setting: &Setting, seconds: u64, commands: bool) -> (f64, f64, usize) {
    let mut pair = setting.warm_pair();
    // Ten times what the link carries of 48 bytes.
    let gap = Duration::from_secs_f64(480.0 / (10.0 * setting.profile.rate as f64));
    let start = pair.world.now();
    let (mut times, mut sequence, mut ages) = (BTreeMap::new(), 0u64, Vec::new());
    let mut held: BTreeMap<i64, Monotonic> = BTreeMap::new();
    let (mut queued, mut number) = (0, 0);
    let mut next_command = start;
    while pair.world.now() - start < Duration::from_secs(seconds) {
        sequence += 1;
        let at = pair.world.now();
        times.insert(sequence, at);
        for instance in 0..10 {
            pair.world.offer(
                pair.vehicle,
                state(VEHICLE, instance, sequence, at.elapsed(), 48),
                Class::State,
            );
        }
        if commands && at >= next_command {
            number += 1;
            let lifespan = Duration::from_secs(60);
            let envelope = command(VEHICLE, SHORE, number, at.elapsed(), lifespan);
            pair.world.offer(pair.vehicle, envelope, Class::Command);
            next_command = at + Duration::from_secs(2);
        }
        pair.world.run_for(gap);
        queued = queued.max(pair.world.link(pair.vehicle).waiting().1);
        for seen in pair.world.take_seen() {
            if let What::Delivered(delivery) = &seen.what
                && delivery.class == Class::State
                && seen.port == pair.shore
            {
                let instance =
                    delivery.envelope.message.instance.as_ref().map_or(0, |i| i64::from(i.hash.0[7]));
                if let Some(at) = times.get(&delivery.envelope.stamp.sequence) {
                    held.insert(instance, *at);
                }
            }
        }
        while times.len() > 2_000 {
            times.pop_first();
        }
        if pair.world.now() - start > Duration::from_secs(20) {
            ages.extend(held.values().map(|at| (pair.world.now() - *at).as_secs_f64()));
        }
    }
    (mean(&ages), percentile(&mut ages, 0.99), queued)
}

/// G8: kbit/s at which a recording passes.
pub(in crate::sim::link) fn bulk(setting: &Setting, bytes: usize) -> f64 {
    let mut pair = setting.warm_pair();
    let start = pair.world.now();
    pair.world.offer(pair.vehicle, bulk_message(VEHICLE, 1, start.elapsed(), bytes), Class::Bulk);
    while pair.world.now() - start < Duration::from_secs(3_600) {
        pair.world.run_for(Duration::from_secs(1));
        let seen = pair.world.take_seen();
        let arrived = seen.iter().find(|seen| {
            seen.port == pair.shore && matches!(&seen.what, What::Delivered(d) if d.class == Class::Bulk)
        });
        if let Some(arrived) = arrived {
            return bytes as f64 * 8.0 / 1_000.0 / (arrived.at - start).as_secs_f64();
        }
    }
    0.0
}
