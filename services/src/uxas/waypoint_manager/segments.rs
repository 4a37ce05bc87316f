//! A mission's waypoints in their order, and cut into segments.

use aldis_envelope::lmcp::cmasi::Waypoint;
use std::collections::{BTreeMap, BTreeSet};

/// The waypoints in the order in which they are gone: one that leads to the first where there is one, the first, and on by
/// their links until one leads nowhere new.
///
/// # Errors
/// A link that leads to no waypoint, two waypoints of one number, or no waypoint at all.
pub fn order(list: &[Waypoint], first: i64) -> Result<Vec<Waypoint>, String> {
    let mut by_number = BTreeMap::new();
    for waypoint in list {
        if by_number.insert(waypoint.number, waypoint).is_some() {
            return Err(format!("two waypoints have the number {}", waypoint.number));
        }
    }
    if list.is_empty() {
        return Err("it has no waypoints".to_owned());
    }
    if !by_number.contains_key(&first) {
        return Err(format!("FirstWaypoint {first} is none of its waypoints"));
    }
    let before = list.iter().find(|waypoint| waypoint.next_waypoint == first && waypoint.number != first);
    // A loop leads to the first again: then nothing stands before it.
    let (mut plan, mut seen) = (Vec::new(), BTreeSet::new());
    let mut next = first;
    while let Some(waypoint) = by_number.get(&next) {
        if !seen.insert(next) {
            break;
        }
        plan.push((*waypoint).clone());
        if waypoint.next_waypoint != waypoint.number && !by_number.contains_key(&waypoint.next_waypoint) {
            return Err(format!(
                "waypoint {} leads to {}, which is not there",
                waypoint.number, waypoint.next_waypoint
            ));
        }
        next = waypoint.next_waypoint;
    }
    if let Some(before) = before.filter(|before| !seen.contains(&before.number)) {
        plan.insert(0, before.clone());
    }
    Ok(plan)
}

/// Segments of at most so many waypoints, each beginning with the last `overlap` of the one before.
pub fn segments(plan: &[Waypoint], serve: usize, overlap: usize) -> Vec<Vec<Waypoint>> {
    let overlap = overlap.max(2);
    let serve = serve.max(overlap + 1);
    let mut found = Vec::new();
    let mut at = 0;
    loop {
        let end = (at + serve).min(plan.len());
        found.push(plan[at..end].to_vec());
        if end == plan.len() {
            return found;
        }
        at = end - overlap;
    }
}
