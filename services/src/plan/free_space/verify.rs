//! Whether a straight way stays in free space, by exact predicates.

use super::Point;
use super::mesh::{Mesh, NONE, orient};

/// Where a straight way is: at a place that these triangles hold.
struct At {
    place: Point,
    holders: Vec<u32>,
}

/// Whether the straight way from a place, which these free triangles hold, to another stays in free space or on its border.
pub(super) fn is_free(mesh: &Mesh, from: (Point, &[u32]), to: Point) -> bool {
    let mut at = At { place: from.0, holders: from.1.to_vec() };
    // A straight way comes to each vertex once at most.
    for _ in 0..=mesh.points.len() {
        match leave(mesh, &at, to) {
            Step::Arrived => return true,
            Step::Blocked => return false,
            Step::Vertex(vertex) => {
                let holders = mesh.around(vertex).iter().copied();
                at = At {
                    place: mesh.points[vertex as usize],
                    holders: holders.filter(|&triangle| mesh.is_free(triangle)).collect(),
                };
            }
        }
    }
    false
}

enum Step {
    Arrived,
    Blocked,
    Vertex(u32),
}

fn is_ahead(from: Point, to: Point, point: Point) -> bool {
    (to.0 - from.0) * (point.0 - from.0) + (to.1 - from.1) * (point.1 - from.1) > 0.0
}

/// From a place to the goal, or the next vertex exactly on the way.
fn leave(mesh: &Mesh, at: &At, to: Point) -> Step {
    if at.holders.iter().any(|&triangle| mesh.holds(triangle, to)) {
        return Step::Arrived;
    }
    for &triangle in &at.holders {
        let vertices = mesh.triangles[triangle as usize];
        let corners = mesh.corners(triangle);
        for side in 0..3 {
            let (a, b) = (corners[side], corners[(side + 1) % 3]);
            let (of_a, of_b) = (orient(at.place, to, a), orient(at.place, to, b));
            if of_a == 0.0 && a != at.place && is_ahead(at.place, to, a) {
                return Step::Vertex(vertices[side]);
            }
            // Out through this side: its first vertex is to the right, its second to the left.
            if orient(a, b, at.place) > 0.0 && of_a < 0.0 && of_b > 0.0 {
                return across(mesh, at.place, to, triangle, side);
            }
        }
    }
    Step::Blocked
}

/// On from a side of a triangle, through one triangle after the other.
fn across(mesh: &Mesh, from: Point, to: Point, triangle: u32, side: usize) -> Step {
    let (mut triangle, mut side) = (triangle, side);
    for _ in 0..=mesh.triangles.len() {
        let next = mesh.behind[triangle as usize][side];
        if next == NONE || !mesh.is_free(next) {
            return Step::Blocked;
        }
        if mesh.holds(next, to) {
            return Step::Arrived;
        }
        let Some(entered) = mesh.behind[next as usize].iter().position(|&other| other == triangle) else {
            return Step::Blocked;
        };
        let opposite = mesh.triangles[next as usize][(entered + 2) % 3];
        let of_opposite = orient(from, to, mesh.points[opposite as usize]);
        if of_opposite == 0.0 {
            return Step::Vertex(opposite);
        }
        // The vertex to the left of the way leaves the side to its right open.
        side = if of_opposite > 0.0 { (entered + 1) % 3 } else { (entered + 2) % 3 };
        triangle = next;
    }
    Step::Blocked
}
