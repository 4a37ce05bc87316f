//! What the dry run of the budget says of a load, against what the load then costs.

use super::{Pair, SHORE, Setting, VEHICLE};
use crate::link::plan::{Flow, plan};
use crate::link::{CarrierConfig, CarrierId, Class};
use crate::sim::link::emulator::Profile;
use crate::sim::link::load::{bulk, command_of, state};
use aldis_envelope::Monotonic;
use std::time::Duration;

/// Bytes a second that one end sends.
#[derive(Debug, Clone, Copy)]
pub(in crate::sim::link) struct Forecast {
    /// What the load is, in words.
    pub(in crate::sim::link) load: &'static str,
    pub(in crate::sim::link) planned: f64,
    pub(in crate::sim::link) measured: f64,
}

impl Forecast {
    /// How far the plan is from the run, as a part of the run.
    pub(in crate::sim::link) fn error(&self) -> f64 {
        (self.planned - self.measured).abs() / self.measured.max(1e-9)
    }
}

/// A load: what the vehicle sends, and what shore sends. The figures are for a link of 1 200 bytes a second.
struct Load {
    name: &'static str,
    there: Vec<Flow>,
    back: Vec<Flow>,
}

fn flow(class: Class, bytes: usize, per_second: f64, instances: u32) -> Flow {
    Flow { descriptor: format!("{class:?}"), class, bytes, per_second, instances }
}

fn loads() -> Vec<Load> {
    let commands = || flow(Class::Command, 64, 0.5, 1);
    let states = |per_second| flow(Class::State, 48, per_second, 10);
    vec![
        Load { name: "nothing", there: vec![], back: vec![] },
        Load { name: "commands", there: vec![commands()], back: vec![] },
        Load { name: "commands both ways", there: vec![commands()], back: vec![commands()] },
        Load { name: "states", there: vec![states(5.0)], back: vec![] },
        Load { name: "states and commands", there: vec![states(4.0), commands()], back: vec![commands()] },
        Load { name: "more states than fit", there: vec![states(60.0), commands()], back: vec![] },
        Load { name: "a recording", there: vec![flow(Class::Bulk, 20_000, 0.02, 1)], back: vec![commands()] },
    ]
}

/// Each load for so many seconds; `all` has those too that fill the link.
pub(in crate::sim::link) fn forecasts(setting: &Setting, seconds: u64, all: bool) -> Vec<Forecast> {
    let of_all = loads();
    let fits = |load: &&Load| {
        all || load.there.iter().all(|flow| flow.per_second < 10.0 && flow.class != Class::Bulk)
    };
    of_all.iter().filter(fits).map(|load| forecast(setting, load, Duration::from_secs(seconds))).collect()
}

fn forecast(setting: &Setting, load: &Load, lasts: Duration) -> Forecast {
    let profile = &setting.profile;
    let carrier = CarrierConfig {
        id: CarrierId(0),
        rate: profile.rate,
        mtu: profile.mtu,
        round_trip: profile.round_trip(),
        loss: profile.loss,
    };
    let planned = plan(&carrier, setting.keyed, &load.there, &load.back).bytes_per_second();
    Forecast { load: load.name, planned, measured: cost_of(setting, &load.there, &load.back, lasts) }
}

/// What flows cost in a run on a simulated carrier: bytes a second that this end sends. `back` comes from the other end. Loss is
/// independent, from the seed; the names are agreed beforehand.
pub fn cost(
    carrier: &CarrierConfig,
    keyed: bool,
    (there, back): (&[Flow], &[Flow]),
    lasts: Duration,
    seed: u64,
) -> f64 {
    let profile = Profile {
        name: "configured",
        rate: carrier.rate,
        delay: carrier.round_trip / 2,
        loss: carrier.loss.clamp(0.0, 0.9),
        mtu: carrier.mtu,
        queue: Profile::L1.queue.max(carrier.mtu * 16),
        ..Profile::L1
    };
    cost_of(&Setting { profile, keyed, seed }, there, back, lasts)
}

/// A flow in the run.
struct Source<'a> {
    flow: &'a Flow,
    there: bool,
    /// Its instances begin here: no two flows share one.
    first: i64,
    number: u64,
    due: Monotonic,
}

fn cost_of(setting: &Setting, there: &[Flow], back: &[Flow], lasts: Duration) -> f64 {
    let mut pair = setting.warm_pair();
    let mut random = fastrand::Rng::with_seed(setting.seed ^ 0x666f_7265);
    let start = pair.world.now();
    let flows = there.iter().map(|flow| (true, flow)).chain(back.iter().map(|flow| (false, flow)));
    let mut first = 0;
    let mut sources: Vec<Source<'_>> = Vec::new();
    for (there, flow) in flows.filter(|(_, flow)| flow.per_second > 1e-9) {
        // Every flow begins at a moment of its own.
        let due = start + Duration::from_secs_f64(random.f64() / flow.per_second);
        sources.push(Source { flow, there, first, number: 0, due });
        first += i64::from(flow.instances);
    }
    let before = pair.world.bytes(pair.vehicle);
    while pair.world.now() - start < lasts {
        let now = pair.world.now();
        for source in sources.iter_mut().filter(|source| source.due <= now) {
            source.offer(&mut pair);
        }
        let next = sources.iter().map(|source| source.due).min();
        pair.world.run_until(next.unwrap_or(start + lasts).min(start + lasts));
        pair.world.take_seen();
    }
    let sent = pair.world.bytes(pair.vehicle) - before;
    sent as f64 / lasts.as_secs_f64()
}

impl Source<'_> {
    fn offer(&mut self, pair: &mut Pair) {
        let Flow { class, bytes, per_second, instances, .. } = *self.flow;
        self.number += 1;
        self.due = self.due + Duration::from_secs_f64(1.0 / per_second);
        let (from, to) = if self.there { (VEHICLE, SHORE) } else { (SHORE, VEHICLE) };
        let (port, at) = (if self.there { pair.vehicle } else { pair.shore }, pair.world.now().elapsed());
        let envelope = match class {
            Class::Command => command_of(bytes, (from, to), self.number, at, Duration::from_secs(60)),
            Class::State => {
                let instance = self.first + (self.number % u64::from(instances.max(1))) as i64;
                state(from, instance, self.number, at, bytes)
            }
            Class::Bulk => bulk(from, self.number, at, bytes),
        };
        pair.world.offer(port, envelope, class);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plan_says_the_bytes_of_a_run_within_a_tenth() {
        let setting = Setting { profile: Profile::L1, keyed: false, seed: 3 };
        for forecast in forecasts(&setting, 2_400, false) {
            assert!(forecast.error() < 0.1, "{forecast:?}");
        }
    }
}
