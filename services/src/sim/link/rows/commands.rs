//! Commands: exactly once, how soon, at what cost, and what is told of those that do not arrive.

use super::{Pair, SHORE, Setting, VEHICLE};
use crate::link::{Class, Ticket, TicketState};
use crate::sim::link::emulator::Profile;
use crate::sim::link::load::{bulk, command, command_number, percentile, state};
use crate::sim::link::world::{LinkWorld, Port, Seen, What};
use aldis_envelope::Monotonic;
use std::collections::BTreeMap;
use std::time::Duration;

/// What became of commands.
#[derive(Debug, Default, Clone, Copy)]
pub(in crate::sim::link) struct Once {
    pub(in crate::sim::link) delivered: u64,
    pub(in crate::sim::link) twice: u64,
    pub(in crate::sim::link) out_of_order: u64,
}

impl Once {
    /// Counts deliveries at a port.
    pub(in crate::sim::link) fn count(&mut self, seen: &[Seen], port: Port, last: &mut BTreeMap<u64, u64>) {
        for seen in seen.iter().filter(|seen| seen.port == port) {
            let What::Delivered(delivery) = &seen.what else { continue };
            if delivery.class != Class::Command {
                continue;
            }
            let (from, number) = command_number(&delivery.envelope.message.content);
            let last = last.entry(from).or_default();
            self.delivered += u64::from(number > *last);
            self.twice += u64::from(number == *last);
            self.out_of_order += u64::from(number < *last);
            *last = number.max(*last);
        }
    }
}

/// G1: `count` commands at 0.5 a second.
pub(in crate::sim::link) fn exactly_once(setting: &Setting, count: u64, lifespan: Duration) -> Once {
    let mut pair = setting.pair();
    let (mut once, mut last) = (Once::default(), BTreeMap::new());
    for number in 1..=count {
        let at = pair.world.now().elapsed();
        pair.world.offer(pair.shore, command(SHORE, VEHICLE, number, at, lifespan), Class::Command);
        pair.world.run_for(Duration::from_secs(2));
        once.count(&pair.world.take_seen(), pair.vehicle, &mut last);
    }
    pair.world.run_for(lifespan + Duration::from_secs(10));
    once.count(&pair.world.take_seen(), pair.vehicle, &mut last);
    once
}

/// What G2 and G9 measure.
#[derive(Debug, Default)]
pub(in crate::sim::link) struct Latency {
    /// Seconds from offer to hand-over.
    pub(in crate::sim::link) seconds: Vec<f64>,
    pub(in crate::sim::link) copies: f64,
    pub(in crate::sim::link) bytes: f64,
    pub(in crate::sim::link) frames: f64,
}

/// G2 and G9: commands at random moments, 0.5 a second on average; with `backlog`, states and bulk at ten times the rate wait too.
pub(in crate::sim::link) fn latency(
    setting: &Setting,
    count: u64,
    mean_gap: Duration,
    backlog: bool,
) -> Latency {
    let mut pair = setting.warm_pair();
    let mut random = fastrand::Rng::with_seed(setting.seed ^ 0x6c61_7465);
    let (bytes, frames) = (pair.bytes(), pair.frames());
    let copies = pair.world.link(pair.shore).counters().command_copies;
    let (mut starts, mut latency) = (BTreeMap::new(), Latency::default());
    let mut sequence = 0;
    for number in 1..=count {
        let gap = mean_gap.mul_f64(-(1.0 - random.f64()).ln());
        let end = pair.world.now() + gap;
        if backlog {
            fill(&mut pair, end, &mut sequence);
        }
        pair.world.run_until(end);
        let at = pair.world.now();
        starts.insert(number, at);
        let lifespan = Duration::from_secs(60);
        pair.world.offer(pair.shore, command(SHORE, VEHICLE, number, at.elapsed(), lifespan), Class::Command);
        collect(&mut pair, &starts, &mut latency);
    }
    pair.world.run_for(Duration::from_secs(30));
    collect(&mut pair, &starts, &mut latency);
    latency.bytes = (pair.bytes() - bytes) as f64 / count as f64;
    latency.frames = (pair.frames() - frames) as f64 / count as f64;
    let counters = pair.world.link(pair.shore).counters();
    latency.copies = (counters.command_copies - copies) as f64 / count as f64;
    latency
}

/// Keeps ten times the rate of states waiting until a moment, and bulk behind them.
fn fill(pair: &mut Pair, end: Monotonic, sequence: &mut u64) {
    while pair.world.now() < end {
        *sequence += 1;
        let at = pair.world.now().elapsed();
        for instance in 0..10 {
            pair.world.offer(pair.shore, state(SHORE, instance, *sequence, at, 48), Class::State);
        }
        if pair.world.link(pair.shore).waiting().2 == 0 {
            pair.world.offer(pair.shore, bulk(SHORE, *sequence, at, 60_000), Class::Bulk);
        }
        let step = end.min(pair.world.now() + Duration::from_millis(400));
        pair.world.run_until(step);
    }
}

fn collect(pair: &mut Pair, starts: &BTreeMap<u64, Monotonic>, latency: &mut Latency) {
    for seen in pair.world.take_seen() {
        if let What::Delivered(delivery) = &seen.what
            && delivery.class == Class::Command
            && seen.port == pair.vehicle
            && let Some(start) = starts.get(&command_number(&delivery.envelope.message.content).1)
        {
            latency.seconds.push((seen.at - *start).as_secs_f64());
        }
    }
}

/// What G3 measures.
#[derive(Debug, Default, Clone, Copy)]
pub(in crate::sim::link) struct Told {
    pub(in crate::sim::link) offered: u64,
    pub(in crate::sim::link) delivered: u64,
    /// Undelivered with a last word in time.
    pub(in crate::sim::link) told: u64,
    /// Undelivered without a last word, or too late.
    pub(in crate::sim::link) untold: u64,
    /// Told as delivered, and not delivered.
    pub(in crate::sim::link) lies: u64,
}

/// G3: commands with short lifespans, some through outages; each that does not arrive is told within its lifespan and a round trip.
pub(in crate::sim::link) fn refused(setting: &Setting, count: u64, lifespan: Duration) -> Told {
    let mut pair = setting.warm_pair();
    let mut random = fastrand::Rng::with_seed(setting.seed ^ 0x6733);
    let (mut tickets, mut words, mut arrived) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
    let mut note = |pair: &mut Pair| {
        for seen in pair.world.take_seen() {
            match seen.what {
                What::Ticket(ticket, state) if seen.port == pair.shore => {
                    let last = !matches!(state, TicketState::Accepted { .. } | TicketState::OnAir { .. });
                    if last {
                        words.insert(ticket, (seen.at, state));
                    }
                }
                What::Delivered(delivery) if seen.port == pair.vehicle => {
                    arrived.insert(command_number(&delivery.envelope.message.content).1, seen.at);
                }
                _ => {}
            }
        }
    };
    for number in 1..=count {
        if number % 50 == 20 {
            pair.world.cut_all(pair.shore, true);
        }
        if number % 50 == 45 {
            pair.world.cut_all(pair.shore, false);
        }
        let at = pair.world.now();
        let envelope = command(SHORE, VEHICLE, number, at.elapsed(), lifespan);
        let ticket: Ticket = pair.world.offer(pair.shore, envelope, Class::Command);
        tickets.insert(number, (ticket, at));
        pair.world.run_for(Duration::from_millis(random.u64(50..3_000)));
        note(&mut pair);
    }
    pair.world.cut_all(pair.shore, false);
    pair.world.run_for(lifespan + Duration::from_secs(60));
    note(&mut pair);
    let limit = lifespan + setting.profile.round_trip() + Duration::from_secs(1) / 2;
    let mut told = Told { offered: count, ..Told::default() };
    for (number, (ticket, at)) in tickets {
        let word = words.get(&ticket);
        let says_delivered = matches!(word, Some((_, TicketState::Delivered { .. })));
        match (arrived.contains_key(&number), word) {
            (true, _) => told.delivered += 1,
            (false, _) if says_delivered => told.lies += 1,
            (false, Some((when, _))) if *when - at <= limit => told.told += 1,
            (false, _) => told.untold += 1,
        }
    }
    told
}

/// G4: seconds from the end of an outage, at a moment of chance, to the hand-over of a command that waited through it.
pub(in crate::sim::link) fn after_outage(setting: &Setting, outages: u64) -> Vec<f64> {
    let measure = |number| {
        let setting = setting.seeded(number);
        let mut pair = setting.warm_pair();
        let mut random = fastrand::Rng::with_seed(setting.seed);
        pair.world.cut_all(pair.shore, true);
        pair.world.run_for(Duration::from_secs(5));
        let at = pair.world.now().elapsed();
        let lifespan = Duration::from_secs(3_600);
        pair.world.offer(pair.shore, command(SHORE, VEHICLE, 1, at, lifespan), Class::Command);
        pair.world.run_for(Duration::from_secs(595) + Duration::from_millis(random.u64(0..2_000)));
        pair.world.cut_all(pair.shore, false);
        pair.world.take_seen();
        let start = pair.world.now();
        pair.world.run_for(Duration::from_secs(60));
        let arrived = pair.world.take_seen().into_iter().find(|seen| {
            seen.port == pair.vehicle && matches!(&seen.what, What::Delivered(d) if d.class == Class::Command)
        });
        arrived.map_or(60.0, |seen| (seen.at - start).as_secs_f64())
    };
    (0..outages).map(measure).collect()
}

/// G14: commands from one vehicle to another by way of shore, through an hour in which shore and the second do not hear each other, with
/// clocks that are minutes off.
pub(in crate::sim::link) fn through_shore(setting: &Setting, count: u64) -> (Once, f64) {
    const SECOND: u64 = 500;
    let minutes = |n: i64| n * 60 * 1_000_000_000;
    let mut world = LinkWorld::new(setting.seed);
    let (a, shore, b) =
        (world.machine(VEHICLE, minutes(5)), world.machine(SHORE, 0), world.machine(SECOND, minutes(-5)));
    let carriers: [Profile; 1] = [setting.profile.clone()];
    let (from, _) = world.join(a, shore, &carriers, &setting.keys(), |_| {});
    let (at_shore, to) = world.join(shore, b, &carriers, &setting.keys(), |_| {});
    let second = crate::sim::link::load::entity(SECOND);
    world.of(shore).routes.insert(second, at_shore.1);
    let (mut once, mut last) = (Once::default(), BTreeMap::new());
    let lifespan = Duration::from_secs(7_200);
    let gap = Duration::from_secs(3_600) / count.max(1) as u32;
    world.run_for(Duration::from_secs(60));
    world.cut_all(at_shore, true);
    for number in 1..=count {
        let at = world.now().elapsed();
        world.offer(from, command(VEHICLE, SECOND, number, at, lifespan), Class::Command);
        world.run_for(gap);
    }
    world.cut_all(at_shore, false);
    let healed = world.now();
    let mut through = healed;
    for _ in 0..360 {
        world.run_for(Duration::from_secs(10));
        let seen = world.take_seen();
        let arrived = seen.iter().filter(|seen| seen.port == to && matches!(seen.what, What::Delivered(_)));
        through = arrived.map(|seen| seen.at).max().unwrap_or(through).max(through);
        once.count(&seen, to, &mut last);
    }
    (once, (through - healed).as_secs_f64())
}

impl Latency {
    /// p50, p99, p99.9 in seconds.
    pub(in crate::sim::link) fn percentiles(&mut self) -> [f64; 3] {
        [0.5, 0.99, 0.999].map(|part| percentile(&mut self.seconds, part))
    }
}
