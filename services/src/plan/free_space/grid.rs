//! Polygons on a grid of whole numbers, where unions and differences are exact: cells of 1/1024 m.

use super::Point;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay::{Overlay, ShapeType};
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::i_float::int::point::IntPoint;

/// Cells in a metre.
const CELLS: f64 = 1024.0;

/// How far from the origin places may be, in metres: half of what the numbers hold, so that what is around still fits.
const FARTHEST_M: f64 = 1_000_000.0;

/// A cell.
pub(in crate::plan) type Cell = IntPoint<i32>;

/// An outline of cells.
pub(in crate::plan) type Ring = Vec<Cell>;

/// Whether a place is on the grid.
pub(in crate::plan) fn fits(place: Point) -> bool {
    place.0.abs() <= FARTHEST_M && place.1.abs() <= FARTHEST_M
}

/// The nearest cell.
pub(in crate::plan) fn cell(place: Point) -> Cell {
    IntPoint::new((place.0 * CELLS).round() as i32, (place.1 * CELLS).round() as i32)
}

/// The place of a cell: exact.
pub(in crate::plan) fn place(cell: Cell) -> Point {
    (f64::from(cell.x) / CELLS, f64::from(cell.y) / CELLS)
}

/// What is in any of these outlines: outlines, each anticlockwise around its area, holes clockwise.
pub(in crate::plan) fn union(rings: &[Ring]) -> Vec<Ring> {
    combine(rings, &[], OverlayRule::Subject)
}

/// What is in one of the first outlines and in none of the others.
pub(in crate::plan) fn difference(rings: &[Ring], without: &[Ring]) -> Vec<Ring> {
    combine(rings, without, OverlayRule::Difference)
}

/// What is in both.
pub(in crate::plan) fn intersection(rings: &[Ring], with: &[Ring]) -> Vec<Ring> {
    combine(rings, with, OverlayRule::Intersect)
}

/// The connected parts of what is in one of the first outlines and in none of the others: each its outline and its holes.
pub(in crate::plan) fn difference_parts(rings: &[Ring], without: &[Ring]) -> Vec<Vec<Ring>> {
    parts(rings, without, OverlayRule::Difference)
}

/// The connected parts of what is in both.
pub(in crate::plan) fn intersection_parts(rings: &[Ring], with: &[Ring]) -> Vec<Vec<Ring>> {
    parts(rings, with, OverlayRule::Intersect)
}

/// What outlines enclose, holes left out, in square metres.
pub(in crate::plan) fn area_m2(rings: &[Ring]) -> f64 {
    let twice: i128 = rings.iter().map(twice_area).sum();
    twice as f64 / (2.0 * CELLS * CELLS)
}

/// Twice the signed area of an outline, in cells: above 0 where it is anticlockwise.
fn twice_area(ring: &Ring) -> i128 {
    let twice = |pair: (&Cell, &Cell)| {
        i128::from(pair.0.x) * i128::from(pair.1.y) - i128::from(pair.0.y) * i128::from(pair.1.x)
    };
    ring.iter().zip(ring.iter().cycle().skip(1)).map(twice).sum()
}

fn combine(subject: &[Ring], clip: &[Ring], rule: OverlayRule) -> Vec<Ring> {
    parts(subject, clip, rule).into_iter().flatten().collect()
}

fn parts(subject: &[Ring], clip: &[Ring], rule: OverlayRule) -> Vec<Vec<Ring>> {
    let count = subject.iter().chain(clip).map(Vec::len).sum();
    let mut overlay = Overlay::<i32>::new(count);
    subject.iter().for_each(|ring| overlay.add_contour(ring, ShapeType::Subject));
    clip.iter().for_each(|ring| overlay.add_contour(ring, ShapeType::Clip));
    overlay.overlay(rule, FillRule::NonZero)
}

/// The outline anticlockwise.
pub(in crate::plan) fn anticlockwise(mut ring: Ring) -> Ring {
    if twice_area(&ring) < 0 {
        ring.reverse();
    }
    ring
}
