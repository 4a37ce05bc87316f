//! The fleet of a run: which services there are, on which nodes, and who watches them.

use super::act::Act;
use super::actors::{Captain, Maker, Stage, User};
use super::arrangement::{AUTOPILOT, Arrangement};
use super::commands::{RudderCommand, VectorCommand, steer};
use super::control::Control;
use super::flow::Flow;
use super::makers::{Allocations, Courses, Lists, Rudders};
use super::mirror::{Board, Mirror, Mirrors, Told};
use super::outside::{Calm, Outside};
use super::saboteur::Saboteur;
use super::scripted::{Helm, Scripted};
use super::tally::Tally;
use super::tamper::{Forgetful, Honest, Stale, Tamper, Unconfirmed};
use super::tampered::Tampered;
use super::watch::{Findings, Watch};
use crate::dds::{Durability, Keep, Qos, TopicRule};
use crate::node::NodeConfig;
use crate::registry;
use crate::service::{Service, ServiceSpec};
use crate::sim::observe::{Checker, Facts};
use crate::sim::options::{FaultOptions, Options};
use crate::sim::run::Workload;
use crate::umaa::allocation::{Arbiter, ArbiterSettings, Arbitration, Guard, GuardSettings, Plan, Resource};
use crate::umaa::command::{Everybody, Provider, ProviderSettings};
use aldis_envelope::umaa::{Command, ResourceAllocationCommand, ResourceAllocationPriorityCommand};
use aldis_envelope::{BootId, Prefix, ServiceId, Source};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

const SECOND: Duration = Duration::from_secs(1);
/// How long providers wait for commands that were lost: longer than a chain of faults keeps consumers away.
pub(super) const ORPHANS_WAIT: Duration = Duration::from_secs(90);

/// What is wrong on purpose, to see that it is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Planted {
    /// Guards believe reports for ever, and go by those of a while ago.
    StaleGuard,
    /// The arbiter does not wait until its report is confirmed.
    UnconfirmedControl,
    /// Providers do not hear after a crash what statuses they have left.
    ForgottenStatus,
}

impl Planted {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::StaleGuard, Self::UnconfirmedControl, Self::ForgottenStatus];

    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::StaleGuard => "stale-guard",
            Self::UnconfirmedControl => "unconfirmed-control",
            Self::ForgottenStatus => "forgotten-status",
        }
    }
}

/// The options of a seed: those of the simulator, and a bus that reorders and repeats. Every tenth seed is quiet, so that what
/// is owed in time is seen to be paid in time.
pub fn options(seed: u64) -> Options {
    let drawn = Options::draw(seed);
    let mut random = fastrand::Rng::with_seed(seed ^ 0x756d_6161_666c_6565);
    let mut share = |most: f64| if random.bool() { most * random.f64().powi(3) } else { 0.0 };
    let faults = FaultOptions {
        reordering: share(0.05),
        duplication: share(0.05),
        // A chain of faults must not outlast the waits of the machines, which are bounded.
        lasts_at_most: drawn.faults.lasts_at_most.min(25 * SECOND),
        ..drawn.faults
    };
    let faults = if seed.is_multiple_of(10) { FaultOptions::default() } else { faults };
    Options { faults, safety: 90 * SECOND, liveness: 130 * SECOND, ..drawn }
}

/// The options of a seed without faults, for a shorter time.
pub(super) fn quiet(seed: u64) -> Options {
    let (safety, liveness) = (30 * SECOND, 20 * SECOND);
    Options { nodes: 3, faults: FaultOptions::default(), safety, liveness, ..Options::draw(seed) }
}

/// The workload of one run. It is not to be used for a second one: it holds what the run has seen.
pub struct UmaaFleet {
    arrangement: Option<Arrangement>,
    planted: Option<Planted>,
    /// A breach of the ICD in place of a bug.
    sabotage: Option<Act>,
    /// How often the breach was done.
    pub(super) count: Arc<AtomicU64>,
    random: fastrand::Rng,
    is_calm: Arc<AtomicBool>,
    board: Board,
    pub(super) tally: Arc<Mutex<Tally>>,
    pub(super) findings: Arc<Mutex<Findings>>,
}

impl UmaaFleet {
    /// The fleet of a seed.
    pub fn new(seed: u64, options: &Options, planted: Option<Planted>) -> Self {
        let mut random = fastrand::Rng::with_seed(seed ^ 0x6172_7261_6e67_6564);
        let arrangement = Arrangement::draw(options.nodes, &mut random);
        Self {
            arrangement,
            planted,
            sabotage: None,
            count: Arc::default(),
            random,
            is_calm: Arc::default(),
            board: Board::default(),
            tally: Arc::default(),
            findings: Arc::default(),
        }
    }

    /// The fleet of a seed with a breach of the ICD in it, watched by the monitor alone.
    pub(super) fn broken(seed: u64, options: &Options, act: Act) -> Self {
        Self { sabotage: Some(act), ..Self::new(seed, options, None) }
    }

    fn tamper_of(&self, source: Source, arrangement: &Arrangement) -> MakeTamper {
        if let Some(act) = self.sabotage.filter(|act| act.by(arrangement) == source) {
            let count = self.count.clone();
            return Box::new(move || -> Box<dyn Tamper> { Box::new(Saboteur::new(act, count.clone())) });
        }
        let provides = [arrangement.steersman, arrangement.rudder, arrangement.lamp].contains(&source);
        match self.planted {
            Some(Planted::UnconfirmedControl) if source == arrangement.arbiter => {
                Box::new(|| -> Box<dyn Tamper> { Box::new(Unconfirmed) })
            }
            Some(Planted::StaleGuard) if provides => {
                Box::new(|| -> Box<dyn Tamper> { Box::<Stale>::default() })
            }
            Some(Planted::ForgottenStatus) if provides => {
                Box::new(|| -> Box<dyn Tamper> { Box::new(Forgetful) })
            }
            _ => Box::new(|| -> Box<dyn Tamper> { Box::new(Honest) }),
        }
    }

    fn guard_settings(&self) -> GuardSettings {
        let usual = GuardSettings::new(AUTOPILOT);
        match self.planted {
            Some(Planted::StaleGuard) => GuardSettings { reader_lease: 100_000 * SECOND, ..usual },
            _ => usual,
        }
    }
}

/// What the services say outlives their processes, on the journals of their nodes.
fn persistent() -> Vec<TopicRule> {
    let kept = Qos { durability: Durability::Persistent, keep: Keep::ByPattern, samples_max: 200_000 };
    let told = Qos { durability: Durability::Volatile, ..kept };
    let rules = [("UMAA::SO::LogReport", told), ("UMAA::", kept)];
    let rule = |(prefix, qos): (&str, Qos)| {
        let prefix = Prefix::new(prefix).ok()?;
        Some(TopicRule { prefix, qos: Some(qos) })
    };
    rules.into_iter().filter_map(rule).collect()
}

/// Makes what stands in the way of a service.
type MakeTamper = Box<dyn Fn() -> Box<dyn Tamper> + Send + Sync>;

/// Makes a service of a life.
type Make = Box<dyn Fn(u64) -> Box<dyn Service> + Send + Sync>;

fn arbiter(arrangement: &Arrangement) -> Option<Make> {
    let Arrangement { guids, arbiter, entities, .. } = arrangement.clone();
    let resource = Resource {
        id: AUTOPILOT,
        name: "autopilot".into(),
        priorities: arrangement.priorities.iter().map(|source| guids.of_service(*source)).collect(),
        related_sources: arrangement.related().to_vec(),
    };
    let settings =
        ArbiterSettings { resources: vec![resource], priority_from: entities, ..ArbiterSettings::default() };
    let arbitration = Arbitration::new(settings).ok()?;
    Some(Box::new(move |_| Box::new(Arbiter::new(arbiter, &guids, arbitration.clone()))))
}

fn provider_settings() -> ProviderSettings {
    ProviderSettings {
        validate_within: Some(5 * SECOND),
        start_within: Some(6 * SECOND),
        execute_within: Some(20 * SECOND),
        orphans_wait: ORPHANS_WAIT,
        ..ProviderSettings::default()
    }
}

fn providers(arrangement: &Arrangement, guard: GuardSettings) -> [(Source, Make); 3] {
    let Arrangement { guids, steersman, rudder, lamp, .. } = arrangement.clone();
    let (of_rudder, of_lamp) = (guids.clone(), guids.clone());
    let steers = move |_| -> Box<dyn Service> {
        let helm = Helm::new(steersman, &guids, rudder);
        let guard = Guard::new(steersman, guids.clone(), guard);
        Box::new(Provider::<VectorCommand, _, _>::new(
            steersman,
            guids.clone(),
            provider_settings(),
            helm,
            guard,
        ))
    };
    let turns = move |_| -> Box<dyn Service> {
        let guids = of_rudder.clone();
        let (scripted, guard) =
            (Scripted::new(guids.of_service(rudder), None), Guard::new(rudder, guids.clone(), guard));
        Box::new(Provider::<RudderCommand, _, _>::new(rudder, guids, provider_settings(), scripted, guard))
    };
    let lights = move |_| -> Box<dyn Service> {
        let guids = of_lamp.clone();
        let scripted = Scripted::new(guids.of_service(lamp), None);
        Box::new(Provider::<RudderCommand, _, _>::new(lamp, guids, provider_settings(), scripted, Everybody))
    };
    [(steersman, Box::new(steers)), (rudder, Box::new(turns)), (lamp, Box::new(lights))]
}

fn user<C: Command, M: Maker<C> + 'static>(
    at: Source,
    arrangement: &Arrangement,
    provider: Source,
    stage: &Stage,
    maker: impl Fn() -> M + Send + Sync + 'static,
) -> (Source, Make) {
    let (guids, stage) = (arrangement.guids.clone(), stage.clone());
    let make = move |seed| -> Box<dyn Service> {
        Box::new(User::new(at, &guids, provider, maker(), (stage.clone(), seed)))
    };
    (at, Box::new(make))
}

fn captains(arrangement: &Arrangement, stage: &Stage, random: &mut fastrand::Rng) -> Vec<(Source, Make)> {
    let captain = |(number, &at): (usize, &Source)| {
        let (guids, stage) = (arrangement.guids.clone(), stage.clone());
        let plan = Plan {
            arbiter: arrangement.guid(arrangement.arbiter),
            resource: AUTOPILOT,
            duration: random.bool().then(|| Duration::from_millis(random.u64(2_000..8_000))),
            provider: arrangement.guid(arrangement.steersman),
            command: steer(0.0, 1, ""),
        };
        let waits = 20 * SECOND * number as u32;
        let make = move |seed| -> Box<dyn Service> {
            Box::new(Captain::new(at, &guids, plan.clone(), (stage.clone(), seed), waits))
        };
        (at, Box::new(make) as Make)
    };
    arrangement.captains.iter().enumerate().map(captain).collect()
}

fn consumers(arrangement: &Arrangement, stage: &Stage) -> Vec<(Source, Make)> {
    let Arrangement { arbiter, steersman, lamp, .. } = *arrangement;
    let list: Vec<_> = arrangement.priorities.iter().map(|source| arrangement.guid(*source)).collect();
    let lists = move || Lists { resource: AUTOPILOT, consumers: list.clone() };
    let mut users = vec![
        user::<ResourceAllocationPriorityCommand, _>(arrangement.chief, arrangement, arbiter, stage, lists),
        user::<VectorCommand, _>(arrangement.pirate, arrangement, steersman, stage, || Courses),
        user::<RudderCommand, _>(arrangement.lamplighter, arrangement, lamp, stage, || Rudders),
    ];
    users.extend(arrangement.askers.iter().map(|&at| {
        user::<ResourceAllocationCommand, _>(at, arrangement, arbiter, stage, || Allocations(AUTOPILOT))
    }));
    users
}

impl Workload for UmaaFleet {
    fn name(&self) -> &'static str {
        "umaa"
    }

    fn nodes(&self, _: &Options, facts: &Facts, random: &mut fastrand::Rng) -> Vec<NodeConfig> {
        let Some(arrangement) = &self.arrangement else { return Vec::new() };
        // A breach is to be planted soon.
        let between = if self.sabotage.is_some() { 600..601 } else { 1_500..8_000 };
        let pace = Duration::from_millis(self.random.clone().u64(between));
        let stage = Stage { facts: facts.clone(), is_calm: self.is_calm.clone(), pace };
        let mut services: Vec<(Source, Make)> = Vec::new();
        services.extend(arbiter(arrangement).map(|make| (arrangement.arbiter, make)));
        services.extend(providers(arrangement, self.guard_settings()));
        services.extend(captains(arrangement, &stage, random));
        services.extend(consumers(arrangement, &stage));
        let tampered: Vec<_> = services
            .into_iter()
            .map(|(source, make)| {
                let (lives, seed) = (AtomicU64::new(0), random.u64(..));
                let (facts, tamper) = (facts.clone(), self.tamper_of(source, arrangement));
                let factory = Arc::new(move || -> Box<dyn Service> {
                    let inner = make(seed.wrapping_add(lives.fetch_add(1, Ordering::Relaxed)));
                    Box::new(Tampered::new(source, inner, tamper(), facts.clone()))
                });
                ServiceSpec { source, name: "umaa".into(), factory }
            })
            .collect();
        let node = |&entity| {
            let mut services = Vec::new();
            if let Ok(service) = ServiceId::new(140) {
                let (board, facts, told) = (self.board.clone(), facts.clone(), Told::default());
                let factory = Arc::new(move || {
                    Box::new(Mirror::new(entity, board.clone(), facts.clone(), told.clone())) as _
                });
                // The first on its node: it sees what is written before anybody answers it.
                let source = Source::new(entity, service);
                services.push(ServiceSpec { source, name: "mirror".into(), factory });
            }
            services.extend(registry::built_in(entity, &arrangement.guids, 5 * SECOND));
            services.extend(tampered.iter().filter(|spec| spec.source.entity == entity).cloned());
            NodeConfig {
                fleet: arrangement.fleet.clone(),
                entities: vec![entity],
                boot: BootId(0),
                topics: persistent(),
                reliable: true,
                operators: arrangement.entities.clone(),
                allow: Vec::new(),
                import: vec![Prefix::all()],
                export: vec![Prefix::all()],
                services,
                bridges: Vec::new(),
                links: Vec::new(),
            }
        };
        arrangement.entities.iter().map(node).collect()
    }

    fn checkers(&self, options: &Options) -> Vec<Box<dyn Checker>> {
        let Some(arrangement) = &self.arrangement else { return Vec::new() };
        let calm: Box<dyn Checker> = Box::new(Calm(self.is_calm.clone()));
        let watch: Box<dyn Checker> = Box::new(Watch::new(options, self.findings.clone()));
        if self.sabotage.is_some() {
            return vec![calm, watch];
        }
        let mut flow = Flow::default();
        flow.watch::<ResourceAllocationCommand>();
        flow.watch::<ResourceAllocationPriorityCommand>();
        flow.watch::<VectorCommand>();
        flow.watch::<RudderCommand>();
        let control = Control::new(arrangement.related());
        let owing = arrangement.captains.iter().copied().chain([arrangement.lamplighter]);
        vec![
            calm,
            Box::new(Outside::new(flow, control, self.tally.clone(), owing)),
            Box::new(Mirrors::new(self.board.clone())),
            watch,
        ]
    }
}
