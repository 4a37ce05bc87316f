//! The shortest way between two places, by search over intervals of sides that are seen from one point: Polyanya, by Cui,
//! Harabor and Grastien (2017), over triangles.

use super::Point;
use super::mesh::{Mesh, orient};
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

/// The start, among vertices.
const START: u32 = u32::MAX;

/// An end of an interval: a vertex, or a place between two.
#[derive(Debug, Clone, Copy)]
struct End {
    at: Point,
    vertex: Option<u32>,
}

/// A part of a side of a triangle that is seen from a root, to be entered.
#[derive(Debug, Clone, Copy)]
struct Interval {
    root: u32,
    /// The length of the way to the root.
    length: f64,
    triangle: u32,
    side: u8,
    left: End,
    right: End,
    parent: u32,
    /// Whether the way is complete: the goal is seen from the root.
    is_goal: bool,
}

/// What to look at next: the least possible length, then the first made.
#[derive(PartialEq)]
struct Next(f64, u32);

impl Eq for Next {}

impl Ord for Next {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0).then(self.1.cmp(&other.1))
    }
}

impl PartialOrd for Next {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// A search under way.
pub(super) struct Search<'a> {
    mesh: &'a Mesh,
    start: Point,
    goal: Point,
    goals: &'a [u32],
    intervals: Vec<Interval>,
    open: BinaryHeap<Reverse<Next>>,
    /// The shortest way to each vertex so far.
    shortest: Vec<f64>,
}

pub(super) fn distance(a: Point, b: Point) -> f64 {
    (b.0 - a.0).hypot(b.1 - a.1)
}

/// Where the line through `a` and `b` meets that through `c` and `d`.
fn meeting(a: Point, b: Point, c: Point, d: Point) -> Point {
    let (x, y) = (b.0 - a.0, b.1 - a.1);
    let from = x * (c.1 - a.1) - y * (c.0 - a.0);
    let to = x * (d.1 - a.1) - y * (d.0 - a.0);
    let share = if from == to { 0.0 } else { (from / (from - to)).clamp(0.0, 1.0) };
    (c.0 + (d.0 - c.0) * share, c.1 + (d.1 - c.1) * share)
}

/// The vertices at which the shortest way turns, or none where there is no way. `starts` and `goals` are the free triangles that
/// hold the places.
pub(super) fn shortest(
    mesh: &Mesh,
    (start, starts): (Point, &[u32]),
    (goal, goals): (Point, &[u32]),
) -> Option<Vec<u32>> {
    if starts.iter().any(|triangle| goals.contains(triangle)) {
        return Some(Vec::new());
    }
    let shortest = vec![f64::INFINITY; mesh.points.len()];
    let (intervals, open) = (Vec::new(), BinaryHeap::new());
    let mut search = Search { mesh, start, goal, goals, intervals, open, shortest };
    for &triangle in starts {
        let corners = mesh.corners(triangle);
        for side in 0..3 {
            let (a, b) = (corners[side], corners[(side + 1) % 3]);
            // A side that the start is on is behind it in the neighbour, which holds it too.
            if orient(a, b, start) > 0.0 {
                let vertices = mesh.triangles[triangle as usize];
                let (right, left) = (vertices[side], vertices[(side + 1) % 3]);
                search.cross(triangle, side, START, 0.0, search.vertex(left), search.vertex(right), u32::MAX);
            }
        }
    }
    search.run()
}

impl Search<'_> {
    fn vertex(&self, vertex: u32) -> End {
        End { at: self.mesh.points[vertex as usize], vertex: Some(vertex) }
    }

    fn place(&self, root: u32) -> Point {
        if root == START { self.start } else { self.mesh.points[root as usize] }
    }

    fn run(&mut self) -> Option<Vec<u32>> {
        while let Some(Reverse(Next(_, at))) = self.open.pop() {
            let interval = self.intervals[at as usize];
            if interval.is_goal {
                return Some(self.turns(at));
            }
            if interval.root != START && interval.length > self.shortest[interval.root as usize] {
                continue;
            }
            if self.goals.contains(&interval.triangle) {
                self.finish(&interval, at);
            }
            self.enter(&interval, at);
        }
        None
    }

    /// The roots from the start to an interval.
    fn turns(&self, at: u32) -> Vec<u32> {
        let mut turns: Vec<u32> = Vec::new();
        let mut next = at;
        while let Some(interval) = self.intervals.get(next as usize) {
            if interval.root != START && turns.last() != Some(&interval.root) {
                turns.push(interval.root);
            }
            next = interval.parent;
        }
        turns.reverse();
        turns
    }

    /// The goal is in the triangle behind an interval.
    fn finish(&mut self, interval: &Interval, parent: u32) {
        let root = self.place(interval.root);
        let sees_left = orient(root, interval.left.at, self.goal) <= 0.0;
        let sees_right = orient(root, interval.right.at, self.goal) >= 0.0;
        let on_root = |end: End| end.vertex.is_some() && end.vertex == Some(interval.root);
        let (turn, length) = match (sees_left, sees_right) {
            _ if on_root(interval.left) || on_root(interval.right) => (interval.root, interval.length),
            (true, true) => (interval.root, interval.length),
            (false, _) => match self.turn(interval, interval.left) {
                Some(turn) => turn,
                None => return,
            },
            (true, false) => match self.turn(interval, interval.right) {
                Some(turn) => turn,
                None => return,
            },
        };
        let whole = length + distance(self.place(turn), self.goal);
        let goal = Interval { root: turn, length, parent, is_goal: true, ..*interval };
        self.push(goal, whole);
    }

    /// The way to an end of an interval, where a way may turn there and none is shorter.
    fn turn(&self, interval: &Interval, end: End) -> Option<(u32, f64)> {
        let vertex = end.vertex.filter(|&vertex| self.mesh.corner[vertex as usize])?;
        let length = interval.length + distance(self.place(interval.root), end.at);
        (length <= self.shortest[vertex as usize]).then_some((vertex, length))
    }

    /// What is seen behind an interval, and what is behind its ends.
    fn enter(&mut self, interval: &Interval, parent: u32) {
        let side = usize::from(interval.side);
        let vertices = self.mesh.triangles[interval.triangle as usize];
        // Facing into the triangle, its first vertex is to the left.
        let [a, b, c] = [side, (side + 1) % 3, (side + 2) % 3].map(|at| self.vertex(vertices[at]));
        let (left_side, right_side) = ((side + 2) % 3, (side + 1) % 3);
        let (triangle, length, root) = (interval.triangle, interval.length, interval.root);
        if a.vertex == Some(root) || b.vertex == Some(root) {
            // From a vertex all of its triangle is seen.
            self.cross(triangle, left_side, root, length, a, c, parent);
            self.cross(triangle, right_side, root, length, c, b, parent);
            return;
        }
        let (from, left, right) = (self.place(root), interval.left, interval.right);
        let (of_left, of_right) = (orient(from, left.at, c.at), orient(from, right.at, c.at));
        let between = |end: End, p: End, q: End| End { at: meeting(from, end.at, p.at, q.at), vertex: None };
        // Where the looks past both ends meet the far sides: the left one from `a` to `c`, the right one from `c` to `b`.
        let left_end = match of_left.total_cmp(&0.0) {
            _ if of_left == 0.0 => c,
            Ordering::Less if left.vertex == a.vertex => a,
            Ordering::Less => between(left, a, c),
            _ => between(left, c, b),
        };
        let right_end = match of_right.total_cmp(&0.0) {
            _ if of_right == 0.0 => c,
            Ordering::Greater if right.vertex == b.vertex => b,
            Ordering::Greater => between(right, c, b),
            _ => between(right, a, c),
        };
        let (left_first, right_last) = (of_left < 0.0, of_right > 0.0);
        if left_first {
            let end = if right_last { c } else { right_end };
            self.cross(triangle, left_side, root, length, left_end, end, parent);
        }
        if right_last {
            let begin = if left_first { c } else { left_end };
            self.cross(triangle, right_side, root, length, begin, right_end, parent);
        }
        if let (false, Some((turn, length))) = (left_first, self.turn_at(interval, left, a)) {
            self.cross(triangle, left_side, turn, length, a, c, parent);
            if of_left > 0.0 {
                self.cross(triangle, right_side, turn, length, c, left_end, parent);
            }
        }
        if let (false, Some((turn, length))) = (right_last, self.turn_at(interval, right, b)) {
            self.cross(triangle, right_side, turn, length, c, b, parent);
            if of_right < 0.0 {
                self.cross(triangle, left_side, turn, length, right_end, c, parent);
            }
        }
    }

    /// The way to an end of an interval that is a vertex of its side.
    fn turn_at(&mut self, interval: &Interval, end: End, vertex: End) -> Option<(u32, f64)> {
        if end.vertex.is_none() || end.vertex != vertex.vertex {
            return None;
        }
        let (turn, length) = self.turn(interval, end)?;
        self.shortest[turn as usize] = length;
        Some((turn, length))
    }

    /// Makes the interval on a side of a triangle, seen from within it, into one of the triangle behind.
    #[expect(clippy::too_many_arguments, reason = "the parts of an interval, which has no other maker")]
    fn cross(&mut self, from: u32, side: usize, root: u32, length: f64, left: End, right: End, parent: u32) {
        let triangle = self.mesh.behind[from as usize][side];
        if !self.mesh.is_free(triangle) || left.at == right.at {
            return;
        }
        let Some(side) = self.mesh.behind[triangle as usize].iter().position(|&other| other == from) else {
            return;
        };
        let interval =
            Interval { root, length, triangle, side: side as u8, left, right, parent, is_goal: false };
        let least = length + self.least(self.place(root), &interval);
        self.push(interval, least);
    }

    /// The least way from a root through an interval to the goal.
    fn least(&self, root: Point, interval: &Interval) -> f64 {
        let (left, right) = (interval.left.at, interval.right.at);
        let side = (right.0 - left.0, right.1 - left.1);
        let above = |point: Point| side.0 * (point.1 - left.1) - side.1 * (point.0 - left.0);
        // A goal on the root's side is seen in the mirror of the interval.
        let of_goal = above(self.goal);
        let goal = if of_goal < 0.0 {
            let twice = 2.0 * of_goal / (side.0 * side.0 + side.1 * side.1);
            (self.goal.0 + side.1 * twice, self.goal.1 - side.0 * twice)
        } else {
            self.goal
        };
        let turn = |a: Point, b: Point| (b.0 - a.0) * (goal.1 - a.1) - (b.1 - a.1) * (goal.0 - a.0);
        if turn(root, left) > 0.0 {
            distance(root, left) + distance(left, goal)
        } else if turn(root, right) < 0.0 {
            distance(root, right) + distance(right, goal)
        } else {
            distance(root, goal)
        }
    }

    fn push(&mut self, interval: Interval, least: f64) {
        self.open.push(Reverse(Next(least, self.intervals.len() as u32)));
        self.intervals.push(interval);
    }
}
