//! A request for a route as a file holds it, in degrees, and its answer.

mod on_roads;
#[cfg(test)]
mod tests;
mod turn;

use super::free_space::{Boundary, Conditions, FreeSpace, Point, RouteError, SpaceError, Zone, ZoneKind};
use super::geodesy::{Place, Plane};
use super::roads::RoadError;
use super::turning::{Piece, Pose, TurningError, TurningSpace};
use serde::Deserialize;

/// How far an arc goes from one of the answer's places to the next, in radians.
const ARC_STEP_RAD: f64 = 0.1;

/// The form of a request for a route.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RouteFile {
    /// Where it starts.
    pub start: EndRow,
    /// Where it goes.
    pub goal: EndRow,
    /// The zones.
    #[serde(default)]
    pub zones: Vec<ZoneRow>,
    /// The radius of the tightest turn, in metres; without one, or without headings, the vehicle turns on the spot.
    pub turn_radius_m: Option<f64>,
    /// How fast it is, in metres a second: with a bank angle or a yaw rate, that gives the radius of the turn.
    pub speed_m_per_s: Option<f64>,
    /// How far an aircraft banks in turns, in degrees.
    pub bank_angle_deg: Option<f64>,
    /// How fast a vessel turns, in degrees a second.
    pub yaw_rate_deg_per_s: Option<f64>,
    /// For ground vehicles: the file of the roads that they keep to, in OpenStreetMap's XML.
    pub roads: Option<String>,
    /// Whether they drive one-way roads both ways.
    #[serde(default)]
    pub ignore_one_way: bool,
    /// The vehicle, for zones that concern some.
    #[serde(default)]
    pub vehicle: i64,
    /// Whether it is bound to water zones.
    #[serde(default)]
    pub on_water: bool,
    /// At which altitude it is, in metres.
    #[serde(default)]
    pub altitude_m: f64,
    /// From when to when it is under way, in milliseconds.
    #[serde(default)]
    pub time_ms: (i64, i64),
}

/// An end of a route, in degrees.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EndRow {
    /// Degrees north.
    pub latitude: f64,
    /// Degrees east.
    pub longitude: f64,
    /// The heading there, in degrees from north, clockwise.
    pub heading: Option<f64>,
}

/// A zone, in degrees.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ZoneRow {
    /// Its id.
    pub id: i64,
    /// What it means.
    pub kind: KindRow,
    /// Its corners: latitude and longitude of each.
    pub polygon: Option<Vec<(f64, f64)>>,
    /// Or a circle: latitude and longitude of its middle, radius in metres.
    pub circle: Option<(f64, f64, f64)>,
    /// How far vehicles stay away from its outline, in metres.
    #[serde(default)]
    pub padding_m: f64,
    /// From which altitude to which it holds, in metres.
    pub altitude_m: Option<(f64, f64)>,
    /// From when to when it holds, in milliseconds; an end of 0 is no end.
    #[serde(default)]
    pub time_ms: (i64, i64),
    /// The vehicles that it concerns; empty means all.
    #[serde(default)]
    pub affected: Vec<i64>,
}

/// What a zone means, in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KindRow {
    /// Vehicles stay in.
    KeepIn,
    /// Vehicles stay out.
    KeepOut,
    /// Vehicles of the surface stay in.
    Water,
}

/// A route in degrees.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedRoute {
    /// Its places: where lines end, and along arcs.
    pub places: Vec<Place>,
    /// How long it is along the earth, in metres.
    pub length_m: f64,
    /// How many arcs it has.
    pub arcs: usize,
}

/// Why there is no route.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RouteFileError {
    /// A place that is none.
    #[error("{0}: latitude {1}, longitude {2} is not a place")]
    Place(String, f64, f64),
    /// A turn that is none.
    #[error("{0}")]
    Turn(String),
    /// No route along roads.
    #[error(transparent)]
    Roads(#[from] RoadError),
    /// A zone without an outline, or with two.
    #[error("zone {0}: it needs either `polygon` or `circle`")]
    Outline(i64),
    /// Zones that make no free space.
    #[error(transparent)]
    Space(#[from] SpaceError),
    /// No route for who turns on the spot. Where it names a place, that is in degrees at the end.
    #[error("{error}{}", .at.map_or(String::new(), |at| format!(" (latitude {:.6}, longitude {:.6})", at.latitude_deg, at.longitude_deg)))]
    Route {
        /// The cause, in metres north and east of the start.
        error: TurningError,
        /// The nearest way out, if it is about that.
        at: Option<Place>,
    },
}

impl RouteFile {
    /// The route that it asks for.
    ///
    /// # Errors
    /// What is wrong with it, or why there is no route.
    pub fn plan(&self) -> Result<PlannedRoute, RouteFileError> {
        let origin = place("the start", self.start.latitude, self.start.longitude)?;
        let goal = place("the goal", self.goal.latitude, self.goal.longitude)?;
        let plane = Plane::new(origin);
        let zones = self.zones.iter().map(|row| row.zone(&plane)).collect::<Result<Vec<_>, _>>()?;
        let conditions = self.conditions();
        let (from, to) = (plane.to_plane(origin), plane.to_plane(goal));
        let pieces = match (self.turn_radius_m()?, self.start.heading, self.goal.heading) {
            (Some(radius), Some(first), Some(last)) => {
                let pose = |place: Place, heading: f64| {
                    let (at, heading_rad) = plane.headed(place, heading);
                    Pose { at, heading_rad }
                };
                let space = TurningSpace::new(&zones, &conditions, radius)?;
                space.route(pose(origin, first), pose(goal, last)).map(|route| route.pieces)
            }
            _ => {
                let route = FreeSpace::new(&zones, &conditions)?.route(from, to);
                let lines = route.map(|route| {
                    let line = |pair: &[Point]| Piece::Line { from: pair[0], to: pair[1] };
                    route.points.windows(2).map(line).collect()
                });
                lines.map_err(TurningError::Route)
            }
        };
        let pieces: Vec<Piece> = pieces.map_err(|error| located(error, &plane))?;
        Ok(answer(&plane, origin, &pieces))
    }

    /// Who is under way, at which height and when.
    fn conditions(&self) -> Conditions {
        let altitude_m = (self.altitude_m, self.altitude_m);
        let (vehicle, on_water, time_ms) = (self.vehicle, self.on_water, self.time_ms);
        Conditions { vehicle, on_water, altitude_m, time_ms }
    }
}

impl ZoneRow {
    fn zone(&self, plane: &Plane) -> Result<Zone, RouteFileError> {
        let at = |latitude: f64, longitude: f64| {
            place(&format!("zone {}", self.id), latitude, longitude).map(|place| plane.to_plane(place))
        };
        let boundary = match (&self.polygon, self.circle) {
            (Some(corners), None) => {
                Boundary::Polygon(corners.iter().map(|row| at(row.0, row.1)).collect::<Result<_, _>>()?)
            }
            (None, Some((latitude, longitude, radius_m))) => {
                Boundary::Circle { center: at(latitude, longitude)?, radius_m }
            }
            _ => return Err(RouteFileError::Outline(self.id)),
        };
        let kind = match self.kind {
            KindRow::KeepIn => ZoneKind::KeepIn,
            KindRow::KeepOut => ZoneKind::KeepOut,
            KindRow::Water => ZoneKind::Water,
        };
        let always = Zone::new(self.id, kind, boundary);
        Ok(Zone {
            padding_m: self.padding_m,
            altitude_m: self.altitude_m.unwrap_or(always.altitude_m),
            time_ms: self.time_ms,
            affected: self.affected.clone(),
            ..always
        })
    }
}

fn place(what: &str, latitude_deg: f64, longitude_deg: f64) -> Result<Place, RouteFileError> {
    let place = Place { latitude_deg, longitude_deg };
    let wrong = || RouteFileError::Place(what.to_owned(), latitude_deg, longitude_deg);
    place.is_valid().then_some(place).ok_or_else(wrong)
}

fn located(error: TurningError, plane: &Plane) -> RouteFileError {
    let at = match &error {
        TurningError::Route(
            RouteError::InKeepOut { nearest, .. } | RouteError::OutsideKeepIn { nearest, .. },
        ) => Some(plane.to_place(*nearest)),
        _ => None,
    };
    RouteFileError::Route { error, at }
}

fn answer(plane: &Plane, origin: Place, pieces: &[Piece]) -> PlannedRoute {
    let mut places = vec![origin];
    let mut arcs = 0;
    for piece in pieces {
        let steps = match piece {
            Piece::Line { .. } => 1.0,
            Piece::Arc { sweep_rad, .. } => {
                arcs += 1;
                (sweep_rad.abs() / ARC_STEP_RAD).ceil().max(1.0)
            }
        };
        let at = |step: usize| plane.to_place(piece.place(step as f64 / steps));
        places.extend((1..=steps as usize).map(at));
    }
    let chords: f64 = places.windows(2).map(|pair| plane.distance_m(pair[0], pair[1])).sum();
    // What the chords of the arcs cut off.
    let cut = |piece: &Piece| match *piece {
        Piece::Line { .. } => 0.0,
        Piece::Arc { radius_m, sweep_rad, .. } => {
            let steps = (sweep_rad.abs() / ARC_STEP_RAD).ceil().max(1.0);
            radius_m * (sweep_rad.abs() - 2.0 * steps * (sweep_rad.abs() / steps / 2.0).sin())
        }
    };
    let length_m = chords + pieces.iter().map(cut).sum::<f64>();
    PlannedRoute { places, length_m, arcs }
}
