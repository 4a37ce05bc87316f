//! What came of requests: assignments, missions, errors.

use crate::cli::print_line;
use aldis_envelope::lmcp::cmasi::{AutomationResponse, MissionCommand, ServiceStatus, ServiceStatusType};
use aldis_envelope::lmcp::impact::ImpactAutomationResponse;
use aldis_envelope::lmcp::uxtask::{TaskAssignment, TaskAssignmentSummary, TaskAutomationResponse};
use aldis_envelope::lmcp::{Object, decode};
use aldis_services::sim::offline::Overheard;
use aldis_services::uxas::task::life::TASK_KEY;
use aldis_services::uxas::validator::failure;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::time::Duration;

/// What came of one request, or of several.
#[derive(Default)]
pub(in crate::cli) struct Outcome {
    /// The longest time from a request to its response.
    pub(in crate::cli) wall: Duration,
    makespan_ms: i64,
    total_ms: i64,
    gap: f64,
    unproven: bool,
    assignments: Vec<TaskAssignment>,
    /// Missions, each with how long it takes as built; of a vehicle that is asked for again the last.
    pub(in crate::cli) missions: BTreeMap<i64, MissionCommand>,
    flown_ms: BTreeMap<i64, i64>,
    /// Why there is no plan.
    pub(in crate::cli) errors: Vec<String>,
}

/// Whether a message answers a request.
pub(in crate::cli) fn is_answer(descriptor: &str) -> bool {
    ["afrl.cmasi.AutomationResponse", "afrl.impact.ImpactAutomationResponse"].contains(&descriptor)
        || descriptor == "uxas.messages.task.TaskAutomationResponse"
}

/// Takes what was heard.
pub(in crate::cli) fn hear(outcome: &mut Outcome, heard: &[Overheard]) {
    let wanted = ["TaskAssignmentSummary", "ServiceStatus", "Response"];
    for one in heard.iter().filter(|one| wanted.iter().any(|word| one.descriptor.ends_with(word))) {
        if let Ok(object) = decode(&one.content) {
            outcome.take(object.as_ref());
        }
    }
}

impl Outcome {
    fn take(&mut self, object: &dyn Object) {
        if let Some(summary) = object.get::<TaskAssignmentSummary>() {
            self.assignments.extend(summary.task_list.iter().filter_map(|one| one.get().cloned()));
        } else if let Some(status) = object.get::<ServiceStatus>() {
            self.status(status);
        } else if let Some(response) = object.get::<AutomationResponse>() {
            self.response(response);
        } else if let Some(response) = object.get::<ImpactAutomationResponse>() {
            response.trial_response.get().into_iter().for_each(|one| self.response(one));
        } else if let Some(response) = object.get::<TaskAutomationResponse>() {
            response.original_response.get().into_iter().for_each(|one| self.response(one));
        }
    }

    fn response(&mut self, response: &AutomationResponse) {
        if let Some(why) = failure(response)
            && !self.errors.contains(&why)
        {
            self.errors.push(why);
        }
        let missions = response.mission_command_list.iter().filter_map(|mission| mission.get());
        self.missions.extend(missions.map(|mission| (mission.vehicle_id, mission.clone())));
    }

    /// How good a plan is, how long missions take, and which tasks cannot be planned.
    fn status(&mut self, status: &ServiceStatus) {
        let pairs: Vec<_> = status.info.iter().filter_map(|pair| pair.get()).collect();
        if status.status_type == ServiceStatusType::Error && pairs.iter().any(|pair| pair.key == TASK_KEY) {
            self.errors.extend(pairs.first().map(|pair| pair.value.to_string()));
        }
        for pair in pairs {
            let whole = pair.value.parse::<i64>();
            match pair.key.as_str() {
                "makespan_ms" => self.makespan_ms = whole.unwrap_or(0),
                "total_ms" => self.total_ms = whole.unwrap_or(0),
                "gap" => self.gap = pair.value.parse().unwrap_or(0.0),
                "proven" => self.unproven = pair.value != "true",
                other => {
                    let vehicle = other.strip_prefix("FinalTime[").and_then(|rest| rest.strip_suffix(']'));
                    if let (Some(Ok(vehicle)), Ok(time)) = (vehicle.map(str::parse), whole) {
                        self.flown_ms.insert(vehicle, time);
                    }
                }
            }
        }
    }

    /// Takes another outcome in.
    pub(in crate::cli) fn add(&mut self, other: Self) {
        self.wall = self.wall.max(other.wall);
        self.makespan_ms = self.makespan_ms.max(other.makespan_ms);
        self.total_ms += other.total_ms;
        self.gap = self.gap.max(other.gap);
        self.unproven |= other.unproven;
        self.assignments.extend(other.assignments);
        self.missions.extend(other.missions);
        self.flown_ms.extend(other.flown_ms);
        let new: Vec<_> = other.errors.into_iter().filter(|why| !self.errors.contains(why)).collect();
        self.errors.extend(new);
    }

    /// As one JSON object.
    pub(in crate::cli) fn json(&self) -> Value {
        let assignments: Vec<_> = self
            .assignments
            .iter()
            .map(|one| {
                json!({
                    "vehicle": one.assigned_vehicle, "task": one.task_id, "option": one.option_id,
                    "threshold_ms": one.time_threshold, "completed_ms": one.time_task_completed,
                })
            })
            .collect();
        let missions: Vec<_> = self.missions.iter().map(|(vehicle, mission)| {
            json!({
                "vehicle": vehicle, "waypoints": mission.waypoint_list.len(), "first": mission.first_waypoint,
                "flown_ms": self.flown_ms.get(vehicle),
            })
        }).collect();
        let has_plan = !self.assignments.is_empty();
        json!({
            "wall_ms": (self.wall.as_secs_f64() * 1e6).round() / 1e3, "makespan_ms": self.makespan_ms,
            "total_ms": self.total_ms, "flown_ms": self.flown_ms.values().max(), "proven": has_plan && !self.unproven,
            "gap": self.gap, "assignments": assignments, "missions": missions, "errors": self.errors,
        })
    }

    /// For people.
    pub(in crate::cli) fn print(&self) {
        for one in &self.assignments {
            let (vehicle, task, option) = (one.assigned_vehicle, one.task_id, one.option_id);
            let complete = one.time_task_completed;
            print_line(format_args!(
                "  vehicle {vehicle:<6} task {task:<6} option {option:<6} complete at {complete:>10} ms"
            ));
        }
        for (vehicle, mission) in &self.missions {
            let flown = self.flown_ms.get(vehicle).copied().unwrap_or(0);
            let count = mission.waypoint_list.len();
            print_line(format_args!("  vehicle {vehicle:<6} {count} waypoints, {flown} ms with its turns"));
        }
        for why in &self.errors {
            print_line(format_args!("  no plan: {why}"));
        }
        if !self.assignments.is_empty() {
            let sure = if self.unproven {
                format!("at most {:.1} % above the best", self.gap * 100.0)
            } else {
                "proven: no plan is better".to_owned()
            };
            let wall = self.wall.as_secs_f64() * 1e3;
            print_line(format_args!("  all complete at {} ms; {sure} ({wall:.1} ms)", self.makespan_ms));
        }
    }
}
