//! The CMASI series: vehicles, payloads, tasks, zones, missions and plans.

mod action;
mod command;
mod entity;
mod geometry;
mod payload;
mod session;
mod task;
mod zone;

pub use action::{
    CameraAction, FlightDirectorAction, GimbalAngleAction, GimbalScanAction, GimbalStareAction,
    GoToWaypointAction, LoiterAction, NavigationAction, PayloadAction, PayloadStowAction, StopMovementAction,
    VehicleAction, VideoStreamAction,
};
pub use command::{
    FollowPathCommand, MissionCommand, PathWaypoint, VehicleActionCommand, Waypoint, WaypointTransfer,
};
pub use entity::{
    AirVehicleConfiguration, AirVehicleState, EntityConfiguration, EntityState, FlightProfile, RemoveEntities,
};
pub use geometry::{AbstractGeometry, Circle, Location3D, Polygon, Rectangle, Wedge};
pub use payload::{
    CameraConfiguration, CameraState, GimbalConfiguration, GimbalState, GimballedPayloadState,
    PayloadConfiguration, PayloadState, VideoStreamConfiguration, VideoStreamState,
};
pub use session::{KeyValuePair, OperatorSignal, ServiceStatus, SessionStatus};
pub use task::{
    AreaSearchTask, AutomationRequest, AutomationResponse, LineSearchTask, LoiterTask, MustFlyTask,
    PointSearchTask, RemoveTasks, SearchTask, Task,
};
pub use zone::{AbstractZone, KeepInZone, KeepOutZone, OperatingRegion, RemoveZones, WeatherReport};

use super::registry::table;
use super::schema::{Series, SeriesName, TypeInfo};

/// The series as the wire and the XML form know it.
pub const SERIES: Series =
    Series { name: SeriesName::new("CMASI"), text: "CMASI", namespace: "afrl.cmasi", version: 3 };

/// Its types by their number.
pub(super) const TYPES_BY_ID: [&TypeInfo; 60] = table(&[
    geometry::TYPES,
    session::TYPES,
    payload::TYPES,
    entity::TYPES,
    action::TYPES,
    command::TYPES,
    task::TYPES,
    zone::TYPES,
]);

lmcp_enums! {
    /// The band of light that a sensor sees.
    WavelengthBand { AllAny = 0, EO = 1, LWIR = 2, SWIR = 3, MWIR = 4, Other = 5 }

    /// What steers a vehicle.
    NavigationMode {
        Waypoint = 0, Loiter = 1, FlightDirector = 2, TargetTrack = 3, FollowLeader = 4, LostComm = 5,
    }

    /// Whether a camera zooms in steps or continuously.
    FOVOperationMode { Continuous = 0, Discrete = 1 }

    /// How a gimbal is told where to point.
    GimbalPointingMode {
        Unknown = 0, AirVehicleRelativeAngle = 1, AirVehicleRelativeSlewRate = 2, LatLonSlaved = 3,
        InertialRelativeSlewRate = 4, Scan = 5, Stowed = 6,
    }

    /// Why a zone is kept out of.
    ZoneAvoidanceType { Physical = 1, Regulatory = 2, Acoustic = 3, Threat = 4, Visual = 5 }

    /// The shape of a loiter.
    LoiterType { VehicleDefault = 0, Circular = 1, Racetrack = 2, FigureEight = 3, Hover = 4 }

    /// The sense of turn of a loiter.
    LoiterDirection { VehicleDefault = 0, CounterClockwise = 1, Clockwise = 2 }

    /// How grave a service's report is.
    ServiceStatusType { Information = 0, Warning = 1, Error = 2 }

    /// What a simulation is doing.
    SimulationStatusType { Stopped = 0, Running = 1, Paused = 2, Reset = 3 }

    /// What a speed is measured against.
    SpeedType { Airspeed = 0, Groundspeed = 1 }

    /// Whether a turn begins before its waypoint or over it.
    TurnType { TurnShort = 0, FlyOver = 1 }

    /// How far a command has come.
    CommandStatusType { Pending = 0, Approved = 1, InProcess = 2, Executed = 3, Cancelled = 4 }

    /// What an altitude is measured from: the ground below or mean sea level.
    AltitudeType { AGL = 0, MSL = 1 }

    /// What a vehicle does at the end of its path.
    TravelMode { SinglePass = 0, ReverseCourse = 1, Loop = 2 }

    /// What is done with the waypoints of a transfer.
    WaypointTransferMode { RequestWaypoints = 0, AddWaypoints = 1, ClearWaypoints = 2, ReportWaypoints = 3 }
}
