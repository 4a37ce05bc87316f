//! Which triangles a place is in.

use super::Point;
use super::mesh::{Mesh, NONE, orient};

/// How many cells a side of the table has for each root of the number of triangles.
const CELLS_PER_ROOT: f64 = 1.0;

/// A table of triangles to begin at, by place.
#[derive(Debug, Clone)]
pub(super) struct Locator {
    from: Point,
    step: Point,
    side: usize,
    near: Vec<u32>,
}

impl Locator {
    pub(super) fn new(mesh: &Mesh) -> Self {
        let least = |get: fn(&Point) -> f64| mesh.points.iter().map(get).fold(f64::INFINITY, f64::min);
        let most = |get: fn(&Point) -> f64| mesh.points.iter().map(get).fold(f64::NEG_INFINITY, f64::max);
        let (from, to) = ((least(|p| p.0), least(|p| p.1)), (most(|p| p.0), most(|p| p.1)));
        let side = ((mesh.triangles.len() as f64).sqrt() * CELLS_PER_ROOT).ceil().max(1.0) as usize;
        let step = ((to.0 - from.0) / side as f64, (to.1 - from.1) / side as f64);
        let mut locator = Self { from, step, side, near: vec![0; side * side] };
        // Each cell begins where the walk to the cell before it has ended.
        let mut at = 0;
        for row in 0..side {
            for column in 0..side {
                let column = if row % 2 == 0 { column } else { side - 1 - column };
                let middle = (from.0 + step.0 * (column as f64 + 0.5), from.1 + step.1 * (row as f64 + 0.5));
                at = walk(mesh, at, middle);
                locator.near[row * side + column] = at;
            }
        }
        locator
    }

    /// The free triangles that hold a place, on their borders too.
    pub(super) fn holders(&self, mesh: &Mesh, place: Point) -> Vec<u32> {
        let cell = |at: f64, from: f64, step: f64| {
            ((at - from) / step).floor().clamp(0.0, self.side as f64 - 1.0) as usize
        };
        let (column, row) =
            (cell(place.0, self.from.0, self.step.0), cell(place.1, self.from.1, self.step.1));
        let found = walk(mesh, self.near[row * self.side + column], place);
        if !mesh.holds(found, place) {
            return Vec::new();
        }
        let mut holders = vec![found];
        let mut at = 0;
        // On a side there are two, on a vertex all around it: neighbours of neighbours.
        while at < holders.len() {
            for vertex in mesh.triangles[holders[at] as usize] {
                if mesh.points[vertex as usize] == place {
                    holders.extend_from_slice(mesh.around(vertex));
                    holders.sort_unstable();
                    holders.dedup();
                    holders.retain(|&triangle| mesh.is_free(triangle));
                    return holders;
                }
            }
            let behind = mesh.behind[holders[at] as usize];
            for other in behind.into_iter().filter(|&other| other != NONE) {
                if !holders.contains(&other) && mesh.holds(other, place) {
                    holders.push(other);
                }
            }
            at += 1;
        }
        holders.retain(|&triangle| mesh.is_free(triangle));
        holders
    }
}

/// Walks towards a place: to the triangle that holds it, or the last before the rim.
fn walk(mesh: &Mesh, from: u32, place: Point) -> u32 {
    let mut at = from;
    let mut former = NONE;
    for _ in 0..mesh.triangles.len() {
        let corners = mesh.corners(at);
        let leads = |side: &usize| {
            let next = mesh.behind[at as usize][*side];
            let outside = orient(corners[*side], corners[(*side + 1) % 3], place) < 0.0;
            outside && next != former
        };
        let Some(side) = (0..3).find(leads) else { return at };
        let next = mesh.behind[at as usize][side];
        if next == NONE {
            return at;
        }
        (former, at) = (at, next);
    }
    let all = 0..mesh.triangles.len() as u32;
    all.into_iter().find(|&triangle| mesh.holds(triangle, place)).unwrap_or(at)
}
