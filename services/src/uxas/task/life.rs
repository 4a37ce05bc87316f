//! The life of a task: from its message to its completion, each request for itself.
//!
//! `planning` answers requests: what sensors see, options and their costs. `implementing` makes waypoints of the option
//! that was chosen. `execution` follows the vehicles that were assigned: active, complete.

mod execution;
mod implementing;
mod planning;

pub(crate) use planning::route_error;

use super::state::{State, Trigger};
use super::{Kind, Offer, Seen, View};
use crate::uxas::machine::Post;
use crate::uxas::planners::Planners;
use crate::uxas::vehicle::Vehicle;
use crate::uxas::world::World;
use aldis_envelope::Monotonic;
use aldis_envelope::lmcp::Object;
use aldis_envelope::lmcp::cmasi::{Location3D, ServiceStatusType, Task};
use aldis_envelope::lmcp::route::RoutePlanRequest;
use aldis_envelope::lmcp::uxtask::{
    TaskAssignmentSummary, TaskImplementationRequest, TaskInitialized, UniqueAutomationRequest,
};
use std::collections::{BTreeMap, BTreeSet};

/// The key of the pair in an error that names the task which cannot be planned.
pub const TASK_KEY: &str = "TaskID";

/// How many requests of a task may be under way; the oldest is dropped for a newer one.
const WORKS_MAX: usize = 64;

/// How many answers may be waited for; of requests that are over none comes.
const WAITING_MAX: usize = 65_536;

/// What the life of a task needs of its surroundings.
pub struct Context<'a, 'b> {
    /// All that is known.
    pub world: &'a World,
    /// Where messages go.
    pub post: &'a mut Post<'b>,
    /// Numbers for requests, and who made them.
    pub numbers: &'a mut Numbers,
    /// The last assignment of each request.
    pub summaries: &'a BTreeMap<i64, TaskAssignmentSummary>,
    /// Whether the earth is flat.
    pub compat: bool,
}

/// Numbers of requests, and the tasks that wait for their answers.
#[derive(Debug, Default)]
pub struct Numbers {
    /// The last number given.
    pub last: i64,
    /// Who waits, and the mailbox of the route planner that was asked.
    pub waiting: BTreeMap<i64, (i64, Option<&'static str>)>,
    /// Who answers the mailboxes.
    pub planners: Planners,
}

impl Numbers {
    fn next(&mut self, task: i64) -> i64 {
        self.last += 1;
        if self.waiting.len() >= WAITING_MAX {
            self.waiting.pop_first();
        }
        self.waiting.insert(self.last, (task, None));
        self.last
    }
}

impl Context<'_, '_> {
    /// Asks whoever plans routes for a mailbox.
    fn ask_planner(&mut self, mailbox: &'static str, request: &RoutePlanRequest) {
        self.numbers.planners.asked(mailbox, self.post.now().monotonic);
        if let Some((_, to)) = self.numbers.waiting.get_mut(&request.request_id) {
            *to = Some(mailbox);
        }
        self.post.mail(mailbox, request);
    }
}

/// What a route was asked for.
enum Asked {
    /// The ways within options of one vehicle: the choice that each route belongs to.
    Options(Vec<usize>),
    /// The waypoints of an option.
    Final(Box<TaskImplementationRequest>),
}

/// A request that the task is part of.
struct Work {
    state: State,
    request: UniqueAutomationRequest,
    seen: Seen,
    /// The number of the request for footprints that is open, and of that for roads.
    footprints: Option<i64>,
    egress: Option<(i64, Monotonic)>,
    offer: Option<Offer>,
    /// The cost of each choice, in its place: milliseconds, or why there is none.
    costs: Vec<Result<i64, String>>,
    routes: BTreeMap<i64, Asked>,
}

/// What a vehicle at a moving task was last sent to.
struct Sent {
    to: Location3D,
    at_ms: i64,
    /// The route that is asked for.
    asked: Option<i64>,
}

/// A task.
pub struct Life {
    task: Box<dyn Object>,
    id: i64,
    eligible: Vec<i64>,
    kind: Box<dyn Kind>,
    settings: BTreeMap<String, String>,
    /// Where the task itself stands; each request has a state of its own.
    state: State,
    works: BTreeMap<i64, Work>,
    assigned: BTreeSet<i64>,
    active: BTreeSet<i64>,
    sent: BTreeMap<i64, Sent>,
    /// By vehicle, what follows the task in its mission.
    passed: BTreeMap<i64, execution::Passed>,
    /// What it lacks, as far as that was told.
    told: Option<String>,
}

impl Life {
    /// The life of a task, before it is ready. None where its kind is not known.
    pub fn new(task: &dyn Object, settings: BTreeMap<String, String>) -> Option<Self> {
        let base = task.get::<Task>()?;
        Some(Self {
            id: base.task_id,
            eligible: base.eligible_entities.clone(),
            kind: super::kind_of(task)?,
            task: task.clone_box(),
            settings,
            state: State::Init,
            works: BTreeMap::new(),
            assigned: BTreeSet::new(),
            active: BTreeSet::new(),
            sent: BTreeMap::new(),
            passed: BTreeMap::new(),
            told: None,
        })
    }

    /// The task's message.
    pub fn task(&self) -> &dyn Object {
        self.task.as_ref()
    }

    /// Where the task stands: within a request, or of itself.
    pub fn state(&self, request: Option<i64>) -> Option<State> {
        match request {
            Some(request) => self.works.get(&request).map(|work| work.state),
            None => Some(self.state),
        }
    }

    /// Gets ready, or says what is missing; asked again when geometry comes.
    pub fn prepare(&mut self, context: &mut Context<'_, '_>) {
        if self.state != State::Init {
            return;
        }
        match self.kind.ready(context.world) {
            Ok(()) => {
                self.state.step(Trigger::Ready);
                for doubt in self.kind.doubts() {
                    let text = format!("task {}: {doubt}", self.id);
                    context.post.status(ServiceStatusType::Warning, &[("TaskManager", text.as_str())]);
                }
                context.post.broadcast(&TaskInitialized { task_id: self.id });
            }
            Err(why) if self.told.as_ref() != Some(&why) => {
                let text = format!("task {} cannot be planned: {why}", self.id);
                let pairs = [("TaskManager", text.as_str()), (TASK_KEY, &self.id.to_string())];
                context.post.status(ServiceStatusType::Error, &pairs);
                self.told = Some(why);
            }
            Err(_) => {}
        }
    }

    /// A request is over without it, or has failed.
    pub fn dropped(&mut self, request: i64) {
        self.works.remove(&request);
    }

    /// When it gives up waiting for roads.
    pub fn deadline(&self) -> Option<Monotonic> {
        self.works.values().filter_map(|work| work.egress).map(|(_, at)| at).min()
    }

    /// The requests under way.
    pub fn requests(&self) -> impl Iterator<Item = i64> + '_ {
        self.works.keys().copied()
    }

    /// What the kind sees, for the vehicles of a request; an empty list means all.
    fn view<'a>(&'a self, context: &Context<'a, '_>, entities: &[i64]) -> View<'a> {
        let is_asked = |id: i64| match entities {
            [] => context.world.states.contains_key(&id),
            some => some.contains(&id),
        };
        let may = |id: i64| self.eligible.is_empty() || self.eligible.contains(&id);
        let configurations = context.world.configurations.iter();
        let vehicles = configurations.filter(|(id, _)| is_asked(**id) && may(**id));
        let vehicles = vehicles.filter_map(|(_, entity)| Vehicle::of(entity.as_ref())).collect();
        View { world: context.world, vehicles, settings: &self.settings, compat: context.compat }
    }
}
