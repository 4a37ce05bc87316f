//! Searches of an area by lanes.

use super::super::{
    Choice, FIRST_OPTION, Kind, Look, Offer, Seen, Stretch, View, Within, angles, composition,
};
use super::lanes::Sweep;
use crate::uxas::ground::{Ground, Point, heading_deg, middle, outline};
use crate::uxas::vehicle::Vehicle;
use crate::uxas::world::World;
use aldis_envelope::lmcp::Ref;
use aldis_envelope::lmcp::cmasi::{AbstractGeometry, AreaSearchTask, Rectangle, SearchTask};
use aldis_envelope::lmcp::impact::AngledAreaSearchTask;
use aldis_envelope::lmcp::uxtask::SensorFootprint;

/// The elevation of looks without a wedge, in degrees.
const ELEVATION_DEG: f64 = -60.0;

/// The looks of all vehicles of a search at these elevations.
pub(super) fn looks(search: &SearchTask, view: &View<'_>, elevations_deg: &[f64]) -> Vec<Look> {
    let look = |vehicle: &Vehicle, elevation: f64| Look {
        vehicle: vehicle.id,
        elevation_rad: elevation.to_radians(),
        ground_sample_distance_m: search.ground_sample_distance,
        bands: search.desired_wavelength_bands.clone(),
    };
    let all = view.vehicles.iter();
    all.flat_map(|vehicle| elevations_deg.iter().map(move |&elevation| look(vehicle, elevation))).collect()
}

/// What a vehicle's sensors see at the elevation, in degrees, that they come nearest to.
pub(super) fn footprint(seen: &Seen, vehicle: i64, elevation_deg: f64) -> Option<&SensorFootprint> {
    let own = seen.footprints.iter().filter(|footprint| footprint.vehicle_id == vehicle);
    let miss = |found: &&SensorFootprint| (f64::from(found.gimbal_elevation) - elevation_deg).abs();
    own.min_by(|a, b| miss(a).total_cmp(&miss(b)))
}

/// The error where no vehicle sees anything.
pub(super) fn nobody_sees(view: &View<'_>) -> String {
    let ids: Vec<_> = view.vehicles.iter().map(|vehicle| vehicle.id.to_string()).collect();
    format!("no sensor of vehicle {} sees the ground as the task asks", ids.join(", "))
}

/// The stretches of lanes and of the ways between them.
pub(super) fn stretches(lanes: &[(Point, Point)], ground: &Ground) -> Vec<Stretch> {
    let mut stretches = Vec::with_capacity(lanes.len() * 2);
    let heading = |lane: &(Point, Point)| heading_deg(lane.0, lane.1) as f32;
    for (at, lane) in lanes.iter().enumerate() {
        if let Some(before) = at.checked_sub(1).map(|before| &lanes[before]) {
            stretches.push(Stretch {
                from: ground.location(before.1),
                to: ground.location(lane.0),
                headings: Some((heading(before), heading(lane))),
            });
        }
        let (from, to) = (ground.location(lane.0), ground.location(lane.1));
        stretches.push(Stretch { from, to, headings: Some((heading(lane), heading(lane))) });
    }
    stretches
}

/// The option of going along lanes.
pub(super) fn along(id: i64, vehicle: i64, lanes: &[(Point, Point)], ground: &Ground) -> Option<Choice> {
    let (first, last) = (lanes.first()?, lanes.last()?);
    Some(Choice {
        id,
        eligible: vec![vehicle],
        start: ground.location(first.0),
        start_heading: heading_deg(first.0, first.1) as f32,
        end: ground.location(last.1),
        end_heading: heading_deg(last.0, last.1) as f32,
        within: Within::Stretches(stretches(lanes, ground)),
    })
}

/// The plane of an area and its corners on it.
pub(super) fn on_plane(
    area: &Ref<AbstractGeometry>,
    view: &View<'_>,
) -> Result<(Ground, Vec<Point>), String> {
    let wrong = || "the area is no polygon, circle or rectangle with an extent".to_owned();
    let ground = view.ground(&middle(area).ok_or_else(wrong)?);
    let corners = outline(area, &ground).ok_or_else(wrong)?;
    Ok((ground, corners))
}

impl Kind for AreaSearchTask {
    fn doubts(&self) -> Vec<String> {
        angles::doubts(&self.view_angle_list)
    }

    fn looks(&self, view: &View<'_>) -> Vec<Look> {
        looks(self, view, &angles::elevations(&self.view_angle_list))
    }

    fn offer(&self, view: &View<'_>, seen: &Seen) -> Result<Offer, String> {
        let (ground, corners) = on_plane(&self.search_area, view)?;
        let mut choices = Vec::new();
        for vehicle in &view.vehicles {
            for elevation in angles::elevations(&self.view_angle_list) {
                let Some(footprint) = footprint(seen, vehicle.id, elevation) else { continue };
                for heading in angles::azimuths(&self.view_angle_list, &angles::around()) {
                    let sweep = Sweep { middle_alone: view.compat, ..Sweep::of(footprint, heading) };
                    let lanes = sweep.lanes(&corners)?;
                    let id = FIRST_OPTION + choices.len() as i64;
                    choices.extend(along(id, vehicle.id, &lanes, &ground));
                }
            }
        }
        if choices.is_empty() {
            return Err(nobody_sees(view));
        }
        Ok(Offer { composition: composition::one_of(choices.iter().map(|choice| choice.id)), choices })
    }
}

fn angled_area<'a>(
    task: &AngledAreaSearchTask,
    world: &'a World,
) -> Result<&'a Ref<AbstractGeometry>, String> {
    let id = task.search_area_id;
    let area = world.areas.get(&id).ok_or_else(|| format!("AreaOfInterest Id[{id}] not available"))?;
    Ok(&area.area)
}

impl Kind for AngledAreaSearchTask {
    fn ready(&self, world: &World) -> Result<(), String> {
        angled_area(self, world).map(drop)
    }

    fn looks(&self, view: &View<'_>) -> Vec<Look> {
        looks(self, view, &[ELEVATION_DEG])
    }

    fn offer(&self, view: &View<'_>, seen: &Seen) -> Result<Offer, String> {
        let area = angled_area(self, view.world)?;
        let (ground, corners) = on_plane(area, view)?;
        let turned =
            area.object().and_then(|area| area.get::<Rectangle>()).map(|area| f64::from(area.rotation));
        let axis = turned.filter(|_| view.compat).unwrap_or(f64::from(self.sweep_angle));
        let mut choices = Vec::new();
        for vehicle in &view.vehicles {
            let Some(footprint) = footprint(seen, vehicle.id, ELEVATION_DEG) else { continue };
            // From each of the four corners.
            for (turn, left_first) in [(0.0, true), (0.0, false), (180.0, true), (180.0, false)] {
                let mut sweep = Sweep { left_first, ..Sweep::of(footprint, axis + turn) };
                sweep.spacing_m = sweep.spacing_m.max(view.number("SearchLaneWidthMin_m").unwrap_or(0.0));
                sweep.spacing_m =
                    sweep.spacing_m.min(view.number("SearchLaneWidthMax_m").unwrap_or(f64::INFINITY));
                sweep.middle_alone = view.compat;
                let lanes = sweep.lanes(&corners).map_err(|why| format!("AngledAreaSearch: {why}"))?;
                let id = FIRST_OPTION + choices.len() as i64;
                choices.extend(along(id, vehicle.id, &lanes, &ground));
            }
        }
        if choices.is_empty() {
            return Err(nobody_sees(view));
        }
        Ok(Offer { composition: composition::one_of(choices.iter().map(|choice| choice.id)), choices })
    }
}
