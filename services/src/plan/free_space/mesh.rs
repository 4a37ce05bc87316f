//! Free space as triangles.

use super::grid::{Cell, Ring, place};
use super::{Point, SpaceError};
use robust::{Coord, orient2d};
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
use std::collections::BTreeMap;

/// No triangle.
pub(super) const NONE: u32 = u32::MAX;

/// Twice the signed area of a triangle, its sign exact: above 0 where `c` is left of the way from `a` to `b`.
pub(super) fn orient(a: Point, b: Point, c: Point) -> f64 {
    let coord = |point: Point| Coord { x: point.0, y: point.1 };
    orient2d(coord(a), coord(b), coord(c))
}

/// Triangles over all places, some of them free.
#[derive(Debug, Clone)]
pub(super) struct Mesh {
    /// Where the vertices are.
    pub points: Vec<Point>,
    /// The vertices of each triangle, anticlockwise.
    pub triangles: Vec<[u32; 3]>,
    /// The triangle behind each side, which leads from the vertex of the same number to the next.
    pub behind: Vec<[u32; 3]>,
    /// The part of free space that each triangle is in; none where it is not free.
    pub part: Vec<Option<u32>>,
    /// Whether a shortest way may turn at each vertex.
    pub corner: Vec<bool>,
    /// The triangles around each vertex: where they begin in `around`.
    first: Vec<u32>,
    around: Vec<u32>,
}

impl Mesh {
    /// The triangles of what lies left of these outlines.
    ///
    /// # Errors
    /// That the outlines cross, which they never should.
    pub(super) fn new(rings: &[Ring]) -> Result<Self, SpaceError> {
        let mut index: BTreeMap<(i32, i32), usize> = BTreeMap::new();
        let mut points = Vec::new();
        let mut sides = Vec::new();
        let mut corner: Vec<bool> = Vec::new();
        let mut seen: Vec<bool> = Vec::new();
        let mut number = |cell: &Cell| {
            *index.entry((cell.x, cell.y)).or_insert_with(|| {
                points.push(place(*cell));
                points.len() - 1
            })
        };
        for ring in rings {
            let numbers: Vec<usize> = ring.iter().map(&mut number).collect();
            let count = numbers.len();
            for at in 0..count {
                let (before, here, after) =
                    (ring[(at + count - 1) % count], ring[at], ring[(at + 1) % count]);
                let number = numbers[at];
                corner.resize(corner.len().max(number + 1), false);
                seen.resize(corner.len(), false);
                // Where outlines touch, a way may turn on either side.
                corner[number] |= seen[number] || orient(place(before), place(here), place(after)) < 0.0;
                seen[number] = true;
                sides.push([number, numbers[(at + 1) % count]]);
            }
        }
        let vertices = points.iter().map(|point| Point2::new(point.0, point.1)).collect();
        let mut crossing = 0;
        let made =
            ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(vertices, sides, |_| {
                crossing += 1;
            });
        match made {
            Ok(made) if crossing == 0 && made.num_vertices() == points.len() => {
                Ok(Self::from_spade(&made, points, corner))
            }
            _ => Err(SpaceError::Degenerate),
        }
    }

    fn from_spade(
        made: &ConstrainedDelaunayTriangulation<Point2<f64>>,
        points: Vec<Point>,
        corner: Vec<bool>,
    ) -> Self {
        let vertex = |handle: FixedVertexHandle| handle.index() as u32;
        let count = made.num_inner_faces();
        let (mut triangles, mut behind) = (vec![[0; 3]; count], vec![[NONE; 3]; count]);
        let mut walls = vec![[false; 3]; count];
        let mut place = vec![NONE; made.num_all_faces()];
        for (at, face) in made.inner_faces().enumerate() {
            place[face.index()] = at as u32;
        }
        for (at, face) in made.inner_faces().enumerate() {
            for (side, edge) in face.adjacent_edges().into_iter().enumerate() {
                triangles[at][side] = vertex(edge.from().fix());
                behind[at][side] = place[edge.rev().face().index()];
                walls[at][side] = edge.is_constraint_edge();
            }
        }
        let part = parts(&behind, &walls);
        let (first, around) = around(&triangles, points.len());
        Self { points, triangles, behind, part, corner, first, around }
    }

    /// The places of a triangle's vertices.
    pub(super) fn corners(&self, triangle: u32) -> [Point; 3] {
        self.triangles[triangle as usize].map(|vertex| self.points[vertex as usize])
    }

    /// The triangles around a vertex.
    pub(super) fn around(&self, vertex: u32) -> &[u32] {
        let (from, to) = (self.first[vertex as usize], self.first[vertex as usize + 1]);
        &self.around[from as usize..to as usize]
    }

    /// Whether a triangle is free.
    pub(super) fn is_free(&self, triangle: u32) -> bool {
        triangle != NONE && self.part[triangle as usize].is_some()
    }

    /// Whether a place is in a triangle or on its border.
    pub(super) fn holds(&self, triangle: u32, place: Point) -> bool {
        let [a, b, c] = self.corners(triangle);
        orient(a, b, place) >= 0.0 && orient(b, c, place) >= 0.0 && orient(c, a, place) >= 0.0
    }
}

/// The part of free space of each triangle: free is what lies behind an odd number of walls.
fn parts(behind: &[[u32; 3]], walls: &[[bool; 3]]) -> Vec<Option<u32>> {
    let mut free: Vec<Option<bool>> = vec![None; behind.len()];
    let mut open = Vec::new();
    for (at, sides) in behind.iter().enumerate() {
        for (side, _) in sides.iter().enumerate().filter(|(_, other)| **other == NONE) {
            if free[at].is_none() {
                free[at] = Some(walls[at][side]);
                open.push(at);
            }
        }
    }
    while let Some(at) = open.pop() {
        for side in 0..3 {
            let other = behind[at][side] as usize;
            if behind[at][side] != NONE && free[other].is_none() {
                free[other] = free[at].map(|free| free != walls[at][side]);
                open.push(other);
            }
        }
    }
    let mut part = vec![None; behind.len()];
    let mut count = 0;
    for start in 0..behind.len() {
        if free[start] != Some(true) || part[start].is_some() {
            continue;
        }
        part[start] = Some(count);
        open.push(start);
        while let Some(at) = open.pop() {
            for (side, &other) in behind[at].iter().enumerate() {
                let reached = other != NONE && !walls[at][side] && part[other as usize].is_none();
                if reached {
                    part[other as usize] = Some(count);
                    open.push(other as usize);
                }
            }
        }
        count += 1;
    }
    part
}

/// The triangles around each vertex, one vertex after the other.
fn around(triangles: &[[u32; 3]], vertices: usize) -> (Vec<u32>, Vec<u32>) {
    let mut first = vec![0_u32; vertices + 1];
    triangles.iter().flatten().for_each(|&vertex| first[vertex as usize + 1] += 1);
    for vertex in 0..vertices {
        first[vertex + 1] += first[vertex];
    }
    let mut next = first.clone();
    let mut around = vec![0; triangles.len() * 3];
    for (at, triangle) in triangles.iter().enumerate() {
        for &vertex in triangle {
            around[next[vertex as usize] as usize] = at as u32;
            next[vertex as usize] += 1;
        }
    }
    (first, around)
}
