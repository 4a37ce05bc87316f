//! The core services of UxAS, as a configuration names them.

use super::error::Fault;
use super::schema;
use super::service::SERVICE_MIN;
use super::text::PlainName;
use aldis_envelope::lmcp::cmasi::TurnType;
use aldis_envelope::{EntityId, ServiceId};
use aldis_services::plan::algebra::Unnamed;
use aldis_services::plan::assignment::{Objective, Precedence};
use aldis_services::uxas::Core;
use aldis_services::uxas::aggregator::AggregatorConfig;
use aldis_services::uxas::builder::BuilderConfig;
use aldis_services::uxas::control::Control;
use aldis_services::uxas::kinematic::KinematicConfig;
use aldis_services::uxas::planner::PlannerConfig;
use aldis_services::uxas::task_manager::{TaskManagerConfig, TaskOptionRule};
use aldis_services::uxas::tree::TreeConfig;
use aldis_services::uxas::validator::ValidatorConfig;
use aldis_services::uxas::waypoint_manager::WaypointConfig;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// What all tables of core services are alike in.
pub(crate) trait CoreTable {
    /// The service id, unique on its entity; none where it is missing.
    fn service(&self) -> Option<ServiceId>;
    /// The entity that it belongs to; none is the node's own.
    fn entity(&self) -> Option<EntityId>;
    /// The service with its configuration, on an entity.
    fn core(&self, entity: EntityId) -> Core;

    /// Checks what the types do not.
    fn check(&self) -> Result<(), Fault> {
        let help = "give 100 or more; 1 to 19 are built in, 20 to 99 are bridges";
        match self.service() {
            Some(service) if service.get() >= SERVICE_MIN => Ok(()),
            Some(service) => Err(Fault::new(
                "service",
                format!("service {service} is not for a configuration to give"),
                help,
            )),
            None => Err(Fault::new("", "the table has no `service`, the id of the service", help)),
        }
    }
}

/// Declares tables: what each is, its keys with their defaults, and its service.
macro_rules! tables {
    ($(
        $(#[doc = $about:literal])+
        $name:ident { $($(#[doc = $doc:literal])+ $key:ident: $type:ty = $default:expr,)* }
        => |$table:ident, $entity:ident| $core:expr;
    )*) => { $(
        $(#[doc = $about])+
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields, default)]
        pub(crate) struct $name {
            /// The service id, 100 or more, unique on its entity. It must be given.
            #[schemars(with = "schema::NamedServiceId")]
            pub(crate) service: Option<ServiceId>,
            /// The entity that it belongs to, one of `entities`. Default: the node's own.
            #[serde(skip_serializing_if = "Option::is_none")]
            #[schemars(with = "Option<schema::EntityId>")]
            pub(crate) entity: Option<EntityId>,
            $($(#[doc = $doc])+ pub(crate) $key: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { service: None, entity: None, $($key: $default,)* }
            }
        }

        impl CoreTable for $name {
            fn service(&self) -> Option<ServiceId> {
                self.service
            }
            fn entity(&self) -> Option<EntityId> {
                self.entity
            }
            #[allow(unused_variables, reason = "not every service has keys, or belongs to a vehicle")]
            fn core(&self, $entity: EntityId) -> Core {
                let $table = self;
                $core
            }
        }
    )* };
}

tables! {
    /// Checks automation requests, feeds them in one at a time, answers them.
    AutomationRequestValidator {
        /// How long an answer may take, in milliseconds; at least 10. Default: 5000.
        max_response_time_ms: u32 = 5000,
    } => |table, entity| Core::Validator(ValidatorConfig {
        max_response_time: Duration::from_millis(u64::from(table.max_response_time_ms)),
    });

    /// Keeps the tasks.
    TaskManager {
        /// Whether tasks measure on the flat earth of the reference. Default: false.
        compat_cost: bool = false,
        /// Options of tasks. Default: none.
        options: Vec<TaskOption> = Vec::new(),
    } => |table, entity| Core::Tasks(TaskManagerConfig {
        compat_cost: table.compat_cost,
        options: table.options.iter().map(TaskOption::rule).collect(),
    });

    /// Knows what sensors see.
    SensorManager {} => |table, entity| Core::Sensors;

    /// Finds ways of air and surface vehicles around zones.
    RoutePlannerVisibility {
        /// The mailboxes that it reads. Default: those of air and surface vehicles.
        mailboxes: Vec<String> = PlannerConfig::default().mailboxes,
        /// How much wider than they must vehicles turn, in metres. Default: 0.
        turn_radius_offset_m: f64 = 0.0,
        /// How far apart waypoints on turns are at least, in metres. Default: 50.
        minimum_waypoint_separation_m: f64 = 50.0,
        /// Flat earth, straight ways, whole metres, as the reference has it. Default: false.
        compat_cost: bool = false,
    } => |table, entity| Core::Planner(PlannerConfig {
        mailboxes: table.mailboxes.clone(),
        turn_radius_offset_m: table.turn_radius_offset_m,
        minimum_waypoint_separation_m: table.minimum_waypoint_separation_m,
        compat_cost: table.compat_cost,
    });

    /// Collects routes, and the costs between tasks.
    RouteAggregator {
        /// How far ahead of where a vehicle is its plan begins, in metres, as for the plan builder. Default: 50.
        lead_m: f64 = 50.0,
        /// Whether ground vehicles go straight, without a planner. Default: false.
        fast_plan: bool = false,
        /// Whether it measures on the flat earth of the reference. Default: false.
        compat_cost: bool = false,
    } => |table, entity| Core::Aggregator(AggregatorConfig {
        lead_m: table.lead_m,
        fast_plan: table.fast_plan,
        compat_cost: table.compat_cost,
    });

    /// Assigns tasks to vehicles.
    AssignmentTreeBranchBound {
        /// The budget of the search; 0 is the default budget. Default: 0.
        number_nodes_maximum: u32 = 0,
        /// What must be small. Default: MINMAX, the end of the last vehicle.
        cost_function: CostFunction = CostFunction::MinMax,
        /// Whether vehicles wait for each other where the relationships name an order. Default: false, as in the reference.
        temporal: bool = false,
        /// Whether tasks that the relationships do not name are left out instead of being a mistake. Default: false.
        leave_out: bool = false,
    } => |table, entity| Core::Tree(TreeConfig {
        number_nodes_maximum: i64::from(table.number_nodes_maximum),
        objective: match table.cost_function {
            CostFunction::MinMax => Objective::MinMax,
            CostFunction::Cumulative => Objective::Cumulative,
        },
        precedence: if table.temporal { Precedence::Temporal } else { Precedence::Choice },
        unnamed: if table.leave_out { Unnamed::LeaveOut } else { Unnamed::Refuse },
    });

    /// Builds missions from assignments.
    PlanBuilder {
        /// How far ahead of where a vehicle is its plan begins, in metres. Default: 50.
        assignment_start_point_lead_m: f64 = 50.0,
        /// Whether vehicles stay at the end of their missions. Default: false.
        add_loiter_to_end_of_mission: bool = false,
        /// By which radius aircraft do, in metres. Default: 300.
        default_loiter_radius_m: f32 = 300.0,
        /// How all waypoints are turned at. Default: as routes have it.
        turn_type: Option<Turn> = None,
        /// Whether it measures on the flat earth of the reference. Default: false.
        compat_cost: bool = false,
    } => |table, entity| Core::Builder(BuilderConfig {
        assignment_start_point_lead_m: table.assignment_start_point_lead_m,
        add_loiter_to_end_of_mission: table.add_loiter_to_end_of_mission,
        default_loiter_radius_m: table.default_loiter_radius_m,
        turn_type: table.turn_type.map(Turn::turn_type),
        compat_cost: table.compat_cost,
    });

    /// Keeps operating region 0: all zones that were seen.
    OperatingRegionState {
        /// How much padding zones get beyond their own, in metres. Default: 0.
        additional_padding_m: f32 = 0.0,
    } => |table, entity| Core::Region(table.additional_padding_m);

    /// Serves a vehicle its mission in segments.
    WaypointPlanManager {
        /// The vehicle. Default: the entity.
        vehicle: Option<i64> = None,
        /// The most waypoints of a segment. Default: 100000.
        number_waypoints_to_serve: u32 = 100_000,
        /// How many of them the next segment begins with; at least 2. Default: 3.
        number_waypoints_overlap: u32 = 3,
        /// By which radius aircraft stay at the end, in metres. Default: 200.
        default_loiter_radius_m: f32 = 200.0,
        /// Whether the vehicle stays at the end of each segment. Default: false.
        add_loiter_to_end_of_segments: bool = false,
        /// Whether it stays at the end of the mission. Default: false.
        add_loiter_to_end_of_mission: bool = false,
        /// Whether it begins again at the first task. Default: false.
        loop_back_to_first_task: bool = false,
        /// Whether it stops at the end. Default: false.
        set_last_waypoint_speed_to_0: bool = false,
        /// How all waypoints are turned at. Default: TurnShort.
        turn_type: Turn = Turn::TurnShort,
        /// The gimbal that is pointed down at the end of a segment. Default: none.
        gimbal_payload: Option<i64> = None,
        /// The resource of the vehicle's entity that has to be controlled before a mission goes out; it is asked for at service 10
        /// of that entity. Missions of this entity alone are served then. Default: none, missions go out at once.
        resource: Option<PlainName> = None,
        /// For how long control is asked for at a time, in seconds; it is renewed at half of it. Default: 60.
        control_s: u32 = 60,
    } => |table, entity| controlled(table, WaypointConfig {
        number_waypoints_to_serve: table.number_waypoints_to_serve as usize,
        number_waypoints_overlap: table.number_waypoints_overlap as usize,
        default_loiter_radius_m: table.default_loiter_radius_m,
        add_loiter_to_end_of_segments: table.add_loiter_to_end_of_segments,
        add_loiter_to_end_of_mission: table.add_loiter_to_end_of_mission,
        loop_back_to_first_task: table.loop_back_to_first_task,
        set_last_waypoint_speed_to_0: table.set_last_waypoint_speed_to_0,
        turn_type: table.turn_type.turn_type(),
        gimbal_payload: table.gimbal_payload,
        ..WaypointConfig::of(table.vehicle.unwrap_or(number(entity)))
    }, entity);

    /// A simulated vehicle that follows its missions.
    SimulatedVehicle {
        /// The vehicle. Default: the entity.
        vehicle: Option<i64> = None,
        /// How often it tells its state, in milliseconds; at least 10. Default: 1000.
        period_ms: u32 = 1000,
        /// How many seconds it moves in one of the clock, at most 1000. Default: 1.
        pace: f64 = 1.0,
        /// The resource of its entity that the sender of a mission has to control. Default: none, it follows every mission.
        resource: Option<PlainName> = None,
    } => |table, entity| guarded(table.resource.as_ref(), KinematicConfig {
        vehicle: table.vehicle.unwrap_or(number(entity)),
        period: Duration::from_millis(u64::from(table.period_ms)),
        pace: table.pace,
    }, entity);
}

/// The manager of a vehicle's mission, under control where a resource is named.
fn controlled(table: &WaypointPlanManager, config: WaypointConfig, entity: EntityId) -> Core {
    match &table.resource {
        Some(name) => {
            let duration = Duration::from_secs(u64::from(table.control_s.max(1)));
            let control = Control::of(vehicle(config.vehicle, entity), name.as_str());
            Core::ControlledWaypoints(config, Control { duration, ..control })
        }
        None => Core::Waypoints(config),
    }
}

/// A simulated vehicle, guarded where a resource is named.
fn guarded(resource: Option<&PlainName>, config: KinematicConfig, entity: EntityId) -> Core {
    match resource {
        Some(name) => {
            Core::GuardedKinematic(config, Control::of(vehicle(config.vehicle, entity), name.as_str()))
        }
        None => Core::Kinematic(config),
    }
}

/// The entity of a vehicle; where its number is none, that of its service.
fn vehicle(number: i64, entity: EntityId) -> EntityId {
    u64::try_from(number).ok().and_then(|number| EntityId::new(number).ok()).unwrap_or(entity)
}

/// An entity's id as LMCP counts.
fn number(entity: EntityId) -> i64 {
    i64::try_from(entity.get()).unwrap_or(i64::MAX)
}

/// What an assignment must make small.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub(crate) enum CostFunction {
    /// When the last vehicle has finished.
    #[serde(rename = "MINMAX")]
    MinMax,
    /// The sum of when each has finished.
    #[serde(rename = "CUMULATIVE")]
    Cumulative,
}

/// How a vehicle turns at a waypoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub(crate) enum Turn {
    /// Before it.
    TurnShort,
    /// Over it.
    FlyOver,
}

impl Turn {
    fn turn_type(self) -> TurnType {
        match self {
            Self::TurnShort => TurnType::TurnShort,
            Self::FlyOver => TurnType::FlyOver,
        }
    }
}

/// An option of tasks: for one, for those of a type, or for all.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct TaskOption {
    /// The task. Default: all, or those of `task_type`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) task_id: Option<i64>,
    /// The full name of the type of tasks, such as afrl.cmasi.LineSearchTask.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) task_type: Option<String>,
    /// The name of the option.
    pub(crate) name: String,
    /// Its value.
    pub(crate) value: String,
}

impl TaskOption {
    fn rule(&self) -> TaskOptionRule {
        let Self { task_id, task_type, name, value } = self.clone();
        TaskOptionRule { task_id, task_type, name, value }
    }
}
