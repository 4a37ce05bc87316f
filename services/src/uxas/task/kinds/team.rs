//! Tasks of several vehicles at once: blockade, watch by many, cordon, rendezvous.

use super::super::{ARRANGEMENTS_MAX, Choice, FIRST_OPTION, Kind, Offer, Seen, View, Within, composition};
use super::moving::whereabouts;
use super::{place, point};
use crate::plan::algebra::{Expression, Operator};
use crate::uxas::ground::{ahead, heading_deg};
use crate::uxas::vehicle::Vehicle;
use aldis_envelope::lmcp::cmasi::{Location3D, Waypoint};
use aldis_envelope::lmcp::impact::{BlockadeTask, CordonTask, MultiVehicleWatchTask};
use aldis_envelope::lmcp::uxtask::RendezvousTask;

/// The place of each vehicle of a team, by the vehicle's rank in it.
type Team = Vec<(i64, Location3D, f32)>;

/// An offer of teams, one of which does the task.
fn offer(teams: Vec<Team>) -> Offer {
    let (mut choices, mut parts) = (Vec::new(), Vec::new());
    for team in teams {
        let mut ids = Vec::new();
        for (vehicle, at, heading) in team {
            let id = FIRST_OPTION + choices.len() as i64;
            ids.push(id);
            choices.push(Choice {
                id,
                eligible: vec![vehicle],
                start: at.clone(),
                start_heading: heading,
                end: at.clone(),
                end_heading: heading,
                within: Within::Places(vec![at], 0),
            });
        }
        parts.push(composition::all_of(ids));
    }
    Offer { composition: Expression::Node(Operator::Alternative, parts), choices }
}

/// The ordered selections of `count` of these places, in order, at most [`ARRANGEMENTS_MAX`].
fn arrangements(places: usize, count: usize) -> Vec<Vec<usize>> {
    chosen(places, count, |so_far, next| !so_far.contains(&next))
}

/// The selections of `count` of these without order, likewise.
fn selections(places: usize, count: usize) -> Vec<Vec<usize>> {
    chosen(places, count, |so_far, next| so_far.last().is_none_or(|&last| last < next))
}

/// The selections of `count` of these places that grow by what may follow.
fn chosen(places: usize, count: usize, may_follow: impl Fn(&[usize], usize) -> bool) -> Vec<Vec<usize>> {
    let mut found = Vec::new();
    let mut open: Vec<Vec<usize>> = vec![Vec::new()];
    while let Some(so_far) = open.pop() {
        if so_far.len() == count {
            found.push(so_far);
            if found.len() == ARRANGEMENTS_MAX {
                break;
            }
            continue;
        }
        for next in (0..places).rev().filter(|&next| may_follow(&so_far, next)) {
            open.push(so_far.iter().copied().chain([next]).collect());
        }
    }
    found
}

/// How many vehicles of those that may take part.
fn enough(view: &View<'_>, wanted: u8) -> Result<usize, String> {
    let (wanted, there) = (usize::from(wanted.max(1)), view.vehicles.len());
    if wanted <= there {
        return Ok(wanted);
    }
    Err(format!("it needs {wanted} vehicles, and {there} of the request may do it"))
}

/// The place of one of `count` vehicles in the wall between whom is blocked and what is protected.
fn wall_post(
    task: &BlockadeTask,
    view: &View<'_>,
    rank: usize,
    count: usize,
) -> Result<(Location3D, f32), String> {
    let enemy = whereabouts(view.world, task.blocked_entity_id)?;
    let ground = view.ground(&enemy);
    let from = ground.point(&enemy);
    let protected = task.protected_location.get().filter(|at| at.latitude != 0.0 || at.longitude != 0.0);
    // Without a place to protect, the west is closed to it.
    let to = protected.map_or_else(|| ahead(from, 270.0, 100.0), |at| ground.point(at));
    let heading = heading_deg(to, from);
    let standoff = f64::from(task.standoff_distance);
    let middle = ahead(from, heading + 180.0, standoff);
    let aside = standoff * (rank as f64 - (count as f64 - 1.0) / 2.0);
    Ok((ground.location(ahead(middle, heading + 90.0, aside)), heading as f32))
}

impl Kind for BlockadeTask {
    fn offer(&self, view: &View<'_>, _: &Seen) -> Result<Offer, String> {
        let count = enough(view, self.number_vehicles)?;
        let mut teams = Vec::new();
        for chosen in selections(view.vehicles.len(), count) {
            let mut team = Team::new();
            for (rank, at) in chosen.into_iter().enumerate() {
                let (place, heading) = wall_post(self, view, rank, count)?;
                team.push((view.vehicles[at].id, place, heading));
            }
            teams.push(team);
        }
        Ok(offer(teams))
    }

    fn follows(&self, view: &View<'_>, vehicle: &Vehicle) -> Option<Location3D> {
        let rank = view.vehicles.iter().position(|other| other.id == vehicle.id)?;
        wall_post(self, view, rank, view.vehicles.len()).ok().map(|(place, _)| place)
    }
}

impl Kind for MultiVehicleWatchTask {
    fn offer(&self, view: &View<'_>, _: &Seen) -> Result<Offer, String> {
        let at = whereabouts(view.world, self.watched_entity_id)?;
        let count = enough(view, self.number_vehicles)?;
        let team = |chosen: Vec<usize>| {
            chosen.into_iter().map(|vehicle| (view.vehicles[vehicle].id, at.clone(), 0.0)).collect()
        };
        Ok(offer(selections(view.vehicles.len(), count).into_iter().map(team).collect()))
    }

    fn finish(&self, view: &View<'_>, vehicle: &Vehicle, _: &Choice, waypoints: &mut Vec<Waypoint>) {
        if let (Ok(at), Some(first)) =
            (whereabouts(view.world, self.watched_entity_id), waypoints.first_mut())
        {
            point::stare(view.world, vehicle.id, &at, first);
        }
    }

    fn follows(&self, view: &View<'_>, _: &Vehicle) -> Option<Location3D> {
        whereabouts(view.world, self.watched_entity_id).ok()
    }
}

impl Kind for CordonTask {
    fn egress(&self) -> Option<(Location3D, f32)> {
        Some((self.cordon_location.get()?.clone(), self.standoff_distance))
    }

    fn offer(&self, view: &View<'_>, seen: &Seen) -> Result<Offer, String> {
        let (vehicles, nodes) = (view.vehicles.len(), seen.egress.len());
        if nodes == 0 {
            return Err("no road leaves the place: nothing is to be closed".to_owned());
        }
        // The fewer of the two are given a place each among the more.
        let teams = match vehicles <= nodes {
            true => arrangements(nodes, vehicles)
                .into_iter()
                .map(|chosen| {
                    let posts = chosen.into_iter().enumerate();
                    posts
                        .map(|(vehicle, node)| (view.vehicles[vehicle].id, seen.egress[node].clone(), 0.0))
                        .collect()
                })
                .collect(),
            false => arrangements(vehicles, nodes)
                .into_iter()
                .map(|chosen| {
                    let posts = chosen.into_iter().enumerate();
                    posts
                        .map(|(node, vehicle)| (view.vehicles[vehicle].id, seen.egress[node].clone(), 0.0))
                        .collect()
                })
                .collect(),
        };
        Ok(offer(teams))
    }
}

impl Kind for RendezvousTask {
    fn offer(&self, view: &View<'_>, _: &Seen) -> Result<Offer, String> {
        let count = enough(view, self.number_of_participants)?;
        let states: Vec<_> = self.rendezvous_states.iter().filter_map(|state| state.get()).collect();
        if states.is_empty() {
            return Err("RendezvousStates names no place to meet".to_owned());
        }
        let mut teams = Vec::new();
        for chosen in selections(view.vehicles.len(), count) {
            // One place for all, or a place each.
            let orders =
                if states.len() < count { vec![vec![0; count]] } else { arrangements(states.len(), count) };
            for order in orders {
                let mut team = Team::new();
                for (&vehicle, &state) in chosen.iter().zip(&order) {
                    let (vehicle, state) = (view.vehicles[vehicle].id, states[state]);
                    if state.entity_id != 0 && state.entity_id != vehicle {
                        break;
                    }
                    let at = place(&state.planning_position, "the place of a RendezvousState")?;
                    team.push((vehicle, at, state.planning_heading));
                }
                if team.len() == count && teams.len() < ARRANGEMENTS_MAX {
                    teams.push(team);
                }
            }
        }
        if teams.is_empty() {
            return Err("no vehicles of the request fit the EntityIDs of its RendezvousStates".to_owned());
        }
        Ok(offer(teams))
    }

    fn begins_together(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrangements_are_all_different_and_bounded() {
        assert_eq!(arrangements(3, 2), [[0, 1], [0, 2], [1, 0], [1, 2], [2, 0], [2, 1]]);
        assert_eq!(selections(3, 2), [[0, 1], [0, 2], [1, 2]]);
        assert_eq!(arrangements(9, 9).len(), ARRANGEMENTS_MAX);
        assert_eq!(selections(2, 2), [[0, 1]]);
    }
}
