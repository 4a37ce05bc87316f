//! Services that a configuration adds to a node.

use super::bridge::in_range;
use super::error::Fault;
use super::recorder::{EntityStates, Recorder};
use super::roads::OsmPlanner;
use super::schema;
use super::send_messages::SendMessages;
use super::uxas::{self, CoreTable};
use aldis_envelope::{EntityId, ServiceId, Source};
use aldis_services::track::TrackConfig;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The smallest service id that a configuration may give; those below are built in or bridges.
pub(crate) const SERVICE_MIN: u32 = 100;

/// One `[[service]]`, by its `kind`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub(crate) enum Service {
    /// A simple moving vehicle that sends telemetry.
    Track(Track),
    /// Checks automation requests, feeds them in one at a time, answers them.
    AutomationRequestValidator(uxas::AutomationRequestValidator),
    /// Keeps the tasks.
    TaskManager(uxas::TaskManager),
    /// Knows what sensors see.
    SensorManager(uxas::SensorManager),
    /// Finds ways around zones.
    RoutePlannerVisibility(uxas::RoutePlannerVisibility),
    /// Finds ways along roads.
    OsmPlanner(OsmPlanner),
    /// Collects routes, and the costs between tasks.
    RouteAggregator(uxas::RouteAggregator),
    /// Assigns tasks to vehicles.
    AssignmentTreeBranchBound(uxas::AssignmentTreeBranchBound),
    /// Builds missions from assignments.
    PlanBuilder(uxas::PlanBuilder),
    /// Keeps operating region 0.
    OperatingRegionState(uxas::OperatingRegionState),
    /// Serves a vehicle its mission in segments.
    WaypointPlanManager(uxas::WaypointPlanManager),
    /// A simulated vehicle that follows its missions.
    SimulatedVehicle(uxas::SimulatedVehicle),
    /// Sends LMCP messages from files at their times.
    SendMessages(SendMessages),
    /// Starts and ends services when UxAS asks for it, and tells who comes and goes.
    ServiceManager(ServiceManager),
    /// Keeps what comes by in files.
    Recorder(Recorder),
    /// Holds the latest state of each vehicle.
    EntityStates(EntityStates),
}

impl Service {
    /// What may stand as `kind`.
    pub(crate) const KINDS: &[&str] = &[
        "track",
        "send-messages",
        "service-manager",
        "recorder",
        "entity-states",
        "automation-request-validator",
        "task-manager",
        "sensor-manager",
        "route-planner-visibility",
        "osm-planner",
        "route-aggregator",
        "assignment-tree-branch-bound",
        "plan-builder",
        "operating-region-state",
        "waypoint-plan-manager",
        "simulated-vehicle",
    ];

    /// The table of a core service; none where it is something else.
    pub(crate) fn core(&self) -> Option<&dyn CoreTable> {
        Some(match self {
            Self::Track(_) | Self::SendMessages(_) | Self::ServiceManager(_) => return None,
            Self::Recorder(_) | Self::EntityStates(_) | Self::OsmPlanner(_) => return None,
            Self::AutomationRequestValidator(table) => table,
            Self::TaskManager(table) => table,
            Self::SensorManager(table) => table,
            Self::RoutePlannerVisibility(table) => table,
            Self::RouteAggregator(table) => table,
            Self::AssignmentTreeBranchBound(table) => table,
            Self::PlanBuilder(table) => table,
            Self::OperatingRegionState(table) => table,
            Self::WaypointPlanManager(table) => table,
            Self::SimulatedVehicle(table) => table,
        })
    }

    /// The service id, unique on its entity. A configuration that was read has one.
    pub(crate) fn service(&self) -> ServiceId {
        match self {
            Self::Track(track) => track.service,
            Self::SendMessages(send) => send.service,
            Self::ServiceManager(manager) => manager.service,
            Self::Recorder(recorder) => recorder.service,
            Self::OsmPlanner(roads) => roads.service,
            Self::EntityStates(states) => states.service,
            core => core.core().and_then(CoreTable::service).unwrap_or(ServiceId::NODE),
        }
    }

    /// The entity that the service belongs to; none is the node's own.
    pub(crate) fn entity(&self) -> Option<EntityId> {
        match self {
            Self::Track(track) => track.entity,
            Self::SendMessages(_) | Self::ServiceManager(_) => None,
            Self::Recorder(_) | Self::EntityStates(_) | Self::OsmPlanner(_) => None,
            core => core.core().and_then(CoreTable::entity),
        }
    }
}

/// The service manager of UxAS: `CreateNewService`, `KillService`, `StartupComplete`, `EntityJoin` and `EntityExit`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ServiceManager {
    /// The service id, 100 or more, unique on the node.
    #[schemars(with = "schema::NamedServiceId")]
    pub(crate) service: ServiceId,
}

/// Whether a configuration may give a service id.
pub(super) fn named_service(service: ServiceId) -> Result<(), Fault> {
    if service.get() >= SERVICE_MIN {
        return Ok(());
    }
    Err(Fault::new(
        "service",
        format!("service {service} is not for a configuration to give"),
        "give 100 or more; 1 to 19 are built in, 20 to 99 are bridges",
    ))
}

/// A vehicle that moves at constant speed and turn rate and tells where it is: a straight line or a circle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Track {
    /// The service id, 100 or more, unique on its entity.
    #[schemars(with = "schema::NamedServiceId")]
    pub(crate) service: ServiceId,
    /// The entity that moves, one of `entities`. Default: the node's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<schema::EntityId>")]
    pub(crate) entity: Option<EntityId>,
    /// Where it starts: latitude, WGS-84 degrees, north positive.
    #[schemars(range(min = -90.0, max = 90.0))]
    pub(crate) latitude_deg: f64,
    /// Where it starts: longitude, WGS-84 degrees, east positive.
    #[schemars(range(min = -180.0, max = 180.0))]
    pub(crate) longitude_deg: f64,
    /// Where it heads at first, degrees from north to the right. Default: 0, north.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 360.0))]
    pub(crate) heading_deg: f64,
    /// Speed over ground in metres a second. Default: 0, it stands still.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub(crate) speed_m_per_s: f64,
    /// Degrees turned a second, to the right positive. Default: 0, straight on.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub(crate) turn_rate_deg_per_s: f64,
    /// Reports a second. Default: 1.
    #[serde(default = "rate_hz")]
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub(crate) rate_hz: f64,
}

fn rate_hz() -> f64 {
    1.0
}

impl Track {
    /// The ids of the service, on a node whose own entity is given.
    pub(crate) fn source(&self, own: EntityId) -> Source {
        Source::new(self.entity.unwrap_or(own), self.service)
    }

    /// How the vehicle moves, as the service wants to know it.
    pub(crate) fn motion(&self, own: EntityId) -> TrackConfig {
        TrackConfig {
            entity: self.entity.unwrap_or(own),
            latitude_deg: self.latitude_deg,
            longitude_deg: self.longitude_deg,
            heading_deg: self.heading_deg,
            speed_m_per_s: self.speed_m_per_s,
            turn_rate_deg_per_s: self.turn_rate_deg_per_s,
            rate_hz: self.rate_hz,
        }
    }

    /// Checks what the types do not.
    pub(super) fn check(self) -> Result<Self, Fault> {
        named_service(self.service)?;
        in_range("latitude_deg", self.latitude_deg, -90.0..=90.0, "degrees")?;
        in_range("longitude_deg", self.longitude_deg, -180.0..=180.0, "degrees")?;
        in_range("heading_deg", self.heading_deg, 0.0..=360.0, "degrees")?;
        in_range("speed_m_per_s", self.speed_m_per_s, 0.0..=1000.0, "metres a second")?;
        in_range("turn_rate_deg_per_s", self.turn_rate_deg_per_s, -360.0..=360.0, "degrees a second")?;
        in_range("rate_hz", self.rate_hz, 0.001..=1000.0, "reports a second")?;
        Ok(self)
    }
}
