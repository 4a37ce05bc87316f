//! Routes and commands to vehicles.

use super::{
    CommandStatusType, Location3D, SERIES, SpeedType, TravelMode, TurnType, VehicleAction,
    WaypointTransferMode,
};
use crate::lmcp::Ref;

lmcp_types! {
    SERIES "afrl.cmasi";

    /// A place of a route, with how to go there and what to do.
    35 Waypoint: Location3D {
        number "Number": i64,
        next_waypoint "NextWaypoint": i64,
        speed "Speed" ["m/s"]: f32,
        speed_type "SpeedType": SpeedType,
        climb_rate "ClimbRate" ["m/s"]: f32,
        turn_type "TurnType": TurnType,
        vehicle_action_list "VehicleActionList": Vec<Ref<VehicleAction>>,
        contingency_waypoint_a "ContingencyWaypointA": i64,
        contingency_waypoint_b "ContingencyWaypointB": i64,
        associated_tasks "AssociatedTasks": Vec<i64>,
    }

    /// A waypoint of a path, with a pause.
    57 PathWaypoint: Waypoint {
        pause_time "PauseTime" ["ms"]: i64,
    }

    /// Has a vehicle act at once.
    47 VehicleActionCommand {
        command_id "CommandID": i64,
        vehicle_id "VehicleID": i64,
        vehicle_action_list "VehicleActionList": Vec<Ref<VehicleAction>>,
        status "Status": CommandStatusType,
    }

    /// Sends a vehicle along waypoints.
    36 MissionCommand: VehicleActionCommand {
        waypoint_list "WaypointList": Vec<Ref<Waypoint>>,
        first_waypoint "FirstWaypoint": i64,
    }

    /// Sends a vehicle along a path, without its own route following.
    56 FollowPathCommand: VehicleActionCommand {
        first_waypoint "FirstWaypoint": i64,
        waypoint_list "WaypointList": Vec<Ref<PathWaypoint>>,
        start_time "StartTime" ["ms"]: i64,
        stop_time "StopTime" ["ms"]: i64,
        repeat_mode "RepeatMode": TravelMode,
    }

    /// Waypoints given to a vehicle or reported by it.
    59 WaypointTransfer {
        entity_id "EntityID": i64,
        waypoints "Waypoints": Vec<Ref<Waypoint>>,
        transfer_mode "TransferMode": WaypointTransferMode = WaypointTransferMode::AddWaypoints,
    }
}
