//! AssignmentTreeBranchBound: who does what, in which order.
//!
//! | state | what comes | what it does | next |
//! | --- | --- | --- | --- |
//! | idle | `UniqueAutomationRequest` | remembers it | wait |
//! | wait | `TaskPlanOptions` | keeps them | wait |
//! | wait | the last of options and `AssignmentCostMatrix` | begins the search, outside the loop | search |
//! | search | the plan | `TaskAssignmentSummary`, with a certificate in a `ServiceStatus` | idle |
//! | search | no plan | an error with the cause: at once | idle |
//! | any | an error that names the request, or its answer | forgets it | idle |
//!
//! Each request has a state of its own. Configuration: `number_nodes_maximum` (0: the default budget; the search ends
//! sooner where its plan is proven best), `cost_function` (`MINMAX`, `CUMULATIVE`), `precedence` (`choice`, `temporal`),
//! `leave_out` (false: tasks that the relationships do not name are a mistake).

mod dominated;

use super::machine::{FAILED_KEY, Heard, Machine, Post, REQUEST_KEY};
use crate::plan::algebra::Unnamed;
use crate::plan::assignment::{
    AssignError, Effort, Objective, Plan, Precedence, Request, Task, TaskOption, Travel, assign,
};
use crate::service::JobOutput;
use aldis_envelope::lmcp::cmasi::{ServiceStatus, ServiceStatusType};
use aldis_envelope::lmcp::uxtask::{
    AssignmentCostMatrix, TaskAssignment, TaskAssignmentSummary, TaskOptionCost, TaskPlanOptions,
    UniqueAutomationRequest, UniqueAutomationResponse,
};
use aldis_envelope::lmcp::{Ref, Struct, TypeInfo};
use std::collections::{BTreeMap, BTreeSet};

/// How many requests may be under way; the oldest is dropped for a newer one.
const REQUESTS_MAX: usize = 64;

/// The key of the pairs that tell how good a plan is.
pub const CERTIFICATE_KEYS: [&str; 5] = ["makespan_ms", "total_ms", "bound_ms", "gap", "proven"];

/// How it is configured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TreeConfig {
    /// The budget of the search; 0 or less means the default.
    pub number_nodes_maximum: i64,
    /// What must be small.
    pub objective: Objective,
    /// What `.` means between vehicles.
    pub precedence: Precedence,
    /// What becomes of tasks that the relationships do not name.
    pub unnamed: Unnamed,
}

impl Default for TreeConfig {
    fn default() -> Self {
        Self {
            number_nodes_maximum: 0,
            objective: Objective::MinMax,
            precedence: Precedence::Choice,
            unnamed: Unnamed::Refuse,
        }
    }
}

/// A request that is waited for.
struct Waiting {
    tasks: Vec<i64>,
    relationships: String,
    region: i64,
    entities: Vec<i64>,
    options: BTreeMap<i64, TaskPlanOptions>,
    rows: Vec<Ref<TaskOptionCost>>,
    has_matrix: bool,
    searching: bool,
}

/// The machine.
pub struct Tree {
    config: TreeConfig,
    waiting: BTreeMap<i64, Waiting>,
}

impl Tree {
    /// A service that waits for nothing.
    pub fn new(config: TreeConfig) -> Self {
        Self { config, waiting: BTreeMap::new() }
    }

    fn begin(&mut self, request: &UniqueAutomationRequest) {
        let Some(asked) = request.original_request.get() else { return };
        while self.waiting.len() >= REQUESTS_MAX {
            self.waiting.pop_first();
        }
        self.waiting.entry(request.request_id).or_insert_with(|| Waiting {
            tasks: asked.task_list.clone(),
            relationships: asked.task_relationships.to_string(),
            region: asked.operating_region,
            entities: asked.entity_list.clone(),
            options: BTreeMap::new(),
            rows: Vec::new(),
            has_matrix: false,
            searching: false,
        });
    }

    fn options(&mut self, options: &TaskPlanOptions, post: &mut Post<'_>) {
        let number = options.corresponding_automation_request_id;
        if let Some(waiting) = self.waiting.get_mut(&number)
            && waiting.tasks.contains(&options.task_id)
        {
            waiting.options.entry(options.task_id).or_insert_with(|| options.clone());
            self.search(number, post);
        }
    }

    fn matrix(&mut self, matrix: &AssignmentCostMatrix, post: &mut Post<'_>) {
        let number = matrix.corresponding_automation_request_id;
        let Some(waiting) = self.waiting.get_mut(&number).filter(|waiting| !waiting.has_matrix) else {
            return;
        };
        waiting.rows.extend(matrix.cost_matrix.iter().cloned());
        // A part without a list of tasks is followed by another.
        waiting.has_matrix = !matrix.task_list.is_empty();
        self.search(number, post);
    }

    /// Begins the search once all is there.
    fn search(&mut self, number: i64, post: &mut Post<'_>) {
        let config = self.config;
        let Some(waiting) = self.waiting.get_mut(&number) else { return };
        let is_whole =
            waiting.has_matrix && waiting.tasks.iter().all(|task| waiting.options.contains_key(task));
        if !is_whole || std::mem::replace(&mut waiting.searching, true) {
            return;
        }
        let mut request = waiting.request(config);
        let nodes = u64::try_from(config.number_nodes_maximum).ok().filter(|&nodes| nodes > 0);
        let effort = Effort { nodes: nodes.unwrap_or(Effort::default().nodes), ..Effort::default() };
        post.job(
            number as u64,
            Box::new(move || {
                dominated::without_dominated(&mut request);
                Box::new(assign(&request, effort))
            }),
        );
    }

    fn found(&mut self, number: i64, plan: &Plan, post: &mut Post<'_>) {
        let Some(waiting) = self.waiting.remove(&number) else { return };
        let assignment = |one: &crate::plan::assignment::Assignment| {
            Ref::new(TaskAssignment {
                task_id: one.task,
                option_id: one.option,
                assigned_vehicle: one.vehicle,
                time_threshold: one.threshold_ms,
                time_task_completed: one.completed_ms,
            })
        };
        let certificate = plan.certificate;
        let values = [
            plan.makespan_ms.to_string(),
            plan.total_ms.to_string(),
            certificate.bound_ms.to_string(),
            certificate.gap.to_string(),
            certificate.proven.to_string(),
        ];
        let number_text = number.to_string();
        let mut pairs = vec![("AssignmentComplete", ""), (REQUEST_KEY, number_text.as_str())];
        pairs.extend(CERTIFICATE_KEYS.iter().copied().zip(values.iter().map(String::as_str)));
        post.status(ServiceStatusType::Information, &pairs);
        post.broadcast(&TaskAssignmentSummary {
            corresponding_automation_request_id: number,
            operating_region: waiting.region,
            task_list: plan.assignments.iter().map(assignment).collect(),
        });
    }

    fn status(&mut self, status: &ServiceStatus) {
        let pairs: Vec<_> = status.info.iter().filter_map(|one| one.get()).collect();
        let failed =
            status.status_type == ServiceStatusType::Error && pairs.iter().any(|pair| pair.key == FAILED_KEY);
        let number =
            pairs.iter().find(|pair| pair.key == REQUEST_KEY).and_then(|pair| pair.value.parse::<i64>().ok());
        if let Some(number) = number.filter(|_| failed) {
            self.waiting.remove(&number);
        }
    }
}

impl Waiting {
    fn request(&self, config: TreeConfig) -> Request {
        let mut tasks = BTreeMap::new();
        for options in self.options.values() {
            let option = |one: &aldis_envelope::lmcp::uxtask::TaskOption| {
                let eligible = one.eligible_entities.clone();
                (one.option_id, TaskOption { cost_ms: one.cost, eligible })
            };
            let by_id = options.options.iter().filter_map(|one| one.get()).map(option).collect();
            tasks.insert(
                options.task_id,
                Task { composition: options.composition.to_string(), options: by_id },
            );
        }
        let rows = || self.rows.iter().filter_map(|row| row.get());
        let mut vehicles: BTreeSet<i64> = rows().map(|row| row.vehicle_id).collect();
        vehicles.extend(&self.entities);
        let way = |row: &TaskOptionCost| Travel {
            vehicle: row.vehicle_id,
            from: (row.intial_task_id != 0).then_some((row.intial_task_id, row.intial_task_option)),
            to: (row.destination_task_id, row.destination_task_option),
            time_ms: row.time_to_go,
        };
        Request {
            relationships: self.relationships.clone(),
            vehicles: vehicles.into_iter().collect(),
            tasks,
            travel: rows().map(way).collect(),
            objective: config.objective,
            precedence: config.precedence,
            unnamed: config.unnamed,
        }
    }
}

impl Machine for Tree {
    fn hears(&self) -> Vec<&'static TypeInfo> {
        vec![
            UniqueAutomationRequest::TYPE,
            UniqueAutomationResponse::TYPE,
            TaskPlanOptions::TYPE,
            AssignmentCostMatrix::TYPE,
            ServiceStatus::TYPE,
        ]
    }

    fn take(&mut self, heard: &Heard<'_>, post: &mut Post<'_>) {
        let object = heard.object;
        if let Some(request) = object.get::<UniqueAutomationRequest>() {
            self.begin(request);
        } else if let Some(options) = object.get::<TaskPlanOptions>() {
            self.options(options, post);
        } else if let Some(matrix) = object.get::<AssignmentCostMatrix>() {
            self.matrix(matrix, post);
        } else if let Some(response) = object.get::<UniqueAutomationResponse>() {
            self.waiting.remove(&response.response_id);
        } else if let Some(status) = object.get::<ServiceStatus>() {
            self.status(status);
        }
    }

    fn done(&mut self, number: u64, output: Result<JobOutput, String>, post: &mut Post<'_>) {
        let number = number as i64;
        let why = match output.map(|output| output.downcast::<Result<Plan, AssignError>>()) {
            Ok(Ok(found)) => match *found {
                Ok(plan) => return self.found(number, &plan, post),
                Err(why) => format!("AssignmentTree: {why}"),
            },
            Ok(Err(_)) => "AssignmentTree: the search returned something else than a plan".to_owned(),
            Err(panic) => format!("AssignmentTree: the search panicked: {panic}"),
        };
        if self.waiting.remove(&number).is_some() {
            post.failed(number, &why);
        }
    }
}
