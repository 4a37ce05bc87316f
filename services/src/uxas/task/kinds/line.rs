//! Searches along a line: beside it, so that the sensor looks at it, one way or the other.

use super::super::{Choice, FIRST_OPTION, Kind, Offer, Seen, Stretch, View, Within, angles, composition};
use crate::plan::algebra::{Expression, Operator};
use crate::plan::line_search::{Detail, LineSearch};
use crate::uxas::ground::{Point, far, heading_deg};
use crate::uxas::vehicle::Vehicle;
use crate::uxas::world::World;
use aldis_envelope::lmcp::Ref;
use aldis_envelope::lmcp::cmasi::{LineSearchTask, Location3D, Wedge};
use aldis_envelope::lmcp::impact::ImpactLineSearchTask;

/// The azimuth where no wedge names one, in degrees.
const AZIMUTH_DEG: f64 = 45.0;

/// A line with how it is looked at.
struct Line<'a> {
    points: Vec<Location3D>,
    wedges: &'a [Ref<Wedge>],
    /// One point of the way for so many metres of line.
    spacing_m: f64,
    /// What the height of a look is measured from, in metres.
    ground_m: f64,
    both_ways: bool,
}

impl Line<'_> {
    fn offer(&self, view: &View<'_>) -> Result<Offer, String> {
        let origin = self.points.first().ok_or("the line has no point: it needs two")?;
        let ground = view.ground(origin);
        let line: Vec<Point> = self.points.iter().map(|at| ground.point(at)).collect();
        let reversed: Vec<Point> = line.iter().rev().copied().collect();
        let (mut choices, mut parts) = (Vec::new(), Vec::new());
        for group in view.groups() {
            for elevation in angles::elevations(self.wedges) {
                for azimuth in angles::azimuths(self.wedges, &[AZIMUTH_DEG]) {
                    let mut pair = Vec::new();
                    let ways = [&line, &reversed];
                    for way in ways.into_iter().take(if self.both_ways { 2 } else { 1 }) {
                        let id = FIRST_OPTION + choices.len() as i64;
                        let path = self.path(way, (azimuth, elevation), &group)?;
                        choices.push(self.choice(view, &group, id, &path.0, path.1, &ground)?);
                        pair.push(id);
                    }
                    parts.push(composition::one_of(pair));
                }
            }
        }
        Ok(Offer { composition: Expression::Node(Operator::Alternative, parts), choices })
    }

    /// The way beside the line, and its length.
    fn path(
        &self,
        line: &[Point],
        (azimuth, elevation): (f64, f64),
        group: &[Vehicle],
    ) -> Result<(Vec<Point>, f64), String> {
        let altitude = group.first().map_or(0.0, |vehicle| f64::from(vehicle.altitude_m));
        let search = LineSearch {
            azimuth_rad: azimuth.to_radians(),
            elevation_rad: elevation.to_radians(),
            height_m: (altitude - self.ground_m).max(0.0),
            detail: Detail::Spacing(self.spacing_m),
        };
        let found = search.path(line).map_err(|why| why.to_string())?;
        Ok((found.path, found.length_m))
    }

    fn choice(
        &self,
        view: &View<'_>,
        group: &[Vehicle],
        id: i64,
        path: &[Point],
        length_m: f64,
        ground: &crate::uxas::ground::Ground,
    ) -> Result<Choice, String> {
        let places: Vec<_> = path.iter().map(|&point| ground.location(point)).collect();
        let (Some(start), Some(end)) = (places.first().cloned(), places.last().cloned()) else {
            return Err("the way along the line has no point".to_owned());
        };
        let last = path.len() - 1;
        let heading = |from: usize, to: usize| heading_deg(path[from], path[to]) as f32;
        let within = if view.compat {
            let time = group.first().and_then(|vehicle| vehicle.time_ms(length_m));
            Within::Places(places, time.ok_or("a vehicle without a speed cannot search a line")?)
        } else {
            // Zones may lie between two points of the way: a planner leads around them.
            let stretch =
                |pair: &[Location3D]| Stretch { from: pair[0].clone(), to: pair[1].clone(), headings: None };
            Within::Stretches(places.windows(2).map(stretch).collect())
        };
        Ok(Choice {
            id,
            eligible: group.iter().map(|vehicle| vehicle.id).collect(),
            start,
            start_heading: heading(0, 1.min(last)),
            end,
            end_heading: heading(last.saturating_sub(1), last),
            within,
        })
    }
}

fn places(points: &[Ref<Location3D>]) -> Result<Vec<Location3D>, String> {
    let places: Vec<Location3D> = points.iter().filter_map(|point| point.get().cloned()).collect();
    let has_length = places
        .windows(2)
        .any(|pair| far((pair[0].latitude, pair[0].longitude), (pair[1].latitude, pair[1].longitude)) > 0.0);
    if has_length {
        Ok(places)
    } else {
        Err("the line has no length: it needs two different points".to_owned())
    }
}

impl Kind for LineSearchTask {
    fn doubts(&self) -> Vec<String> {
        angles::doubts(&self.view_angle_list)
    }

    fn ready(&self, _: &World) -> Result<(), String> {
        places(&self.point_list).map(drop)
    }

    fn offer(&self, view: &View<'_>, _: &Seen) -> Result<Offer, String> {
        let points = places(&self.point_list)?;
        let ground_m = points.iter().map(|at| f64::from(at.altitude)).fold(f64::INFINITY, f64::min);
        let both_ways = !view.flag("LineSearchOneDirection");
        Line { points, wedges: &self.view_angle_list, spacing_m: 200.0, ground_m, both_ways }.offer(view)
    }
}

fn impact_line(task: &ImpactLineSearchTask, world: &World) -> Result<Vec<Location3D>, String> {
    let id = task.line_id;
    let line = world.lines.get(&id).ok_or_else(|| format!("LineOfInterest Id[{id}] not available"))?;
    places(&line.line)
}

impl Kind for ImpactLineSearchTask {
    fn doubts(&self) -> Vec<String> {
        angles::doubts(&self.view_angle_list)
    }

    fn ready(&self, world: &World) -> Result<(), String> {
        impact_line(self, world).map(drop)
    }

    fn offer(&self, view: &View<'_>, _: &Seen) -> Result<Offer, String> {
        let points = impact_line(self, view.world)?;
        // The reference offers one direction and measures heights from sea level.
        let lowest = points.iter().map(|at| f64::from(at.altitude)).fold(f64::INFINITY, f64::min);
        let ground_m = if view.compat { 0.0 } else { lowest };
        let both_ways = !view.compat && !view.flag("LineSearchOneDirection");
        Line { points, wedges: &self.view_angle_list, spacing_m: 50.0, ground_m, both_ways }.offer(view)
    }
}
