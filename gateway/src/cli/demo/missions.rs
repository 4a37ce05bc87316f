//! The missions of the demo: shore plans the harbour scenario, is given control of the boats, and they do what is asked.

use super::board::{BOATS, Board};
use crate::cli::exit::Failure;
use crate::cli::member::{Desk, desk_service};
use crate::cli::plan::scenario::Scenario;
use aldis_envelope::lmcp::cmasi::{
    AutomationRequest, AutomationResponse, EntityConfiguration, EntityState, MissionCommand, ServiceStatus,
};
use aldis_envelope::lmcp::uxtask::{TaskActive, TaskComplete};
use aldis_envelope::lmcp::{self, Object, Struct};
use aldis_envelope::{EntityId, Envelope, Guids, Monotonic, Now, Prefix, ServiceId, Source};
use aldis_services::registry::{self, Kind};
use aldis_services::uxas::Core;
use aldis_services::uxas::control::Control;
use aldis_services::uxas::kinematic::KinematicConfig;
use aldis_services::uxas::machine::{LOST_KEY, Post};
use aldis_services::uxas::validator::failure;
use aldis_services::uxas::waypoint_manager::WaypointConfig;
use aldis_services::{Input, Outbox, ServiceSpec};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The resource of a boat that shore must control before the boat follows its missions.
pub(super) const RESOURCE: &str = "mission";

/// The scenario that is planned.
const SCENARIO: &str = include_str!("../../../../configs/scenarios/harbour/scenario.xml");

/// The services of shore: the planner's from here on, then who serves each boat its mission, then who tells the scenario.
const PLANNER: u64 = 200;
const SERVER: u64 = 220;
const TELLER: u64 = 230;

/// The services of a boat: the boat itself, and who tells it where it begins.
const VEHICLE: u64 = 100;
const BEGINNING: u64 = 120;

/// How often a boat tells its state.
const PERIOD: Duration = Duration::from_millis(100);

/// How often shore looks whether all boats are heard.
const LOOK: Duration = Duration::from_millis(200);

/// After how long a mission that was lost is planned again.
const AGAIN: Duration = Duration::from_secs(5);

/// What is to be done, and how fast boats move.
pub(super) struct Plan {
    pub(super) scenario: Scenario,
    pub(super) request: AutomationRequest,
    pace: f64,
}

impl Plan {
    /// The harbour scenario.
    pub(super) fn new(pace: f64) -> Result<Self, Failure> {
        if !(pace > 0.0 && pace <= 1000.0) {
            return Err(Failure::Usage(format!(
                "--pace {pace} is none: give a number above 0, at most 1000"
            )));
        }
        let scenario = Scenario::parse("harbour", SCENARIO)?;
        let request = scenario.requests().into_iter().find_map(|(_, object)| object.get().cloned());
        let request =
            request.ok_or_else(|| Failure::Failed("the scenario has no AutomationRequest".into()))?;
        Ok(Self { scenario, request, pace })
    }
}

/// How far the missions are.
#[derive(Debug, Clone, Default)]
pub(super) struct Progress {
    /// The missions as they were planned, by boat.
    pub(super) missions: BTreeMap<i64, MissionCommand>,
    pub(super) active: BTreeSet<i64>,
    pub(super) complete: BTreeSet<i64>,
    requests: u64,
    /// Missions that lost their control, and requests without a plan: why.
    troubles: Vec<String>,
}

impl Progress {
    /// Whether every task is complete.
    pub(super) fn is_complete(&self, plan: &Plan) -> bool {
        plan.request.task_list.iter().all(|task| self.complete.contains(task))
    }

    /// What the result says of them.
    pub(super) fn object(&self, plan: &Plan) -> Value {
        json!({
            "tasks": plan.request.task_list.len(), "active": self.active.len(), "complete": self.complete.len(),
            "boats": self.missions.len(), "requests": self.requests, "troubles": self.troubles.len(), "pace": plan.pace,
        })
    }

    /// What is not complete, and what happened on the way.
    pub(super) fn incomplete(&self, plan: &Plan) -> String {
        let open: Vec<_> =
            plan.request.task_list.iter().filter(|task| !self.complete.contains(task)).collect();
        let troubles = self.troubles.join("; ");
        format!("tasks {open:?} are not complete{}{troubles}", if troubles.is_empty() { "" } else { ": " })
    }

    /// The tasks of a boat's mission that are not complete.
    fn open_of(&self, boat: i64) -> Vec<i64> {
        let list = self.missions.get(&boat).map_or(&[][..], |mission| &mission.waypoint_list);
        let tasks: BTreeSet<i64> = list
            .iter()
            .filter_map(|at| at.get())
            .flat_map(|at| at.associated_tasks.iter().copied())
            .collect();
        tasks.difference(&self.complete).copied().collect()
    }
}

fn failed<E: std::fmt::Display>(why: E) -> Failure {
    Failure::Failed(why.to_string())
}

/// The service of shore that serves a boat its mission.
pub(super) fn server(boat: u64) -> u64 {
    SERVER + BOATS.iter().position(|&other| other == boat).unwrap_or(0) as u64
}

fn source(entity: EntityId, service: u64) -> Result<Source, Failure> {
    Ok(Source::new(entity, ServiceId::new(service).map_err(failed)?))
}

/// What plans and serves missions on shore.
pub(super) fn ashore(
    plan: &Plan,
    board: &Arc<Mutex<Board>>,
    guids: &Guids,
    shore: EntityId,
) -> Result<Vec<ServiceSpec>, Failure> {
    let mut services = Vec::new();
    let mut add = |number: u64, core: Core| -> Result<(), Failure> {
        let name = core.name();
        services.push(registry::service(source(shore, number)?, name, Kind::Core(core), guids));
        Ok(())
    };
    for (core, number) in Core::pipeline(false, 0.0).into_iter().zip(PLANNER..) {
        add(number, core)?;
    }
    for boat in BOATS {
        let control = Control::of(EntityId::new(boat).map_err(failed)?, RESOURCE);
        add(server(boat), Core::ControlledWaypoints(WaypointConfig::of(boat as i64), control))?;
    }
    let told = plan.scenario.told().into_iter().filter(|object| !object.is_a(EntityState::TYPE));
    let teller = Teller {
        board: board.clone(),
        told: told.collect(),
        request: plan.request.clone(),
        heard: BTreeSet::new(),
        next: None,
        again: BTreeMap::new(),
        is_asked: false,
    };
    let heard = [
        EntityState::TYPE,
        AutomationResponse::TYPE,
        TaskActive::TYPE,
        TaskComplete::TYPE,
        ServiceStatus::TYPE,
    ];
    let heard = heard.into_iter().flat_map(lmcp::descendants).map(|info| Prefix::new(info.full_name));
    let prefixes = heard.collect::<Result<Vec<_>, _>>().map_err(failed)?;
    services.push(desk_service(source(shore, TELLER)?, prefixes, teller));
    Ok(services)
}

/// What moves on a boat.
pub(super) fn afloat(plan: &Plan, guids: &Guids, boat: u64) -> Result<Vec<ServiceSpec>, Failure> {
    let (entity, vehicle) = (EntityId::new(boat).map_err(failed)?, boat as i64);
    let config = KinematicConfig { pace: plan.pace, ..KinematicConfig::of(vehicle, PERIOD) };
    let core = Core::GuardedKinematic(config, Control::of(entity, RESOURCE));
    let moves = registry::service(source(entity, VEHICLE)?, core.name(), Kind::Core(core), guids);
    let told = plan.scenario.told().into_iter().filter(|object| is_of(object.as_ref(), vehicle));
    let beginning = Beginning { told: told.collect(), next: None };
    Ok(vec![moves, desk_service(source(entity, BEGINNING)?, Vec::new(), beginning)])
}

/// Whether it is the configuration or the state of a boat.
fn is_of(object: &dyn Object, boat: i64) -> bool {
    object.get::<EntityConfiguration>().is_some_and(|one| one.id == boat)
        || object.get::<EntityState>().is_some_and(|one| one.id == boat)
}

/// Tells a boat what it is and where it begins.
struct Beginning {
    told: Vec<Box<dyn Object>>,
    next: Option<Monotonic>,
}

impl Desk for Beginning {
    fn take(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Started => self.next = Some(now.monotonic),
            Input::Deadline => {
                self.next = None;
                let mut post = Post::new(now, out);
                self.told.drain(..).for_each(|object| post.broadcast(object.as_ref()));
            }
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.next
    }
}

/// Tells shore's planner the scenario, asks for a plan once all boats are heard, and again for what is lost.
struct Teller {
    board: Arc<Mutex<Board>>,
    told: Vec<Box<dyn Object>>,
    request: AutomationRequest,
    heard: BTreeSet<i64>,
    next: Option<Monotonic>,
    /// Boats whose missions are lost, and when what is left of them is planned again.
    again: BTreeMap<i64, Monotonic>,
    is_asked: bool,
}

impl Teller {
    fn board(&self) -> MutexGuard<'_, Board> {
        self.board.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn look(&mut self, now: Now, out: &mut Outbox) {
        self.next = Some(now.monotonic + LOOK);
        let mut post = Post::new(now, out);
        self.told.drain(..).for_each(|object| post.broadcast(object.as_ref()));
        if !self.is_asked && self.request.entity_list.iter().all(|boat| self.heard.contains(boat)) {
            self.is_asked = true;
            self.ask(&self.request.clone(), &mut post);
        }
        let due: Vec<i64> =
            self.again.iter().filter(|(_, at)| **at <= now.monotonic).map(|(&boat, _)| boat).collect();
        for boat in due {
            self.again.remove(&boat);
            let task_list = self.board().missions.open_of(boat);
            if !task_list.is_empty() {
                let request =
                    AutomationRequest { entity_list: vec![boat], task_list, ..self.request.clone() };
                self.ask(&request, &mut post);
            }
        }
    }

    fn ask(&self, request: &AutomationRequest, post: &mut Post<'_>) {
        self.board().missions.requests += 1;
        post.broadcast(request);
    }

    fn message(&mut self, now: Now, envelope: &Envelope) {
        let Ok(object) = lmcp::decode(&envelope.message.content) else { return };
        if let Some(state) = object.get::<EntityState>() {
            self.heard.insert(state.id);
        } else if let Some(response) = object.get::<AutomationResponse>() {
            let missions = response.mission_command_list.iter().filter_map(|mission| mission.get());
            let planned = missions.map(|mission| (mission.vehicle_id, mission.clone()));
            let mut board = self.board();
            board.missions.missions.extend(planned);
            board.missions.troubles.extend(failure(response));
        } else if let Some(active) = object.get::<TaskActive>() {
            self.board().missions.active.insert(active.task_id);
        } else if let Some(complete) = object.get::<TaskComplete>() {
            self.board().missions.complete.insert(complete.task_id);
        } else if let Some(status) = object.get::<ServiceStatus>() {
            let pairs: Vec<_> = status.info.iter().filter_map(|pair| pair.get()).collect();
            let lost =
                pairs.iter().find(|pair| pair.key == LOST_KEY).and_then(|pair| pair.value.parse().ok());
            let is_own = envelope.message.label.source().entity == envelope.stamp.node;
            if let (Some(boat), Some(why), true) = (lost, pairs.first(), is_own) {
                self.board().missions.troubles.push(why.value.to_string());
                self.again.insert(boat, now.monotonic + AGAIN);
            }
        }
    }
}

impl Desk for Teller {
    fn take(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Started => self.next = Some(now.monotonic),
            Input::Deadline => self.look(now, out),
            Input::Message(envelope) => self.message(now, envelope),
            Input::Shutdown => self.next = None,
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.next
    }
}
