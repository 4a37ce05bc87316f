//! One route of a region: its cost, and its waypoints where they are asked for.

use super::region::{RADIUS_MIN_M, Region, in_degrees};
use crate::plan::free_space::Point;
use crate::plan::turning::{Piece, Pose, TurningError, shortest_m};
use crate::uxas::ground::far;
use aldis_envelope::lmcp::Ref;
use aldis_envelope::lmcp::cmasi::{Location3D, Waypoint};
use aldis_envelope::lmcp::route::RouteConstraints;

/// Cost in milliseconds, and waypoints.
type Routed = Result<(i64, Vec<Ref<Waypoint>>), String>;

/// How far an arc goes from one waypoint to the next, in radians, at least and at most: beyond that its corners would lie far
/// from it.
const ARC_STEP_RAD: (f64, f64) = (0.1, 0.25);

impl Region {
    /// The route that is asked for.
    ///
    /// # Errors
    /// Why there is none, in words.
    pub(super) fn route(&mut self, asked: &RouteConstraints, cost_only: bool) -> Routed {
        let (start, end) = (place(&asked.start_location, "start")?, place(&asked.end_location, "goal")?);
        let poses = (self.pose(start, asked.start_heading), self.pose(end, asked.end_heading));
        let is_headed = asked.use_start_heading && asked.use_end_heading;
        let turns = is_headed && self.vehicle.turn_radius_m >= RADIUS_MIN_M && !self.compat;
        if !turns {
            let compat = self.compat;
            let (points, length_m) = self.straight(poses.0.at, poses.1.at).clone()?;
            let metres = if compat { whole_metres(&points) } else { length_m };
            let cost = self.time_ms(metres)?;
            let waypoints = if cost_only { Vec::new() } else { self.waypoints(&points[1..]) };
            return Ok((cost, waypoints));
        }
        if cost_only {
            let length_m = self.estimate(poses)?;
            return Ok((self.time_ms(length_m)?, Vec::new()));
        }
        self.turned(poses)
    }

    fn time_ms(&self, metres: f64) -> Result<i64, String> {
        self.vehicle.time_ms(metres).ok_or_else(|| format!("{metres} m cannot be timed"))
    }

    /// How long a way with turns is, without a look at what its arcs come near to.
    fn estimate(&mut self, (start, goal): (Pose, Pose)) -> Result<f64, String> {
        let radius = self.vehicle.turn_radius_m;
        let (points, _) = self.straight(start.at, goal.at).as_ref().map_err(Clone::clone)?;
        let shortest = |from: Pose, to: Pose| shortest_m(from, to, radius).unwrap_or(f64::INFINITY);
        let heading = |from: Point, to: Point| (to.1 - from.1).atan2(to.0 - from.0);
        let mut pose = start;
        let mut sum = 0.0;
        for near in points.windows(3) {
            let at = Pose { at: near[1], heading_rad: heading(near[0], near[2]) };
            sum += shortest(pose, at);
            pose = at;
        }
        let sum = sum + shortest(pose, goal);
        if sum.is_finite() { Ok(sum) } else { Err("no turns lead from one heading to the other".to_owned()) }
    }

    /// A way with turns that keeps clear of all zones.
    fn turned(&mut self, (start, goal): (Pose, Pose)) -> Routed {
        let separation = self.separation_m;
        let Some(space) = self.turning()? else { return Err("the vehicle has no turns".to_owned()) };
        let found = space.route(start, goal).map_err(|why| match why {
            TurningError::Route(why) => Err(why),
            other => Ok(other.to_string()),
        });
        let route = match found {
            Ok(route) => route,
            Err(Ok(text)) => return Err(text),
            Err(Err(why)) => return Err(in_degrees(&why, &self.ground)),
        };
        let mut points: Vec<Point> = Vec::new();
        for piece in &route.pieces {
            points.extend(corners(piece, separation));
        }
        points.push(goal.at);
        points.dedup_by(|a, b| far(*a, *b) < 0.01);
        Ok((self.time_ms(route.length_m)?, self.waypoints(&points)))
    }

    fn waypoints(&self, points: &[Point]) -> Vec<Ref<Waypoint>> {
        let (altitude, altitude_type) = (self.vehicle.altitude_m, self.vehicle.altitude_type);
        let waypoint = |(&point, number): (&Point, i64)| {
            let base = Location3D { altitude, altitude_type, ..self.ground.location(point) };
            let last = points.len() as i64;
            Ref::new(Waypoint {
                base,
                number,
                next_waypoint: (number + 1).min(last),
                speed: self.vehicle.speed_m_per_s as f32,
                ..Waypoint::default()
            })
        };
        points.iter().zip(1..).map(waypoint).collect()
    }
}

/// The corners of a piece of way. Those of an arc lie around it, so that who turns within each corner is on the arc.
fn corners(piece: &Piece, separation_m: f64) -> Vec<Point> {
    let Piece::Arc { center, radius_m, from_rad, sweep_rad } = *piece else { return vec![piece.place(1.0)] };
    let step = (separation_m / radius_m).clamp(ARC_STEP_RAD.0, ARC_STEP_RAD.1);
    let count = (sweep_rad.abs() / step).ceil().max(1.0);
    let half = sweep_rad / count / 2.0;
    let corner = |at: u32| {
        let (sine, cosine) = (from_rad + half * (2.0 * f64::from(at) + 1.0)).sin_cos();
        (center.0 + radius_m / half.cos() * cosine, center.1 + radius_m / half.cos() * sine)
    };
    (0..count as u32).map(corner).collect()
}

/// The length as the reference counts it: each piece in whole metres.
fn whole_metres(points: &[Point]) -> f64 {
    points.windows(2).map(|pair| far(pair[0], pair[1]).trunc()).sum()
}

fn place<'a>(at: &'a Ref<Location3D>, what: &str) -> Result<&'a Location3D, String> {
    let found = at.get().ok_or_else(|| format!("the {what} is not given"))?;
    let is_place = found.latitude.abs() <= 90.0 && found.longitude.is_finite();
    is_place.then_some(found).ok_or_else(|| format!("the {what} is not a place"))
}
