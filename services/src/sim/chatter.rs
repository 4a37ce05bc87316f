//! A workload over what every node has: services that call each other, streams that everybody hears, health.
//!
//! What must hold: a call ends once, with answers or with a reason; streams come in order and their gaps are told; after all
//! faults have ended calls are answered, nothing is lost and the health of all is known to all; a start has a larger number
//! than those before it.

mod boots;
mod calls;
mod health;
mod services;
mod streams;
#[cfg(test)]
mod tests;

use super::observe::{Checker, Facts};
use super::options::Options;
use super::run::Workload;
use crate::dds::TopicRule;
use crate::node::NodeConfig;
use crate::registry;
use aldis_envelope::{
    BootId, CallId, EntityId, Fleet, GuidForm, Guids, Prefix, Refusal, ServiceId, Source, Wall,
};
use services::{Caller, Echo, Ticker, spec};
use std::time::Duration;

/// How often health is repeated.
const HEALTH_PERIOD: Duration = Duration::from_secs(5);
/// A call waits so long for its answers.
const CALL_WITHIN: Duration = Duration::from_secs(3);
/// What everybody hears.
const TICK: &str = "sim.Tick";
/// The mailbox that all echoes share.
const MAILBOX: &str = "sim.EchoBox";

/// What the services of this workload tell.
#[derive(Debug, Clone, PartialEq, Eq)]
enum ChatterFact {
    /// A call begins.
    Calls { caller: Source, id: CallId, to: Target },
    /// An answer comes.
    Answer { caller: Source, id: CallId, from: Source },
    /// A call ends.
    CallEnds { caller: Source, id: CallId, outcome: Result<(), Refusal> },
    /// A tick was heard: what the ticker numbered it, in which of its lives.
    Tick { by: Source, from: Source, life: Wall, number: u64 },
}

impl super::observe::Fact for ChatterFact {}

/// Who is called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Target {
    /// An echo that answers once.
    Echo(Source),
    /// All services of an entity.
    All(EntityId),
    /// The mailbox of the echoes.
    Mailbox,
    /// A service that is nowhere.
    Nobody,
}

/// What is wrong on purpose, to see that it is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Planted {
    /// An echo answers twice, once in twenty times.
    AnswersTwice,
    /// A ticker leaves out a number, once in twenty times.
    SkipsTick,
    /// The call of a caller is forgotten, once in twenty times.
    ForgetsEnd,
}

/// The workload.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Chatter {
    /// A fault in it.
    pub planted: Option<Planted>,
}

fn entity(number: usize) -> Option<EntityId> {
    EntityId::new(number as u64 + 1).ok()
}

fn source(entity: EntityId, service: u32) -> Option<Source> {
    ServiceId::new(service.into()).ok().map(|service| Source::new(entity, service))
}

impl Workload for Chatter {
    fn name(&self) -> &'static str {
        "chatter"
    }

    fn nodes(&self, options: &Options, facts: &Facts, random: &mut fastrand::Rng) -> Vec<NodeConfig> {
        let entities: Vec<_> = (0..options.nodes).filter_map(entity).collect();
        let Ok(fleet) = Fleet::new("sim") else { return Vec::new() };
        let guids = Guids::new(&fleet, GuidForm::Readable);
        let node = |&own: &EntityId| {
            let mut services = registry::built_in(own, &guids, HEALTH_PERIOD);
            let (facts, planted, all) = (facts.clone(), self.planted, entities.clone());
            let (ticks, calls) = (random.u64(50..=2000), random.u64(100..=4000));
            let seed = random.u64(..);
            let heard = facts.clone();
            services.extend(
                source(own, 100)
                    .map(|source| spec(source, move || Ticker::new(source, ticks, heard.clone(), planted))),
            );
            services.extend(source(own, 101).map(|source| spec(source, move || Echo::new(planted))));
            services.extend(source(own, 102).map(|source| {
                spec(source, move || Caller::new(source, all.clone(), calls, seed, facts.clone(), planted))
            }));
            NodeConfig {
                fleet: fleet.clone(),
                entities: vec![own],
                boot: BootId(0),
                // Best effort, so that every gap is there to be told.
                topics: vec![TopicRule { prefix: Prefix::all(), qos: None }],
                reliable: true,
                operators: entities.clone(),
                allow: Vec::new(),
                import: vec![Prefix::all()],
                export: vec![Prefix::all()],
                services,
                bridges: Vec::new(),
                links: Vec::new(),
            }
        };
        entities.iter().map(node).collect()
    }

    fn checkers(&self, options: &Options) -> Vec<Box<dyn Checker>> {
        vec![
            Box::new(boots::Boots::default()),
            Box::new(calls::Calls::new(options)),
            Box::new(streams::Streams::new(options)),
            Box::new(health::Health::new(options)),
        ]
    }
}
