//! The budget dry run: what a load costs on a link before anything is sent, and what starves.

use super::path::ACK_DELAY;
use super::{CarrierConfig, Class, TAG_BYTES};
use std::time::Duration;

/// One kind of message that is to cross.
#[derive(Debug, Clone, PartialEq)]
pub struct Flow {
    /// Its descriptor.
    pub descriptor: String,
    /// How it crosses.
    pub class: Class,
    /// The bytes of its content.
    pub bytes: usize,
    /// How many a second are offered, of all instances together.
    pub per_second: f64,
    /// How many instances it has; 1 for what has none.
    pub instances: u32,
}

/// What a kind of message costs.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowPlan {
    /// Its descriptor.
    pub descriptor: String,
    /// How it crosses.
    pub class: Class,
    /// Bytes a second that it wants, with frames, copies and their losses.
    pub wanted: f64,
    /// Bytes a second that it gets.
    pub granted: f64,
    /// Whether what is offered does not get through as offered: commands expire, states are conflated, bulk waits.
    pub starves: bool,
}

/// What a load costs.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Each kind.
    pub flows: Vec<FlowPlan>,
    /// Bytes a second of acknowledgements for what comes from the other end, and for keeping alive.
    pub overhead: f64,
    /// Bytes a second of the link.
    pub rate: f64,
    /// The longest that all but one of a thousand commands take, where commands do not starve.
    pub worst_command: Duration,
    /// How long it takes until the receiver holds the newest of every instance after an outage.
    pub resync: Duration,
}

impl Plan {
    /// Bytes a second that go out: those that the flows get, and the overhead.
    pub fn bytes_per_second(&self) -> f64 {
        self.flows.iter().map(|flow| flow.granted).sum::<f64>() + self.overhead
    }
}

/// Head, item and stamp of a command alone in its frame, and of a sample.
const COMMAND_OVERHEAD: f64 = 20.0;
const STATE_OVERHEAD: f64 = 15.0;
/// A sample in short form, with its part of a frame.
const SHORT_OVERHEAD: f64 = 4.0;
/// The bytes beside a piece.
const PIECE_OVERHEAD: f64 = 9.0;
/// A frame with an acknowledgement alone, and one that keeps alive.
const ACK: f64 = 9.0;
const ALIVE: f64 = 4.0;

/// Works out what flows cost on a carrier. `back` is what comes from the other end: it costs acknowledgements here.
pub fn plan(carrier: &CarrierConfig, keyed: bool, flows: &[Flow], back: &[Flow]) -> Plan {
    let loss = carrier.loss.clamp(0.0, 0.9);
    let tag = if keyed { TAG_BYTES as f64 } else { 0.0 };
    let rate = carrier.rate as f64;
    let copies = command_copies(loss);
    let room = carrier.mtu as f64 - PIECE_OVERHEAD - tag;
    let wanted = |flow: &Flow| {
        let bytes = flow.bytes as f64;
        let cost = match flow.class {
            Class::Command => copies * (bytes + COMMAND_OVERHEAD + tag),
            Class::State => state_copies(carrier, flow) * (bytes + STATE_OVERHEAD + tag),
            Class::Bulk => bytes / room * carrier.mtu as f64 / (1.0 - loss),
        };
        cost * flow.per_second
    };
    let overhead = overhead(carrier, tag, flows, back);
    let mut left = rate - overhead;
    let mut planned: Vec<FlowPlan> = Vec::new();
    for class in [Class::Command, Class::State, Class::Bulk] {
        let mine: Vec<_> = flows.iter().filter(|flow| flow.class == class).collect();
        let sum: f64 = mine.iter().map(|flow| wanted(flow)).sum();
        let part = if sum > left { (left / sum).max(0.0) } else { 1.0 };
        left -= sum * part;
        planned.extend(mine.iter().map(|flow| FlowPlan {
            descriptor: flow.descriptor.clone(),
            class,
            wanted: wanted(flow),
            granted: wanted(flow) * part,
            starves: part < 1.0,
        }));
    }
    let round = carrier.round_trip.as_secs_f64();
    let longest = flows.iter().filter(|flow| flow.class == Class::Command).map(|flow| flow.bytes).max();
    let airtime = (longest.unwrap_or(0) as f64 + COMMAND_OVERHEAD + tag) / rate;
    // One copy, then rounds of copies a time-out apart; the third leaves one in a thousand.
    let rounds = if loss < 0.001 { 0.0 } else { (1e-3f64.ln() / loss.ln() / 4.0).ceil().clamp(1.0, 6.0) };
    let waiting = carrier.mtu as f64 / rate;
    let worst = round / 2.0 + airtime + waiting + rounds * (round + airtime + waiting) + round / 4.0;
    let held: f64 = flows
        .iter()
        .filter(|flow| flow.class == Class::State)
        .map(|flow| f64::from(flow.instances) * (flow.bytes as f64 + SHORT_OVERHEAD + tag / 9.0))
        .sum();
    let resync = held / (1.0 - loss) / (rate - overhead).max(1.0) + 2.0 * round;
    Plan {
        flows: planned,
        overhead,
        rate,
        worst_command: Duration::from_secs_f64(worst),
        resync: Duration::from_secs_f64(resync),
    }
}

/// Bytes a second of acknowledgements for what comes from the other end, and of frames that keep alive where nothing else does.
fn overhead(carrier: &CarrierConfig, tag: f64, flows: &[Flow], back: &[Flow]) -> f64 {
    let loss = carrier.loss.clamp(0.0, 0.9);
    let room = carrier.mtu as f64 - PIECE_OVERHEAD - tag;
    // Frames a second with a kind of message, and with acknowledgements for it.
    let frames = |flow: &Flow| {
        let each = match flow.class {
            Class::Command => command_copies(loss),
            Class::State => state_copies(carrier, flow),
            Class::Bulk => flow.bytes as f64 / room / (1.0 - loss),
        };
        each * flow.per_second
    };
    let answers = |flow: &Flow| {
        let each = match flow.class {
            Class::Command => command_copies(loss) * (1.0 - loss) * if loss >= 0.08 { 2.0 } else { 1.0 },
            Class::State => 0.5 * (1.0 - loss),
            Class::Bulk => 0.5 * flow.bytes as f64 / room,
        };
        each * flow.per_second
    };
    let answering = back.iter().map(answers).sum::<f64>();
    let sending = flows.iter().map(frames).sum::<f64>() + answering;
    let wanted = (4e-5f64.ln() / (loss + 0.03).clamp(0.02, 0.8).ln()).ceil().max(3.0) / 9.5;
    let alive = (wanted - sending).max(0.0) * (ALIVE + tag);
    (answering * (ACK + tag)).min(carrier.rate as f64 / 4.0) + alive
}

/// How many copies of a sample go out on average: a lost one goes again, unless a newer one is there before the loss is known.
fn state_copies(carrier: &CarrierConfig, flow: &Flow) -> f64 {
    let loss = carrier.loss.clamp(0.0, 0.9);
    let known_after = carrier.round_trip.as_secs_f64() * 1.1
        + carrier.mtu as f64 / carrier.rate as f64
        + ACK_DELAY.as_secs_f64();
    let turns = f64::from(flow.instances) / flow.per_second.max(1e-9) / known_after;
    (0..16).map(|turn| loss.powi(turn) * (turns - f64::from(turn) + 1.0).clamp(0.0, 1.0)).sum()
}

/// How many copies of a command go out on average: one, and where no word comes, rounds of more.
fn command_copies(loss: f64) -> f64 {
    let ack_copies = if loss < 0.08 { 1.0 } else { 2.0 };
    let silent = 1.0 - (1.0 - loss) * (1.0 - loss.powf(ack_copies));
    let second = (0.01f64.ln() / loss.clamp(0.001, 0.9).ln() - 0.35).clamp(1.0, 4.0);
    // After the second round silence is rare, and each round has about two copies.
    let still = silent * (1.0 - (1.0 - silent).powf(second));
    1.0 + silent * second
        + if silent.powf(second) < 1.0 { 2.0 * still.powi(2) / (1.0 - silent * 0.5) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::CarrierId;

    fn carrier(rate: u64, loss: f64) -> CarrierConfig {
        CarrierConfig { id: CarrierId(0), rate, mtu: 256, round_trip: Duration::from_millis(600), loss }
    }

    fn flow(class: Class, bytes: usize, per_second: f64, instances: u32) -> Flow {
        Flow { descriptor: format!("{class:?}"), class, bytes, per_second, instances }
    }

    #[test]
    fn what_fits_gets_all_and_what_does_not_starves_from_the_lowest_class_up() {
        let flows = [
            flow(Class::Bulk, 60_000, 0.1, 1),
            flow(Class::State, 48, 10.0, 10),
            flow(Class::Command, 64, 0.5, 1),
        ];
        let roomy = plan(&carrier(100_000, 0.3), false, &flows, &[]);
        assert!(roomy.flows.iter().all(|flow| !flow.starves && flow.granted == flow.wanted));
        let tight = plan(&carrier(1_200, 0.3), false, &flows, &[]);
        let starving: Vec<_> = tight.flows.iter().map(|flow| (flow.class, flow.starves)).collect();
        assert_eq!(starving, [(Class::Command, false), (Class::State, false), (Class::Bulk, true)]);
        let granted: f64 = tight.flows.iter().map(|flow| flow.granted).sum();
        assert!((granted + tight.overhead - 1_200.0).abs() < 1e-6);
    }

    #[test]
    fn loss_and_keys_cost() {
        let command = [flow(Class::Command, 64, 1.0, 1)];
        let wanted = |loss, keyed| plan(&carrier(1_200, loss), keyed, &command, &[]).flows[0].wanted;
        assert!(
            wanted(0.0, false) < 90.0
                && wanted(0.3, false) > 170.0
                && wanted(0.5, false) > wanted(0.3, false)
        );
        assert!(wanted(0.3, true) > wanted(0.3, false) + 15.0);
    }

    #[test]
    fn four_hundred_instances_are_whole_again_in_a_quarter_of_a_minute() {
        let states = [flow(Class::State, 24, 0.7, 400)];
        let resync = plan(&carrier(1_200, 0.3), false, &states, &[]).resync.as_secs_f64();
        assert!((13.0..17.0).contains(&resync), "{resync}");
    }
}
