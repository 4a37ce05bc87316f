//! TaskManager: keeps the tasks, and lets each live.
//!
//! | what comes | what it does |
//! | --- | --- |
//! | a task | begins its life; one with its id ends before. `TaskInitialized` is told once all that it refers to is known |
//! | a task of a kind that is not known, or that lacks geometry | an error with the cause and its `TaskID` |
//! | `RemoveTasks` | ends their lives |
//! | everything else that tasks hear | goes to those that it concerns |
//!
//! Tasks are no services of their own here: nothing is written as XML and read back, and a task's answers carry this
//! service's ids. Configuration: `compat_cost`, and `[[service.task_option]]` with `task_id` or `task_type`, `name`, `value`.

use super::coordinator::Coordinator;
use super::machine::{FAILED_KEY, Heard, LOST_KEY, Machine, Post, REQUEST_KEY};
use super::planners;
use super::task::life::{Context, Life, Numbers, TASK_KEY};
use super::world::World;
use aldis_envelope::lmcp::cmasi::{EntityState, RemoveTasks, ServiceStatus, ServiceStatusType, Task};
use aldis_envelope::lmcp::route::{EgressRouteResponse, RoutePlanResponse};
use aldis_envelope::lmcp::uxtask::{
    AssignmentCoordination, AssignmentCoordinatorTask, CoordinatedAutomationRequest, SensorFootprintResponse,
    TaskAssignmentSummary, TaskAutomationResponse, TaskImplementationRequest, UniqueAutomationRequest,
    UniqueAutomationResponse,
};
use aldis_envelope::lmcp::{Object, Struct, TypeInfo};
use aldis_envelope::{Monotonic, Source};
use std::collections::BTreeMap;

/// How many assignments are remembered.
const SUMMARIES_MAX: usize = 16;

/// An option of tasks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TaskOptionRule {
    /// The task that it is for; with this and `task_type` none, for all.
    pub task_id: Option<i64>,
    /// The type of tasks that it is for.
    pub task_type: Option<String>,
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: String,
}

/// How it is configured.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TaskManagerConfig {
    /// Whether tasks measure on the reference's flat earth.
    pub compat_cost: bool,
    /// Options of tasks.
    pub options: Vec<TaskOptionRule>,
}

impl TaskManagerConfig {
    /// The options of a task: those for all, then those for its id, or else those for its type.
    pub fn options_of(&self, id: i64, full_name: &str) -> BTreeMap<String, String> {
        let global = self.options.iter().filter(|rule| rule.task_id.is_none() && rule.task_type.is_none());
        let by_id: Vec<_> = self.options.iter().filter(|rule| rule.task_id == Some(id)).collect();
        let is_of_type =
            |rule: &&TaskOptionRule| rule.task_id.is_none() && rule.task_type.as_deref() == Some(full_name);
        let by_type: Vec<_> = self.options.iter().filter(is_of_type).collect();
        let special = if by_id.is_empty() { by_type } else { by_id };
        global.chain(special).map(|rule| (rule.name.clone(), rule.value.clone())).collect()
    }
}

/// How much older than the newest a state may be that was overtaken, in milliseconds.
const OVERTAKEN_MS: i64 = 60_000;

/// The machine.
pub struct TaskManager {
    config: TaskManagerConfig,
    world: World,
    lives: BTreeMap<i64, Life>,
    numbers: Numbers,
    summaries: BTreeMap<i64, TaskAssignmentSummary>,
    coordinator: Coordinator,
}

impl TaskManager {
    /// A manager without tasks.
    pub fn new(config: TaskManagerConfig) -> Self {
        Self {
            config,
            world: World::default(),
            lives: BTreeMap::new(),
            numbers: Numbers::default(),
            summaries: BTreeMap::new(),
            coordinator: Coordinator::default(),
        }
    }

    /// The life of a task.
    pub fn life(&self, task: i64) -> Option<&Life> {
        self.lives.get(&task)
    }

    fn begin(&mut self, object: &dyn Object, id: i64, post: &mut Post<'_>) {
        let name = object.type_info().full_name;
        if object.get::<AssignmentCoordinatorTask>().is_some() {
            return self.coordinator.begin(id, post);
        }
        match Life::new(object, self.config.options_of(id, name)) {
            Some(life) => {
                self.lives.insert(id, life);
                self.each(post, |life, context| life.prepare(context));
            }
            None => {
                self.lives.remove(&id);
                let text = format!("task {id} is a {name}, which nobody here can plan");
                let pairs = [("TaskManager", text.as_str()), (TASK_KEY, &id.to_string())];
                post.status(ServiceStatusType::Error, &pairs);
            }
        }
    }

    /// Whether a state was overtaken by a newer one: what it says is over. A vehicle whose clock was set back is believed.
    fn is_old(&self, state: &EntityState) -> bool {
        let newest = self.world.states.get(&state.id).and_then(|known| known.get::<EntityState>());
        let behind = newest.map_or(0, |newest| newest.time.saturating_sub(state.time));
        state.time > 0 && (1..=OVERTAKEN_MS).contains(&behind)
    }

    /// Lets every task do something.
    fn each(&mut self, post: &mut Post<'_>, mut act: impl FnMut(&mut Life, &mut Context<'_, '_>)) {
        let Self { config, world, lives, numbers, summaries, .. } = self;
        let mut context = Context { world, post, numbers, summaries, compat: config.compat_cost };
        lives.values_mut().for_each(|life| act(life, &mut context));
    }

    /// Lets the task do something that waits for the answer with this number, which comes from this service.
    fn waiting(
        &mut self,
        number: i64,
        from: Source,
        post: &mut Post<'_>,
        act: impl FnOnce(&mut Life, &mut Context<'_, '_>),
    ) {
        let Some((task, mailbox)) = self.numbers.waiting.remove(&number) else { return };
        if let Some(mailbox) = mailbox {
            self.numbers.planners.answered(mailbox, from);
        }
        let Self { config, world, lives, numbers, summaries, .. } = self;
        let mut context = Context { world, post, numbers, summaries, compat: config.compat_cost };
        if let Some(life) = lives.get_mut(&task) {
            act(life, &mut context);
        }
    }

    /// Nobody answers a mailbox of route planners: the tasks that wait for it tell the cause.
    fn unanswered(&mut self, mailbox: &'static str, planner: Source, post: &mut Post<'_>) {
        let why = planners::cause(mailbox, planner);
        let waiting = self.numbers.waiting.iter().filter(|(_, (_, to))| *to == Some(mailbox));
        let waiting: Vec<_> = waiting.map(|(&number, (task, _))| (number, *task)).collect();
        let Self { config, world, lives, numbers, summaries, .. } = self;
        for (number, task) in waiting {
            numbers.waiting.remove(&number);
            let mut context = Context { world, post, numbers, summaries, compat: config.compat_cost };
            if let Some(life) = lives.get_mut(&task) {
                life.unrouted(number, &why, &mut context);
            }
        }
    }

    fn status(&mut self, status: &ServiceStatus, is_own: bool) {
        let pairs: Vec<_> = status.info.iter().filter_map(|one| one.get()).collect();
        let lost = pairs.iter().find(|pair| pair.key == LOST_KEY).and_then(|pair| pair.value.parse().ok());
        // What another shore has lost may be what the own one has won.
        if let Some(vehicle) = lost.filter(|_| is_own) {
            self.lives.values_mut().for_each(|life| life.lost(vehicle));
        }
        let is_failure =
            status.status_type == ServiceStatusType::Error && pairs.iter().any(|pair| pair.key == FAILED_KEY);
        let number =
            pairs.iter().find(|pair| pair.key == REQUEST_KEY).and_then(|pair| pair.value.parse().ok());
        if let Some(number) = number.filter(|_| is_failure) {
            self.lives.values_mut().for_each(|life| life.dropped(number));
        }
    }

    fn planning(&mut self, object: &dyn Object, from: Source, post: &mut Post<'_>) {
        if let Some(request) = object.get::<UniqueAutomationRequest>() {
            self.each(post, |life, context| life.requested(request, context));
        } else if let Some(response) = object.get::<SensorFootprintResponse>() {
            self.waiting(response.response_id, from, post, |life, context| {
                life.footprints(response, context)
            });
        } else if let Some(response) = object.get::<EgressRouteResponse>() {
            self.waiting(response.response_id, from, post, |life, context| life.egress(response, context));
        } else if let Some(response) = object.get::<RoutePlanResponse>() {
            self.waiting(response.response_id, from, post, |life, context| life.routes(response, context));
        } else if let Some(summary) = object.get::<TaskAssignmentSummary>() {
            self.summaries.insert(summary.corresponding_automation_request_id, summary.clone());
            while self.summaries.len() > SUMMARIES_MAX {
                self.summaries.pop_first();
            }
        } else if let Some(request) = object.get::<TaskImplementationRequest>() {
            let Self { config, world, lives, numbers, summaries, .. } = self;
            let mut context = Context { world, post, numbers, summaries, compat: config.compat_cost };
            if let Some(life) = lives.get_mut(&request.task_id) {
                life.chosen(request, &mut context);
            }
        } else if let Some(response) = object.get::<UniqueAutomationResponse>() {
            let plan = response.original_response.get().cloned().unwrap_or_default();
            self.lives.values_mut().for_each(|life| life.answered(response.response_id, &plan));
        }
    }
}

impl Machine for TaskManager {
    fn hears(&self) -> Vec<&'static TypeInfo> {
        let mut types = World::hears();
        types.extend([
            Task::TYPE,
            RemoveTasks::TYPE,
            UniqueAutomationRequest::TYPE,
            UniqueAutomationResponse::TYPE,
            SensorFootprintResponse::TYPE,
            EgressRouteResponse::TYPE,
            TaskAssignmentSummary::TYPE,
            TaskImplementationRequest::TYPE,
            ServiceStatus::TYPE,
            CoordinatedAutomationRequest::TYPE,
            AssignmentCoordination::TYPE,
            TaskAutomationResponse::TYPE,
        ]);
        types
    }

    fn start(&mut self, post: &mut Post<'_>) {
        // Answers that are told to everybody carry numbers that no other manager gives.
        let source = post.source();
        let own = (source.entity.get() & 0xffff) << 16 | u64::from(source.service.get() & 0xffff);
        self.numbers.last = (own << 24) as i64;
    }

    fn take(&mut self, heard: &Heard<'_>, post: &mut Post<'_>) {
        let object = heard.object;
        if let Some(state) = object.get::<EntityState>()
            && self.is_old(state)
        {
            return;
        }
        if self.world.take(object) {
            if let Some(state) = object.get::<EntityState>() {
                self.each(post, |life, context| life.state_of(state, context));
                self.coordinator.state_of(state);
            } else {
                self.each(post, |life, context| life.prepare(context));
            }
        } else if let Some(task) = object.get::<Task>() {
            self.begin(object, task.task_id, post);
        } else if let Some(gone) = object.get::<RemoveTasks>() {
            gone.task_list.iter().for_each(|id| drop(self.lives.remove(id)));
            self.coordinator.remove(&gone.task_list);
        } else if let Some(status) = object.get::<ServiceStatus>() {
            self.status(status, heard.source.entity == post.source().entity);
        } else if !self.coordinator.take(object, post) {
            self.planning(object, heard.source, post);
        }
    }

    fn wake(&mut self, post: &mut Post<'_>) {
        self.each(post, |life, context| life.wake(context));
        self.coordinator.wake(post);
        for (mailbox, planner) in self.numbers.planners.overdue(post.now().monotonic) {
            self.unanswered(mailbox, planner, post);
        }
    }

    fn gone(&mut self, source: Source, post: &mut Post<'_>) {
        for mailbox in self.numbers.planners.lost(source) {
            self.unanswered(mailbox, source, post);
        }
    }

    fn deadline(&self) -> Option<Monotonic> {
        let others = [self.coordinator.deadline(), self.numbers.planners.deadline()];
        self.lives.values().filter_map(Life::deadline).chain(others.into_iter().flatten()).min()
    }
}
