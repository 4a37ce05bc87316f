//! Loiter somewhere, and pass a point.

use super::super::{Choice, FIRST_OPTION, Kind, Offer, Seen, View, Within, composition};
use super::place;
use super::point::from_all_sides;
use crate::uxas::vehicle::Vehicle;
use aldis_envelope::lmcp::Ref;
use aldis_envelope::lmcp::cmasi::{LoiterTask, MustFlyTask, Waypoint};

impl Kind for LoiterTask {
    fn offer(&self, view: &View<'_>, _: &Seen) -> Result<Offer, String> {
        let action = self.desired_action.get().ok_or("DesiredAction is not given")?;
        let at = place(&action.location, "the place of DesiredAction")?;
        // A loiter without end is over, for the plan, when it begins.
        let time_ms = if view.compat { 0 } else { action.duration.max(0) };
        let choice = Choice {
            id: FIRST_OPTION,
            eligible: view.vehicles.iter().map(|vehicle| vehicle.id).collect(),
            start: at.clone(),
            start_heading: 0.0,
            end: at.clone(),
            end_heading: 0.0,
            within: Within::Places(vec![at], time_ms),
        };
        Ok(Offer { composition: composition::one_of([FIRST_OPTION]), choices: vec![choice] })
    }

    fn finish(&self, view: &View<'_>, vehicle: &Vehicle, _: &Choice, waypoints: &mut Vec<Waypoint>) {
        let (Some(action), Some(last)) = (self.desired_action.get(), waypoints.last_mut()) else { return };
        let mut action = action.clone();
        action.associated_task_list.clone_from(&last.associated_tasks);
        let flown = view.world.state(vehicle.id).and_then(|state| state.location.get());
        let (altitude, altitude_type) =
            flown.map_or((vehicle.altitude_m, vehicle.altitude_type), |at| (at.altitude, at.altitude_type));
        if let Some(place) = action.location.get_mut() {
            (place.altitude, place.altitude_type) = (altitude, altitude_type);
        }
        last.vehicle_action_list.push(Ref::new(action));
    }
}

impl Kind for MustFlyTask {
    fn offer(&self, view: &View<'_>, _: &Seen) -> Result<Offer, String> {
        let at = place(&self.position, "Position")?;
        Ok(from_all_sides(view, &at, 0.0, &[], 1))
    }

    fn finish(&self, _: &View<'_>, _: &Vehicle, _: &Choice, waypoints: &mut Vec<Waypoint>) {
        let Some(at) = self.position.get().filter(|_| self.use_altitude) else { return };
        for waypoint in waypoints.iter_mut().filter(|waypoint| !waypoint.associated_tasks.is_empty()) {
            (waypoint.altitude, waypoint.altitude_type) = (at.altitude, at.altitude_type);
        }
    }
}
