//! Actions of vehicles and payloads.

use super::{AltitudeType, Location3D, LoiterDirection, LoiterType, SERIES, SpeedType};
use crate::lmcp::Ref;

lmcp_types! {
    SERIES "afrl.cmasi";

    /// What every action of a vehicle is.
    7 VehicleAction in Box {
        associated_task_list "AssociatedTaskList": Vec<i64>,
    }

    /// What every action of a payload is.
    4 PayloadAction: VehicleAction {
        payload_id "PayloadID": i64,
    }

    /// Zooms a camera.
    18 CameraAction: PayloadAction {
        horizontal_field_of_view "HorizontalFieldOfView" ["deg"]: f32,
    }

    /// Points a gimbal by angles to the vehicle.
    23 GimbalAngleAction: PayloadAction {
        azimuth "Azimuth" ["deg"]: f32,
        elevation "Elevation" ["deg"]: f32,
        rotation "Rotation" ["deg"]: f32,
    }

    /// Sweeps a gimbal to and fro.
    25 GimbalScanAction: PayloadAction {
        azimuth_slew_rate "AzimuthSlewRate" ["deg/s"]: f32,
        elevation_slew_rate "ElevationSlewRate" ["deg/s"]: f32,
        start_azimuth "StartAzimuth" ["deg"]: f32,
        end_azimuth "EndAzimuth" ["deg"]: f32,
        start_elevation "StartElevation" ["deg"]: f32,
        end_elevation "EndElevation" ["deg"]: f32,
        cycles "Cycles": u32,
    }

    /// Keeps a gimbal on a point.
    26 GimbalStareAction: PayloadAction {
        starepoint "Starepoint": Ref<Location3D>,
        duration "Duration" ["ms"]: i64,
    }

    /// Stows a payload.
    60 PayloadStowAction {
        payload_id "PayloadID": i64,
    }

    /// Selects the sensor of a video stream.
    48 VideoStreamAction: VehicleAction {
        video_stream_id "VideoStreamID": i32,
        active_sensor "ActiveSensor": i32,
    }

    /// What every action that steers a vehicle is.
    32 NavigationAction: VehicleAction {}

    /// Sends a vehicle to a waypoint of its mission.
    28 GoToWaypointAction: NavigationAction {
        waypoint_number "WaypointNumber": i64,
    }

    /// Keeps a vehicle near a place.
    33 LoiterAction: NavigationAction in Box {
        loiter_type "LoiterType": LoiterType,
        radius "Radius" ["m"]: f32,
        axis "Axis" ["deg"]: f32,
        length "Length" ["m"]: f32,
        direction "Direction": LoiterDirection,
        duration "Duration" ["ms"]: i64,
        airspeed "Airspeed" ["m/s"]: f32,
        location "Location": Ref<Location3D>,
    }

    /// Has an aircraft hold speed, heading and altitude.
    54 FlightDirectorAction: NavigationAction {
        speed "Speed" ["m/s"]: f32,
        speed_type "SpeedType": SpeedType,
        heading "Heading" ["deg"]: f32,
        altitude "Altitude" ["m"]: f32,
        altitude_type "AltitudeType": AltitudeType = AltitudeType::MSL,
        climb_rate "ClimbRate" ["m/s"]: f32,
    }

    /// Stops a vehicle, at a place or where it is.
    58 StopMovementAction: VehicleAction {
        location "Location": Ref<Location3D> = Ref::NULL,
    }
}
