//! Cells: lanes side by side that are swept one after the other, to and fro.

use super::line::Leg;
use crate::plan::turning::Piece;

/// A cell: its sweeps from one side to the other, all in the same direction.
#[derive(Debug, Clone, Default)]
pub(super) struct Cell {
    legs: Vec<Leg>,
}

impl Cell {
    /// A cell of one sweep.
    pub(super) fn single(leg: Leg) -> Self {
        Self { legs: vec![leg] }
    }

    /// The ways through it: from either side, each begun in either direction.
    pub(super) fn ways(&self) -> Vec<Vec<Piece>> {
        let forth: Vec<Piece> = self.legs.iter().map(Leg::piece).collect();
        let back: Vec<Piece> = forth.iter().rev().copied().collect();
        let orders = if forth.len() == 1 { vec![forth] } else { vec![forth, back] };
        let alternately = |order: &[Piece], odd: usize| {
            let turned = |(at, piece): (usize, &Piece)| if at % 2 == odd { piece.back() } else { *piece };
            order.iter().enumerate().map(turned).collect::<Vec<_>>()
        };
        orders.iter().flat_map(|order| [0, 1].map(|odd| alternately(order, odd))).collect()
    }
}

/// The cells of lanes. A sweep goes on the cell of one in the lane before if both have no other beside them.
pub(super) fn cells(lanes: &[Vec<Leg>]) -> Vec<Cell> {
    let mut cells: Vec<Cell> = Vec::new();
    // The cell of each sweep in the lane before.
    let mut before: Vec<usize> = Vec::new();
    for (number, lane) in lanes.iter().enumerate() {
        let former: &[Leg] = if number == 0 { &[] } else { &lanes[number - 1] };
        let beside = |leg: &Leg, others: &[Leg]| {
            let overlaps = |other: &Leg| other.span.0 < leg.span.1 && leg.span.0 < other.span.1;
            (0..others.len()).filter(|&at| overlaps(&others[at])).collect::<Vec<_>>()
        };
        let mut here = Vec::new();
        for leg in lane {
            let one = match beside(leg, former)[..] {
                [one] if beside(&former[one], lane).len() == 1 => Some(before[one]),
                _ => None,
            };
            let cell = one.unwrap_or_else(|| {
                cells.push(Cell::default());
                cells.len() - 1
            });
            cells[cell].legs.push(*leg);
            here.push(cell);
        }
        before = here;
    }
    cells
}
