//! The IMPACT series: play-calling tasks, points, lines and areas of interest, radio and water.

use super::cmasi::{
    AbstractGeometry, AbstractZone, AltitudeType, AutomationRequest, AutomationResponse, EntityConfiguration,
    EntityState, Location3D, LoiterAction, PayloadConfiguration, PayloadState, SearchTask, Task,
    VehicleAction, Waypoint, Wedge,
};
use super::registry::table;
use super::schema::{Series, SeriesName, TypeInfo};
use super::{Ref, Text};

/// The series as the wire and the XML form know it.
pub const SERIES: Series =
    Series { name: SeriesName::new("IMPACT"), text: "IMPACT", namespace: "afrl.impact", version: 14 };

/// Its types by their number.
pub(super) const TYPES_BY_ID: [&TypeInfo; 35] = table(&[TYPES]);

lmcp_enums! {
    /// The pattern by which an area is searched.
    AreaSearchPattern { Spiral = 0, Sector = 1, Sweep = 2 }

    /// What drives a vehicle.
    PowerPlant { Gasoline = 0, JP5 = 1, JP8 = 2, FuelCell = 3, Hybrid = 4, Electric = 5 }

    /// What happened to a point, line or area of interest.
    AreaActionOptions { Created = 0, Destroyed = 1, Modified = 2 }

    /// A kind of payload.
    ImpactPayloadType {
        Unknown = 0, EO = 1, FLIR = 2, MWIR = 3, LFIR = 4, Track = 5, Tag = 6, Megaphone = 7, Siren = 8,
        SearchLight = 9, FiftyCal = 10, M240B = 11, Flashbang = 12, TearGas = 13, Taser = 14, HeatBeam = 15,
        SEGM = 16, CommRelay = 17, GMTI = 18, LaserDesignator = 19, LWIR = 20,
    }
}

lmcp_types! {
    SERIES "afrl.impact";

    /// What drives a vehicle, as a payload.
    1 PowerConfiguration: PayloadConfiguration {
        nominal_power_configuration "NominalPowerConfiguration": PowerPlant,
    }

    /// A radio, as a payload.
    2 RadioConfiguration: PayloadConfiguration {
        range "Range" ["m"]: f32 = 1500.0,
        rally_point "RallyPoint": Ref<Location3D> = Ref::NULL,
        timeout "Timeout" ["ms"]: i64 = 120_000,
    }

    /// A radio tower, as an entity.
    3 RadioTowerConfiguration: EntityConfiguration {
        position "Position": Ref<Location3D>,
        range "Range" ["m"]: f32 = 1500.0,
        enabled "Enabled": bool = true,
    }

    /// Whether a radio is on and reaches somebody.
    4 RadioState: PayloadState {
        enabled "Enabled": bool = true,
        in_range "InRange": bool,
    }

    /// Whether a radio tower is on.
    5 RadioTowerState: EntityState {
        enabled "Enabled": bool = true,
    }

    /// The kinds of payload that a vehicle carries.
    6 ImpactPayloadConfiguration: PayloadConfiguration {
        available_payloads "AvailablePayloads": Vec<ImpactPayloadType>,
    }

    /// Uses a payload on an entity.
    7 DeployImpactPayload: VehicleAction {
        vehicle_id "VehicleID": i64,
        deployed_payload "DeployedPayload": ImpactPayloadType,
        target_entity_id "TargetEntityID": i64,
    }

    /// What drives a vehicle now.
    8 PowerPlantState: PayloadState {
        active_power_plant "ActivePowerPlant": PowerPlant,
    }

    /// Asks for travel times of vehicles to and between tasks.
    9 BatchRoutePlanRequest {
        request_id "RequestID": i64,
        vehicles "Vehicles": Vec<i64>,
        task_list "TaskList": Vec<i64>,
        operating_region "OperatingRegion": i64,
        compute_task_to_task_timing "ComputeTaskToTaskTiming": bool,
        compute_inter_task_to_task_timing "ComputeInterTaskToTaskTiming": bool,
        inter_task_percentage "InterTaskPercentage": Vec<f32>,
    }

    /// Travel times of vehicles to and between tasks.
    10 BatchRoutePlanResponse {
        response_id "ResponseID": i64,
        vehicle_timing "VehicleTiming": Vec<Ref<TaskTimingPair>>,
    }

    /// How long a vehicle takes from one task to another.
    11 TaskTimingPair {
        vehicle_id "VehicleID": i64,
        initial_task_id "InitialTaskID": i64,
        initial_task_percentage "InitialTaskPercentage": f32,
        destination_task_id "DestinationTaskID": i64,
        time_to_go "TimeToGo" ["ms"]: i64,
    }

    /// Asks for what tasks would cost each vehicle.
    12 BatchSummaryRequest {
        request_id "RequestID": i64,
        vehicles "Vehicles": Vec<i64>,
        task_list "TaskList": Vec<i64>,
        task_relationships "TaskRelationships": Text,
        inter_task_percentage "InterTaskPercentage": Vec<f32>,
        operating_region "OperatingRegion": i64,
    }

    /// What tasks would cost each vehicle.
    13 BatchSummaryResponse {
        response_id "ResponseID": i64,
        summaries "Summaries": Vec<Ref<TaskSummary>>,
    }

    /// What a task would cost each vehicle.
    14 TaskSummary {
        task_id "TaskID": i64,
        performing_vehicles "PerformingVehicles": Vec<Ref<VehicleSummary>>,
        best_effort "BestEffort" ["%"]: f32 = 100.0,
    }

    /// What a task would cost one vehicle.
    15 VehicleSummary {
        vehicle_id "VehicleID": i64,
        destination_task_id "DestinationTaskID": i64,
        initial_task_id "InitialTaskID": i64,
        initial_task_percentage "InitialTaskPercentage": f32,
        estimate_time_to_task_percentage "EstimateTimeToTaskPercentage" ["ms"]: i64,
        time_to_arrive "TimeToArrive" ["ms"]: i64,
        time_on_task "TimeOnTask" ["ms"]: i64,
        energy_remaining "EnergyRemaining" ["%"]: f32,
        beyond_comm_range "BeyondCommRange": bool,
        conflicts_with_roz "ConflictsWithROZ": bool,
        roz_ids "ROZIDs": Vec<i64>,
        waypoint_list "WaypointList": Vec<Ref<Waypoint>>,
        first_waypoint "FirstWaypoint": i64,
    }

    /// A speed and altitude for a vehicle at a task.
    16 SpeedAltPair {
        vehicle_id "VehicleID": i64,
        task_id "TaskID": i64,
        speed "Speed" ["m/s"]: f32,
        altitude "Altitude" ["m"]: f32,
        altitude_type "AltitudeType": AltitudeType,
    }

    /// An automation request with conditions of its own.
    17 ImpactAutomationRequest {
        request_id "RequestID": i64,
        trial_request "TrialRequest": Ref<AutomationRequest>,
        override_planning_conditions "OverridePlanningConditions": Vec<Ref<SpeedAltPair>>,
        play_id "PlayID": i64,
        solution_id "SolutionID": i64,
        sandbox "Sandbox": bool,
    }

    /// A plan with a summary of its tasks.
    18 ImpactAutomationResponse {
        response_id "ResponseID": i64,
        trial_response "TrialResponse": Ref<AutomationResponse>,
        play_id "PlayID": i64,
        solution_id "SolutionID": i64,
        sandbox "Sandbox": bool,
        summaries "Summaries": Vec<Ref<TaskSummary>>,
    }

    /// A point that tasks refer to by its number.
    19 PointOfInterest {
        point_id "PointID": i64,
        location "Location": Ref<Location3D>,
        point_action "PointAction": AreaActionOptions,
        point_label "PointLabel": Text,
        background_behavior_point "BackgroundBehaviorPoint": bool,
    }

    /// A line that tasks refer to by its number.
    20 LineOfInterest {
        line_id "LineID": i64,
        line "Line": Vec<Ref<Location3D>>,
        line_action "LineAction": AreaActionOptions,
        line_label "LineLabel": Text,
        background_behavior_line "BackgroundBehaviorLine": bool,
    }

    /// An area that tasks refer to by its number.
    21 AreaOfInterest {
        area_id "AreaID": i64,
        area "Area": Ref<AbstractGeometry>,
        area_action "AreaAction": AreaActionOptions,
        area_label "AreaLabel": Text,
        background_behavior_area "BackgroundBehaviorArea": bool,
    }

    /// A task to look at a point of interest, and then to act.
    22 ImpactPointSearchTask: SearchTask {
        search_location_id "SearchLocationID": i64,
        search_location "SearchLocation": Ref<Location3D> = Ref::NULL,
        standoff_distance "StandoffDistance" ["m"]: f32,
        view_angle_list "ViewAngleList": Vec<Ref<Wedge>>,
        desired_action "DesiredAction": Ref<LoiterAction> = Ref::NULL,
    }

    /// A task to search around a point by a pattern.
    23 PatternSearchTask: SearchTask {
        search_location_id "SearchLocationID": i64,
        search_location "SearchLocation": Ref<Location3D> = Ref::NULL,
        pattern "Pattern": AreaSearchPattern,
        extent "Extent" ["m"]: f32,
    }

    /// A task to sweep an area of interest at an angle.
    24 AngledAreaSearchTask: SearchTask {
        search_area_id "SearchAreaID": i64,
        sweep_angle "SweepAngle" ["deg"]: f32,
        start_point "StartPoint": Ref<Location3D> = Ref::NULL,
    }

    /// A task to search along a line of interest.
    25 ImpactLineSearchTask: SearchTask {
        line_id "LineID": i64,
        view_angle_list "ViewAngleList": Vec<Ref<Wedge>>,
        use_inertial_view_angles "UseInertialViewAngles": bool,
    }

    /// A task to keep an entity in view.
    26 WatchTask: SearchTask {
        watched_entity_id "WatchedEntityID": i64,
    }

    /// A task to keep an entity in view by several vehicles.
    27 MultiVehicleWatchTask: SearchTask {
        watched_entity_id "WatchedEntityID": i64,
        number_vehicles "NumberVehicles": u8 = 1,
    }

    /// A task to relay an entity's radio to a tower.
    28 CommRelayTask: Task {
        supported_entity_id "SupportedEntityID": i64,
        destination_location "DestinationLocation": Ref<Location3D> = Ref::NULL,
        tower_id "TowerID": i64,
    }

    /// A task to close the ways to a place.
    29 CordonTask: Task {
        cordon_location "CordonLocation": Ref<Location3D>,
        standoff_distance "StandoffDistance" ["m"]: f32 = 100.0,
    }

    /// A task to keep an entity from a place.
    30 BlockadeTask: Task {
        blocked_entity_id "BlockedEntityID": i64,
        standoff_distance "StandoffDistance" ["m"]: f32,
        number_vehicles "NumberVehicles": u8 = 1,
        protected_location "ProtectedLocation": Ref<Location3D> = Ref::NULL,
    }

    /// A task to go with an entity.
    31 EscortTask: SearchTask {
        supported_entity_id "SupportedEntityID": i64,
        route_id "RouteID": i64,
        prescribed_waypoints "PrescribedWaypoints": Vec<Ref<Waypoint>>,
        standoff_distance "StandoffDistance" ["m"]: f32 = 100.0,
    }

    /// Asks for the configurations of vehicles.
    32 ConfigurationRequest {
        vehicle_id "VehicleID": Vec<i64>,
    }

    /// Current and waves in an area.
    33 WaterReport {
        area "Area": Ref<AbstractGeometry>,
        current_speed "CurrentSpeed" ["m/s"]: f32,
        current_direction "CurrentDirection" ["deg"]: f32,
        wave_direction "WaveDirection" ["deg"]: f32,
        wave_height "WaveHeight" ["m"]: f32,
    }

    /// A zone that surface vehicles stay in.
    34 WaterZone: AbstractZone {}

    /// A task to drop a payload and to look at the effect.
    35 PayloadDropTask: Task {
        drop_location "DropLocation": Ref<Location3D>,
        bda_location "BDALocation": Ref<Location3D>,
    }
}
