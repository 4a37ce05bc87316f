//! The flat earth of the reference, for comparisons with its results alone: its error grows with the distance from the origin.

/// The equatorial radius that the reference takes, in metres: that of WGS 72.
const RADIUS_M: f64 = 6_378_135.0;

/// The squared eccentricity that it takes.
const ECCENTRICITY_SQUARED: f64 = 6.694_379_990_096_503e-3;

/// A tangent plane by the radii of curvature at its origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlatEarth {
    latitude_rad: f64,
    longitude_rad: f64,
    /// Metres of a radian of latitude.
    meridian_m: f64,
    /// Metres of a radian of longitude.
    parallel_m: f64,
}

impl FlatEarth {
    /// The plane at a place, in degrees.
    pub fn new(latitude_deg: f64, longitude_deg: f64) -> Self {
        let (latitude_rad, longitude_rad) = (latitude_deg.to_radians(), longitude_deg.to_radians());
        let (sine, cosine) = latitude_rad.sin_cos();
        let denominator = 1.0 - ECCENTRICITY_SQUARED * sine * sine;
        Self {
            latitude_rad,
            longitude_rad,
            meridian_m: RADIUS_M * (1.0 - ECCENTRICITY_SQUARED) / denominator.powf(1.5),
            parallel_m: RADIUS_M / denominator.sqrt() * cosine,
        }
    }

    /// Metres north and east of the origin, of a place in degrees.
    pub fn to_plane(&self, latitude_deg: f64, longitude_deg: f64) -> (f64, f64) {
        let north = self.meridian_m * (latitude_deg.to_radians() - self.latitude_rad);
        (north, self.parallel_m * (longitude_deg.to_radians() - self.longitude_rad))
    }

    /// The place in degrees that is so many metres north and east of the origin.
    pub fn to_degrees(&self, north_m: f64, east_m: f64) -> (f64, f64) {
        let latitude = self.latitude_rad + north_m / self.meridian_m;
        (latitude.to_degrees(), (self.longitude_rad + east_m / self.parallel_m).to_degrees())
    }
}
