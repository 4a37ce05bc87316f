//! The shortest way by exact predicates alone: slow, for where rounding has misled the fast search.

use super::Point;
use super::mesh::Mesh;
use super::search::distance;
use super::verify;

/// The vertices at which the shortest way turns, by trying at each what it sees.
pub(super) fn shortest(mesh: &Mesh, start: (Point, &[u32]), goal: Point) -> Option<Vec<u32>> {
    if verify::is_free(mesh, start, goal) {
        return Some(Vec::new());
    }
    let count = mesh.points.len();
    let mut lengths = vec![f64::INFINITY; count];
    let mut former: Vec<Option<u32>> = vec![None; count];
    let mut done = vec![false; count];
    for vertex in (0..count).filter(|&vertex| mesh.corner[vertex]) {
        if verify::is_free(mesh, start, mesh.points[vertex]) {
            lengths[vertex] = distance(start.0, mesh.points[vertex]);
        }
    }
    loop {
        let open = (0..count).filter(|&vertex| !done[vertex] && lengths[vertex].is_finite());
        let rated = |vertex: usize| lengths[vertex] + distance(mesh.points[vertex], goal);
        let at = open.min_by(|&a, &b| rated(a).total_cmp(&rated(b)))?;
        done[at] = true;
        let free: Vec<u32> =
            mesh.around(at as u32).iter().copied().filter(|&triangle| mesh.is_free(triangle)).collect();
        let here = (mesh.points[at], free.as_slice());
        if verify::is_free(mesh, here, goal) {
            let mut turns = vec![at as u32];
            while let Some(before) = former[turns[turns.len() - 1] as usize] {
                turns.push(before);
            }
            turns.reverse();
            return Some(turns);
        }
        for next in (0..count).filter(|&next| mesh.corner[next]) {
            let length = lengths[at] + distance(here.0, mesh.points[next]);
            if length < lengths[next] && verify::is_free(mesh, here, mesh.points[next]) {
                lengths[next] = length;
                former[next] = Some(at as u32);
            }
        }
    }
}
