//! Many links drawn from seeds, each with its own mixture of troubles, and what must hold on all of them.

use super::emulator::{Burst, Profile};
use super::load::{bulk, command_number, command_of, state};
use super::world::{LinkWorld, MachineId, Port, Seen, What};
use crate::link::{Class, LinkKey, Ticket, TicketState};
use aldis_envelope::Monotonic;
use std::collections::BTreeMap;
use std::time::Duration;

/// How long one link of the swarm is in trouble, and how long it then has to settle.
const TROUBLE: Duration = Duration::from_secs(1_200);
const SETTLE: Duration = Duration::from_secs(600);

/// What a swarm came to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SwarmReport {
    /// Hours of links that were simulated.
    pub hours: f64,
    /// Links.
    pub links: u64,
    /// Commands offered, handed over, and told of otherwise.
    pub commands: u64,
    /// Crashes.
    pub crashes: u64,
    /// What was drawn for the first links.
    pub options: Vec<String>,
    /// What did not hold: each with its seed and the options drawn.
    pub violations: Vec<String>,
}

/// The troubles of one link.
#[derive(Debug, Clone)]
struct Options {
    profile: Profile,
    keyed: bool,
    carriers: usize,
    crashes: f64,
    cuts: f64,
    write_time: Duration,
    clock_off: i64,
    lifespan: Duration,
    gap: Duration,
    states: i64,
    bulk: usize,
    /// The length of a command.
    bytes: usize,
}

impl Options {
    fn draw(random: &mut fastrand::Rng) -> Self {
        // Of its own: what is drawn here moves nothing else.
        let mut sizes = random.clone();
        let bytes = if sizes.u8(0..4) == 0 { sizes.usize(100..3_000) } else { 64 };
        let burst =
            (random.u8(0..3) == 0).then(|| Burst { mean: Duration::from_millis(random.u64(100..4_000)) });
        let rate = [300, 1_200, 5_000, 125_000][random.usize(0..4)];
        let profile = Profile {
            name: "drawn",
            rate,
            delay: Duration::from_millis(random.u64(1..900)),
            jitter: Duration::from_millis(if random.bool() { random.u64(0..300) } else { 0 }),
            loss: random.f64() * 0.5,
            burst,
            twice: if random.bool() { random.f64() * 0.2 } else { 0.0 },
            mtu: [128, 256, 512, 1_200][random.usize(0..4)],
            queue: 65_536,
            outage: None,
        };
        Self {
            keyed: random.bool(),
            carriers: random.usize(1..3),
            crashes: if random.bool() { random.f64() * 0.02 } else { 0.0 },
            cuts: if random.bool() { random.f64() * 0.02 } else { 0.0 },
            write_time: Duration::from_millis(random.u64(0..60)),
            clock_off: random.i64(-300..300) * 1_000_000_000,
            lifespan: Duration::from_secs(random.u64(5..900)),
            // A third of the rate at most for commands, so that the link can carry them.
            gap: Duration::from_millis(random.u64(300..8_000))
                .max(Duration::from_secs_f64((bytes + 336) as f64 / rate as f64)),
            states: random.i64(0..30),
            bulk: if random.bool() { random.usize(100..20_000) } else { 0 },
            bytes,
            profile,
        }
    }
}

/// What is known of a command.
#[derive(Debug, Clone, Copy)]
struct Known {
    offered: Monotonic,
    /// The sender's machine died before the last word.
    orphaned: bool,
    last_word: Option<(Monotonic, bool)>,
}

struct Run {
    options: Options,
    random: fastrand::Rng,
    world: LinkWorld,
    ports: [Port; 2],
    known: BTreeMap<(u64, u64), Known>,
    tickets: BTreeMap<Ticket, (u64, u64)>,
    newest: BTreeMap<(u64, [u8; 16]), u64>,
    offered_states: BTreeMap<(u64, i64), u64>,
    last: BTreeMap<u64, u64>,
    crashes: u64,
    /// Kills of each end: what a link held in memory alone is gone.
    killed: [bool; 2],
    complaints: Vec<String>,
}

/// Simulates links until so many hours of them have passed.
pub fn swarm(hours: f64, seed: u64) -> SwarmReport {
    let mut report = SwarmReport::default();
    while report.hours < hours {
        one(swarm_seed(seed, report.links), &mut report);
    }
    report
}

/// The seed of a link of a swarm.
pub fn swarm_seed(seed: u64, link: u64) -> u64 {
    seed.wrapping_mul(1_000_003).wrapping_add(link)
}

impl SwarmReport {
    /// Adds what other links came to.
    pub fn add(&mut self, other: Self) {
        let Self { hours, links, commands, crashes, options, violations } = other;
        self.hours += hours;
        self.links += links;
        self.commands += commands;
        self.crashes += crashes;
        self.options.extend(options);
        self.options.truncate(OPTIONS_TOLD);
        self.violations.extend(violations);
    }
}

/// Of how many links the options are told.
const OPTIONS_TOLD: usize = 8;

/// One link from its seed: this is how a failure is replayed.
pub fn swarm_one(seed: u64) -> SwarmReport {
    let mut report = SwarmReport::default();
    one(seed, &mut report);
    report
}

fn one(seed: u64, report: &mut SwarmReport) {
    let mut random = fastrand::Rng::with_seed(seed);
    let options = Options::draw(&mut random);
    if report.options.len() < OPTIONS_TOLD {
        report.options.push(format!("seed {seed}: {options:?}"));
    }
    let mut world = LinkWorld::new(seed ^ 0x7761_726d);
    world.write_time = options.write_time;
    world.trace = true;
    let (a, b) = (world.machine(1, 0), world.machine(400, options.clock_off));
    let keys = if options.keyed { vec![LinkKey { number: 4, secret: [7; 32] }] } else { Vec::new() };
    let carriers = vec![options.profile.clone(); options.carriers];
    let ports = world.join(a, b, &carriers, &keys, |_| {});
    let mut run = Run {
        options,
        random,
        world,
        ports: [ports.0, ports.1],
        known: BTreeMap::new(),
        tickets: BTreeMap::new(),
        newest: BTreeMap::new(),
        offered_states: BTreeMap::new(),
        last: BTreeMap::new(),
        crashes: 0,
        killed: [false; 2],
        complaints: Vec::new(),
    };
    run.trouble();
    run.settle();
    run.judge();
    report.links += 1;
    report.hours += run.world.now().elapsed().as_secs_f64() / 3_600.0;
    report.commands += run.known.len() as u64;
    report.crashes += run.crashes;
    let options = format!("{:?}", run.options);
    report
        .violations
        .extend(run.complaints.into_iter().map(|what| format!("seed {seed}: {what}; {options}")));
}

impl Run {
    fn trouble(&mut self) {
        let mut number = 0;
        if self.options.bulk > 0 {
            let envelope = bulk(400, 1, Duration::ZERO, self.options.bulk);
            self.world.offer(self.ports[1], envelope, Class::Bulk);
        }
        while self.world.now().elapsed() < TROUBLE {
            number += 1;
            let at = self.world.now();
            for (from, to, end) in [(1, 400, 0), (400, 1, 1)] {
                let envelope =
                    command_of(self.options.bytes, (from, to), number, at.elapsed(), self.options.lifespan);
                let ticket = self.world.offer(self.ports[end], envelope, Class::Command);
                self.tickets.insert(ticket, (from, number));
                let known = Known { offered: at, orphaned: false, last_word: None };
                self.known.insert((from, number), known);
            }
            for instance in 0..self.options.states {
                if self.random.u8(0..4) == 0 {
                    self.offered_states.insert((400, instance), number);
                    let envelope = state(400, instance, number, at.elapsed(), 32);
                    self.world.offer(self.ports[1], envelope, Class::State);
                }
            }
            let gap = self.options.gap.mul_f64(self.random.f64() * 2.0);
            self.world.run_for(gap);
            self.look();
            if self.random.f64() < self.options.cuts {
                let long = Duration::from_secs(self.random.u64(1..200));
                self.world.cut_all(self.ports[0], true);
                self.world.run_for(long);
                self.world.cut_all(self.ports[0], false);
            }
            if self.random.f64() < self.options.crashes {
                self.crash();
            }
        }
    }

    fn crash(&mut self) {
        self.look();
        let end = self.random.usize(0..2);
        self.crashes += 1;
        self.killed[end] = true;
        self.world.kill(MachineId(end));
        let from = [1, 400][end];
        let open =
            self.known.iter_mut().filter(|((sender, _), known)| *sender == from && known.last_word.is_none());
        open.for_each(|(_, known)| known.orphaned = true);
        let down = Duration::from_millis(self.random.u64(0..20_000));
        self.world.run_for(down);
        self.world.restart(MachineId(end));
    }

    fn settle(&mut self) {
        let last = self.options.states;
        let at = self.world.now().elapsed();
        for instance in 0..last {
            self.offered_states.insert((400, instance), 1 << 30);
            self.world.offer(self.ports[1], state(400, instance, 1 << 30, at, 32), Class::State);
        }
        let end = self.world.now() + self.options.lifespan + SETTLE;
        while self.world.now() < end {
            self.world.run_for(Duration::from_secs(10));
            self.look();
        }
    }

    fn look(&mut self) {
        for seen in self.world.take_seen() {
            let Seen { at, port, what } = seen;
            match what {
                What::Ticket(ticket, state) => self.on_word(at, ticket, &state),
                What::Delivered(delivery) => match delivery.class {
                    Class::Command => self.on_command(&delivery.envelope, delivery.recovered),
                    Class::State => self.on_state(port, &delivery.envelope),
                    Class::Bulk => {
                        let same = bulk(400, 1, Duration::ZERO, self.options.bulk);
                        if delivery.envelope.message.content != same.message.content {
                            self.complaints.push("a large message is not what was sent".into());
                        }
                    }
                },
            }
        }
    }

    fn on_word(&mut self, at: Monotonic, ticket: Ticket, state: &TicketState) {
        let known = self.tickets.get(&ticket).and_then(|key| self.known.get_mut(key));
        let Some(known) = known else { return };
        match state {
            TicketState::Accepted { .. } | TicketState::OnAir { .. } => {}
            TicketState::Delivered { .. } => known.last_word = Some((at, true)),
            // A machine that dies before it has forgotten a command tells the same once more in its next life.
            _ => known.last_word = known.last_word.or(Some((at, false))),
        }
    }

    fn on_command(&mut self, envelope: &aldis_envelope::Envelope, recovered: bool) {
        let (from, number) = command_number(&envelope.message.content);
        let last = self.last.entry(from).or_default();
        if number < *last && !recovered {
            self.complaints.push(format!("command {number} of {from} came after {last}"));
        }
        *last = number.max(*last);
    }

    fn on_state(&mut self, port: Port, envelope: &aldis_envelope::Envelope) {
        let hash = envelope.message.instance.as_ref().map_or([0; 16], |instance| instance.hash.0);
        let key = (envelope.message.label.source().entity.get(), hash);
        let newest = self.newest.entry(key).or_default();
        // A receiver that lost its memory may hold older ones until it has heard the newest.
        if envelope.stamp.sequence <= *newest && !self.killed[port.0.0] {
            self.complaints.push(format!("state {} came after {newest}", envelope.stamp.sequence));
        }
        *newest = envelope.stamp.sequence.max(*newest);
    }

    fn judge(&mut self) {
        let handled: Vec<_> =
            [0, 1].map(|end| self.world.handled(MachineId(end))).into_iter().flatten().collect();
        let mut times: BTreeMap<(u64, u64), u64> = BTreeMap::new();
        for (content, count) in handled {
            *times.entry(command_number(&content)).or_default() += count;
        }
        let limit = self.options.lifespan + self.options.profile.round_trip() + Duration::from_secs(2);
        for (key, known) in &self.known {
            let count = times.get(key).copied().unwrap_or(0);
            if count > 1 {
                self.complaints.push(format!("command {key:?} was handled {count} times"));
            }
            match known.last_word {
                Some((_, true)) if count == 0 => {
                    self.complaints.push(format!("command {key:?} was told as delivered and was not"));
                }
                None if !known.orphaned => self.complaints.push(format!("no last word of command {key:?}")),
                Some((at, false)) if at - known.offered > limit && !known.orphaned => {
                    self.complaints.push(format!("word of command {key:?} came late"));
                }
                _ => {}
            }
        }
        if !self.killed[1] {
            self.judge_states();
        }
        self.judge_pace();
    }

    /// After all is mended the receiver holds the newest of every instance.
    fn judge_states(&mut self) {
        for (&(source, instance), &sequence) in &self.offered_states {
            let mut hash = [0; 16];
            hash[..8].copy_from_slice(&instance.to_be_bytes());
            let newest = self.newest.get(&(source, hash)).copied().unwrap_or(0);
            if newest != sequence {
                self.complaints
                    .push(format!("instance {instance} is held at {newest}, the newest is {sequence}"));
            }
        }
    }

    /// In no ten seconds goes more than the rate and a frame, on one carrier. A machine that starts anew has forgotten what it sent.
    fn judge_pace(&mut self) {
        if self.crashes > 0 || self.options.carriers > 1 {
            return;
        }
        let allowed = 10 * self.options.profile.rate as usize + self.options.profile.mtu;
        for port in self.ports {
            let frames = self.world.sent(port);
            let (mut sum, mut first) = (0, 0);
            for (at, bytes) in frames {
                sum += bytes;
                while *at - frames[first].0 >= Duration::from_secs(10) {
                    sum -= frames[first].1;
                    first += 1;
                }
                if sum > allowed {
                    self.complaints.push(format!("{sum} bytes in ten seconds, {allowed} are allowed"));
                    return;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_must_hold_holds_on_some_drawn_links() {
        let report = swarm(0.8, 1);
        assert_eq!(report.violations, Vec::<String>::new());
        assert!(report.links >= 1 && report.commands > 100, "{report:?}");
    }
}
