//! The UXNATIVE series: the inner life of UxAS services and vehicles.

use super::cmasi::{
    AltitudeType, EntityConfiguration, EntityState, KeepInZone, KeepOutZone, Location3D, MissionCommand,
    OperatingRegion, Task, VehicleAction,
};
use super::impact::{AreaOfInterest, LineOfInterest, PointOfInterest};
use super::registry::table;
use super::schema::{Series, SeriesName, TypeInfo};
use super::{Ref, Text};

/// The series as the wire and the XML form know it.
pub const SERIES: Series = Series {
    name: SeriesName::new("UXNATIVE"),
    text: "UXNATIVE",
    namespace: "uxas.messages.uxnative",
    version: 9,
};

/// Its types by their number.
pub(super) const TYPES_BY_ID: [&TypeInfo; 17] = table(&[TYPES]);

lmcp_types! {
    SERIES "uxas.messages.uxnative";

    /// Starts or stops a recording.
    1 VideoRecord {
        record "Record": bool,
    }

    /// All services of an entity have started.
    2 StartupComplete {}

    /// Has the service manager start a service, and tells it what is known.
    3 CreateNewService {
        service_id "ServiceID": i64,
        xml_configuration "XmlConfiguration": Text,
        entity_configurations "EntityConfigurations": Vec<Ref<EntityConfiguration>>,
        entity_states "EntityStates": Vec<Ref<EntityState>>,
        mission_commands "MissionCommands": Vec<Ref<MissionCommand>>,
        areas "Areas": Vec<Ref<AreaOfInterest>>,
        lines "Lines": Vec<Ref<LineOfInterest>>,
        points "Points": Vec<Ref<PointOfInterest>>,
        keep_in_zones "KeepInZones": Vec<Ref<KeepInZone>>,
        keep_out_zones "KeepOutZones": Vec<Ref<KeepOutZone>>,
        operating_regions "OperatingRegions": Vec<Ref<OperatingRegion>>,
    }

    /// Has the service manager stop a service.
    4 KillService {
        service_id "ServiceID": i64,
    }

    /// Has a vehicle go on to its next waypoint.
    5 IncrementWaypoint {
        vehicle_id "VehicleID": i64,
    }

    /// Steers a vehicle by heading within its operating region.
    6 SafeHeadingAction: VehicleAction {
        vehicle_id "VehicleID": i64,
        operating_region "OperatingRegion": i64,
        lead_ahead_distance "LeadAheadDistance" ["m"]: f32 = 1000.0,
        loiter_radius "LoiterRadius" ["m"]: f32,
        desired_heading "DesiredHeading" ["deg"]: f32,
        desired_heading_rate "DesiredHeadingRate" ["deg/s"]: f32,
        use_heading_rate "UseHeadingRate": bool,
        altitude "Altitude" ["m"]: f32,
        altitude_type "AltitudeType": AltitudeType = AltitudeType::MSL,
        use_altitude "UseAltitude": bool,
        speed "Speed" ["m/s"]: f32,
        use_speed "UseSpeed": bool,
    }

    /// Where an entity is, and since when.
    7 EntityLocation {
        entity_id "EntityID": i64,
        position "Position": Ref<Location3D>,
        time "Time" ["ms"]: i64,
    }

    /// A payload to measure a link with.
    8 BandwidthTest: EntityLocation {
        message_id "MessageID": i64,
        payload "Payload": Text,
    }

    /// What arrived of a payload, and where from.
    9 BandwidthReceiveReport {
        entity_sender "EntitySender": Ref<EntityLocation>,
        entity_receiver "EntityReceiver": Ref<EntityLocation>,
        transfer_payload_size "TransferPayloadSize": u32,
    }

    /// Tasks for an entity to do within another.
    10 SubTaskExecution {
        sub_tasks "SubTasks": Vec<Ref<Task>>,
        strict_order "StrictOrder": bool,
    }

    /// Tasks given to an entity within another, and its neighbours.
    11 SubTaskAssignment {
        sub_tasks "SubTasks": Vec<Ref<Task>>,
        neighbors "Neighbors": Vec<Ref<EntityState>>,
    }

    /// What the autopilot is allowed to do, sent often.
    12 AutopilotKeepAlive {
        autopilot_enabled "AutopilotEnabled": bool = true,
        speed_authorized "SpeedAuthorized": bool = true,
        gimbal_enabled "GimbalEnabled": bool = true,
        time_sent "TimeSent" ["ms since 1970"]: i64,
        speed_override "SpeedOverride" ["m/s"]: f32 = -1.0,
        alt_override "AltOverride" ["m above mean sea level"]: f32 = -1.0,
    }

    /// What runs on a vehicle and what it may do.
    13 OnboardStatusReport {
        vehicle_id "VehicleID": i64,
        connected_entities "ConnectedEntities": Vec<i64>,
        current_task_list "CurrentTaskList": Vec<i64>,
        valid_state "ValidState": bool,
        valid_authorization "ValidAuthorization": bool,
        speed_authorization "SpeedAuthorization": bool,
        gimbal_authorization "GimbalAuthorization": bool,
        vehicle_time "VehicleTime" ["ms since 1970"]: i64,
    }

    /// An entity joined the network.
    14 EntityJoin {
        entity_id "EntityID": i64,
        label "Label": Text,
    }

    /// An entity left the network.
    15 EntityExit {
        entity_id "EntityID": i64,
        label "Label": Text,
    }

    /// A vehicle is done with a step of simulated time.
    16 SimulationTimeStepAcknowledgement {
        vehicle_id "VehicleID": i64,
        reported_time "ReportedTime" ["ms"]: i64,
    }

    /// Sets a vehicle's speed.
    17 SpeedOverrideAction: VehicleAction {
        vehicle_id "VehicleID": i64,
        speed "Speed" ["m/s"]: f32,
    }
}
