//! Where a gimbal points a camera, and the look that comes nearest to what is asked.

use super::{Camera, Footprint, Sensor, SensorError};
use std::f64::consts::{PI, TAU};

/// Looks end this far below the horizon, in radians: nearer to it, a footprint has no far edge.
const BELOW_HORIZON_RAD: f64 = PI / 180.0;

/// How far elevations that are tried lie apart, in radians.
const STEP_RAD: f64 = 5.0 * PI / 180.0;

/// The field of regard of a gimbal, from the nose of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gimbal {
    /// From which azimuth to which it turns, in radians, clockwise; none: all around.
    pub azimuth_rad: Option<(f64, f64)>,
    /// From which elevation to which, in radians above the horizon; none: all around.
    pub elevation_rad: Option<(f64, f64)>,
}

/// A look at the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aim {
    /// The camera, at one of its fields of view.
    pub camera: Camera,
    /// The elevation, in radians: below 0.
    pub elevation_rad: f64,
    /// What it sees.
    pub footprint: Footprint,
}

/// Why there is no look.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum AimError {
    /// The gimbal only looks up.
    #[error("the gimbal does not turn to the ground: its elevation ends above -1°")]
    NoGround,
    /// The elevation is above what the gimbal reaches.
    #[error("an elevation of {0}° is out of reach: at most {1}° are")]
    TooHigh(f64, f64),
    /// Nothing to look with.
    #[error("there is no camera to look with")]
    NoCamera,
    /// The camera sees nothing.
    #[error(transparent)]
    Sensor(#[from] SensorError),
}

impl Gimbal {
    /// Whether it turns to an azimuth, from the nose of the vehicle, and an elevation, both in radians.
    pub fn reaches(&self, azimuth_rad: f64, elevation_rad: f64) -> bool {
        let across = self.azimuth_rad.is_none_or(|(from, to)| {
            let beyond = (azimuth_rad - from).rem_euclid(TAU);
            to >= from && (beyond <= to - from || TAU - beyond < 1e-12)
        });
        across && self.elevation_rad.is_none_or(|(from, to)| (from..=to).contains(&elevation_rad))
    }

    /// From which elevation to which it looks at the ground; none if it cannot.
    pub fn ground_rad(&self) -> Option<(f64, f64)> {
        let (from, to) = self.elevation_rad.unwrap_or((-PI, 0.0));
        let (from, to) = (from.max(BELOW_HORIZON_RAD - PI), to.min(-BELOW_HORIZON_RAD));
        (from <= to).then_some((from, to))
    }

    /// Of these cameras (one for each field of view that a camera has), and of the elevation asked for or, without one, of those in
    /// steps of 5°, the look whose pixels come nearest to the ground sample distance asked for; without that, the look with the
    /// widest pixels. An elevation steeper than the gimbal's limit becomes the limit.
    ///
    /// # Errors
    /// That none sees the ground.
    pub fn aim(
        &self,
        cameras: &[Camera],
        height_m: f64,
        elevation_rad: Option<f64>,
        ground_sample_distance_m: Option<f64>,
    ) -> Result<Aim, AimError> {
        let (from, to) = self.ground_rad().ok_or(AimError::NoGround)?;
        let elevations = match elevation_rad {
            Some(asked) if asked > to => {
                return Err(AimError::TooHigh(asked.to_degrees(), to.to_degrees()));
            }
            Some(asked) => vec![asked.max(from)],
            None => {
                let steps = ((to - from) / STEP_RAD).floor() as u32;
                (0..=steps).map(|step| from + f64::from(step) * STEP_RAD).collect()
            }
        };
        let mut best: Option<(f64, Aim)> = None;
        for &camera in cameras {
            for &elevation_rad in &elevations {
                let footprint = camera.footprint(height_m, elevation_rad)?;
                let pixel_m = footprint.ground_sample_distance_m;
                let miss = ground_sample_distance_m.map_or(-pixel_m, |wanted| (wanted - pixel_m).abs());
                if best.as_ref().is_none_or(|best| miss < best.0) {
                    best = Some((miss, Aim { camera, elevation_rad, footprint }));
                }
            }
        }
        best.map(|(_, aim)| aim).ok_or(AimError::NoCamera)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(degrees: f64) -> Camera {
        let horizontal_field_of_view_rad = degrees.to_radians();
        Camera { horizontal_field_of_view_rad, horizontal_pixels: 1024, vertical_pixels: 768 }
    }

    #[test]
    fn what_is_in_reach_is_known_over_the_tail_too() {
        let ahead = Gimbal { azimuth_rad: Some((-1.0, 1.0)), elevation_rad: Some((-1.5, 0.2)) };
        assert!(ahead.reaches(TAU - 0.5, -1.0) && ahead.reaches(1.0, 0.2) && ahead.reaches(-1.0, 0.0));
        assert!(!ahead.reaches(1.1, 0.0) && !ahead.reaches(PI, 0.0) && !ahead.reaches(0.0, 0.3));
        assert!(Gimbal::default().reaches(3.0, -3.0));
        let behind = Gimbal { azimuth_rad: Some((2.0, 4.0)), elevation_rad: None };
        assert!(behind.reaches(-PI, -1.0) && !behind.reaches(0.0, -1.0));
    }

    #[test]
    fn the_look_nearest_to_what_is_asked_is_taken() {
        let gimbal = Gimbal { azimuth_rad: None, elevation_rad: Some((-PI / 2.0, 0.5)) };
        let cameras = [camera(10.0), camera(45.0)];
        let asked = Some((-60.0_f64).to_radians());
        let widest = gimbal.aim(&cameras, 500.0, asked, None).unwrap();
        assert!((widest.footprint.ground_sample_distance_m - 0.590_429).abs() < 1e-6, "{widest:?}");
        let finest = gimbal.aim(&cameras, 500.0, asked, Some(0.1)).unwrap();
        assert_eq!(finest.camera, cameras[0]);
        // No elevation asked for: each is tried.
        let swept = gimbal.aim(&cameras, 500.0, None, Some(0.7)).unwrap();
        let near = (swept.footprint.ground_sample_distance_m - 0.7).abs();
        for degrees in 0..=17 {
            let other = (-90.0 + 5.0 * f64::from(degrees)).to_radians();
            for camera in cameras {
                let other = camera.footprint(500.0, other).unwrap().ground_sample_distance_m;
                assert!((other - 0.7).abs() >= near - 1e-9, "{swept:?}");
            }
        }
        let limit = gimbal.aim(&cameras, 500.0, Some(-2.0), None).unwrap();
        assert_eq!(limit.elevation_rad, -PI / 2.0);
    }

    #[test]
    fn what_is_wrong_is_told() {
        let gimbal = Gimbal::default();
        let told = |aim: Result<Aim, AimError>| aim.unwrap_err().to_string();
        assert!(told(gimbal.aim(&[], 500.0, None, None)).contains("no camera"));
        assert!(told(gimbal.aim(&[camera(9.0)], 500.0, Some(0.1), None)).contains("out of reach"));
        assert!(told(gimbal.aim(&[camera(9.0)], -5.0, None, None)).contains("not above ground"));
        let up = Gimbal { elevation_rad: Some((0.1, 1.0)), ..gimbal };
        assert!(told(up.aim(&[camera(9.0)], 5.0, None, None)).contains("does not turn to the ground"));
    }
}
