//! The core services of UxAS: from a request for automation to vehicles on their way.
//!
//! ```text
//! AutomationRequest | ImpactAutomationRequest | TaskAutomationRequest
//!   -> validator            checks it, one at a time                       UniqueAutomationRequest
//!   -> tasks                sensors, ways within their options             TaskPlanOptions
//!   -> aggregator           ways to and between the options                AssignmentCostMatrix
//!   -> tree                 who does what, in which order                  TaskAssignmentSummary
//!   -> builder and tasks    waypoints, task by task                        UniqueAutomationResponse
//!   -> validator                                                           AutomationResponse | …
//!   -> waypoint_manager     the mission in segments                        MissionCommand
//! ```
//!
//! Each service is a pure [`machine::Machine`]: messages and times go in, messages come out. What is under way is kept by
//! the number of its request, so that requests may overlap, and is forgotten when that is answered. A failure is told
//! in a `ServiceStatus` that names the request, by whoever sees it first; the validator then answers at once with the cause.

pub mod aggregator;
pub mod builder;
pub mod clearance;
pub mod control;
pub mod coordinator;
pub mod ground;
pub mod kinematic;
pub mod machine;
pub mod osm;
pub mod planner;
pub mod planners;
pub mod region_state;
pub mod sensor_manager;
pub mod task;
pub mod task_manager;
pub mod tree;
pub mod validator;
pub mod vehicle;
pub mod waypoint_manager;
pub mod world;

use crate::service::Service;
use aldis_envelope::{Guids, Source};
use control::{ControlledMissions, GuardedVehicle};
use machine::Hosted;

/// A core service with its configuration.
#[derive(Debug, Clone, PartialEq)]
pub enum Core {
    /// Checks requests and answers them.
    Validator(validator::ValidatorConfig),
    /// Keeps the tasks.
    Tasks(task_manager::TaskManagerConfig),
    /// Finds ways.
    Planner(planner::PlannerConfig),
    /// Finds ways along roads.
    Roads(osm::OsmConfig),
    /// Collects ways.
    Aggregator(aggregator::AggregatorConfig),
    /// Assigns tasks.
    Tree(tree::TreeConfig),
    /// Builds missions.
    Builder(builder::BuilderConfig),
    /// Keeps operating region 0, with so much more padding of zones, in metres.
    Region(f32),
    /// Knows what sensors see.
    Sensors,
    /// Serves a vehicle its mission.
    Waypoints(waypoint_manager::WaypointConfig),
    /// Serves a vehicle its mission while it is in control of it.
    ControlledWaypoints(waypoint_manager::WaypointConfig, control::Control),
    /// Moves as a vehicle does.
    Kinematic(kinematic::KinematicConfig),
    /// Moves as a vehicle does, for who is in control of it.
    GuardedKinematic(kinematic::KinematicConfig, control::Control),
}

impl Core {
    /// The service with these ids.
    pub fn service(&self, source: Source, guids: &Guids) -> Box<dyn Service> {
        match self {
            Self::Validator(config) => Box::new(Hosted::new(validator::Validator::new(*config))),
            Self::Tasks(config) => Box::new(Hosted::new(task_manager::TaskManager::new(config.clone()))),
            Self::Planner(config) => Box::new(Hosted::new(planner::Planner::new(config.clone()))),
            Self::Roads(config) => Box::new(Hosted::new(osm::Osm::new(config.clone()))),
            Self::Aggregator(config) => Box::new(Hosted::new(aggregator::Aggregator::new(*config))),
            Self::Tree(config) => Box::new(Hosted::new(tree::Tree::new(*config))),
            Self::Builder(config) => Box::new(Hosted::new(builder::Builder::new(*config))),
            Self::Region(padding_m) => Box::new(Hosted::new(region_state::RegionState::new(*padding_m))),
            Self::Sensors => Box::new(Hosted::new(sensor_manager::SensorManager::default())),
            Self::Waypoints(config) => Box::new(Hosted::new(waypoint_manager::WaypointManager::new(*config))),
            Self::Kinematic(config) => Box::new(Hosted::new(kinematic::Kinematic::new(*config))),
            Self::ControlledWaypoints(config, control) => {
                Box::new(ControlledMissions::new(source, guids, *config, control.clone()))
            }
            Self::GuardedKinematic(config, control) => {
                Box::new(GuardedVehicle::new(source, guids, *config, control.clone()))
            }
        }
    }

    /// What it is, for people: the name of the service in UxAS.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Validator(_) => "AutomationRequestValidator",
            Self::Tasks(_) => "TaskManager",
            Self::Planner(_) => "RoutePlannerVisibility",
            Self::Roads(_) => "OsmPlanner",
            Self::Aggregator(_) => "RouteAggregator",
            Self::Tree(_) => "AssignmentTreeBranchBound",
            Self::Builder(_) => "PlanBuilder",
            Self::Region(_) => "OperatingRegionState",
            Self::Sensors => "SensorManager",
            Self::Waypoints(_) | Self::ControlledWaypoints(..) => "WaypointPlanManager",
            Self::Kinematic(_) | Self::GuardedKinematic(..) => "Vehicle",
        }
    }

    /// All that a planner runs but the services of single vehicles, so many metres ahead of where vehicles are.
    pub fn pipeline(compat_cost: bool, lead_m: f64) -> Vec<Self> {
        // The reference's collector has no lead.
        let collected_m = if compat_cost { 0.0 } else { lead_m };
        vec![
            Self::Validator(validator::ValidatorConfig::default()),
            Self::Tasks(task_manager::TaskManagerConfig { compat_cost, ..Default::default() }),
            Self::Sensors,
            Self::Planner(planner::PlannerConfig { compat_cost, ..Default::default() }),
            Self::Aggregator(aggregator::AggregatorConfig {
                compat_cost,
                lead_m: collected_m,
                ..Default::default()
            }),
            Self::Tree(tree::TreeConfig::default()),
            Self::Builder(builder::BuilderConfig {
                compat_cost,
                assignment_start_point_lead_m: lead_m,
                ..Default::default()
            }),
        ]
    }
}
