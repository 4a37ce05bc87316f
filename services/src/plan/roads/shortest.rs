//! The shortest way along roads.

use super::{OnRoad, OneWay, Roads, Segment};
use crate::plan::geodesy::Place;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// No node.
const NONE: u32 = u32::MAX;

/// The least radius of curvature of WGS 84, in metres: that of the meridian at the equator.
const CURVATURE_LEAST_M: f64 = 6_335_439.0;

/// A node by the least that a way over it can be, in metres.
#[derive(PartialEq)]
struct Next(f64, u32);

impl Eq for Next {}

impl PartialOrd for Next {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Next {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0).then(self.1.cmp(&other.1))
    }
}

impl Segment {
    /// Whether it may be driven as it is drawn, and the other way.
    fn directions(&self, one_way: OneWay) -> (bool, bool) {
        match one_way {
            OneWay::Respect => (self.forth, self.back),
            OneWay::Ignore => (true, true),
        }
    }
}

impl Roads {
    /// How long the shortest way is, and the nodes that it passes.
    pub(super) fn shortest(&self, from: &OnRoad, to: &OnRoad, one_way: OneWay) -> Option<(f64, Vec<u32>)> {
        let (first, last) = (self.segments[from.segment as usize], self.segments[to.segment as usize]);
        let is_within = |on: &OnRoad| on.share > 0.0 && on.share < 1.0;
        // Along one segment, if that is the way it leads.
        let along = to.share - from.share;
        let (forth, back) = first.directions(one_way);
        let leads = from.segment == to.segment && (along >= 0.0 && forth || along <= 0.0 && back);
        let leads = leads && is_within(from) && is_within(to);
        let mut best = leads.then(|| (along.abs() * first.metres, NONE));
        let mut metres = vec![f64::INFINITY; self.nodes.len()];
        let mut before = vec![NONE; self.nodes.len()];
        let mut open = BinaryHeap::new();
        let goal = direction(to.place);
        let least = |node: u32| chord_m(direction(self.nodes[node as usize].place), goal);
        // Who is at a node begins there, whatever the direction of the road.
        let reach = |on: &OnRoad, far: bool, share: f64, leads: bool| match is_within(on) {
            true => leads,
            false => share == 0.0 && far == (on.share == 1.0),
        };
        for (node, far, share, leads) in
            [(first.to, true, 1.0 - from.share, forth), (first.from, false, from.share, back)]
        {
            if reach(from, far, share, leads) {
                metres[node as usize] = share * first.metres;
                open.push(Reverse(Next(metres[node as usize] + least(node), node)));
            }
        }
        let (forth, back) = last.directions(one_way);
        let ends = [(last.from, false, to.share, forth), (last.to, true, 1.0 - to.share, back)];
        let ends = ends.map(|(node, far, share, leads)| (node, share, reach(to, far, share, leads)));
        while let Some(Reverse(Next(bound, node))) = open.pop() {
            if best.is_some_and(|best| best.0 <= bound) {
                break;
            }
            let here = metres[node as usize];
            if bound > here + least(node) {
                continue;
            }
            for (end, share, leads) in ends {
                let found = here + share * last.metres;
                if end == node && leads && best.is_none_or(|best| found < best.0) {
                    best = Some((found, node));
                }
            }
            for &number in self.around(node) {
                let segment = &self.segments[number as usize];
                let (forth, back) = segment.directions(one_way);
                let (next, leads) =
                    if segment.from == node { (segment.to, forth) } else { (segment.from, back) };
                let found = here + segment.metres;
                if leads && found < metres[next as usize] {
                    metres[next as usize] = found;
                    before[next as usize] = node;
                    open.push(Reverse(Next(found + least(next), next)));
                }
            }
        }
        let (length_m, mut node) = best?;
        let mut passed = Vec::new();
        while node != NONE {
            passed.push(node);
            node = before[node as usize];
        }
        passed.reverse();
        Some((length_m, passed))
    }

    fn around(&self, node: u32) -> &[u32] {
        &self.at[self.first[node as usize] as usize..self.first[node as usize + 1] as usize]
    }
}

/// The direction of the vertical at a place.
fn direction(place: Place) -> [f64; 3] {
    let (latitude, longitude) = (place.latitude_deg.to_radians(), place.longitude_deg.to_radians());
    let across = latitude.cos();
    [across * longitude.cos(), across * longitude.sin(), latitude.sin()]
}

/// No more than the distance of two places, by the directions of their verticals: over a radius of curvature these turn by a
/// radian, and no radius is less.
fn chord_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    let off = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    CURVATURE_LEAST_M * (off[0] * off[0] + off[1] * off[1] + off[2] * off[2]).sqrt()
}
