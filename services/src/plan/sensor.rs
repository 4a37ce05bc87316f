//! What a sensor sees of the ground.

mod gimbal;

pub use gimbal::{Aim, AimError, Gimbal};

use std::f64::consts::{FRAC_PI_2, PI};

/// Where a sensor sees the ground, in metres from below it, along its look.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footprint {
    /// To the far edge; infinite where it reaches the horizon.
    pub to_leading_edge_m: f64,
    /// To the near edge; negative where that lies behind.
    pub to_trailing_edge_m: f64,
    /// To where the middle of the sensor looks.
    pub to_center_m: f64,
    /// How wide it is there.
    pub width_center_m: f64,
    /// From the sensor to there.
    pub slant_range_m: f64,
    /// The ground that one pixel covers there, in metres; 0 for sensors without pixels.
    pub ground_sample_distance_m: f64,
}

/// Why a sensor sees no ground.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SensorError {
    /// The sensor is not over the ground.
    #[error("a height of {0} m above ground is not above ground")]
    Height(f64),
    /// It does not look down.
    #[error("an elevation of {0}° does not look down: it must be between -180° and 0°, both left out")]
    Elevation(f64),
    /// A field of view that is none.
    #[error("a field of view of {0}° is none: it must be above 0° and below 180°")]
    FieldOfView(f64),
    /// A width that is none.
    #[error("a swath of {0} m is none")]
    Swath(f64),
}

/// Something that sees a piece of the ground.
pub trait Sensor {
    /// What it sees from a height in metres above ground, looking `elevation_rad` above the horizon: negative is down.
    ///
    /// # Errors
    /// Why it sees nothing.
    fn footprint(&self, height_m: f64, elevation_rad: f64) -> Result<Footprint, SensorError>;
}

/// A camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// The horizontal field of view, in radians.
    pub horizontal_field_of_view_rad: f64,
    /// Pixels across.
    pub horizontal_pixels: u32,
    /// Pixels down.
    pub vertical_pixels: u32,
}

impl Camera {
    /// Width by height of a picture; 1 where pixels are unknown.
    pub fn aspect_ratio(&self) -> f64 {
        match (self.horizontal_pixels, self.vertical_pixels) {
            (0, _) | (_, 0) => 1.0,
            (across, down) => f64::from(across) / f64::from(down),
        }
    }
}

impl Sensor for Camera {
    fn footprint(&self, height_m: f64, elevation_rad: f64) -> Result<Footprint, SensorError> {
        let across = self.horizontal_field_of_view_rad;
        if !(across > 0.0 && across < PI) {
            return Err(SensorError::FieldOfView(across.to_degrees()));
        }
        looks_down(height_m, elevation_rad)?;
        let half = across / self.aspect_ratio() / 2.0;
        let slant = height_m / (-elevation_rad).sin();
        let pixels = self.horizontal_pixels.min(self.vertical_pixels);
        Ok(Footprint {
            to_leading_edge_m: ahead(height_m, elevation_rad + half),
            to_trailing_edge_m: ahead(height_m, elevation_rad - half),
            to_center_m: ahead(height_m, elevation_rad),
            width_center_m: 2.0 * slant * (across / 2.0).tan(),
            slant_range_m: slant,
            ground_sample_distance_m: if pixels == 0 {
                0.0
            } else {
                slant * (across / f64::from(pixels)).sin()
            },
        })
    }
}

/// A sonar or radar that covers a width to both sides of the track, whatever the height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swath {
    /// The width, in metres.
    pub width_m: f64,
}

impl Sensor for Swath {
    fn footprint(&self, _height_m: f64, _elevation_rad: f64) -> Result<Footprint, SensorError> {
        if !(self.width_m > 0.0 && self.width_m.is_finite()) {
            return Err(SensorError::Swath(self.width_m));
        }
        Ok(Footprint {
            to_leading_edge_m: 0.0,
            to_trailing_edge_m: 0.0,
            to_center_m: 0.0,
            width_center_m: self.width_m,
            slant_range_m: 0.0,
            ground_sample_distance_m: 0.0,
        })
    }
}

fn looks_down(height_m: f64, elevation_rad: f64) -> Result<(), SensorError> {
    if !(height_m > 0.0 && height_m.is_finite()) {
        return Err(SensorError::Height(height_m));
    }
    if !(elevation_rad < 0.0 && elevation_rad > -PI) {
        return Err(SensorError::Elevation(elevation_rad.to_degrees()));
    }
    Ok(())
}

/// How far ahead a ray of this elevation meets the ground.
fn ahead(height_m: f64, elevation_rad: f64) -> f64 {
    let down = (-elevation_rad).min(PI);
    match down {
        down if down <= 0.0 => f64::INFINITY,
        down if down >= PI => f64::NEG_INFINITY,
        // Straight down: no tangent, no distance.
        down if down == FRAC_PI_2 => 0.0,
        down => height_m / down.tan(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: f64, b: &serde_json::Value) -> bool {
        let b = b.as_f64().unwrap();
        (a - b).abs() <= 1e-9 * b.abs()
    }

    #[test]
    fn footprints_are_those_of_the_reference() {
        let Some(golden) = crate::plan::tests::golden("sensor_footprint_golden.json") else { return };
        let cases: Vec<serde_json::Value> = serde_json::from_str(&golden).unwrap();
        assert_eq!(cases.len(), 9);
        for case in cases {
            let number = |key: &str| case[key].as_f64().unwrap();
            let camera = Camera {
                horizontal_field_of_view_rad: number("HorizontalFOV").to_radians(),
                horizontal_pixels: 1024,
                vertical_pixels: 768,
            };
            let found =
                camera.footprint(number("AglAltitude"), number("GimbalElevation").to_radians()).unwrap();
            assert!(near(camera.aspect_ratio(), &case["AspectRatio"]));
            assert!(near(found.ground_sample_distance_m, &case["AchievedGSD"]), "{case}");
            assert!(near(found.to_leading_edge_m, &case["HorizontalToLeadingEdge"]), "{case}");
            assert!(near(found.to_trailing_edge_m, &case["HorizontalToTrailingEdge"]), "{case}");
            assert!(near(found.to_center_m, &case["HorizontalToCenter"]), "{case}");
            assert!(near(found.width_center_m, &case["WidthCenter"]), "{case}");
            assert!(near(found.slant_range_m, &case["SlantRangeToCenter"]), "{case}");
        }
    }

    #[test]
    fn the_horizon_is_far_and_what_looks_up_sees_nothing() {
        let camera =
            Camera { horizontal_field_of_view_rad: 1.0, horizontal_pixels: 640, vertical_pixels: 480 };
        let grazing = camera.footprint(100.0, -0.1).unwrap();
        assert_eq!(grazing.to_leading_edge_m, f64::INFINITY);
        assert!(camera.footprint(100.0, -FRAC_PI_2).unwrap().to_center_m.abs() < 1e-9);
        assert!(camera.footprint(100.0, 0.1).unwrap_err().to_string().contains("does not look down"));
        assert!(camera.footprint(0.0, -1.0).unwrap_err().to_string().contains("not above ground"));
        assert!(Swath { width_m: f64::NAN }.footprint(1.0, -1.0).is_err());
        assert_eq!(Swath { width_m: 100.0 }.footprint(0.0, 0.0).unwrap().width_center_m, 100.0);
    }
}
