//! AutomationRequestValidator: checks requests, feeds them into the system one at a time, and answers each.
//!
//! | state | what comes | what it does | next |
//! | --- | --- | --- | --- |
//! | any | a request that is not valid | answers at once, empty, with all reasons | the same |
//! | any | a valid request, a task of it known as not plannable | answers at once, empty, with the cause | the same |
//! | any | a valid request | puts it into the queue | the same |
//! | idle | the first of the queue whose tasks are all initialized | sends it as `UniqueAutomationRequest` | busy |
//! | busy | the `UniqueAutomationResponse` of it | answers in the kind of the request | idle |
//! | busy | an error that names it | answers at once, empty, with the cause | idle |
//! | busy | `MaxResponseTime_ms` after it was sent | answers, empty, and says what was silent; an error tells all others | idle |
//! | any | `MaxResponseTime_ms` after a request came whose tasks are not initialized | answers, empty | the same |
//!
//! A request that waits for its tasks holds up no other. Configuration: `max_response_time_ms` (5000, at least 10).

mod check;
mod pending;
#[cfg(test)]
mod tests;

use super::machine::{FAILED_KEY, Heard, Machine, Post, REQUEST_KEY, pair};
use super::task::life::TASK_KEY;
use super::world::World;
use aldis_envelope::Monotonic;
use aldis_envelope::lmcp::cmasi::{
    AutomationRequest, AutomationResponse, RemoveTasks, ServiceStatus, ServiceStatusType, Task,
};
use aldis_envelope::lmcp::impact::{ImpactAutomationRequest, ImpactAutomationResponse};
use aldis_envelope::lmcp::uxtask::{
    AssignmentCostMatrix, TaskAssignmentSummary, TaskAutomationRequest, TaskAutomationResponse,
    TaskInitialized, TaskPlanOptions, UniqueAutomationRequest, UniqueAutomationResponse,
};
use aldis_envelope::lmcp::{Object, Ref, Struct, TypeInfo};
pub use check::check;
use pending::{Asker, Pending, Progress};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

/// The key of the pair that says why a request is refused.
const KEY: &str = "RequestValidator";

/// How many texts of errors an answer holds, as the model limits them.
const INFO_MAX: usize = 8;

/// How many requests may wait; a further one is refused.
const WAITING_MAX: usize = 1024;

/// How it is configured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ValidatorConfig {
    /// How long an answer may take.
    pub max_response_time: Duration,
}

impl Default for ValidatorConfig {
    fn default() -> Self {
        Self { max_response_time: Duration::from_secs(5) }
    }
}

/// The machine.
pub struct Validator {
    config: ValidatorConfig,
    world: World,
    tasks: BTreeMap<i64, Box<dyn Object>>,
    initialized: BTreeSet<i64>,
    /// Tasks that cannot be planned, and why.
    faulty: BTreeMap<i64, String>,
    waiting: VecDeque<Pending>,
    /// The request in flight.
    sent: Option<(Pending, Progress)>,
    last_id: i64,
}

impl Validator {
    /// A validator that knows nothing yet.
    pub fn new(config: ValidatorConfig) -> Self {
        let max_response_time = config.max_response_time.max(Duration::from_millis(10));
        Self {
            config: ValidatorConfig { max_response_time },
            world: World::default(),
            tasks: BTreeMap::new(),
            initialized: BTreeSet::new(),
            faulty: BTreeMap::new(),
            waiting: VecDeque::new(),
            sent: None,
            last_id: 0,
        }
    }

    /// Takes a request of whatever kind.
    fn request(&mut self, asker: Asker, request: UniqueAutomationRequest, post: &mut Post<'_>) {
        let number = request.request_id;
        let is_known = self
            .waiting
            .iter()
            .chain(self.sent.as_ref().map(|(sent, _)| sent))
            .any(|p| p.request.request_id == number);
        let deadline = post.now().monotonic + self.config.max_response_time;
        let pending = Pending { asker, request, deadline };
        let refusal = match check(&self.world, &self.tasks, &pending.request) {
            _ if is_known => Some(format!("- a request with the id {number} is under way already.\n")),
            _ if self.waiting.len() >= WAITING_MAX => {
                Some(format!("- {WAITING_MAX} requests are waiting already.\n"))
            }
            Err(reasons) => Some(reasons),
            Ok(()) => None,
        };
        if let Some(reasons) = refusal {
            let text = format!("Automation Request ID[{number}] Not Ready ::\n{reasons}");
            return answer_empty(&pending, &[(KEY.to_owned(), text)], post);
        }
        self.waiting.push_back(pending);
        self.next(post);
    }

    /// Answers what cannot be planned, and sends the first that can where none is in flight.
    fn next(&mut self, post: &mut Post<'_>) {
        let mut left = VecDeque::new();
        for pending in std::mem::take(&mut self.waiting) {
            let faults: Vec<_> = pending.tasks().iter().filter_map(|task| self.faulty.get(task)).collect();
            if faults.is_empty() {
                left.push_back(pending);
                continue;
            }
            let told: Vec<_> = faults.into_iter().map(|why| (KEY.to_owned(), format!("- {why}\n"))).collect();
            answer_empty(&pending, &told, post);
        }
        self.waiting = left;
        if self.sent.is_some() {
            return;
        }
        let is_ready = |pending: &Pending| pending.tasks().iter().all(|task| self.initialized.contains(task));
        let Some(at) = self.waiting.iter().position(is_ready) else { return };
        let Some(mut pending) = self.waiting.remove(at) else { return };
        pending.deadline = post.now().monotonic + self.config.max_response_time;
        let request = pending.request.clone();
        self.sent = Some((pending, Progress::default()));
        post.broadcast(&request);
        post.information(&format!("UniqueAutomationRequest[{}] - sent", request.request_id), "");
    }

    /// The plan has come.
    fn response(&mut self, response: &UniqueAutomationResponse, post: &mut Post<'_>) {
        let is_it =
            |(pending, _): &mut (Pending, Progress)| pending.request.request_id == response.response_id;
        let Some((pending, _)) = self.sent.take_if(is_it) else { return };
        let original = response.original_response.get().cloned().unwrap_or_default();
        pending.answer(original, response.final_states.clone(), post);
        self.next(post);
    }

    /// An error is told: of the request in flight, of a task, or of something else.
    fn status(&mut self, status: &ServiceStatus, post: &mut Post<'_>) {
        if status.status_type != ServiceStatusType::Error {
            return;
        }
        let pairs: Vec<_> = status.info.iter().filter_map(|one| one.get()).collect();
        let number = |key: &str| {
            pairs.iter().find(|pair| pair.key == key).and_then(|pair| pair.value.parse::<i64>().ok())
        };
        let texts: Vec<_> = pairs
            .iter()
            .filter(|pair| pair.key != REQUEST_KEY && pair.key != TASK_KEY)
            .map(|pair| (pair.key.to_string(), pair.value.to_string()))
            .collect();
        if let Some(task) = number(TASK_KEY) {
            let why = texts
                .first()
                .map_or_else(|| format!("task {task} cannot be planned"), |(_, why)| why.clone());
            self.faulty.insert(task, why);
            return self.next(post);
        }
        let named = number(REQUEST_KEY);
        let Some((pending, progress)) = &mut self.sent else { return };
        progress.texts.extend(texts);
        progress.texts.truncate(INFO_MAX - 1);
        if named == Some(pending.request.request_id) {
            let (pending, progress) = (pending.clone(), std::mem::take(progress));
            self.sent = None;
            answer_empty(&pending, &progress.texts, post);
            self.next(post);
        }
    }

    fn task(&mut self, task: &dyn Object, id: i64) {
        self.initialized.remove(&id);
        self.faulty.remove(&id);
        self.tasks.insert(id, task.clone_box());
    }

    fn automation_request(&mut self, object: &dyn Object, post: &mut Post<'_>) -> bool {
        if let Some(request) = object.get::<AutomationRequest>() {
            self.last_id = (self.last_id + 1).max(post.wall_ms());
            let unique = UniqueAutomationRequest {
                request_id: self.last_id,
                original_request: Ref::new(request.clone()),
                ..UniqueAutomationRequest::default()
            };
            self.request(Asker::Plain, unique, post);
        } else if let Some(request) = object.get::<ImpactAutomationRequest>() {
            let unique = UniqueAutomationRequest {
                request_id: request.request_id,
                original_request: request.trial_request.clone(),
                // A trial never moves a vehicle, whatever it says of itself.
                sand_box_request: true,
                ..UniqueAutomationRequest::default()
            };
            let (play, solution) = (request.play_id, request.solution_id);
            self.request(Asker::Impact { play, solution }, unique, post);
        } else if let Some(request) = object.get::<TaskAutomationRequest>() {
            let unique = UniqueAutomationRequest {
                request_id: request.request_id,
                original_request: request.original_request.clone(),
                sand_box_request: request.sand_box_request,
                planning_states: request.planning_states.clone(),
            };
            self.request(Asker::Task, unique, post);
        } else {
            return false;
        }
        true
    }
}

/// Answers a request without a plan, in its own kind, and says why.
fn answer_empty(pending: &Pending, reasons: &[(String, String)], post: &mut Post<'_>) {
    let info = reasons.iter().take(INFO_MAX).map(|(key, value)| pair(key, value)).collect();
    pending.answer(AutomationResponse { info, ..AutomationResponse::default() }, Vec::new(), post);
}

impl Machine for Validator {
    fn hears(&self) -> Vec<&'static TypeInfo> {
        let mut types = World::hears();
        types.extend([
            AutomationRequest::TYPE,
            ImpactAutomationRequest::TYPE,
            TaskAutomationRequest::TYPE,
            UniqueAutomationResponse::TYPE,
            Task::TYPE,
            RemoveTasks::TYPE,
            TaskInitialized::TYPE,
            ServiceStatus::TYPE,
            TaskPlanOptions::TYPE,
            AssignmentCostMatrix::TYPE,
            TaskAssignmentSummary::TYPE,
        ]);
        types
    }

    fn take(&mut self, heard: &Heard<'_>, post: &mut Post<'_>) {
        let object = heard.object;
        if self.world.take(object) || self.automation_request(object, post) {
            return;
        }
        if let Some(task) = object.get::<Task>() {
            self.task(object, task.task_id);
        } else if let Some(gone) = object.get::<RemoveTasks>() {
            for id in &gone.task_list {
                self.tasks.remove(id);
                self.initialized.remove(id);
                self.faulty.remove(id);
            }
        } else if let Some(ready) = object.get::<TaskInitialized>() {
            self.initialized.insert(ready.task_id);
            self.faulty.remove(&ready.task_id);
            self.next(post);
        } else if let Some(response) = object.get::<UniqueAutomationResponse>() {
            self.response(response, post);
        } else if let Some(status) = object.get::<ServiceStatus>() {
            self.status(status, post);
        } else if let Some((pending, progress)) = &mut self.sent {
            progress.hear(pending.request.request_id, object);
        }
    }

    fn wake(&mut self, post: &mut Post<'_>) {
        let now = post.now().monotonic;
        if let Some((pending, mut progress)) = self.sent.take_if(|(pending, _)| pending.deadline <= now) {
            let id = pending.request.request_id;
            let silent = progress.silent(&pending);
            let text = format!(
                "- automation request ID[{id}] was not ready in time and was not sent.\n- {silent}\n"
            );
            // All who wait for it forget it.
            post.failed(id, &silent);
            progress.texts.push((KEY.to_owned(), text));
            answer_empty(&pending, &progress.texts, post);
        }
        while let Some(at) =
            self.waiting.iter().position(|pending| pending.deadline <= now && !self.is_ready(pending))
        {
            let Some(pending) = self.waiting.remove(at) else { break };
            let late: Vec<_> =
                pending.tasks().iter().filter(|task| !self.initialized.contains(task)).collect();
            let id = pending.request.request_id;
            let text = format!(
                "- automation request ID[{id}] was not able to properly initialize all requested tasks\n- \
                 not initialized: {late:?}\n"
            );
            answer_empty(&pending, &[(KEY.to_owned(), text)], post);
        }
        self.next(post);
    }

    fn deadline(&self) -> Option<Monotonic> {
        let unready = self.waiting.iter().filter(|pending| !self.is_ready(pending));
        let sent = self.sent.as_ref().map(|(pending, _)| pending.deadline);
        unready.map(|pending| pending.deadline).chain(sent).min()
    }
}

impl Validator {
    fn is_ready(&self, pending: &Pending) -> bool {
        pending.tasks().iter().all(|task| self.initialized.contains(task))
    }
}

/// Whether an answer says that a request failed.
pub fn failure(response: &AutomationResponse) -> Option<String> {
    let pairs: Vec<_> = response.info.iter().filter_map(|one| one.get()).collect();
    let is_cause = |key: &str| key == KEY || key == FAILED_KEY;
    let is_empty = response.mission_command_list.is_empty();
    let told: Vec<_> = pairs
        .iter()
        .filter(|pair| is_empty || is_cause(&pair.key))
        .map(|pair| pair.value.trim().to_owned())
        .collect();
    (!told.is_empty() || is_empty).then(|| told.join("; "))
}

impl Pending {
    /// Sends the answer, in the kind of the request.
    fn answer(
        &self,
        response: AutomationResponse,
        final_states: Vec<Ref<aldis_envelope::lmcp::uxtask::PlanningState>>,
        post: &mut Post<'_>,
    ) {
        let number = self.request.request_id;
        match self.asker {
            Asker::Plain => post.broadcast(&response),
            Asker::Impact { play, solution } => post.broadcast(&ImpactAutomationResponse {
                response_id: number,
                trial_response: Ref::new(response),
                play_id: play,
                solution_id: solution,
                sandbox: true,
                ..ImpactAutomationResponse::default()
            }),
            Asker::Task => post.broadcast(&TaskAutomationResponse {
                response_id: number,
                original_response: Ref::new(response),
                final_states,
            }),
        }
    }
}
