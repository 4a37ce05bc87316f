//! The route of a file along roads.

use super::{RouteFile, RouteFileError, ZoneRow, place};
use crate::plan::free_space::{FreeSpace, Point, ZoneKind};
use crate::plan::geodesy::{Place, Plane};
use crate::plan::roads::{OneWay, RoadRoute, Roads};

impl RouteFile {
    /// The route that it asks for, along roads that no zone lies on.
    ///
    /// # Errors
    /// What is wrong with it, or why there is no route.
    pub fn plan_on_roads(&self, roads: Roads) -> Result<RoadRoute, RouteFileError> {
        let start = place("the start", self.start.latitude, self.start.longitude)?;
        let goal = place("the goal", self.goal.latitude, self.goal.longitude)?;
        let one_way = if self.ignore_one_way { OneWay::Ignore } else { OneWay::Respect };
        let roads = if self.zones.is_empty() { roads } else { self.open(start, roads)? };
        Ok(roads.route(start, goal, one_way)?)
    }

    /// The pieces of roads that zones leave open.
    fn open(&self, start: Place, roads: Roads) -> Result<Roads, RouteFileError> {
        let plane = Plane::new(start);
        let zone = |row: &ZoneRow| row.zone(&plane);
        let zones = self.zones.iter().map(zone).collect::<Result<Vec<_>, _>>()?;
        let conditions = self.conditions();
        let space = FreeSpace::new(&zones, &conditions)?;
        // Where nothing keeps vehicles in, free space ends far from all zones, and roads go on.
        let is_kept = |kind| kind == ZoneKind::KeepIn || kind == ZoneKind::Water && self.on_water;
        let outlines = space.outlines();
        let farthest = outlines.iter().flatten().map(|at| at.0.abs().max(at.1.abs())).fold(0.0, f64::max);
        let rim = if zones.iter().any(|zone| is_kept(zone.kind)) { f64::INFINITY } else { farthest };
        let is_beyond = |at: Point| at.0.abs().max(at.1.abs()) > rim;
        Ok(roads.only(|from, to| {
            let (from, to) = (plane.to_plane(from), plane.to_plane(to));
            is_beyond(from) || is_beyond(to) || space.sees(from, to)
        }))
    }
}
