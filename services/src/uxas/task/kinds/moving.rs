//! Tasks about something that moves: watch it, go with it, relay its radio.

use super::super::{Choice, FIRST_OPTION, Kind, Offer, Seen, View, Within, composition};
use super::{place, point};
use crate::uxas::ground::{Point, ahead, far};
use crate::uxas::vehicle::Vehicle;
use crate::uxas::world::World;
use aldis_envelope::lmcp::cmasi::{Location3D, Waypoint};
use aldis_envelope::lmcp::impact::{CommRelayTask, EscortTask, RadioTowerConfiguration, WatchTask};

/// A distance below which one stands where the other is, in metres.
const TOGETHER_M: f64 = 0.1;

/// One option at a place, for each vehicle.
fn each_at(view: &View<'_>, at: &Location3D) -> Offer {
    let choice = |(vehicle, id): (&Vehicle, i64)| Choice {
        id,
        eligible: vec![vehicle.id],
        start: at.clone(),
        start_heading: 0.0,
        end: at.clone(),
        end_heading: 0.0,
        within: Within::Places(vec![at.clone()], 0),
    };
    let choices: Vec<_> = view.vehicles.iter().zip(FIRST_OPTION..).map(choice).collect();
    Offer { composition: composition::one_of(choices.iter().map(|choice| choice.id)), choices }
}

/// Where an entity is.
pub(super) fn whereabouts(world: &World, id: i64) -> Result<Location3D, String> {
    let state = world.state(id).ok_or_else(|| format!("EntityState for Entity Id[{id}] not available"))?;
    place(&state.location, "the place of the entity")
}

fn stare_at(view: &View<'_>, vehicle: &Vehicle, target: i64, waypoints: &mut [Waypoint]) {
    if let (Ok(at), Some(first)) = (whereabouts(view.world, target), waypoints.first_mut()) {
        point::stare(view.world, vehicle.id, &at, first);
    }
}

impl Kind for WatchTask {
    fn offer(&self, view: &View<'_>, _: &Seen) -> Result<Offer, String> {
        Ok(each_at(view, &whereabouts(view.world, self.watched_entity_id)?))
    }

    fn finish(&self, view: &View<'_>, vehicle: &Vehicle, _: &Choice, waypoints: &mut Vec<Waypoint>) {
        stare_at(view, vehicle, self.watched_entity_id, waypoints);
    }

    fn follows(&self, view: &View<'_>, _: &Vehicle) -> Option<Location3D> {
        whereabouts(view.world, self.watched_entity_id).ok()
    }
}

/// Half way from the tower to whom is supported, or to where that one goes.
fn relay_target(task: &CommRelayTask, view: &View<'_>) -> Result<Location3D, String> {
    let id = task.tower_id;
    let tower = view.world.configurations.get(&id);
    let tower = tower.ok_or_else(|| format!("EntityConfiguration for Entity Id[{id}] not available"))?;
    let tower: &RadioTowerConfiguration =
        tower.get().ok_or_else(|| format!("entity {id} is no radio tower: TowerID must name one"))?;
    let tower = place(&tower.position, "the place of the radio tower")?;
    let end = match task.destination_location.get() {
        Some(_) => place(&task.destination_location, "DestinationLocation")?,
        None => whereabouts(view.world, task.supported_entity_id)?,
    };
    let ground = view.ground(&tower);
    let (a, b) = (ground.point(&tower), ground.point(&end));
    Ok(ground.location(((a.0 + b.0) / 2.0, (a.1 + b.1) / 2.0)))
}

impl Kind for CommRelayTask {
    fn offer(&self, view: &View<'_>, _: &Seen) -> Result<Offer, String> {
        Ok(each_at(view, &relay_target(self, view)?))
    }

    fn follows(&self, view: &View<'_>, _: &Vehicle) -> Option<Location3D> {
        relay_target(self, view).ok()
    }
}

/// The way that the supported entity takes: its line, its mission, the waypoints of the task, or the nearest line.
fn escort_way(task: &EscortTask, world: &World) -> Vec<Location3D> {
    let of_line = |line: &aldis_envelope::lmcp::impact::LineOfInterest| -> Vec<Location3D> {
        line.line.iter().filter_map(|at| at.get().cloned()).collect()
    };
    let of_waypoints = |list: &[aldis_envelope::lmcp::Ref<Waypoint>]| -> Vec<Location3D> {
        list.iter().filter_map(|at| at.get()).map(|at| at.base.clone()).collect()
    };
    if let Some(line) = world.lines.get(&task.route_id).filter(|_| task.route_id != 0) {
        return of_line(line);
    }
    if let Some(mission) = world.missions.get(&task.supported_entity_id) {
        return of_waypoints(&mission.waypoint_list);
    }
    if !task.prescribed_waypoints.is_empty() {
        return of_waypoints(&task.prescribed_waypoints);
    }
    Vec::new()
}

/// The place so far ahead of the supported entity on its way, or behind.
fn escort_target(task: &EscortTask, view: &View<'_>) -> Result<Location3D, String> {
    let id = task.supported_entity_id;
    let here = whereabouts(view.world, id)?;
    let distance = f64::from(task.standoff_distance);
    if distance.abs() < TOGETHER_M {
        return Ok(here);
    }
    let ground = view.ground(&here);
    let way: Vec<Point> = escort_way(task, view.world).iter().map(|at| ground.point(at)).collect();
    let here = ground.point(&here);
    let point = if way.len() >= 2 {
        along(&way, nearest(&way, here) + distance)
    } else {
        let heading = view.world.state(id).map_or(0.0, |state| f64::from(state.heading));
        ahead(here, heading, distance)
    };
    Ok(ground.location(point))
}

/// How far along a line its nearest place to a point is.
fn nearest(line: &[Point], point: Point) -> f64 {
    let (mut best, mut gone) = ((f64::INFINITY, 0.0), 0.0);
    for pair in line.windows(2) {
        let length = far(pair[0], pair[1]);
        let way = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
        let to = (point.0 - pair[0].0, point.1 - pair[0].1);
        let share = if length > 0.0 {
            ((way.0 * to.0 + way.1 * to.1) / (length * length)).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let at = (pair[0].0 + way.0 * share, pair[0].1 + way.1 * share);
        if far(at, point) < best.0 {
            best = (far(at, point), gone + length * share);
        }
        gone += length;
    }
    best.1
}

/// The place so far along a line; its ends go on to both sides as places of their own.
fn along(line: &[Point], mut metres: f64) -> Point {
    metres = metres.max(0.0);
    for pair in line.windows(2) {
        let length = far(pair[0], pair[1]);
        if metres <= length && length > 0.0 {
            let share = metres / length;
            return (
                pair[0].0 + (pair[1].0 - pair[0].0) * share,
                pair[0].1 + (pair[1].1 - pair[0].1) * share,
            );
        }
        metres -= length;
    }
    line[line.len() - 1]
}

impl Kind for EscortTask {
    fn ready(&self, world: &World) -> Result<(), String> {
        let id = self.route_id;
        let is_there = id == 0 || world.lines.contains_key(&id);
        is_there.then_some(()).ok_or_else(|| format!("LineOfInterest Id[{id}] not available"))
    }

    fn offer(&self, view: &View<'_>, _: &Seen) -> Result<Offer, String> {
        Ok(each_at(view, &escort_target(self, view)?))
    }

    fn finish(&self, view: &View<'_>, vehicle: &Vehicle, _: &Choice, waypoints: &mut Vec<Waypoint>) {
        stare_at(view, vehicle, self.supported_entity_id, waypoints);
    }

    fn follows(&self, view: &View<'_>, _: &Vehicle) -> Option<Location3D> {
        escort_target(self, view).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_ahead_on_a_bent_way() {
        let way = [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0)];
        assert_eq!(nearest(&way, (60.0, -5.0)), 60.0);
        assert_eq!(along(&way, 60.0 + 70.0), (100.0, 30.0));
        assert_eq!(along(&way, 900.0), (100.0, 100.0));
        assert_eq!(along(&way, -10.0), (0.0, 0.0));
    }
}
