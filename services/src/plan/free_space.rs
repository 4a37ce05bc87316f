//! Free space: where a vehicle may be, and the shortest ways through it.
//!
//! Zones are brought onto a grid of whole numbers, joined and taken from each other there exactly, and what is left is cut into
//! triangles. A way is searched over the triangles and then checked, segment by segment, by exact predicates: it is in free
//! space or on its border, without exception. Places are in metres on a plane.

mod fallback;
pub(in crate::plan) mod grid;
mod grow;
pub mod instance;
mod locate;
mod mesh;
mod search;
#[cfg(test)]
mod tests;
mod verify;
mod zone;

pub use zone::{Boundary, Conditions, Zone, ZoneKind};

use grid::Ring;
use locate::Locator;
use mesh::Mesh;

/// A place in metres on the plane.
pub type Point = (f64, f64);

/// How much farther away than asked ways stay, in metres: more than bringing a place onto the grid moves it.
const HAIR_M: f64 = 0.002;

/// How far around all zones free space reaches where nothing keeps vehicles in, in metres.
const AROUND_M: f64 = 50_000.0;

/// Zones that make no free space.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SpaceError {
    /// A zone that is none.
    #[error("zone {zone}: {what}")]
    Zone {
        /// The zone.
        zone: i64,
        /// What is wrong with it.
        what: String,
    },
    /// No place is left.
    #[error("no free space is left: the zones to keep out of cover all that vehicles are kept in")]
    Empty,
    /// Outlines that cross where none should.
    #[error("the zones' outlines cross each other within a thousandth of a metre: move or simplify them")]
    Degenerate,
}

/// Which end of a way an error is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RouteEnd {
    /// Where it starts.
    Start,
    /// Where it goes.
    Goal,
}

impl std::fmt::Display for RouteEnd {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Start => "start",
            Self::Goal => "goal",
        })
    }
}

/// Why there is no way.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RouteError {
    /// An end lies in a zone to keep out of.
    #[error("the {end} lies in keep-out zone {zone}: the nearest way out is at ({:.3}, {:.3}), {distance_m:.3} m away", .nearest.0, .nearest.1)]
    InKeepOut {
        /// Which end.
        end: RouteEnd,
        /// The zone.
        zone: i64,
        /// The nearest place of free space.
        nearest: Point,
        /// How far that is, in metres.
        distance_m: f64,
    },
    /// An end lies outside of all zones to keep in.
    #[error("the {end} lies outside of what vehicles are kept in: the nearest way in is at ({:.3}, {:.3}), {distance_m:.3} m away", .nearest.0, .nearest.1)]
    OutsideKeepIn {
        /// Which end.
        end: RouteEnd,
        /// The nearest place of free space.
        nearest: Point,
        /// How far that is, in metres.
        distance_m: f64,
    },
    /// Zones lie between the ends, whichever way one goes.
    #[error("no way leads from the start to the goal: zones separate them")]
    Disconnected,
    /// A number that is none.
    #[error("the {0} is not a place")]
    NotAPlace(RouteEnd),
}

/// A way.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// The start, where it turns, and the goal.
    pub points: Vec<Point>,
    /// How long it is, in metres.
    pub length_m: f64,
}

/// Where vehicles may be.
#[derive(Debug, Clone)]
pub struct FreeSpace {
    mesh: Mesh,
    locator: Locator,
    rings: Vec<Ring>,
    keep_out: Vec<(i64, Vec<Ring>)>,
}

impl FreeSpace {
    /// The free space that zones leave under these conditions.
    ///
    /// # Errors
    /// A zone that is none, or that nothing is left.
    pub fn new(zones: &[Zone], conditions: &Conditions) -> Result<Self, SpaceError> {
        let concern: Vec<_> = zones.iter().filter(|zone| conditions.concern(zone)).collect();
        Self::of(&concern, HAIR_M)
    }

    /// The free space of zones that hold for all, with their outlines as they are: for comparisons with the reference.
    ///
    /// # Errors
    /// A zone that is none, or that nothing is left.
    pub fn compat(zones: &[Zone]) -> Result<Self, SpaceError> {
        Self::of(&zones.iter().collect::<Vec<_>>(), 0.0)
    }

    fn of(zones: &[&Zone], hair_m: f64) -> Result<Self, SpaceError> {
        let mut keep_out = Vec::new();
        let mut within: [Vec<Ring>; 2] = [Vec::new(), Vec::new()];
        for zone in zones {
            let outline = outline(zone)?;
            let room = zone.padding_m + hair_m;
            match zone.kind {
                ZoneKind::KeepOut => keep_out.push((zone.id, grown(outline, room))),
                ZoneKind::KeepIn => within[0].extend(shrunk(outline, room)),
                ZoneKind::Water => within[1].extend(shrunk(outline, room)),
            }
        }
        let [keep_in, water] = within.map(|rings| grid::union(&rings));
        let is_kept = |kind| zones.iter().any(|zone| zone.kind == kind);
        let bounds = match (is_kept(ZoneKind::KeepIn), is_kept(ZoneKind::Water)) {
            (true, true) => grid::intersection(&keep_in, &water),
            (true, false) => keep_in,
            (false, true) => water,
            (false, false) => vec![around(&keep_out)],
        };
        let obstacles: Vec<Ring> = keep_out.iter().flat_map(|(_, rings)| rings).cloned().collect();
        let rings = grid::difference(&bounds, &obstacles);
        if rings.is_empty() {
            return Err(SpaceError::Empty);
        }
        let mesh = Mesh::new(&rings)?;
        Ok(Self { locator: Locator::new(&mesh), mesh, rings, keep_out })
    }

    /// Whether a place is in free space or on its border.
    pub fn contains(&self, place: Point) -> bool {
        !self.locator.holders(&self.mesh, place).is_empty()
    }

    /// The outlines of free space, each with free space to its left.
    pub fn outlines(&self) -> Vec<Vec<Point>> {
        self.rings.iter().map(|ring| ring.iter().map(|&cell| grid::place(cell)).collect()).collect()
    }

    /// The same on the grid.
    pub(in crate::plan) fn rings(&self) -> &[Ring] {
        &self.rings
    }

    /// How many corners its outlines have.
    pub fn vertices(&self) -> usize {
        self.mesh.points.len()
    }

    /// Whether the straight way from a place to another stays in free space or on its border: by exact predicates.
    pub fn sees(&self, from: Point, to: Point) -> bool {
        verify::is_free(&self.mesh, (from, &self.locator.holders(&self.mesh, from)), to)
    }

    /// Whether a corner of an outline lies within a triangle or on its border, its own corners left out.
    pub fn has_corner_in(&self, triangle: [Point; 3]) -> bool {
        let [a, b, c] = triangle;
        let side = |from, to, point| mesh::orient(from, to, point);
        let turn = side(a, b, c);
        let within = |point: &Point| {
            let sides = [side(a, b, *point), side(b, c, *point), side(c, a, *point)];
            sides.iter().all(|side| side * turn >= 0.0)
        };
        let (low, high) =
            ((a.0.min(b.0).min(c.0), a.1.min(b.1).min(c.1)), (a.0.max(b.0).max(c.0), a.1.max(b.1).max(c.1)));
        let near = |p: &&Point| p.0 >= low.0 && p.0 <= high.0 && p.1 >= low.1 && p.1 <= high.1;
        self.mesh.points.iter().filter(near).any(|point| !triangle.contains(point) && within(point))
    }

    /// The shortest way from a place to another.
    ///
    /// # Errors
    /// Why there is none.
    pub fn route(&self, start: Point, goal: Point) -> Result<Route, RouteError> {
        let starts = self.holders(start, RouteEnd::Start)?;
        let goals = self.holders(goal, RouteEnd::Goal)?;
        let parts = |holders: &[u32]| {
            holders.iter().map(|&triangle| self.mesh.part[triangle as usize]).collect::<Vec<_>>()
        };
        if !parts(&starts).iter().any(|part| parts(&goals).contains(part)) {
            return Err(RouteError::Disconnected);
        }
        let turns = search::shortest(&self.mesh, (start, &starts), (goal, &goals));
        let points = |turns: &[u32]| {
            let between = turns.iter().map(|&turn| self.mesh.points[turn as usize]);
            std::iter::once(start).chain(between).chain([goal]).collect::<Vec<_>>()
        };
        let checked = turns
            .map(|turns| points(&turns))
            .filter(|points| points.windows(2).all(|pair| self.sees(pair[0], pair[1])));
        // Rounding may let a way graze a zone by less than a nanometre: then the exact and slow search decides.
        let points = match checked {
            Some(points) => points,
            None => points(
                &fallback::shortest(&self.mesh, (start, &starts), goal).ok_or(RouteError::Disconnected)?,
            ),
        };
        let length_m = points.windows(2).map(|pair| search::distance(pair[0], pair[1])).sum();
        Ok(Route { points, length_m })
    }

    fn holders(&self, place: Point, end: RouteEnd) -> Result<Vec<u32>, RouteError> {
        if !(place.0.is_finite() && place.1.is_finite()) {
            return Err(RouteError::NotAPlace(end));
        }
        let holders = self.locator.holders(&self.mesh, place);
        if !holders.is_empty() {
            return Ok(holders);
        }
        let (nearest, distance_m) = self.nearest(place);
        let zone = self.keep_out.iter().find(|(_, rings)| is_inside(rings, place));
        Err(match zone {
            Some(&(zone, _)) => RouteError::InKeepOut { end, zone, nearest, distance_m },
            None => RouteError::OutsideKeepIn { end, nearest, distance_m },
        })
    }

    /// The nearest place on the border of free space, and how far it is.
    fn nearest(&self, place: Point) -> (Point, f64) {
        let mut best = (place, f64::INFINITY);
        for ring in self.outlines() {
            for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
                let (along, to) = ((b.0 - a.0, b.1 - a.1), (place.0 - a.0, place.1 - a.1));
                let square = along.0 * along.0 + along.1 * along.1;
                let share = ((along.0 * to.0 + along.1 * to.1) / square).clamp(0.0, 1.0);
                let found = (a.0 + along.0 * share, a.1 + along.1 * share);
                let distance = search::distance(found, place);
                if distance < best.1 {
                    best = (found, distance);
                }
            }
        }
        best
    }
}

/// The outlines of a zone on the grid, without its padding.
pub(in crate::plan) fn outline(zone: &Zone) -> Result<Vec<Ring>, SpaceError> {
    let ring: Ring = zone::corners(zone)?.into_iter().map(grid::cell).collect();
    let outline = grid::union(&[grid::anticlockwise(ring)]);
    if outline.is_empty() {
        return Err(SpaceError::Zone { zone: zone.id, what: "its outline has no area".to_owned() });
    }
    Ok(outline)
}

/// Outlines with room around them.
fn grown(outline: Vec<Ring>, room_m: f64) -> Vec<Ring> {
    if room_m <= 0.0 {
        return outline;
    }
    if let Some(moved) = outline.iter().map(|ring| grow::moved(ring, room_m)).collect::<Option<Vec<_>>>() {
        return grid::union(&moved);
    }
    let mut pieces: Vec<Ring> = outline.iter().flat_map(|ring| grow::right_of(ring, room_m)).collect();
    pieces.extend(outline);
    grid::union(&pieces)
}

/// Outlines without the room along them.
fn shrunk(outline: Vec<Ring>, room_m: f64) -> Vec<Ring> {
    if room_m <= 0.0 {
        return outline;
    }
    if let Some(moved) = outline.iter().map(|ring| grow::moved(ring, -room_m)).collect::<Option<Vec<_>>>() {
        return grid::union(&moved);
    }
    let back = |ring: &Ring| ring.iter().rev().copied().collect::<Ring>();
    let pieces: Vec<Ring> = outline.iter().flat_map(|ring| grow::right_of(&back(ring), room_m)).collect();
    grid::difference(&outline, &pieces)
}

/// A frame around all zones.
fn around(zones: &[(i64, Vec<Ring>)]) -> Ring {
    let places: Vec<Point> =
        zones.iter().flat_map(|(_, rings)| rings).flatten().map(|&cell| grid::place(cell)).collect();
    let most = places.iter().map(|place| place.0.abs().max(place.1.abs())).fold(0.0, f64::max) + AROUND_M;
    [(-most, -most), (most, -most), (most, most), (-most, most)].map(grid::cell).to_vec()
}

/// Whether outlines wind around a place.
fn is_inside(rings: &[Ring], place: Point) -> bool {
    let mut winding = 0;
    for ring in rings {
        for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
            let (a, b) = (grid::place(*a), grid::place(*b));
            let side = mesh::orient(a, b, place);
            if a.1 <= place.1 && b.1 > place.1 && side > 0.0 {
                winding += 1;
            } else if a.1 > place.1 && b.1 <= place.1 && side < 0.0 {
                winding -= 1;
            }
        }
    }
    winding != 0
}
