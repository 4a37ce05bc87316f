//! The order of cells, and the way through each, with short ways between them.

use super::cells::Cell;
use crate::plan::search_plan::{Look, Mover};
use crate::plan::turning::{Piece, Pose, words};
use std::collections::BTreeMap;

/// Up to so many cells, the best of all orders is found.
const CELLS_EXACT: usize = 9;

/// Up to so many cells, ways between them are measured around zones; of more, straight.
const CELLS_MEASURED: usize = 16;

/// How many ways between cells may be looked at to improve an order.
const BUDGET: usize = 20_000_000;

/// How far it is to where no way leads, in metres: such a cell comes last.
const FAR_M: f64 = 1e9;

/// Ways through cells, and how far it is from one to the next.
struct Ways {
    pieces: Vec<Vec<Piece>>,
    /// The ways of each cell.
    of: Vec<std::ops::Range<usize>>,
    /// From the end of a way to the beginning of another, in metres.
    between: Vec<Vec<f64>>,
    /// To the beginning of each way, in metres.
    first: Vec<f64>,
}

impl Ways {
    fn new(mover: Mover<'_>, look: &Look, start: Option<Pose>, cells: &[Cell]) -> Self {
        let (mut pieces, mut of) = (Vec::new(), Vec::new());
        for cell in cells {
            let ways = cell.ways();
            of.push(pieces.len()..pieces.len() + ways.len());
            pieces.extend(ways);
        }
        let mut measure = Measure { mover, is_exact: cells.len() <= CELLS_MEASURED, known: BTreeMap::new() };
        let begins: Vec<Pose> = pieces.iter().map(|way: &Vec<Piece>| look.track(&way[0]).pose(0.0)).collect();
        let ends: Vec<Pose> = pieces.iter().map(|way| look.track(&way[way.len() - 1]).pose(1.0)).collect();
        let first = begins.iter().map(|&to| start.map_or(0.0, |from| measure.metres(from, to))).collect();
        let between =
            ends.iter().map(|&from| begins.iter().map(|&to| measure.metres(from, to)).collect()).collect();
        Self { pieces, of, between, first }
    }

    /// The best ways through cells in this order, and how far it is between them.
    fn along(&self, order: &[usize]) -> (f64, Vec<usize>) {
        let mut best: Vec<(f64, usize)> = Vec::new();
        let mut stages = Vec::with_capacity(order.len());
        for (stage, &cell) in order.iter().enumerate() {
            let reach = |way: usize| {
                if stage == 0 {
                    return (self.first[way], 0);
                }
                let former = self.of[order[stage - 1]].clone();
                let through =
                    former.zip(&best).map(|(from, (metres, _))| (metres + self.between[from][way], from));
                through.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::INFINITY, 0))
            };
            best = self.of[cell].clone().map(reach).collect();
            stages.push(best.clone());
        }
        let Some((at, &(metres, _))) = best.iter().enumerate().min_by(|a, b| a.1.0.total_cmp(&b.1.0)) else {
            return (0.0, Vec::new());
        };
        let mut way = self.of[order[order.len() - 1]].start + at;
        let mut ways = vec![way];
        for stage in (1..order.len()).rev() {
            way = stages[stage][way - self.of[order[stage]].start].1;
            ways.push(way);
        }
        ways.reverse();
        (metres, ways)
    }

    /// The best of all orders: over sets of cells and the way through the last.
    fn exact(&self) -> Vec<usize> {
        let (cells, ways) = (self.of.len(), self.pieces.len());
        let sets = 1_usize << cells;
        let mut best = vec![(f64::INFINITY, usize::MAX); sets * ways];
        let cell_of: Vec<usize> =
            self.of.iter().enumerate().flat_map(|(cell, ways)| ways.clone().map(move |_| cell)).collect();
        for way in 0..ways {
            best[(1 << cell_of[way]) * ways + way].0 = self.first[way];
        }
        for set in 1..sets {
            for way in (0..ways).filter(|way| set & (1 << cell_of[*way]) != 0) {
                let so_far = best[set * ways + way].0;
                for next in (0..ways).filter(|next| set & (1 << cell_of[*next]) == 0) {
                    let metres = so_far + self.between[way][next];
                    let slot = &mut best[(set | 1 << cell_of[next]) * ways + next];
                    if metres < slot.0 {
                        *slot = (metres, way);
                    }
                }
            }
        }
        let mut set = sets - 1;
        let last = (0..ways).min_by(|&a, &b| best[set * ways + a].0.total_cmp(&best[set * ways + b].0));
        let mut way = last.unwrap_or(usize::MAX);
        let mut found = Vec::new();
        while way != usize::MAX {
            found.push(way);
            let former = best[set * ways + way].1;
            set &= !(1 << cell_of[way]);
            way = former;
        }
        found.reverse();
        found
    }

    /// The nearest cell next, then parts of the order turned around and moved while that helps.
    fn improved(&self) -> Vec<usize> {
        let cells = self.of.len();
        let mut order: Vec<usize> = Vec::with_capacity(cells);
        let mut at: Option<usize> = None;
        while order.len() < cells {
            let open = (0..cells).filter(|cell| !order.contains(cell));
            let reach = |way: usize| at.map_or(self.first[way], |at| self.between[at][way]);
            let ways = open.flat_map(|cell| self.of[cell].clone().map(move |way| (cell, way)));
            let Some((cell, way)) = ways.min_by(|a, b| reach(a.1).total_cmp(&reach(b.1))) else { break };
            order.push(cell);
            at = Some(way);
        }
        let (mut metres, mut ways) = self.along(&order);
        let mut left = BUDGET / (cells * 16);
        loop {
            let before = metres;
            for first in 0..cells {
                for last in first + 1..cells {
                    let mut turned = order.clone();
                    turned[first..=last].reverse();
                    let mut later = order.clone();
                    later[first..=last].rotate_left(1);
                    let mut sooner = order.clone();
                    sooner[first..=last].rotate_right(1);
                    for tried in [turned, later, sooner] {
                        if left == 0 {
                            return ways;
                        }
                        left -= 1;
                        let found = self.along(&tried);
                        if found.0 < metres - 1e-6 {
                            (metres, ways) = found;
                            order = tried;
                        }
                    }
                }
            }
            if metres >= before {
                return ways;
            }
        }
    }
}

/// How far it is from a pose to another.
struct Measure<'a> {
    mover: Mover<'a>,
    is_exact: bool,
    /// Ways around zones, by the bits of their ends.
    known: BTreeMap<[u64; 4], f64>,
}

impl Measure<'_> {
    fn metres(&mut self, from: Pose, to: Pose) -> f64 {
        let straight = (to.at.0 - from.at.0).hypot(to.at.1 - from.at.1);
        let mut metres = straight;
        if self.is_exact {
            let ends = [from.at.0, from.at.1, to.at.0, to.at.1].map(f64::to_bits);
            let way = || self.mover.space().route(from.at, to.at).map_or(FAR_M, |way| way.length_m);
            metres = *self.known.entry(ends).or_insert_with(way);
        }
        let radius = self.mover.radius_m();
        if radius > 0.0 {
            let turning = words(from, to, radius).into_iter().map(|word| word.length_m);
            metres = metres.max(turning.fold(f64::INFINITY, f64::min));
        }
        metres
    }
}

/// The sweeps of all cells, in the order in which they are swept.
pub(super) fn ordered(mover: Mover<'_>, look: &Look, start: Option<Pose>, cells: Vec<Cell>) -> Vec<Piece> {
    if cells.is_empty() {
        return Vec::new();
    }
    let ways = Ways::new(mover, look, start, &cells);
    let chosen = if cells.len() <= CELLS_EXACT { ways.exact() } else { ways.improved() };
    chosen.into_iter().flat_map(|way| ways.pieces[way].clone()).collect()
}
