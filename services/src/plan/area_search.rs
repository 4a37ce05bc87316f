//! Search of an area: lanes side by side, so few as can be, around what must not be entered.
//!
//! The area, less the zones, is cut into lanes; lanes that lie side by side make cells, and the cells are put in an order with
//! short ways between them. What lanes leave open beside slanted borders is swept along those. How much is covered is computed
//! from the outlines of all that is swept, not promised.

mod cells;
mod lanes;
mod line;
mod order;
mod rest;
#[cfg(test)]
mod tests;

use super::free_space::Boundary;
use super::search_plan::{Look, Mover, SearchError, SearchPlan, Target, fly};
use super::turning::{Piece, Pose};
use lanes::Lanes;

/// How an area is searched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AreaSearch {
    /// What the sensor covers.
    pub look: Look,
    /// Which share of its width neighbouring lanes cover twice: 0.1 is the reference's.
    pub overlap: f64,
    /// The direction of the lanes, in radians from the first axis towards the second; none: that of the fewest lanes.
    pub direction_rad: Option<f64>,
}

impl AreaSearch {
    /// The search of what lies within an outline, begun at a pose; without one, at whichever end is best.
    ///
    /// # Errors
    /// What is wrong with the request, or that nothing can be searched.
    pub fn plan(
        &self,
        area: &Boundary,
        mover: Mover<'_>,
        start: Option<Pose>,
    ) -> Result<SearchPlan, SearchError> {
        let spacing_m = self.look.spacing_m(self.overlap)?;
        if let Some(direction) = self.direction_rad.filter(|direction| !direction.is_finite()) {
            return Err(SearchError::Direction(direction));
        }
        let space = mover.space();
        let target = Target::new(area, space, start)?;
        let lanes = Lanes { target: &target.rings, outlines: &space.outlines(), look: self.look, spacing_m };
        let direction = match self.direction_rad {
            Some(direction) => direction,
            None => lanes.best_direction(space)?,
        };
        let lanes_found = lanes.of(mover, direction)?;
        let swept: Vec<Piece> = lanes_found.iter().flatten().map(|leg| leg.piece()).collect();
        let rest = rest::legs(&lanes, mover, direction, &swept);
        let cells = cells::cells(&lanes_found).into_iter().chain(rest.into_iter().map(cells::Cell::single));
        let ordered = order::ordered(mover, &self.look, start, cells.collect());
        let flown = fly(mover, &self.look, start, ordered);
        if flown.swept.is_empty() {
            return Err(SearchError::NothingSwept);
        }
        let coverage = target.coverage(&flown.swept, self.look.width_m);
        let length_m = flown.pieces.iter().map(Piece::length_m).sum();
        let (swept, pieces, left_out) = (flown.swept, flown.pieces, flown.left_out);
        Ok(SearchPlan { swept, pieces, length_m, coverage, left_out })
    }
}
