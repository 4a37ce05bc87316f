//! What makes a request valid: every vehicle, region, zone and task that it names is known.

use crate::uxas::world::World;
use aldis_envelope::lmcp::Object;
use aldis_envelope::lmcp::cmasi::AutomationRequest;
use aldis_envelope::lmcp::impact::{
    AngledAreaSearchTask, ImpactLineSearchTask, ImpactPointSearchTask, PatternSearchTask,
};
use aldis_envelope::lmcp::uxtask::UniqueAutomationRequest;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// Checks a request; all reasons are told, one a line.
///
/// # Errors
/// The reasons.
pub fn check(
    world: &World,
    tasks: &BTreeMap<i64, Box<dyn Object>>,
    request: &UniqueAutomationRequest,
) -> Result<(), String> {
    let mut reasons = Reasons::default();
    let Some(asked) = request.original_request.get() else {
        return Err("- the request is null.\n".to_owned());
    };
    entities(world, request, asked, &mut reasons);
    region(world, asked.operating_region, &mut reasons);
    if asked.task_list.is_empty() {
        reasons.add("the request names no task.");
    }
    let mut seen = BTreeSet::new();
    for &id in &asked.task_list {
        if !seen.insert(id) {
            reasons.add(format!("Task with the Id[{id}] is named twice."));
        }
        match tasks.get(&id) {
            Some(task) => geometry(world, task.as_ref(), &mut reasons),
            None => reasons.add(format!(
                "Task with the Id[{id}] is unknown. Ensure task description preceeds automation request."
            )),
        }
    }
    if reasons.0.is_empty() { Ok(()) } else { Err(reasons.0) }
}

/// Reasons as the reference writes them.
#[derive(Default)]
struct Reasons(String);

impl Reasons {
    fn add(&mut self, reason: impl std::fmt::Display) {
        // Writing to a String cannot fail.
        let _ = writeln!(self.0, "- {reason}");
    }
}

fn entities(
    world: &World,
    request: &UniqueAutomationRequest,
    asked: &AutomationRequest,
    reasons: &mut Reasons,
) {
    let planned: BTreeSet<i64> =
        request.planning_states.iter().filter_map(|state| state.get()).map(|state| state.entity_id).collect();
    let has_state = |id: &i64| world.states.contains_key(id) || planned.contains(id);
    let any_state = !world.states.is_empty() || !planned.is_empty();
    if world.configurations.is_empty() {
        reasons.add("No EntityConfigurations available.");
    }
    if !any_state {
        reasons.add("No EntityStates available.");
    }
    if asked.entity_list.is_empty() {
        let configured = !world.configurations.is_empty();
        if configured && any_state && !world.configurations.keys().any(has_state) {
            reasons.add("No EntityStates that match EntityConfigurations are available.");
        }
        return;
    }
    for id in &asked.entity_list {
        if !world.configurations.is_empty() && !world.configurations.contains_key(id) {
            reasons.add(format!("EntityConfiguration for Entity Id[{id}] not available."));
        }
        if any_state && !has_state(id) {
            reasons.add(format!("EntityState for Entity Id[{id}] not available."));
        }
    }
}

fn region(world: &World, id: i64, reasons: &mut Reasons) {
    if id == 0 {
        return;
    }
    let Some(region) = world.regions.get(&id) else {
        return reasons.add(format!("OperatingRegion Id[{id}] not available."));
    };
    for (name, ids) in [("KeepInArea", &region.keep_in_areas), ("KeepOutArea", &region.keep_out_areas)] {
        for zone in ids.iter().filter(|zone| !world.zones.contains_key(zone)) {
            reasons.add(format!("{name} Id[{zone}] not available."));
        }
    }
}

fn geometry(world: &World, task: &dyn Object, reasons: &mut Reasons) {
    let (what, id, is_known) = if let Some(task) = task.get::<AngledAreaSearchTask>() {
        ("AreaOfInterest", task.search_area_id, world.areas.contains_key(&task.search_area_id))
    } else if let Some(task) = task.get::<ImpactLineSearchTask>() {
        ("LineOfInterest", task.line_id, world.lines.contains_key(&task.line_id))
    } else if let Some(task) = task.get::<ImpactPointSearchTask>() {
        ("PointOfInterest", task.search_location_id, world.points.contains_key(&task.search_location_id))
    } else if let Some(task) = task.get::<PatternSearchTask>() {
        ("PointOfInterest", task.search_location_id, world.points.contains_key(&task.search_location_id))
    } else {
        return;
    };
    if id != 0 && !is_known {
        reasons.add(format!("{what} Id[{id}] not available."));
    }
}
