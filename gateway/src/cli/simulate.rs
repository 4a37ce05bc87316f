//! `aldis simulate`: plans a scenario, and simulated vehicles do it.

use super::exit::Failure;
use super::plan::outcome::{self, Outcome};
use super::plan::scenario::Scenario;
use super::plan::until_answered;
use super::print_line;
use aldis_envelope::Monotonic;
use aldis_envelope::lmcp::cmasi::{AutomationRequest, EntityConfiguration, EntityState};
use aldis_envelope::lmcp::decode;
use aldis_envelope::lmcp::impact::ImpactAutomationRequest;
use aldis_envelope::lmcp::uxtask::{
    CoordinatedAutomationRequest, TaskActive, TaskAutomationRequest, TaskComplete,
};
use aldis_envelope::lmcp::{Object, Struct};
use aldis_services::registry::Kind;
use aldis_services::sim::offline::{Offline, Overheard, Played};
use aldis_services::uxas::Core;
use aldis_services::uxas::clearance::clearance_m;
use aldis_services::uxas::kinematic::KinematicConfig;
use aldis_services::uxas::vehicle::Vehicle;
use aldis_services::uxas::waypoint_manager::WaypointConfig;
use aldis_services::uxas::world::World;
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::time::Duration;

/// How often vehicles tell their states, in virtual time.
const PERIOD: Duration = Duration::from_millis(500);

/// Plan a scenario and let simulated vehicles do it, in virtual time, until all tasks are complete.
///
/// DIR is as for `aldis plan`. Every vehicle with a configuration and a state turns no tighter than it may, is served its mission
/// in segments, and reports where it is; so tasks become active and complete. How near each came to a zone is measured from
/// its track.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  aldis simulate configs/scenarios/harbour --json")]
pub(crate) struct Simulate {
    /// The scenario.
    #[arg(value_name = "DIR")]
    directory: PathBuf,
    /// The longest simulated time, in seconds.
    #[arg(long, default_value_t = 36_000)]
    seconds: u64,
    /// One JSON object: `seconds` (simulated), `tasks` (`task`, `active_s`, `complete_s`), `vehicles` (`vehicle`, `clearance_m`
    /// beyond the zones' padding), `errors`.
    #[arg(long)]
    json: bool,
}

/// What was seen of a run.
#[derive(Default)]
struct Run {
    world: World,
    region: i64,
    active: BTreeMap<i64, f64>,
    complete: BTreeMap<i64, f64>,
    clearance: BTreeMap<i64, f64>,
}

impl Simulate {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let scenario = Scenario::read(&self.directory)?;
        let mut run = Run::default();
        for object in scenario.all() {
            run.world.take(object);
        }
        let mut node = Offline::new(scenario.entity, services(&scenario)).map_err(Failure::Failed)?;
        node.play(scenario.told().into_iter().map(|object| Played { at: Duration::ZERO, object }).collect());
        let mut outcome = Outcome::default();
        let mut tasks = BTreeSet::new();
        for (_, object) in scenario.requests() {
            let (region, list) = asked(object.as_ref());
            tasks.extend(list);
            run.region = region;
            let at = node.now().elapsed();
            node.play(vec![Played { at, object }]);
            let heard = until_answered(&mut node);
            outcome::hear(&mut outcome, &heard);
            heard.iter().for_each(|one| run.hear(one));
        }
        let mut errors = outcome.errors;
        let until = Monotonic::since_start(Duration::from_secs(self.seconds));
        while errors.is_empty() && !tasks.iter().all(|task| run.complete.contains_key(task)) {
            if !node.step(until) {
                let open: Vec<_> = tasks.iter().filter(|task| !run.complete.contains_key(task)).collect();
                errors.push(format!("task {open:?} is not complete after {} s", self.seconds));
            }
            node.heard().iter().for_each(|one| run.hear(one));
        }
        for (vehicle, clearance) in run.clearance.iter().filter(|(_, clearance)| **clearance < 0.0) {
            errors.push(format!(
                "vehicle {vehicle} came {:.2} m nearer to a zone than its padding",
                -clearance
            ));
        }
        run.print(self.json, node.now().elapsed().as_secs_f64(), &errors);
        match errors.is_empty() {
            true => Ok(()),
            false => Err(Failure::Failed(format!("{}: {}", self.directory.display(), errors.join("; ")))),
        }
    }
}

/// The core services, and for each vehicle the vehicle itself and the manager of its mission.
fn services(scenario: &Scenario) -> Vec<(String, Kind)> {
    let mut all = Core::pipeline(false, 0.0);
    let states: BTreeSet<i64> =
        scenario.all().filter_map(|object| object.get::<EntityState>()).map(|state| state.id).collect();
    for object in scenario.all().filter(|object| object.is_a(EntityConfiguration::TYPE)) {
        let Some(vehicle) = Vehicle::of(object).filter(|vehicle| states.contains(&vehicle.id)) else {
            continue;
        };
        all.push(Core::Waypoints(WaypointConfig::of(vehicle.id)));
        all.push(Core::Kinematic(KinematicConfig { vehicle: vehicle.id, period: PERIOD }));
    }
    all.into_iter().map(|core| (core.name().to_owned(), Kind::Core(core))).collect()
}

/// The region and the tasks of a request.
fn asked(object: &dyn Object) -> (i64, Vec<i64>) {
    let original = object.get::<AutomationRequest>().cloned();
    let trial = object.get::<ImpactAutomationRequest>().and_then(|one| one.trial_request.get().cloned());
    let task = object.get::<TaskAutomationRequest>().and_then(|one| one.original_request.get().cloned());
    let many =
        object.get::<CoordinatedAutomationRequest>().and_then(|one| one.original_request.get().cloned());
    let request = original.or(trial).or(task).or(many).unwrap_or_default();
    (request.operating_region, request.task_list)
}

impl Run {
    fn hear(&mut self, one: &Overheard) {
        let wanted = ["State", "TaskActive", "TaskComplete"];
        if !wanted.iter().any(|word| one.descriptor.ends_with(word)) {
            return;
        }
        let Ok(object) = decode(&one.content) else { return };
        let seconds = one.at.elapsed().as_secs_f64();
        if let Some(active) = object.get::<TaskActive>() {
            self.active.entry(active.task_id).or_insert(seconds);
        } else if let Some(complete) = object.get::<TaskComplete>() {
            self.complete.insert(complete.task_id, seconds);
        } else if let Some(state) = object.get::<EntityState>()
            && let Some(vehicle) =
                self.world.configurations.get(&state.id).and_then(|found| Vehicle::of(found.as_ref()))
            && let Some(at) = state.location.get()
            && let Some(clearance) = clearance_m(&self.world, self.region, &vehicle, at)
        {
            let least = self.clearance.entry(state.id).or_insert(clearance);
            *least = least.min(clearance);
        }
    }

    fn print(&self, as_json: bool, seconds: f64, errors: &[String]) {
        if as_json {
            let tasks: Vec<_> = self.complete.iter().map(|(task, complete)| {
                json!({ "task": task, "active_s": self.active.get(task), "complete_s": complete })
            }).collect();
            let vehicles: Vec<_> = self.clearance.iter().map(|(vehicle, clearance)| {
                json!({ "vehicle": vehicle, "clearance_m": (clearance * 100.0).round() / 100.0 })
            }).collect();
            print_line(json!({ "seconds": seconds, "tasks": tasks, "vehicles": vehicles, "errors": errors }));
            return;
        }
        for (task, complete) in &self.complete {
            let active = self.active.get(task).copied().unwrap_or(0.0);
            print_line(format_args!(
                "task {task:<6} active at {active:>8.1} s, complete at {complete:>8.1} s"
            ));
        }
        for (vehicle, clearance) in &self.clearance {
            print_line(format_args!(
                "vehicle {vehicle:<6} nearest to a zone: {clearance:.1} m beyond its padding"
            ));
        }
        print_line(format_args!("{seconds:.1} s simulated"));
    }
}
