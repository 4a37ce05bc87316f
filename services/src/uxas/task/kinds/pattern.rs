//! Searches around a point by a pattern: spiral, sectors, or lanes over a square.

use super::super::{Choice, FIRST_OPTION, Kind, Look, Offer, Seen, Stretch, View, Within, composition};
use super::area::{along, footprint, looks, nobody_sees};
use super::lanes::{APART, Sweep};
use super::place;
use crate::uxas::ground::{Ground, Point, ahead, far, heading_deg};
use crate::uxas::world::World;
use aldis_envelope::lmcp::cmasi::Location3D;
use aldis_envelope::lmcp::impact::{AreaSearchPattern, PatternSearchTask};

/// The elevation of looks, in degrees.
const ELEVATION_DEG: f64 = -60.0;

/// The radius at which a spiral begins, in metres, where the vehicle may come so near.
const SPIRAL_FIRST_M: f64 = 50.0;

/// How near a vehicle comes to the middle of a spiral, in metres, unless `SpiralCenterRadius_m` says otherwise.
const SPIRAL_CENTER_M: f64 = 200.0;

/// How far apart the points of a spiral are, in metres.
const SPIRAL_STEP_M: f64 = 50.0;

/// The most points of a pattern.
const POINTS_MAX: usize = 4000;

fn pattern_target(task: &PatternSearchTask, world: &World) -> Result<Location3D, String> {
    if task.search_location_id > 0 {
        let id = task.search_location_id;
        let point = world.points.get(&id).ok_or_else(|| format!("PointOfInterest Id[{id}] not available"))?;
        return place(&point.location, "the place of the point of interest");
    }
    place(&task.search_location, "SearchLocation")
}

/// The way of a spiral from the middle outwards: so many metres from one turn to the next.
fn pattern_spiral(task: &PatternSearchTask, spacing_m: f64, center_m: f64) -> Vec<Point> {
    let end = f64::from(task.extent) + spacing_m * 0.55;
    let nearest = center_m.min(end).max(1.0);
    let mut points = vec![ahead((0.0, 0.0), 0.0, SPIRAL_FIRST_M.max(nearest))];
    let mut angle = 0.0_f64;
    while points.len() < POINTS_MAX {
        let radius = (spacing_m / 2.0) * (1.0 + angle / std::f64::consts::PI);
        if radius > end {
            break;
        }
        points.push(ahead((0.0, 0.0), angle.to_degrees(), radius.max(nearest)));
        angle += SPIRAL_STEP_M / radius.max(nearest);
    }
    points.dedup_by(|a, b| far(*a, *b) < 1.0);
    points
}

/// The way of sectors: diameters through the middle.
fn pattern_sectors(task: &PatternSearchTask, spacing_m: f64) -> Vec<Point> {
    let extent = f64::from(task.extent);
    let step = (spacing_m / extent).to_degrees().clamp(5.0, 90.0);
    let count = (180.0 / step).ceil() as usize;
    let spoke = |at: usize| {
        let heading = at as f64 * step + if at.is_multiple_of(2) { 0.0 } else { 180.0 };
        [ahead((0.0, 0.0), heading + 180.0, extent), ahead((0.0, 0.0), heading, extent)]
    };
    (0..count).flat_map(spoke).collect()
}

/// The option of going from point to point.
fn through(id: i64, vehicle: i64, points: &[Point], ground: &Ground) -> Option<Choice> {
    let (&first, &last) = (points.first()?, points.last()?);
    let places: Vec<_> = points.iter().map(|&point| ground.location(point)).collect();
    let stretch =
        |pair: &[Location3D]| Stretch { from: pair[0].clone(), to: pair[1].clone(), headings: None };
    Some(Choice {
        id,
        eligible: vec![vehicle],
        start: ground.location(first),
        start_heading: heading_deg(first, *points.get(1)?) as f32,
        end: ground.location(last),
        end_heading: heading_deg(points[points.len() - 2], last) as f32,
        within: Within::Stretches(places.windows(2).map(stretch).collect()),
    })
}

impl Kind for PatternSearchTask {
    fn ready(&self, world: &World) -> Result<(), String> {
        pattern_target(self, world).map(drop)
    }

    fn looks(&self, view: &View<'_>) -> Vec<Look> {
        looks(self, view, &[ELEVATION_DEG])
    }

    fn offer(&self, view: &View<'_>, seen: &Seen) -> Result<Offer, String> {
        let ground = view.ground(&pattern_target(self, view.world)?);
        let extent = f64::from(self.extent);
        if extent.is_nan() || extent <= 0.0 {
            return Err(format!("Extent is {extent} m: a pattern needs one above 0"));
        }
        let mut choices = Vec::new();
        for vehicle in &view.vehicles {
            let Some(footprint) = footprint(seen, vehicle.id, ELEVATION_DEG) else { continue };
            let spacing = APART * f64::from(footprint.width_center);
            if spacing.is_nan() || spacing <= 0.01 {
                return Err("Lane Spacing is Zero: no sensor covers any width of ground".to_owned());
            }
            let id = FIRST_OPTION + choices.len() as i64;
            let center = view.number("SpiralCenterRadius_m").unwrap_or(SPIRAL_CENTER_M);
            choices.extend(match self.pattern {
                AreaSearchPattern::Spiral => {
                    through(id, vehicle.id, &pattern_spiral(self, spacing, center), &ground)
                }
                AreaSearchPattern::Sector => {
                    through(id, vehicle.id, &pattern_sectors(self, spacing), &ground)
                }
                _ => {
                    let square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                        .map(|(x, y)| (x * extent, y * extent));
                    along(id, vehicle.id, &Sweep::of(footprint, 0.0).lanes(&square)?, &ground)
                }
            });
        }
        if choices.is_empty() {
            return Err(nobody_sees(view));
        }
        Ok(Offer { composition: composition::one_of(choices.iter().map(|choice| choice.id)), choices })
    }
}
