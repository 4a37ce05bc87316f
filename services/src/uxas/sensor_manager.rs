//! SensorManager: what the sensors of vehicles see of the ground.
//!
//! | what comes | what it does |
//! | --- | --- |
//! | configurations | keeps the newest |
//! | `SensorFootprintRequests` | `SensorFootprintResponse`: one footprint for each vehicle, band, distance, altitude and elevation that some sensor can do |
//!
//! An empty list means: any band, any ground sample distance, the nominal altitude, the whole range of elevations. A payload
//! with the parameter `SwathWidth_m` is a sonar or radar: it covers this width at any elevation. No configuration.

use super::machine::{Heard, Machine, Post};
use super::vehicle::named_in;
use super::world::World;
use crate::plan::sensor::{Camera, Footprint, Sensor, Swath};
use aldis_envelope::lmcp::cmasi::{
    CameraConfiguration, EntityConfiguration, FOVOperationMode, GimbalConfiguration, PayloadConfiguration,
    RemoveEntities, WavelengthBand,
};
use aldis_envelope::lmcp::uxtask::{
    FootprintRequest, SensorFootprint, SensorFootprintRequests, SensorFootprintResponse,
};
use aldis_envelope::lmcp::{Ref, Struct, TypeInfo};

/// The parameter of a payload that covers a width whatever its height.
pub const SWATH_KEY: &str = "SwathWidth_m";

/// How far apart elevations and fields of view are tried, in degrees.
const STEP_DEG: f64 = 5.0;

/// The lowest height that is reckoned with, in metres.
const HEIGHT_MIN_M: f64 = 10.0;

/// The highest look, in degrees.
const ELEVATION_MAX_DEG: f64 = -1.0;

/// The ground sample distance where none is asked for, in metres: any.
const DISTANCE_ANY_M: f64 = 1000.0;

/// The machine.
#[derive(Default)]
pub struct SensorManager {
    world: World,
}

/// What is asked of a vehicle.
struct Wish {
    band: WavelengthBand,
    distance_m: f64,
    height_m: f64,
    /// None: any.
    elevation_deg: Option<f64>,
}

/// A sensor's look that was found.
struct Found {
    camera: i64,
    gimbal: i64,
    elevation_deg: f64,
    field_of_view_deg: f64,
    aspect_ratio: f64,
    band: WavelengthBand,
    footprint: Footprint,
}

impl SensorManager {
    fn answer(&self, request: &FootprintRequest) -> Vec<SensorFootprint> {
        let Some(entity) = self.world.configuration(request.vehicle_id) else { return Vec::new() };
        let or = |list: &[f32], default: f64| match list {
            [] => vec![default],
            some => some.iter().map(|&one| f64::from(one)).collect(),
        };
        let bands = match request.eligible_wavelengths.as_slice() {
            [] => vec![WavelengthBand::AllAny],
            some => some.to_vec(),
        };
        let elevations: Vec<Option<f64>> = match request.elevation_angles.as_slice() {
            [] => vec![None],
            some => some.iter().map(|&one| Some(f64::from(one).to_degrees())).collect(),
        };
        let mut found = Vec::new();
        for &band in &bands {
            for distance_m in or(&request.ground_sample_distances, DISTANCE_ANY_M) {
                for height_m in or(&request.agl_altitudes, f64::from(entity.nominal_altitude)) {
                    for &elevation_deg in &elevations {
                        let distance_m = if distance_m > 0.0 { distance_m } else { DISTANCE_ANY_M };
                        let wish =
                            Wish { band, distance_m, height_m: height_m.max(HEIGHT_MIN_M), elevation_deg };
                        found.extend(best(entity, &wish).map(|one| told(request, &wish, &one)));
                    }
                }
            }
        }
        found
    }
}

/// The look of a vehicle that comes nearest to the wish.
fn best(entity: &EntityConfiguration, wish: &Wish) -> Option<Found> {
    let payloads = || entity.payload_configuration_list.iter().filter_map(|payload| payload.object());
    let all = || payloads().filter_map(|payload| payload.get::<PayloadConfiguration>());
    if let Some(found) = all().find_map(|payload| swath(payload, wish)) {
        return Some(found);
    }
    let mut best: Option<(f64, Found)> = None;
    for gimbal in payloads().filter_map(|payload| payload.get::<GimbalConfiguration>()) {
        for camera in payloads().filter_map(|payload| payload.get::<CameraConfiguration>()) {
            let is_carried = gimbal.contained_payload_list.contains(&camera.payload_id);
            let fits = [WavelengthBand::AllAny, camera.supported_wavelength_band].contains(&wish.band)
                || camera.supported_wavelength_band == WavelengthBand::AllAny;
            if !is_carried || !fits {
                continue;
            }
            for elevation_deg in elevations(gimbal, wish.elevation_deg) {
                for field_of_view_deg in fields_of_view(camera) {
                    let Some(found) = look(camera, gimbal, elevation_deg, field_of_view_deg, wish) else {
                        continue;
                    };
                    let miss = (wish.distance_m - found.footprint.ground_sample_distance_m).abs();
                    if best.as_ref().is_none_or(|(least, _)| miss < *least) {
                        best = Some((miss, found));
                    }
                }
            }
        }
    }
    best.map(|(_, found)| found)
}

fn look(
    camera: &CameraConfiguration,
    gimbal: &GimbalConfiguration,
    elevation_deg: f64,
    field_of_view_deg: f64,
    wish: &Wish,
) -> Option<Found> {
    let sensor = Camera {
        horizontal_field_of_view_rad: field_of_view_deg.to_radians(),
        horizontal_pixels: camera.video_stream_horizontal_resolution,
        vertical_pixels: camera.video_stream_vertical_resolution,
    };
    let footprint = sensor.footprint(wish.height_m, elevation_deg.to_radians()).ok()?;
    Some(Found {
        camera: camera.payload_id,
        gimbal: gimbal.payload_id,
        elevation_deg,
        field_of_view_deg,
        aspect_ratio: sensor.aspect_ratio(),
        band: camera.supported_wavelength_band,
        footprint,
    })
}

fn swath(payload: &PayloadConfiguration, wish: &Wish) -> Option<Found> {
    let width_m = named_in(&payload.parameters, SWATH_KEY)?;
    let footprint = Swath { width_m }.footprint(wish.height_m, 0.0).ok()?;
    Some(Found {
        camera: payload.payload_id,
        gimbal: 0,
        elevation_deg: wish.elevation_deg.unwrap_or(0.0),
        field_of_view_deg: 0.0,
        aspect_ratio: 1.0,
        band: wish.band,
        footprint,
    })
}

/// The elevations that a gimbal can do, of those that are wished for.
fn elevations(gimbal: &GimbalConfiguration, wished_deg: Option<f64>) -> Vec<f64> {
    let (low, high) = match gimbal.is_elevation_clamped {
        true => (
            f64::from(gimbal.min_elevation).max(-179.0),
            f64::from(gimbal.max_elevation).min(ELEVATION_MAX_DEG),
        ),
        false => (-179.0, ELEVATION_MAX_DEG),
    };
    match wished_deg {
        // As near as the gimbal comes.
        Some(wished) if wished < 0.0 && low <= high => vec![wished.clamp(low, high)],
        Some(_) => Vec::new(),
        None => {
            let steps = ((high - low) / STEP_DEG).floor();
            if steps.is_nan() || steps < 0.0 {
                return Vec::new();
            }
            (0..=steps as u32).map(|at| low + f64::from(at) * STEP_DEG).collect()
        }
    }
}

fn fields_of_view(camera: &CameraConfiguration) -> Vec<f64> {
    if camera.field_of_view_mode == FOVOperationMode::Discrete {
        return camera.discrete_horizontal_field_of_view_list.iter().map(|&one| f64::from(one)).collect();
    }
    let (low, high) = (
        f64::from(camera.min_horizontal_field_of_view),
        f64::from(camera.max_horizontal_field_of_view).min(179.0),
    );
    let steps = ((high - low) / STEP_DEG).floor();
    if steps.is_nan() || steps < 0.0 {
        return Vec::new();
    }
    (0..=steps as u32).map(|at| low + f64::from(at) * STEP_DEG).collect()
}

fn told(request: &FootprintRequest, wish: &Wish, found: &Found) -> SensorFootprint {
    let footprint = &found.footprint;
    SensorFootprint {
        footprint_response_id: request.footprint_request_id,
        vehicle_id: request.vehicle_id,
        camera_id: found.camera,
        gimbal_id: found.gimbal,
        horizontal_fov: found.field_of_view_deg as f32,
        agl_altitude: wish.height_m as f32,
        gimbal_elevation: found.elevation_deg as f32,
        aspect_ratio: found.aspect_ratio as f32,
        achieved_gsd: footprint.ground_sample_distance_m as f32,
        camera_wavelength: found.band,
        horizontal_to_leading_edge: footprint.to_leading_edge_m as f32,
        horizontal_to_trailing_edge: footprint.to_trailing_edge_m as f32,
        horizontal_to_center: footprint.to_center_m as f32,
        width_center: footprint.width_center_m as f32,
        slant_range_to_center: footprint.slant_range_m as f32,
    }
}

impl Machine for SensorManager {
    fn hears(&self) -> Vec<&'static TypeInfo> {
        vec![EntityConfiguration::TYPE, RemoveEntities::TYPE, SensorFootprintRequests::TYPE]
    }

    fn take(&mut self, heard: &Heard<'_>, post: &mut Post<'_>) {
        if let Some(request) = heard.object.get::<SensorFootprintRequests>() {
            let asked = request.footprints.iter().filter_map(|one| one.get());
            let footprints = asked.flat_map(|one| self.answer(one)).map(Ref::new).collect();
            post.broadcast(&SensorFootprintResponse { response_id: request.request_id, footprints });
        } else {
            self.world.take(heard.object);
        }
    }
}
