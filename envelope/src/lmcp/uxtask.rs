//! The UXTASK series: what tasks and the planner say to each other.

use super::cmasi::{AutomationRequest, AutomationResponse, Location3D, Task, WavelengthBand, Waypoint};
use super::registry::table;
use super::schema::{Series, SeriesName, TypeInfo};
use super::{Ref, Text};

/// The series as the wire and the XML form know it.
pub const SERIES: Series =
    Series { name: SeriesName::new("UXTASK"), text: "UXTASK", namespace: "uxas.messages.task", version: 8 };

/// Its types by their number.
pub(super) const TYPES_BY_ID: [&TypeInfo; 29] = table(&[TYPES]);

lmcp_types! {
    SERIES "uxas.messages.task";

    /// A task to plan together with other planners.
    1 AssignmentCoordinatorTask: Task {}

    /// A task to arrive at the same time.
    2 RendezvousTask: Task {
        number_of_participants "NumberOfParticipants": u8,
        rendezvous_states "RendezvousStates": Vec<Ref<PlanningState>>,
    }

    /// Where an entity will be when the plan begins.
    3 PlanningState {
        entity_id "EntityID": i64,
        planning_position "PlanningPosition": Ref<Location3D>,
        planning_heading "PlanningHeading": f32,
    }

    /// A planner's state, told to the others.
    4 AssignmentCoordination {
        coordinated_automation_request_id "CoordinatedAutomationRequestID": i64,
        planning_state "PlanningState": Ref<PlanningState>,
    }

    /// An automation request that several planners answer together.
    5 CoordinatedAutomationRequest {
        request_id "RequestID": i64,
        maximum_response_time "MaximumResponseTime" ["ms"]: i64 = -1,
        original_request "OriginalRequest": Ref<AutomationRequest>,
        planning_states "PlanningStates": Vec<Ref<PlanningState>>,
    }

    /// An automation request that a task makes.
    6 TaskAutomationRequest {
        request_id "RequestID": i64,
        original_request "OriginalRequest": Ref<AutomationRequest>,
        sand_box_request "SandBoxRequest": bool,
        planning_states "PlanningStates": Vec<Ref<PlanningState>>,
    }

    /// The plan for a task's request.
    7 TaskAutomationResponse {
        response_id "ResponseID": i64,
        original_response "OriginalResponse": Ref<AutomationResponse>,
        final_states "FinalStates": Vec<Ref<PlanningState>>,
    }

    /// An automation request with a number of its own.
    8 UniqueAutomationRequest {
        request_id "RequestID": i64,
        original_request "OriginalRequest": Ref<AutomationRequest>,
        sand_box_request "SandBoxRequest": bool,
        planning_states "PlanningStates": Vec<Ref<PlanningState>>,
    }

    /// The plan for a request of that number.
    9 UniqueAutomationResponse {
        response_id "ResponseID": i64,
        original_response "OriginalResponse": Ref<AutomationResponse>,
        final_states "FinalStates": Vec<Ref<PlanningState>>,
    }

    /// Asks what sensors see under given conditions.
    10 SensorFootprintRequests {
        request_id "RequestID": i64,
        footprints "Footprints": Vec<Ref<FootprintRequest>>,
    }

    /// The conditions for one vehicle's sensors.
    11 FootprintRequest {
        footprint_request_id "FootprintRequestID": i64,
        vehicle_id "VehicleID": i64,
        eligible_wavelengths "EligibleWavelengths": Vec<WavelengthBand>,
        ground_sample_distances "GroundSampleDistances": Vec<f32>,
        agl_altitudes "AglAltitudes" ["m"]: Vec<f32>,
        elevation_angles "ElevationAngles" ["deg"]: Vec<f32>,
    }

    /// What a camera sees at an altitude and elevation.
    12 SensorFootprint {
        footprint_response_id "FootprintResponseID": i64,
        vehicle_id "VehicleID": i64,
        camera_id "CameraID": i64,
        gimbal_id "GimbalID": i64,
        horizontal_fov "HorizontalFOV" ["deg"]: f32,
        agl_altitude "AglAltitude" ["m"]: f32,
        gimbal_elevation "GimbalElevation" ["deg"]: f32,
        aspect_ratio "AspectRatio": f32,
        achieved_gsd "AchievedGSD" ["m/pixel"]: f32,
        camera_wavelength "CameraWavelength": WavelengthBand,
        horizontal_to_leading_edge "HorizontalToLeadingEdge" ["m"]: f32,
        horizontal_to_trailing_edge "HorizontalToTrailingEdge" ["m"]: f32,
        horizontal_to_center "HorizontalToCenter" ["m"]: f32,
        width_center "WidthCenter" ["m"]: f32,
        slant_range_to_center "SlantRangeToCenter" ["m"]: f32,
    }

    /// What sensors see under the conditions asked for.
    13 SensorFootprintResponse {
        response_id "ResponseID": i64,
        footprints "Footprints": Vec<Ref<SensorFootprint>>,
    }

    /// Asks a task for the waypoints of an option by a vehicle.
    14 TaskImplementationRequest {
        request_id "RequestID": i64,
        corresponding_automation_request_id "CorrespondingAutomationRequestID": i64,
        starting_waypoint_id "StartingWaypointID": i64,
        vehicle_id "VehicleID": i64,
        start_position "StartPosition": Ref<Location3D>,
        start_heading "StartHeading" ["deg"]: f32,
        start_time "StartTime" ["ms since 1970"]: i64,
        region_id "RegionID": i64,
        task_id "TaskID": i64,
        option_id "OptionID": i64,
        time_threshold "TimeThreshold" ["ms since 1970"]: i64,
        neighbor_locations "NeighborLocations": Vec<Ref<PlanningState>>,
    }

    /// The waypoints of a task's option by a vehicle.
    15 TaskImplementationResponse {
        response_id "ResponseID": i64,
        corresponding_automation_request_id "CorrespondingAutomationRequestID": i64,
        task_id "TaskID": i64,
        option_id "OptionID": i64,
        vehicle_id "VehicleID": i64,
        task_waypoints "TaskWaypoints": Vec<Ref<Waypoint>>,
        final_location "FinalLocation": Ref<Location3D>,
        final_heading "FinalHeading" ["deg"]: f32,
        final_time "FinalTime" ["ms since 1970"]: i64,
    }

    /// Travel times between all options of all tasks, by vehicle.
    16 AssignmentCostMatrix {
        corresponding_automation_request_id "CorrespondingAutomationRequestID": i64,
        task_level_relationship "TaskLevelRelationship": Text,
        task_list "TaskList": Vec<i64>,
        operating_region "OperatingRegion": i64,
        cost_matrix "CostMatrix": Vec<Ref<TaskOptionCost>>,
    }

    /// How long a vehicle takes from one task's option to another's.
    17 TaskOptionCost {
        vehicle_id "VehicleID": i64,
        intial_task_id "IntialTaskID": i64,
        intial_task_option "IntialTaskOption": i64,
        destination_task_id "DestinationTaskID": i64,
        destination_task_option "DestinationTaskOption": i64,
        time_to_go "TimeToGo" ["ms"]: i64,
    }

    /// A task's option, given to a vehicle for a time.
    18 TaskAssignment {
        task_id "TaskID": i64,
        option_id "OptionID": i64,
        assigned_vehicle "AssignedVehicle": i64,
        time_threshold "TimeThreshold" ["ms since 1970"]: i64,
        time_task_completed "TimeTaskCompleted" ["ms since 1970"]: i64,
    }

    /// Who does what, in which order.
    19 TaskAssignmentSummary {
        corresponding_automation_request_id "CorrespondingAutomationRequestID": i64,
        operating_region "OperatingRegion": i64,
        task_list "TaskList": Vec<Ref<TaskAssignment>>,
    }

    /// One way to do a task.
    20 TaskOption {
        task_id "TaskID": i64,
        option_id "OptionID": i64,
        eligible_entities "EligibleEntities": Vec<i64>,
        cost "Cost" ["ms"]: i64,
        start_location "StartLocation": Ref<Location3D>,
        start_heading "StartHeading" ["deg"]: f32,
        end_location "EndLocation": Ref<Location3D>,
        end_heading "EndHeading" ["deg"]: f32,
    }

    /// The ways to do a task, and how they combine.
    21 TaskPlanOptions {
        corresponding_automation_request_id "CorrespondingAutomationRequestID": i64,
        task_id "TaskID": i64,
        composition "Composition": Text,
        options "Options": Vec<Ref<TaskOption>>,
    }

    /// Pauses a task.
    22 TaskPause {
        task_id "TaskID": i64,
    }

    /// Resumes a task.
    23 TaskResume {
        task_id "TaskID": i64,
        restart_completely "RestartCompletely": bool,
        re_assign "ReAssign": Ref<TaskAssignment> = Ref::NULL,
    }

    /// How far a task has come.
    24 TaskProgress {
        response_id "ResponseID": i64,
        task_id "TaskID": i64,
        percent_complete "PercentComplete": f32,
        entities_engaged "EntitiesEngaged": Vec<i64>,
    }

    /// Asks how far a task has come.
    25 TaskProgressRequest {
        request_id "RequestID": i64,
        task_id "TaskID": i64,
    }

    /// A task is ready to be planned.
    26 TaskInitialized {
        task_id "TaskID": i64,
    }

    /// An entity has begun a task.
    27 TaskActive {
        task_id "TaskID": i64,
        entity_id "EntityID": i64,
        time_task_activated "TimeTaskActivated" ["ms since 1970"]: i64,
    }

    /// A task is done.
    28 TaskComplete {
        task_id "TaskID": i64,
        entities_involved "EntitiesInvolved": Vec<i64>,
        time_task_completed "TimeTaskCompleted" ["ms since 1970"]: i64,
    }

    /// Stops vehicles from doing tasks.
    29 CancelTask {
        vehicles "Vehicles": Vec<i64>,
        canceled_tasks "CanceledTasks": Vec<i64>,
    }
}
