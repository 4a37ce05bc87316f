//! Searches along lines and arcs: what a sensor sweeps, how much of an area that is, and the ways from one to the next.

mod fly;
pub(super) mod swept;

pub(super) use fly::{clear_parts, fly, turns_out};

use super::free_space::grid::{self, Ring};
use super::free_space::{self, Boundary, FreeSpace, SpaceError, Zone, ZoneKind};
use super::sensor::Footprint;
use super::turning::{Piece, Pose, TurningError, TurningSpace};

/// What a sensor covers at a time: a line across the track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// How wide it is, in metres.
    pub width_m: f64,
    /// How far ahead of the vehicle it lies, in metres.
    pub ahead_m: f64,
}

impl Look {
    /// The middle of a footprint.
    pub fn of(footprint: &Footprint) -> Self {
        Self { width_m: footprint.width_center_m, ahead_m: footprint.to_center_m }
    }

    /// Where the vehicle is while it sweeps along a piece. Along arcs the sensor looks straight down.
    pub fn track(&self, piece: &Piece) -> Piece {
        match *piece {
            Piece::Line { from, to } if self.ahead_m != 0.0 => {
                let (sine, cosine) = piece.pose(0.0).heading_rad.sin_cos();
                let behind = |at: (f64, f64)| (at.0 - cosine * self.ahead_m, at.1 - sine * self.ahead_m);
                Piece::Line { from: behind(from), to: behind(to) }
            }
            piece => piece,
        }
    }

    /// The most metres from one lane to the next.
    ///
    /// # Errors
    /// A width or an overlap that is none.
    pub(super) fn spacing_m(&self, overlap: f64) -> Result<f64, SearchError> {
        if !(self.width_m > 0.0 && self.width_m <= WIDTH_MAX_M) {
            return Err(SearchError::Width(self.width_m));
        }
        if self.ahead_m.is_nan() || self.ahead_m.abs() > WIDTH_MAX_M {
            return Err(SearchError::Ahead(self.ahead_m));
        }
        if !(0.0..1.0).contains(&overlap) {
            return Err(SearchError::Overlap(overlap));
        }
        Ok(self.width_m * (1.0 - overlap))
    }
}

/// The widest look, and the farthest ahead, in metres: beyond, no sensor of a vehicle sees.
const WIDTH_MAX_M: f64 = 100_000.0;

/// Where a vehicle moves, and how it turns.
#[derive(Debug, Clone, Copy)]
pub enum Mover<'a> {
    /// It turns on the spot.
    OnTheSpot(&'a FreeSpace),
    /// It turns no tighter than a radius.
    Turning(&'a TurningSpace),
}

impl<'a> Mover<'a> {
    /// Where it may be.
    pub fn space(&self) -> &'a FreeSpace {
        match self {
            Self::OnTheSpot(space) => space,
            Self::Turning(space) => space.space(),
        }
    }

    /// The radius of its tightest turn, in metres: 0 on the spot.
    pub fn radius_m(&self) -> f64 {
        match self {
            Self::OnTheSpot(_) => 0.0,
            Self::Turning(space) => space.radius_m(),
        }
    }

    /// The way from a pose to another.
    ///
    /// # Errors
    /// Why there is none.
    pub fn way(&self, from: Pose, to: Pose) -> Result<Vec<Piece>, TurningError> {
        match self {
            Self::OnTheSpot(space) => {
                let points = space.route(from.at, to.at)?.points;
                let line = |pair: &[(f64, f64)]| Piece::Line { from: pair[0], to: pair[1] };
                Ok(points.windows(2).filter(|pair| pair[0] != pair[1]).map(line).collect())
            }
            Self::Turning(space) => Ok(space.route(from, to)?.pieces),
        }
    }
}

/// How much of an area was asked for, can be searched, and is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coverage {
    /// The area as it was asked for, in square metres.
    pub asked_m2: f64,
    /// What of it lies in free space and can be reached.
    pub free_m2: f64,
    /// What of it lies in free space, but where no way leads.
    pub cut_off_m2: f64,
    /// What is swept of the free area that can be reached.
    pub swept_m2: f64,
}

impl Coverage {
    /// The share of the free area that is swept, from 0 to 1.
    pub fn share(&self) -> f64 {
        if self.free_m2 > 0.0 { self.swept_m2 / self.free_m2 } else { 0.0 }
    }
}

/// A search.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchPlan {
    /// What is swept, piece by piece in order.
    pub swept: Vec<Piece>,
    /// Where the vehicle moves: along what it sweeps, and from one to the next.
    pub pieces: Vec<Piece>,
    /// How long its way is, in metres.
    pub length_m: f64,
    /// How much is searched.
    pub coverage: Coverage,
    /// How many pieces are left out, because the vehicle cannot turn into them.
    pub left_out: usize,
}

/// Why there is no search.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SearchError {
    /// A width that is none.
    #[error("a look of {0} m across is none: it must be above 0 m and at most 100 km")]
    Width(f64),
    /// Too far ahead.
    #[error("a look {0} m ahead is none: it must be within 100 km; look down more steeply")]
    Ahead(f64),
    /// An overlap that is none.
    #[error("an overlap of {0} is none: it must be 0 or more and below 1")]
    Overlap(f64),
    /// A direction that is none.
    #[error("a direction of {0} is none")]
    Direction(f64),
    /// An extent that is none.
    #[error("an extent of {0} m is none: it must be above 0 m")]
    Extent(f64),
    /// An outline that is none.
    #[error("the area to search: {0}")]
    Area(SpaceError),
    /// More than can be planned.
    #[error("{lanes} lanes are too many, {most} are the limit: search a smaller area, or look wider")]
    TooManyLanes {
        /// How many there would be.
        lanes: u64,
        /// How many may be.
        most: u64,
    },
    /// No place in it may be entered.
    #[error("nothing of the area is in free space")]
    NothingFree,
    /// No part of it can be swept.
    #[error("no part of the area is wide enough to sweep it: turn tighter, or look less far ahead")]
    NothingSwept,
    /// The start lies where it may not.
    #[error(transparent)]
    Start(#[from] TurningError),
}

/// At which shares of a part's height a place inside is looked for.
const HEIGHTS: [f64; 5] = [0.503, 0.257, 0.751, 0.061, 0.941];

/// A place inside a part, in the middle of where a line across meets it. The part's corners will not do: where outlines cross,
/// they are rounded to the grid, and may be a hair outside.
fn inner(part: &[Ring], space: &FreeSpace) -> Option<(f64, f64)> {
    let rings: Vec<Vec<_>> =
        part.iter().map(|ring| ring.iter().map(|&cell| grid::place(cell)).collect()).collect();
    let heights = || rings.iter().flatten().map(|at: &(f64, f64)| at.1);
    let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
    HEIGHTS.into_iter().find_map(|share| {
        let height = low + (high - low) * share;
        let sides = rings.iter().flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1)));
        let mut crossings: Vec<f64> = sides
            .filter(|(a, b)| (a.1 <= height) != (b.1 <= height))
            .map(|(a, b)| a.0 + (b.0 - a.0) * (height - a.1) / (b.1 - a.1))
            .collect();
        crossings.sort_by(f64::total_cmp);
        let middles = crossings.chunks_exact(2).map(|pair| (f64::midpoint(pair[0], pair[1]), height));
        middles.into_iter().find(|place| space.contains(*place))
    })
}

/// An area on the grid: all of it, and its parts in free space that can be reached.
pub(super) struct Target {
    asked_m2: f64,
    cut_off_m2: f64,
    /// Outlines, holes too.
    pub(super) rings: Vec<Ring>,
}

impl Target {
    /// The area within an outline, as far as a way leads there from the start; without a start, from its largest free part.
    pub(super) fn new(area: &Boundary, space: &FreeSpace, start: Option<Pose>) -> Result<Self, SearchError> {
        // Of this kind, a circle's polygon lies around it.
        let zone = Zone::new(0, ZoneKind::KeepOut, area.clone());
        let asked = free_space::outline(&zone).map_err(|error| match error {
            SpaceError::Zone { what, .. } => SearchError::Area(SpaceError::Zone { zone: 0, what }),
            other => SearchError::Area(other),
        })?;
        let mut parts = grid::intersection_parts(&asked, space.rings());
        parts.sort_by(|a, b| grid::area_m2(b).total_cmp(&grid::area_m2(a)));
        let from = match start {
            Some(start) => start.at,
            None => parts.iter().find_map(|part| inner(part, space)).ok_or(SearchError::NothingFree)?,
        };
        if start.is_some() {
            // The start's own faults are told as such.
            space.route(from, from).map_err(TurningError::Route)?;
        }
        let is_reached = |part: &[Ring]| inner(part, space).is_some_and(|to| space.route(from, to).is_ok());
        let (reached, cut_off): (Vec<_>, Vec<_>) = parts.into_iter().partition(|part| is_reached(part));
        if reached.is_empty() {
            return Err(SearchError::NothingFree);
        }
        let area_m2 = |parts: &[Vec<Ring>]| parts.iter().map(|part| grid::area_m2(part)).sum::<f64>();
        let (asked_m2, cut_off_m2) = (grid::area_m2(&asked), area_m2(&cut_off));
        Ok(Self { asked_m2, cut_off_m2, rings: reached.into_iter().flatten().collect() })
    }

    /// How much of it is swept along these pieces.
    pub(super) fn coverage(&self, swept: &[Piece], width_m: f64) -> Coverage {
        let outlines: Vec<Ring> = swept.iter().flat_map(|piece| swept::outlines(piece, width_m)).collect();
        Coverage {
            asked_m2: self.asked_m2,
            free_m2: grid::area_m2(&self.rings),
            cut_off_m2: self.cut_off_m2,
            swept_m2: grid::area_m2(&grid::intersection(&self.rings, &outlines)),
        }
    }
}
