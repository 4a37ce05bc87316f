//! Searches of a point: come to it from some direction, and look.

use super::super::{Choice, FIRST_OPTION, Kind, Offer, View, Within, angles, composition};
use super::place;
use crate::uxas::ground::ahead;
use crate::uxas::vehicle::{Medium, Vehicle};
use crate::uxas::world::World;
use aldis_envelope::lmcp::Ref;
use aldis_envelope::lmcp::cmasi::{
    GimbalConfiguration, GimbalStareAction, Location3D, PointSearchTask, Waypoint, Wedge,
};
use aldis_envelope::lmcp::impact::ImpactPointSearchTask;

/// One option for each direction; with a distance to stand off, one for each group of like vehicles.
pub(super) fn from_all_sides(
    view: &View<'_>,
    at: &Location3D,
    standoff_m: f64,
    wedges: &[Ref<Wedge>],
    service_ms: i64,
) -> Offer {
    let ground = view.ground(at);
    let everyone: Vec<_> = view.vehicles.iter().map(|vehicle| vehicle.id).collect();
    let mut choices = Vec::new();
    for azimuth in angles::azimuths(wedges, &angles::around()) {
        let heading = (azimuth + 180.0).rem_euclid(360.0) as f32;
        let mut add = |eligible: Vec<i64>, start: Location3D, places: Vec<Location3D>, time_ms| {
            choices.push(Choice {
                id: FIRST_OPTION + choices.len() as i64,
                eligible,
                start,
                start_heading: heading,
                end: at.clone(),
                end_heading: heading,
                within: Within::Places(places, time_ms),
            });
        };
        if standoff_m <= 0.0 {
            add(everyone.clone(), at.clone(), vec![at.clone()], service_ms);
            continue;
        }
        let start = ground.location(ahead(ground.point(at), azimuth, standoff_m));
        for group in view.groups() {
            let Some(time_ms) = group.first().and_then(|vehicle| vehicle.time_ms(standoff_m)) else {
                continue;
            };
            let eligible = group.iter().map(|vehicle| vehicle.id).collect();
            add(eligible, start.clone(), vec![start.clone(), at.clone()], time_ms);
        }
    }
    Offer { composition: composition::one_of(choices.iter().map(|choice| choice.id)), choices }
}

/// The payload by which a vehicle stares: its last gimbal.
pub(super) fn gimbal(world: &World, vehicle: i64) -> Option<i64> {
    let payloads = &world.configuration(vehicle)?.payload_configuration_list;
    let mut gimbals = payloads.iter().filter_map(|payload| payload.object()?.get::<GimbalConfiguration>());
    gimbals.next_back().map(|gimbal| gimbal.payload_id)
}

/// Has a vehicle's gimbal stare at a place, from a waypoint on.
pub(super) fn stare(world: &World, vehicle: i64, at: &Location3D, waypoint: &mut Waypoint) {
    let Some(payload) = gimbal(world, vehicle) else { return };
    let mut action = GimbalStareAction { starepoint: Ref::new(at.clone()), ..GimbalStareAction::default() };
    action.payload_id = payload;
    action.associated_task_list.clone_from(&waypoint.associated_tasks);
    waypoint.vehicle_action_list.push(Ref::new(action));
}

impl Kind for PointSearchTask {
    fn offer(&self, view: &View<'_>, _: &super::super::Seen) -> Result<Offer, String> {
        let at = place(&self.search_location, "SearchLocation")?;
        Ok(from_all_sides(view, &at, f64::from(self.standoff_distance), &self.view_angle_list, 0))
    }

    fn finish(&self, view: &View<'_>, vehicle: &Vehicle, _: &Choice, waypoints: &mut Vec<Waypoint>) {
        if let (Some(at), Some(first)) = (self.search_location.get(), waypoints.first_mut()) {
            stare(view.world, vehicle.id, at, first);
        }
    }
}

/// Where to look: the point of interest, or else the place in the task; the loiter's own place goes before both.
fn impact_target(task: &ImpactPointSearchTask, world: &World) -> Result<Location3D, String> {
    if let Some(loiter) = task.desired_action.get()
        && let Ok(at) = place(&loiter.location, "the place of DesiredAction")
    {
        return Ok(at);
    }
    if task.search_location_id > 0 {
        let id = task.search_location_id;
        let point = world.points.get(&id).ok_or_else(|| format!("PointOfInterest Id[{id}] not available"))?;
        return place(&point.location, "the place of the point of interest");
    }
    place(&task.search_location, "SearchLocation")
}

impl Kind for ImpactPointSearchTask {
    fn ready(&self, world: &World) -> Result<(), String> {
        impact_target(self, world).map(drop)
    }

    fn offer(&self, view: &View<'_>, _: &super::super::Seen) -> Result<Offer, String> {
        let at = impact_target(self, view.world)?;
        let time_ms = self.desired_action.get().map_or(0, |loiter| loiter.duration.max(0));
        let standoff = f64::from(self.standoff_distance);
        Ok(from_all_sides(view, &at, standoff, &self.view_angle_list, if view.compat { 0 } else { time_ms }))
    }

    fn finish(&self, view: &View<'_>, vehicle: &Vehicle, _: &Choice, waypoints: &mut Vec<Waypoint>) {
        let Ok(at) = impact_target(self, view.world) else { return };
        if let Some(first) = waypoints.first_mut() {
            stare(view.world, vehicle.id, &at, first);
        }
        if let (Some(loiter), Some(last)) = (self.desired_action.object(), waypoints.last_mut())
            && let Some(action) = loiter.get::<aldis_envelope::lmcp::cmasi::LoiterAction>()
        {
            let mut action = action.clone();
            action.associated_task_list.clone_from(&last.associated_tasks);
            if let Some(place) = action.location.get_mut() {
                (place.altitude, place.altitude_type) = (vehicle.altitude_m, vehicle.altitude_type);
            }
            if vehicle.medium != Medium::Air {
                action.loiter_type = aldis_envelope::lmcp::cmasi::LoiterType::Hover;
                action.radius = 0.0;
            }
            last.vehicle_action_list.push(Ref::new(action));
        }
    }
}
