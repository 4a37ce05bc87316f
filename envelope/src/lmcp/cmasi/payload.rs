//! Payloads and their states.

use super::{FOVOperationMode, GimbalPointingMode, KeyValuePair, Location3D, SERIES, WavelengthBand};
use crate::lmcp::{Ref, Text};

lmcp_types! {
    SERIES "afrl.cmasi";

    /// What every payload of an entity is.
    5 PayloadConfiguration in Box {
        payload_id "PayloadID": i64,
        payload_kind "PayloadKind": Text,
        parameters "Parameters": Vec<Ref<KeyValuePair>>,
    }

    /// What a camera is able to do.
    19 CameraConfiguration: PayloadConfiguration {
        supported_wavelength_band "SupportedWavelengthBand": WavelengthBand = WavelengthBand::EO,
        field_of_view_mode "FieldOfViewMode": FOVOperationMode,
        min_horizontal_field_of_view "MinHorizontalFieldOfView" ["deg"]: f32,
        max_horizontal_field_of_view "MaxHorizontalFieldOfView" ["deg"]: f32,
        discrete_horizontal_field_of_view_list "DiscreteHorizontalFieldOfViewList" ["deg"]: Vec<f32>,
        video_stream_horizontal_resolution "VideoStreamHorizontalResolution" ["pixel"]: u32,
        video_stream_vertical_resolution "VideoStreamVerticalResolution" ["pixel"]: u32,
    }

    /// What a gimbal is able to do and carries.
    24 GimbalConfiguration: PayloadConfiguration {
        supported_pointing_modes "SupportedPointingModes": Vec<GimbalPointingMode>,
        min_azimuth "MinAzimuth" ["deg"]: f32 = -180.0,
        max_azimuth "MaxAzimuth" ["deg"]: f32 = 180.0,
        is_azimuth_clamped "IsAzimuthClamped": bool,
        min_elevation "MinElevation" ["deg"]: f32 = -180.0,
        max_elevation "MaxElevation" ["deg"]: f32 = 180.0,
        is_elevation_clamped "IsElevationClamped": bool,
        min_rotation "MinRotation" ["deg"]: f32,
        max_rotation "MaxRotation" ["deg"]: f32,
        is_rotation_clamped "IsRotationClamped": bool = true,
        max_azimuth_slew_rate "MaxAzimuthSlewRate" ["deg/s"]: f32,
        max_elevation_slew_rate "MaxElevationSlewRate" ["deg/s"]: f32,
        max_rotation_rate "MaxRotationRate" ["deg/s"]: f32,
        contained_payload_list "ContainedPayloadList": Vec<i64>,
    }

    /// A video stream and the sensors that it can show.
    49 VideoStreamConfiguration: PayloadConfiguration {
        available_sensor_list "AvailableSensorList": Vec<i64>,
    }

    /// What every payload's state is.
    6 PayloadState in Box {
        payload_id "PayloadID": i64,
        parameters "Parameters": Vec<Ref<KeyValuePair>>,
    }

    /// The state of a payload that points by itself.
    20 GimballedPayloadState: PayloadState {
        pointing_mode "PointingMode": GimbalPointingMode,
        azimuth "Azimuth" ["deg"]: f32,
        elevation "Elevation" ["deg"]: f32,
        rotation "Rotation" ["deg"]: f32,
    }

    /// The state of a camera and what it sees.
    21 CameraState: GimballedPayloadState {
        horizontal_field_of_view "HorizontalFieldOfView" ["deg"]: f32,
        vertical_field_of_view "VerticalFieldOfView" ["deg"]: f32,
        footprint "Footprint": Vec<Ref<Location3D>>,
        centerpoint "Centerpoint": Ref<Location3D> = Ref::NULL,
    }

    /// The state of a gimbal.
    27 GimbalState: PayloadState {
        pointing_mode "PointingMode": GimbalPointingMode,
        azimuth "Azimuth" ["deg"]: f32,
        elevation "Elevation" ["deg"]: f32,
        rotation "Rotation" ["deg"]: f32,
    }

    /// The sensor that a video stream shows.
    50 VideoStreamState: PayloadState {
        active_sensor "ActiveSensor": i64,
    }
}
