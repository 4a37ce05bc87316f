//! A request that waits, and how far it has come.

use aldis_envelope::Monotonic;
use aldis_envelope::lmcp::Object;
use aldis_envelope::lmcp::uxtask::{
    AssignmentCostMatrix, TaskAssignmentSummary, TaskPlanOptions, UniqueAutomationRequest,
};
use std::collections::BTreeSet;

/// Who asked, and so in which kind the answer goes out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Asker {
    /// By an `AutomationRequest`.
    Plain,
    /// By an `ImpactAutomationRequest`.
    Impact { play: i64, solution: i64 },
    /// By a `TaskAutomationRequest`.
    Task,
}

/// A request that waits.
#[derive(Debug, Clone)]
pub(super) struct Pending {
    pub(super) asker: Asker,
    pub(super) request: UniqueAutomationRequest,
    pub(super) deadline: Monotonic,
}

impl Pending {
    pub(super) fn tasks(&self) -> &[i64] {
        self.request.original_request.get().map_or(&[], |request| &request.task_list)
    }
}

/// How far the request in flight has come.
#[derive(Debug, Default)]
pub(super) struct Progress {
    /// What errors said.
    pub(super) texts: Vec<(String, String)>,
    options: BTreeSet<i64>,
    matrix: bool,
    summary: bool,
}

impl Progress {
    /// Notes what shows how far a request has come.
    pub(super) fn hear(&mut self, request: i64, object: &dyn Object) {
        if let Some(options) = object.get::<TaskPlanOptions>() {
            if options.corresponding_automation_request_id == request {
                self.options.insert(options.task_id);
            }
        } else if let Some(matrix) = object.get::<AssignmentCostMatrix>() {
            self.matrix |= matrix.corresponding_automation_request_id == request;
        } else if let Some(summary) = object.get::<TaskAssignmentSummary>() {
            self.summary |= summary.corresponding_automation_request_id == request;
        }
    }

    /// Who has not answered.
    pub(super) fn silent(&self, pending: &Pending) -> String {
        let late: Vec<_> = pending.tasks().iter().filter(|task| !self.options.contains(task)).collect();
        if !late.is_empty() {
            return format!(
                "no TaskPlanOptions of task {late:?}: the task, the sensor manager or a route planner is silent"
            );
        }
        let stage = match (self.matrix, self.summary) {
            (false, _) => "no AssignmentCostMatrix: the route aggregator or a route planner is silent",
            (true, false) => "no TaskAssignmentSummary: the assignment service is silent",
            (true, true) => {
                "no UniqueAutomationResponse: the plan builder, a task or a route planner is silent"
            }
        };
        stage.to_owned()
    }
}
