//! One function for each row of the table of goals.

mod commands;
mod forecast;
mod lower;
mod pace;

pub(super) use commands::{after_outage, exactly_once, latency, refused, through_shore};
pub use forecast::cost;
pub(super) use forecast::{Forecast, forecasts};
pub(super) use lower::{bulk, overload, resync};
pub(super) use pace::{Idle, budget, idle, queueing};

use super::emulator::Profile;
use super::world::{LinkWorld, Port};
use crate::link::LinkKey;
use std::time::Duration;

/// What a measurement runs on.
#[derive(Debug, Clone)]
pub(super) struct Setting {
    pub(super) profile: Profile,
    pub(super) keyed: bool,
    pub(super) seed: u64,
}

/// Shore (entity 1) and a vehicle (entity 400), joined.
pub(super) struct Pair {
    pub(super) world: LinkWorld,
    pub(super) shore: Port,
    pub(super) vehicle: Port,
}

pub(super) const SHORE: u64 = 1;
pub(super) const VEHICLE: u64 = 400;

impl Setting {
    pub(super) fn keys(&self) -> Vec<LinkKey> {
        if self.keyed { vec![LinkKey { number: 1, secret: [42; 32] }] } else { Vec::new() }
    }

    /// The same with another seed, however many are asked for.
    pub(super) fn seeded(&self, number: u64) -> Self {
        Self { seed: self.seed.wrapping_mul(1_000_003).wrapping_add(number), ..self.clone() }
    }

    pub(super) fn pair(&self) -> Pair {
        let mut world = LinkWorld::new(self.seed);
        let (a, b) = (world.machine(SHORE, 0), world.machine(VEHICLE, 0));
        let carriers = [self.profile.clone()];
        let (shore, vehicle) = world.join(a, b, &carriers, &self.keys(), |_| {});
        Pair { world, shore, vehicle }
    }

    /// A pair that has spoken for a while: names are agreed, loss and round trip are measured.
    pub(super) fn warm_pair(&self) -> Pair {
        let mut pair = self.pair();
        pair.warm_up(60);
        pair
    }
}

impl Pair {
    /// Lets both ends send commands to each other, one a second.
    pub(super) fn warm_up(&mut self, seconds: u64) {
        for number in 0..seconds {
            let at = self.world.now().elapsed();
            let lifespan = Duration::from_secs(60);
            let there = super::load::command(SHORE, VEHICLE, (1 << 40) + number, at, lifespan);
            let back = super::load::command(VEHICLE, SHORE, (1 << 40) + number, at, lifespan);
            self.world.offer(self.shore, there, crate::link::Class::Command);
            self.world.offer(self.vehicle, back, crate::link::Class::Command);
            self.world.run_for(Duration::from_secs(1));
        }
        self.world.run_for(Duration::from_secs(20));
        self.world.take_seen();
    }

    pub(super) fn frames(&self) -> u64 {
        let frames = |port| self.world.link(port).counters().frames_sent;
        frames(self.shore) + frames(self.vehicle)
    }

    pub(super) fn bytes(&self) -> u64 {
        self.world.bytes(self.shore) + self.world.bytes(self.vehicle)
    }
}
