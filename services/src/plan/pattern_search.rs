//! Search around a place: in a spiral, in sectors, or in lanes.
//!
//! Where zones lie in the pattern, it is cut, and the vehicle goes around to the next part.

#[cfg(test)]
mod tests;

use super::free_space::{Boundary, Point};
use super::search_plan::{Look, Mover, SearchError, SearchPlan, Target, clear_parts, fly};
use super::turning::{Piece, Pose};
use std::f64::consts::PI;

/// How many lines or arcs a pattern may have.
const PIECES_MAX: u64 = 4_096;

/// How finely a pattern is cut at zones, in widths of the look.
const CUT: f64 = 0.1;

/// What the way looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pattern {
    /// From the middle outwards, in half circles that grow: for who was seen at the place a short time ago.
    Spiral,
    /// Across the place again and again, turned a little each time: for who is probably at the place.
    Sector,
    /// In lanes side by side: for who may be anywhere.
    Sweep,
}

/// How what lies around a place is searched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatternSearch {
    /// The way.
    pub pattern: Pattern,
    /// The place.
    pub center: Point,
    /// How far around it, in metres.
    pub extent_m: f64,
    /// What the sensor covers. Along spirals it looks straight down or to its sides.
    pub look: Look,
    /// Which share of its width neighbouring ways cover twice.
    pub overlap: f64,
    /// In which direction the pattern begins, in radians from the first axis towards the second.
    pub direction_rad: f64,
}

impl PatternSearch {
    /// The search, begun at a pose; without one, where the pattern begins.
    ///
    /// # Errors
    /// What is wrong with the request, or that nothing can be searched.
    pub fn plan(&self, mover: Mover<'_>, start: Option<Pose>) -> Result<SearchPlan, SearchError> {
        let pieces = self.pieces(mover.radius_m())?;
        let disc = Boundary::Circle { center: self.center, radius_m: self.extent_m };
        let target = Target::new(&disc, mover.space(), start)?;
        let step_m = CUT * self.look.width_m;
        let parts = pieces.iter().flat_map(|piece| clear_parts(mover, &self.look, piece, step_m));
        let flown = fly(mover, &self.look, start, parts);
        if flown.swept.is_empty() {
            return Err(SearchError::NothingSwept);
        }
        let coverage = target.coverage(&flown.swept, self.look.width_m);
        let length_m = flown.pieces.iter().map(Piece::length_m).sum();
        let (swept, pieces, left_out) = (flown.swept, flown.pieces, flown.left_out);
        Ok(SearchPlan { swept, pieces, length_m, coverage, left_out })
    }

    /// The lines and arcs of the pattern without regard to zones, for a vehicle that turns no tighter than a radius. A spiral
    /// begins with it; what lies within is crossed first, in a lane or more.
    ///
    /// # Errors
    /// What is wrong with the request.
    pub fn pieces(&self, turn_radius_m: f64) -> Result<Vec<Piece>, SearchError> {
        let spacing_m = self.look.spacing_m(self.overlap)?;
        if !(self.extent_m > 0.0 && self.extent_m.is_finite()) {
            return Err(SearchError::Extent(self.extent_m));
        }
        if !self.direction_rad.is_finite() {
            return Err(SearchError::Direction(self.direction_rad));
        }
        let lanes = match self.pattern {
            Pattern::Spiral => 2.0 * self.extent_m / spacing_m,
            Pattern::Sector => PI * self.extent_m / spacing_m,
            Pattern::Sweep => 2.0 * self.extent_m / spacing_m,
        };
        if lanes > PIECES_MAX as f64 {
            return Err(SearchError::TooManyLanes { lanes: lanes as u64, most: PIECES_MAX });
        }
        Ok(match self.pattern {
            Pattern::Spiral => self.spiral(spacing_m, turn_radius_m),
            Pattern::Sector => self.sectors(spacing_m),
            Pattern::Sweep => self.lanes(spacing_m, self.extent_m),
        })
    }

    /// The place so far along a direction from the middle, and so far to its left.
    fn at(&self, direction_rad: f64, along_m: f64, aside_m: f64) -> Point {
        let (sine, cosine) = direction_rad.sin_cos();
        (self.center.0 + cosine * along_m - sine * aside_m, self.center.1 + sine * along_m + cosine * aside_m)
    }

    /// Half circles around two middles in turn, so that each begins where and as the one before ends, and each turn is one
    /// spacing farther out than the one before.
    fn spiral(&self, spacing_m: f64, turn_radius_m: f64) -> Vec<Piece> {
        let first = turn_radius_m.max(spacing_m / 2.0);
        // The first turn covers half a width to its inside; where more is open there, lanes go first.
        let open = first - self.look.width_m / 2.0;
        let mut pieces = if open > 0.0 { self.lanes(spacing_m, open.min(self.extent_m)) } else { Vec::new() };
        let mut radius_m = first;
        let mut half = 0;
        // The last turn is over when all of it lies so far out that half a width reaches the rim.
        while radius_m < self.extent_m - self.look.width_m / 2.0 + 1.5 * spacing_m {
            let is_even = half % 2 == 0;
            let shift = if is_even { 0.0 } else { spacing_m / 2.0 };
            pieces.push(Piece::Arc {
                center: self.at(self.direction_rad, shift, 0.0),
                radius_m,
                from_rad: self.direction_rad + if is_even { 0.0 } else { PI },
                sweep_rad: PI,
            });
            radius_m += spacing_m / 2.0;
            half += 1;
        }
        pieces
    }

    /// Lines across the middle, at the rim one spacing from each other.
    fn sectors(&self, spacing_m: f64) -> Vec<Piece> {
        let lines = (PI * self.extent_m / spacing_m).ceil().max(1.0);
        let line = |number: u32| {
            let turned = self.direction_rad + PI * f64::from(number) / lines;
            let side = if number.is_multiple_of(2) { self.extent_m } else { -self.extent_m };
            Piece::Line { from: self.at(turned, -side, 0.0), to: self.at(turned, side, 0.0) }
        };
        (0..lines as u32).map(line).collect()
    }

    /// Lanes over all within a distance of the middle.
    fn lanes(&self, spacing_m: f64, extent_m: f64) -> Vec<Piece> {
        let lanes = (2.0 * extent_m / spacing_m).ceil().max(1.0);
        let pitch = 2.0 * extent_m / lanes;
        let lane = |number: u32| {
            let aside = (f64::from(number) + 0.5) * pitch - extent_m;
            // As long as the rim is where the lane's strip is widest.
            let inner = (aside.abs() - pitch / 2.0).max(0.0);
            let half = (extent_m * extent_m - inner * inner).sqrt();
            let side = if number.is_multiple_of(2) { half } else { -half };
            let at = |along| self.at(self.direction_rad, along, aside);
            Piece::Line { from: at(-side), to: at(side) }
        };
        (0..lanes as u32).map(lane).collect()
    }
}
