//! The earth as it is: a plane around an origin, and true distances.

use geographiclib_rs::{DirectGeodesic, Geodesic, InverseGeodesic};

/// A place on the earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Degrees north.
    pub latitude_deg: f64,
    /// Degrees east.
    pub longitude_deg: f64,
}

impl Place {
    /// Whether it is a place: numbers, and not beyond a pole.
    pub fn is_valid(&self) -> bool {
        self.latitude_deg.abs() <= 90.0 && self.longitude_deg.is_finite()
    }
}

/// The plane that keeps distances and directions from its origin (azimuthal equidistant), on the ellipsoid WGS 84. It knows no
/// antimeridian. Across, it stretches: by 4 in 100 000 at 100 km from the origin.
pub struct Plane {
    geodesic: Geodesic,
    origin: Place,
}

impl Plane {
    /// The plane around a place.
    pub fn new(origin: Place) -> Self {
        Self { geodesic: Geodesic::wgs84(), origin }
    }

    /// Metres to the north and to the east.
    pub fn to_plane(&self, place: Place) -> (f64, f64) {
        let (from, to) = (self.origin, place);
        let (metres, azimuth, _, _): (f64, f64, f64, f64) =
            self.geodesic.inverse(from.latitude_deg, from.longitude_deg, to.latitude_deg, to.longitude_deg);
        let (sine, cosine) = azimuth.to_radians().sin_cos();
        (metres * cosine, metres * sine)
    }

    /// The place that is so many metres to the north and to the east.
    pub fn to_place(&self, point: (f64, f64)) -> Place {
        let azimuth = point.1.atan2(point.0).to_degrees();
        let (latitude_deg, longitude_deg): (f64, f64) = self.geodesic.direct(
            self.origin.latitude_deg,
            self.origin.longitude_deg,
            azimuth,
            point.0.hypot(point.1),
        );
        Place { latitude_deg, longitude_deg }
    }

    /// The distance between two places along the ellipsoid, in metres.
    pub fn distance_m(&self, from: Place, to: Place) -> f64 {
        self.geodesic.inverse(from.latitude_deg, from.longitude_deg, to.latitude_deg, to.longitude_deg)
    }

    /// Metres to the north and to the east, and the direction on the plane, in radians from north to east, of a heading in degrees
    /// at the place.
    pub fn headed(&self, place: Place, heading_deg: f64) -> ((f64, f64), f64) {
        let (from, to) = (self.origin, place);
        let (metres, azimuth, onwards, reduced, _): (f64, f64, f64, f64, f64) =
            self.geodesic.inverse(from.latitude_deg, from.longitude_deg, to.latitude_deg, to.longitude_deg);
        let azimuth = azimuth.to_radians();
        let (sine, cosine) = azimuth.sin_cos();
        // Away from the origin the plane is true; across, it stretches by the length over the reduced length.
        let stretch = if reduced > 0.0 { metres / reduced } else { 1.0 };
        let (across, away) = (heading_deg - onwards).to_radians().sin_cos();
        ((metres * cosine, metres * sine), azimuth + (across * stretch).atan2(away))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_come_back_over_the_antimeridian_too() {
        for longitude_deg in [10.0, 179.9, -179.95] {
            let plane = Plane::new(Place { latitude_deg: 60.0, longitude_deg });
            for point in [(0.0, 0.0), (12_000.0, 30_000.0), (-500.0, -40_000.0)] {
                let back = plane.to_plane(plane.to_place(point));
                assert!((back.0 - point.0).hypot(back.1 - point.1) < 1e-6, "{point:?} but {back:?}");
            }
        }
    }

    #[test]
    fn distances_and_directions_are_true() {
        let (from, to) = (
            Place { latitude_deg: 60.0, longitude_deg: 179.9 },
            Place { latitude_deg: 60.0, longitude_deg: -179.9 },
        );
        let plane = Plane::new(from);
        // 0.2° of the parallel of 60°: 11.16 km on WGS 84.
        assert!((plane.distance_m(from, to) - 11_160.0).abs() < 5.0);
        let far = plane.to_plane(to);
        assert!((far.0.hypot(far.1) - plane.distance_m(from, to)).abs() < 1e-6);
        assert!((plane.headed(to, 90.0).1 - std::f64::consts::FRAC_PI_2).abs() < 0.004);
    }

    #[test]
    fn a_heading_is_where_a_step_into_it_leads() {
        let plane = Plane::new(Place { latitude_deg: 60.0, longitude_deg: 179.9 });
        let places = [(0.0, 0.0), (12_000.0, 30_000.0), (-500.0, -40_000.0), (300_000.0, 200_000.0)];
        for (at, heading_deg) in
            places.into_iter().flat_map(|at| [0.0, 77.0, 200.0, 359.0].map(|to| (at, to)))
        {
            let place = plane.to_place(at);
            let (latitude_deg, longitude_deg): (f64, f64) =
                plane.geodesic.direct(place.latitude_deg, place.longitude_deg, heading_deg, 1.0);
            let ahead = plane.to_plane(Place { latitude_deg, longitude_deg });
            let (here, direction) = plane.headed(place, heading_deg);
            let step = (ahead.1 - here.1).atan2(ahead.0 - here.0);
            let apart = (direction - step + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU);
            assert!((apart - std::f64::consts::PI).abs() < 1e-6, "{at:?} {heading_deg}: {direction} {step}");
            assert!((here.0 - at.0).hypot(here.1 - at.1) < 1e-6);
        }
    }
}
