//! `aldis simulate`: plans a scenario, and simulated vehicles do it.

mod control;
mod fleet;

use super::exit::Failure;
use super::plan::outcome::{self, Outcome};
use super::plan::scenario::Scenario;
use super::print_line;
use aldis_envelope::Monotonic;
use aldis_envelope::lmcp::Object;
use aldis_envelope::lmcp::cmasi::{AutomationRequest, EntityState, ServiceStatus};
use aldis_envelope::lmcp::decode;
use aldis_envelope::lmcp::impact::ImpactAutomationRequest;
use aldis_envelope::lmcp::uxtask::{
    CoordinatedAutomationRequest, TaskActive, TaskAutomationRequest, TaskComplete,
};
use aldis_services::sim::link::Profile;
use aldis_services::sim::offline::Overheard;
use aldis_services::uxas::clearance::clearance_m;
use aldis_services::uxas::machine::LOST_KEY;
use aldis_services::uxas::vehicle::Vehicle;
use aldis_services::uxas::world::World;
use control::ControlFile;
use fleet::Fleet;
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::time::Duration;

/// How long vehicles are looked at after a mission has lost its control.
const AFTER_LOSS: Duration = Duration::from_secs(60);

/// Plan a scenario and let simulated vehicles do it, in virtual time, until all tasks are complete.
///
/// DIR is as for `aldis plan`. Every vehicle with a configuration and a state turns no tighter than it may, is served its mission
/// in segments, and reports where it is; so tasks become active and complete. How near each came to a zone is measured from
/// its track.
///
/// With `--link` the planner is ashore and each vehicle is a node of its own behind a bad link. A `control.toml` in DIR names the
/// resource that the planner must control before a vehicle follows it, and who takes it over when.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  aldis simulate configs/scenarios/harbour --json\n  aldis simulate configs/scenarios/harbour --link L1\n  aldis simulate configs/scenarios/loss-of-control"
)]
pub(crate) struct Simulate {
    /// The scenario.
    #[arg(value_name = "DIR")]
    directory: PathBuf,
    /// The longest simulated time, in seconds.
    #[arg(long, default_value_t = 36_000)]
    seconds: u64,
    /// Put every vehicle behind a link: L1, L2, L3, L4 or WiFi.
    #[arg(long, value_name = "PROFILE")]
    link: Option<String>,
    /// What the troubles of the links are drawn from.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// One JSON object: `seconds` (simulated), `tasks` (`task`, `active_s`, `complete_s`), `vehicles` (`vehicle`, `clearance_m`
    /// beyond the zones' padding, `speed_m_per_s` at the end), `lost` (`vehicle`, `why`), `link_bytes`, `errors`.
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
    speed: BTreeMap<i64, f32>,
    /// Missions that lost their control, by vehicle, and why.
    lost: BTreeMap<i64, String>,
    is_ending: bool,
    link_bytes: u64,
}

impl Simulate {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let scenario = Scenario::read(&self.directory)?;
        let control = ControlFile::read(&self.directory)?;
        let profile = self.link.as_deref().map(profile).transpose()?;
        let mut run = Run::default();
        for object in scenario.all() {
            run.world.take(object);
        }
        let mut fleet = Fleet::new(&scenario, control.as_ref(), profile.as_ref(), self.seed)?;
        let mut outcome = Outcome::default();
        let mut tasks = BTreeSet::new();
        for (_, object) in scenario.requests() {
            let (region, list) = asked(object.as_ref());
            tasks.extend(list);
            run.region = region;
            let heard = fleet.ask(object);
            outcome::hear(&mut outcome, &heard);
            heard.iter().for_each(|one| run.hear(one));
        }
        let mut errors = outcome.errors;
        let mut until = Monotonic::since_start(Duration::from_secs(self.seconds));
        while errors.is_empty() && !tasks.iter().all(|task| run.complete.contains_key(task)) {
            let goes_on = fleet.step(until);
            fleet.heard().iter().for_each(|one| run.hear(one));
            if !goes_on {
                let open: Vec<_> = tasks.iter().filter(|task| !run.complete.contains_key(task)).collect();
                let seconds = fleet.now().elapsed().as_secs();
                errors.extend(run.lost.values().cloned());
                errors.push(format!("task {open:?} is not complete after {seconds} s"));
            } else if !run.lost.is_empty() && !run.is_ending {
                // Nobody does what is left: what the vehicles do now is looked at, and nothing more.
                run.is_ending = true;
                until = until.min(fleet.now() + AFTER_LOSS);
            }
        }
        for (vehicle, clearance) in run.clearance.iter().filter(|(_, clearance)| **clearance < 0.0) {
            errors.push(format!(
                "vehicle {vehicle} came {:.2} m nearer to a zone than its padding",
                -clearance
            ));
        }
        run.link_bytes = fleet.link_bytes();
        run.print(self.json, fleet.now().elapsed().as_secs_f64(), &errors);
        match errors.is_empty() {
            true => Ok(()),
            false => Err(Failure::Failed(format!("{}: {}", self.directory.display(), errors.join("; ")))),
        }
    }
}

/// A link's profile by its name.
fn profile(name: &str) -> Result<Profile, Failure> {
    Profile::named(name).ok_or_else(|| {
        let names: Vec<_> = Profile::ALL.iter().map(|profile| profile.name).collect();
        Failure::Usage(format!("`{name}` is no profile of a link: give one of {}", names.join(", ")))
    })
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
        let wanted = ["State", "TaskActive", "TaskComplete", "ServiceStatus"];
        if !wanted.iter().any(|word| one.descriptor.ends_with(word)) {
            return;
        }
        let Ok(object) = decode(&one.content) else { return };
        let seconds = one.at.elapsed().as_secs_f64();
        if let Some(active) = object.get::<TaskActive>() {
            self.active.entry(active.task_id).or_insert(seconds);
        } else if let Some(complete) = object.get::<TaskComplete>() {
            self.complete.insert(complete.task_id, seconds);
        } else if let Some(status) = object.get::<ServiceStatus>() {
            self.status(status);
        } else if let Some(state) = object.get::<EntityState>() {
            self.state(state);
        }
    }

    /// A mission may have lost its control.
    fn status(&mut self, status: &ServiceStatus) {
        let pairs: Vec<_> = status.info.iter().filter_map(|pair| pair.get()).collect();
        let vehicle = pairs.iter().find(|pair| pair.key == LOST_KEY).and_then(|pair| pair.value.parse().ok());
        if let (Some(vehicle), Some(why)) = (vehicle, pairs.first()) {
            self.lost.entry(vehicle).or_insert_with(|| why.value.to_string());
        }
    }

    fn state(&mut self, state: &EntityState) {
        self.speed.insert(state.id, state.groundspeed);
        if let Some(vehicle) =
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
                let clearance = (clearance * 100.0).round() / 100.0;
                json!({ "vehicle": vehicle, "clearance_m": clearance, "speed_m_per_s": self.speed.get(vehicle) })
            }).collect();
            let lost: Vec<_> =
                self.lost.iter().map(|(vehicle, why)| json!({ "vehicle": vehicle, "why": why })).collect();
            print_line(json!({
                "seconds": seconds, "tasks": tasks, "vehicles": vehicles, "lost": lost,
                "link_bytes": self.link_bytes, "errors": errors,
            }));
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
