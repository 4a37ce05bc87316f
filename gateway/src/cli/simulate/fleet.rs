//! The nodes of a simulated scenario: one alone, or ashore and on each vehicle one.

use super::control::ControlFile;
use crate::cli::exit::Failure;
use crate::cli::plan::outcome;
use crate::cli::plan::scenario::Scenario;
use aldis_envelope::lmcp::cmasi::{EntityConfiguration, EntityState};
use aldis_envelope::lmcp::{Object, Struct, natural_key};
use aldis_envelope::{EntityId, Monotonic};
use aldis_services::registry::Kind;
use aldis_services::sim::link::Profile;
use aldis_services::sim::mission::{Member, Missions};
use aldis_services::sim::offline::{Offline, Overheard, Played};
use aldis_services::uxas::Core;
use aldis_services::uxas::control::Control;
use aldis_services::uxas::kinematic::KinematicConfig;
use aldis_services::uxas::vehicle::Vehicle;
use aldis_services::uxas::waypoint_manager::WaypointConfig;
use std::collections::BTreeSet;
use std::time::Duration;

/// How often vehicles tell their states, in virtual time.
const PERIOD: Duration = Duration::from_millis(500);

/// How far time goes on between two looks at what many nodes heard.
const LOOK: Duration = Duration::from_millis(100);

/// How long an answer is waited for: longer than any planner may take.
const ANSWER_WITHIN: Duration = Duration::from_secs(60);

/// The nodes.
pub(super) enum Fleet {
    /// All services on one.
    One(Box<Offline>),
    /// The planner's first, then one for each of these vehicles.
    Many(Box<Missions>, Vec<i64>),
}

impl Fleet {
    /// The nodes of a scenario, to which everything but its requests is told.
    pub(super) fn new(
        scenario: &Scenario,
        control: Option<&ControlFile>,
        profile: Option<&Profile>,
        seed: u64,
    ) -> Result<Self, Failure> {
        let vehicles = vehicles(scenario);
        if control.is_none() && profile.is_none() {
            let mut cores = Core::pipeline(false, 0.0);
            for &vehicle in &vehicles {
                cores.push(Core::Waypoints(WaypointConfig::of(vehicle)));
                cores.push(Core::Kinematic(KinematicConfig::of(vehicle, PERIOD)));
            }
            let mut node = Offline::new(scenario.entity, named(cores)).map_err(Failure::Failed)?;
            node.play(at_once(scenario.told()));
            return Ok(Self::One(Box::new(node)));
        }
        let members = members(scenario, &vehicles, control)?;
        let mut missions = Missions::new(seed, profile, 1, members).map_err(Failure::Failed)?;
        missions.play(0, at_once(scenario.told()));
        for (member, &vehicle) in (1..).zip(&vehicles) {
            let told = scenario.told().into_iter();
            missions.play(member, at_once(told.filter(|object| is_of(object.as_ref(), vehicle)).collect()));
        }
        Ok(Self::Many(Box::new(missions), vehicles))
    }

    /// Tells the planner a request, and waits for the answer; what was heard until then.
    pub(super) fn ask(&mut self, object: Box<dyn Object>) -> Vec<Overheard> {
        let now = self.now();
        let played = vec![Played { at: now.elapsed(), object }];
        match self {
            Self::One(node) => node.play(played),
            Self::Many(missions, _) => missions.play(0, played),
        }
        let mut heard = Vec::new();
        loop {
            let news = self.heard();
            let is_answered = news.iter().any(|one| outcome::is_answer(&one.descriptor));
            heard.extend(news);
            if is_answered || !self.step(now + ANSWER_WITHIN) {
                heard.extend(self.heard());
                return heard;
            }
        }
    }

    /// The virtual time.
    pub(super) fn now(&self) -> Monotonic {
        match self {
            Self::One(node) => node.now(),
            Self::Many(missions, _) => missions.now(),
        }
    }

    /// Goes on, but not beyond `until`; whether there is anything to come.
    pub(super) fn step(&mut self, until: Monotonic) -> bool {
        match self {
            Self::One(node) => node.step(until),
            Self::Many(missions, _) => {
                missions.run_for(LOOK);
                missions.now() < until
            }
        }
    }

    /// What was heard since this was last asked: of states those that vehicles tell themselves, of all else what the planner hears.
    pub(super) fn heard(&mut self) -> Vec<Overheard> {
        let (missions, vehicles) = match self {
            Self::One(node) => return node.heard(),
            Self::Many(missions, vehicles) => (missions, vehicles),
        };
        let is_state = |one: &Overheard| one.descriptor.ends_with("State");
        let mut all: Vec<Overheard> = missions.heard(0).into_iter().filter(|one| !is_state(one)).collect();
        for (member, &vehicle) in (1..).zip(vehicles.iter()) {
            let is_own = |one: &Overheard| natural_key(&one.descriptor, &one.content) == Some(vehicle);
            all.extend(missions.heard(member).into_iter().filter(|one| is_state(one) && is_own(one)));
        }
        all
    }

    /// Bytes on the links.
    pub(super) fn link_bytes(&self) -> u64 {
        match self {
            Self::One(_) => 0,
            Self::Many(missions, _) => missions.link_bytes(),
        }
    }
}

/// The planner's node and the vehicles' nodes.
fn members(
    scenario: &Scenario,
    vehicles: &[i64],
    control: Option<&ControlFile>,
) -> Result<Vec<Member>, Failure> {
    let entity = |vehicle: i64| {
        let number = u64::try_from(vehicle).unwrap_or(0);
        match EntityId::new(number) {
            Ok(entity) if entity != scenario.entity => Ok(entity),
            Ok(entity) => {
                Err(Failure::Usage(format!("vehicle {entity} plans itself: simulate it without --link")))
            }
            Err(why) => Err(Failure::Usage(format!("vehicle {vehicle} cannot be a node: {why}"))),
        }
    };
    let mut cores = Core::pipeline(false, 0.0);
    let before = cores.len();
    for &vehicle in vehicles {
        let config = WaypointConfig::of(vehicle);
        cores.push(match control {
            Some(file) => Core::ControlledWaypoints(config, Control::of(entity(vehicle)?, &file.resource)),
            None => Core::Waypoints(config),
        });
    }
    let mut shore = Member::new(scenario.entity, named(cores));
    if let Some(file) = control {
        shore.takes_over = file.takes_over().map_err(Failure::Usage)?;
    }
    let mut members = Vec::new();
    for (place, &vehicle) in (before..).zip(vehicles) {
        let config = KinematicConfig::of(vehicle, PERIOD);
        let own = entity(vehicle)?;
        let core = match control {
            Some(file) => Core::GuardedKinematic(config, Control::of(own, &file.resource)),
            None => Core::Kinematic(config),
        };
        let resource =
            control.map(|file| (file.resource.clone(), vec![shore.source(place), shore.operator()]));
        members.push(Member { resource, ..Member::new(own, named(vec![core])) });
    }
    members.insert(0, shore);
    Ok(members)
}

/// The vehicles with a configuration and a state.
fn vehicles(scenario: &Scenario) -> Vec<i64> {
    let states: BTreeSet<i64> =
        scenario.all().filter_map(|object| object.get::<EntityState>()).map(|state| state.id).collect();
    let configured = scenario.all().filter(|object| object.is_a(EntityConfiguration::TYPE));
    let known = configured.filter_map(Vehicle::of).map(|vehicle| vehicle.id);
    known.filter(|id| states.contains(id)).collect::<BTreeSet<_>>().into_iter().collect()
}

/// Whether it is the configuration or the state of a vehicle.
fn is_of(object: &dyn Object, vehicle: i64) -> bool {
    object.get::<EntityConfiguration>().is_some_and(|one| one.id == vehicle)
        || object.get::<EntityState>().is_some_and(|one| one.id == vehicle)
}

fn named(cores: Vec<Core>) -> Vec<(String, Kind)> {
    cores.into_iter().map(|core| (core.name().to_owned(), Kind::Core(core))).collect()
}

fn at_once(objects: Vec<Box<dyn Object>>) -> Vec<Played> {
    objects.into_iter().map(|object| Played { at: Duration::ZERO, object }).collect()
}
