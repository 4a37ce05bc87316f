//! What is measured, where no file is given.

use aldis_envelope::lmcp::Ref;
use aldis_envelope::lmcp::cmasi::{
    AirVehicleState, CameraState, EntityState, GimbalPointingMode, GimbalState, GimballedPayloadState,
    KeyValuePair, Location3D, MissionCommand, NavigationMode, PayloadState, VehicleActionCommand, Waypoint,
};

/// The length of the mission.
pub(super) const WAYPOINTS: u16 = 75;

fn place(number: u16) -> Location3D {
    let shift = f64::from(number) * 1e-3;
    Location3D { latitude: 45.3 + shift, longitude: -120.9 - shift, altitude: 700.0, ..Default::default() }
}

fn pairs(what: &str) -> Vec<Ref<KeyValuePair>> {
    let pair = |number| KeyValuePair { key: format!("{what}_{number}").into(), value: "nominal".into() };
    vec![pair(1).into(), pair(2).into()]
}

/// The state of an aircraft with a camera in a gimbal, two tasks and some remarks.
pub(super) fn state() -> AirVehicleState {
    let camera = CameraState {
        base: GimballedPayloadState {
            base: PayloadState { payload_id: 2, parameters: pairs("parameter") },
            pointing_mode: GimbalPointingMode::LatLonSlaved,
            azimuth: 12.5,
            elevation: -40.0,
            rotation: 0.5,
        },
        horizontal_field_of_view: 30.0,
        vertical_field_of_view: 22.5,
        footprint: vec![place(1).into(), place(2).into()],
        centerpoint: place(3).into(),
    };
    let mount = GimbalState {
        base: PayloadState { payload_id: 1, parameters: pairs("parameter") },
        pointing_mode: GimbalPointingMode::LatLonSlaved,
        azimuth: 12.5,
        elevation: -40.0,
        rotation: 0.5,
    };
    let base = EntityState {
        id: 400,
        u: 22.0,
        heading: 90.0,
        course: 91.0,
        groundspeed: 21.5,
        location: place(0).into(),
        energy_available: 87.5,
        actual_energy_rate: 0.01,
        payload_state_list: vec![camera.into(), mount.into()],
        current_waypoint: 7,
        current_command: 100,
        mode: NavigationMode::Waypoint,
        associated_tasks: vec![1000, 1001],
        time: 1_795_309_868_120,
        info: pairs("remark"),
        ..Default::default()
    };
    AirVehicleState { base, airspeed: 22.0, wind_speed: 3.0, wind_direction: 270.0, ..Default::default() }
}

/// A mission without actions on its way.
pub(super) fn mission() -> MissionCommand {
    let waypoint = |number: u16| Waypoint {
        base: place(number),
        number: number.into(),
        next_waypoint: i64::from(number) + 1,
        speed: 22.0,
        associated_tasks: vec![1000],
        ..Default::default()
    };
    MissionCommand {
        base: VehicleActionCommand { command_id: 100, vehicle_id: 400, ..Default::default() },
        waypoint_list: (1..=WAYPOINTS).map(|number| waypoint(number).into()).collect(),
        first_waypoint: 1,
    }
}
