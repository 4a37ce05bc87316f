//! The plane on which routes and patterns are made: true around its origin, or flat as the reference has it.

use crate::plan::flat_earth::FlatEarth;
use crate::plan::geodesy::{Place, Plane};
use aldis_envelope::lmcp::Ref;
use aldis_envelope::lmcp::cmasi::{AbstractGeometry, Circle, Location3D, Polygon, Rectangle};

/// A point in metres, to the north and to the east.
pub type Point = (f64, f64);

/// A plane around a place.
pub enum Ground {
    /// Distances and directions from the origin are true.
    True(Box<Plane>),
    /// The reference's: for comparisons.
    Flat(FlatEarth),
}

impl Ground {
    /// The plane around a place.
    pub fn new(origin: &Location3D, compat: bool) -> Self {
        let (latitude_deg, longitude_deg) = (origin.latitude, origin.longitude);
        match compat {
            true => Self::Flat(FlatEarth::new(latitude_deg, longitude_deg)),
            false => Self::True(Box::new(Plane::new(Place { latitude_deg, longitude_deg }))),
        }
    }

    /// A place on the plane.
    pub fn point(&self, at: &Location3D) -> Point {
        match self {
            Self::True(plane) => {
                plane.to_plane(Place { latitude_deg: at.latitude, longitude_deg: at.longitude })
            }
            Self::Flat(flat) => flat.to_plane(at.latitude, at.longitude),
        }
    }

    /// The place of a point, at no altitude.
    pub fn location(&self, point: Point) -> Location3D {
        let (latitude, longitude) = match self {
            Self::True(plane) => {
                let place = plane.to_place(point);
                (place.latitude_deg, place.longitude_deg)
            }
            Self::Flat(flat) => flat.to_degrees(point.0, point.1),
        };
        Location3D { latitude, longitude, ..Location3D::default() }
    }

    /// How far it is from a place to another, in metres.
    pub fn distance_m(&self, from: &Location3D, to: &Location3D) -> f64 {
        match self {
            Self::True(plane) => {
                let place =
                    |at: &Location3D| Place { latitude_deg: at.latitude, longitude_deg: at.longitude };
                plane.distance_m(place(from), place(to))
            }
            Self::Flat(_) => far(self.point(from), self.point(to)),
        }
    }

    /// A place on the plane, and the direction there, in radians from north to east, of a heading in degrees.
    pub fn headed(&self, at: &Location3D, heading_deg: f64) -> (Point, f64) {
        match self {
            Self::True(plane) => {
                plane.headed(Place { latitude_deg: at.latitude, longitude_deg: at.longitude }, heading_deg)
            }
            Self::Flat(flat) => (flat.to_plane(at.latitude, at.longitude), heading_deg.to_radians()),
        }
    }
}

/// How far it is between two points.
pub fn far(a: Point, b: Point) -> f64 {
    (b.0 - a.0).hypot(b.1 - a.1)
}

/// The heading from a point to another, in degrees from north, clockwise, from 0 to below 360.
pub fn heading_deg(from: Point, to: Point) -> f64 {
    (to.1 - from.1).atan2(to.0 - from.0).to_degrees().rem_euclid(360.0)
}

/// The point so far from another into a direction in degrees.
pub fn ahead(from: Point, heading_deg: f64, metres: f64) -> Point {
    let (sine, cosine) = heading_deg.to_radians().sin_cos();
    (from.0 + metres * cosine, from.1 + metres * sine)
}

/// The length of a line, in metres.
pub fn length_m(line: &[Point]) -> f64 {
    line.windows(2).map(|pair| far(pair[0], pair[1])).sum()
}

/// The sides of the polygon that stands for a circle to be searched.
const CIRCLE_SIDES: u32 = 36;

/// Where to put the origin of a geometry's plane.
pub fn middle(geometry: &Ref<AbstractGeometry>) -> Option<Location3D> {
    let object = geometry.object()?;
    if let Some(circle) = object.get::<Circle>() {
        return circle.center_point.get().cloned();
    }
    if let Some(rectangle) = object.get::<Rectangle>() {
        return rectangle.center_point.get().cloned();
    }
    object.get::<Polygon>()?.boundary_points.iter().find_map(|point| point.get().cloned())
}

/// The corners of a geometry; a circle becomes a polygon around it.
pub fn outline(geometry: &Ref<AbstractGeometry>, ground: &Ground) -> Option<Vec<Point>> {
    let object = geometry.object()?;
    if let Some(circle) = object.get::<Circle>() {
        let (center, radius) = (ground.point(circle.center_point.get()?), f64::from(circle.radius));
        let step = 360.0 / f64::from(CIRCLE_SIDES);
        let around = radius / (step / 2.0).to_radians().cos();
        let corner = |side: u32| ahead(center, f64::from(side) * step, around);
        return (radius > 0.0).then(|| (0..CIRCLE_SIDES).map(corner).collect());
    }
    if let Some(rectangle) = object.get::<Rectangle>() {
        let center = ground.point(rectangle.center_point.get()?);
        // The width is from west to east and the height from south to north before it is turned clockwise.
        let (east, north) = (f64::from(rectangle.width) / 2.0, f64::from(rectangle.height) / 2.0);
        let turn = f64::from(rectangle.rotation);
        let corner = |(n, e): Point| ahead(ahead(center, turn, n * north), turn + 90.0, e * east);
        let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)].map(corner).to_vec();
        return (east > 0.0 && north > 0.0).then_some(corners);
    }
    let polygon = object.get::<Polygon>()?;
    let corners: Vec<_> =
        polygon.boundary_points.iter().filter_map(|point| point.get()).map(|at| ground.point(at)).collect();
    (corners.len() >= 3).then_some(corners)
}
