//! Ways of ground vehicles along roads, as a file of OpenStreetMap holds them.
//!
//! Roads are the ways with a tag `highway`, whatever its value. A way begins and ends at the places on roads that are nearest to
//! where it is asked to; along roads it is the shortest by true lengths.

mod nearest;
mod parse;
mod shortest;
#[cfg(test)]
mod tests;

pub use parse::{RoadsError, RoadsFault};

use super::geodesy::{Place, Plane};
use nearest::Boxes;
use parse::Document;

/// Places nearer than this to a node are at it, in metres.
const AT_NODE_M: f64 = 0.001;

/// Whether one-way roads are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OneWay {
    /// They are driven their way alone.
    #[default]
    Respect,
    /// They are driven both ways, as the reference does.
    Ignore,
}

/// A straight piece of a road, from a node to the next.
#[derive(Debug, Clone, Copy)]
struct Segment {
    /// The node where it begins.
    from: u32,
    /// The node where it ends.
    to: u32,
    /// The road.
    way: i64,
    /// How long it is.
    metres: f64,
    /// Whether it may be driven as it is drawn, …
    forth: bool,
    /// … and the other way.
    back: bool,
}

/// A node of a road.
#[derive(Debug, Clone, Copy)]
struct Node {
    id: i64,
    place: Place,
    /// The same on a plane around all roads.
    point: (f64, f64),
}

/// Roads.
pub struct Roads {
    plane: Plane,
    nodes: Vec<Node>,
    segments: Vec<Segment>,
    /// The segments at each node: where they begin in `at`.
    first: Vec<u32>,
    at: Vec<u32>,
    boxes: Boxes,
    missing_nodes: usize,
}

/// The place on a road that is nearest to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnRoad {
    /// The place on the road.
    pub place: Place,
    /// How far it is away, in metres.
    pub distance_m: f64,
    /// The road's id.
    pub way: i64,
    /// The id of the nearer node at an end of this piece of road.
    pub node: i64,
    segment: u32,
    /// How far along the segment it is, from 0 to 1.
    share: f64,
}

/// A way along roads.
#[derive(Debug, Clone, PartialEq)]
pub struct RoadRoute {
    /// The start, where the road is joined, the nodes passed, where the road is left, and the goal.
    pub places: Vec<Place>,
    /// The ids of the nodes passed, with those at its ends if it begins or ends at nodes.
    pub nodes: Vec<i64>,
    /// How long the way is in all, in metres.
    pub length_m: f64,
    /// How much of it is along roads.
    pub on_road_m: f64,
}

/// Where a road crosses a circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// The place.
    pub place: Place,
    /// The direction of the road there, outwards, in degrees from north, clockwise.
    pub heading_deg: f64,
    /// The road's id.
    pub way: i64,
}

/// Why there is no way along roads.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RoadError {
    /// A place that is none.
    #[error("the {what} is no place: latitude {latitude_deg}, longitude {longitude_deg}")]
    NotAPlace {
        /// Which.
        what: &'static str,
        /// Degrees north.
        latitude_deg: f64,
        /// Degrees east.
        longitude_deg: f64,
    },
    /// A radius that is none.
    #[error("a circle of {0} m is none: its radius must be above 0 m")]
    Radius(f64),
    /// The roads are not joined.
    #[error(
        "no road leads from way {from}, the nearest to the start, to way {to}, the nearest to the goal: move an end to another road, \
         or ignore one-way roads"
    )]
    Disconnected {
        /// The road at the start.
        from: i64,
        /// The road at the goal.
        to: i64,
    },
    /// All roads are closed.
    #[error("no road is open")]
    NoRoad,
}

impl Roads {
    /// The roads of a document in OpenStreetMap's XML. What a document of n bytes takes in memory is bounded by a multiple of n.
    ///
    /// # Errors
    /// What is wrong with the document, and in which line.
    pub fn read(document: &[u8]) -> Result<Self, RoadsError> {
        let document = parse::parse(document)?;
        let Document { nodes, ways, missing_nodes } = document;
        let middle = nodes[nodes.len() / 2].1;
        let plane = Plane::new(middle);
        let number = |id: &i64| nodes.binary_search_by_key(id, |node| node.0).ok();
        let mut segments = Vec::new();
        for way in &ways {
            for pair in way.nodes.windows(2) {
                let (Some(from), Some(to)) = (number(&pair[0]), number(&pair[1])) else { continue };
                let metres = plane.distance_m(nodes[from].1, nodes[to].1);
                if from != to {
                    let (from, to) = (from as u32, to as u32);
                    let (forth, back) = (way.forth, way.back);
                    segments.push(Segment { from, to, way: way.id, metres, forth, back });
                }
            }
        }
        let node = |&(id, place): &(i64, Place)| Node { id, place, point: plane.to_plane(place) };
        let nodes = nodes.iter().map(node).collect();
        Ok(Self::of(plane, nodes, segments, missing_nodes))
    }

    fn of(plane: Plane, nodes: Vec<Node>, segments: Vec<Segment>, missing_nodes: usize) -> Self {
        let mut first = vec![0_u32; nodes.len() + 1];
        for segment in &segments {
            first[segment.from as usize + 1] += 1;
            first[segment.to as usize + 1] += 1;
        }
        for node in 0..nodes.len() {
            first[node + 1] += first[node];
        }
        let mut next = first.clone();
        let mut at = vec![0_u32; 2 * segments.len()];
        for (number, segment) in segments.iter().enumerate() {
            for node in [segment.from, segment.to] {
                at[next[node as usize] as usize] = number as u32;
                next[node as usize] += 1;
            }
        }
        let ends = |segment: &Segment| (nodes[segment.from as usize].point, nodes[segment.to as usize].point);
        let boxes = Boxes::new(segments.iter().map(ends).collect());
        Self { plane, nodes, segments, first, at, boxes, missing_nodes }
    }

    /// The roads without the pieces that are closed: a zone may lie on them.
    #[must_use]
    pub fn only(self, is_open: impl Fn(Place, Place) -> bool) -> Self {
        let place = |node: u32| self.nodes[node as usize].place;
        let open = |segment: &&Segment| is_open(place(segment.from), place(segment.to));
        let segments = self.segments.iter().filter(open).copied().collect();
        Self::of(self.plane, self.nodes, segments, self.missing_nodes)
    }

    /// How many nodes roads have.
    pub fn nodes(&self) -> usize {
        self.nodes.len()
    }

    /// How many straight pieces roads have.
    pub fn segments(&self) -> usize {
        self.segments.len()
    }

    /// How many nodes roads name that the document does not hold, as where an extract is cut off. Roads end there.
    pub fn missing_nodes(&self) -> usize {
        self.missing_nodes
    }

    /// The place on a road that is nearest; none where no road is open.
    pub fn nearest(&self, place: Place) -> Option<OnRoad> {
        let point = self.plane.to_plane(place);
        let (segment, share) = self.boxes.nearest(point)?;
        let found = self.segments[segment as usize];
        let share = match share * found.metres {
            along if along < AT_NODE_M => 0.0,
            along if along > found.metres - AT_NODE_M => 1.0,
            _ => share,
        };
        let node = self.nodes[if share < 0.5 { found.from } else { found.to } as usize].id;
        let at = self.place_on(segment, share);
        let distance_m = self.plane.distance_m(place, at);
        Some(OnRoad { place: at, distance_m, way: found.way, node, segment, share })
    }

    fn place_on(&self, segment: u32, share: f64) -> Place {
        let segment = self.segments[segment as usize];
        let (from, to) = (&self.nodes[segment.from as usize], &self.nodes[segment.to as usize]);
        match share {
            0.0 => from.place,
            1.0 => to.place,
            _ => self.plane.to_place((
                from.point.0 + share * (to.point.0 - from.point.0),
                from.point.1 + share * (to.point.1 - from.point.1),
            )),
        }
    }

    /// The shortest way along roads from the place on them that is nearest to the start to the one nearest to the goal.
    ///
    /// # Errors
    /// Why there is none.
    pub fn route(&self, start: Place, goal: Place, one_way: OneWay) -> Result<RoadRoute, RoadError> {
        let on_road = |what: &'static str, place: Place| {
            let Place { latitude_deg, longitude_deg } = place;
            if !place.is_valid() {
                return Err(RoadError::NotAPlace { what, latitude_deg, longitude_deg });
            }
            self.nearest(place).ok_or(RoadError::NoRoad)
        };
        let (from, to) = (on_road("start", start)?, on_road("goal", goal)?);
        let disconnected = RoadError::Disconnected { from: from.way, to: to.way };
        let (on_road_m, passed) = self.shortest(&from, &to, one_way).ok_or(disconnected)?;
        let nodes = passed.iter().map(|&node| self.nodes[node as usize]);
        let between = nodes.clone().map(|node| node.place);
        let mut places: Vec<Place> =
            [start, from.place].into_iter().chain(between).chain([to.place, goal]).collect();
        places.dedup();
        let length_m = from.distance_m + on_road_m + to.distance_m;
        Ok(RoadRoute { places, nodes: nodes.map(|node| node.id).collect(), length_m, on_road_m })
    }

    /// Where roads cross a circle around a place, by direction from north, clockwise.
    ///
    /// # Errors
    /// A place or a radius that is none.
    pub fn crossings(&self, center: Place, radius_m: f64) -> Result<Vec<Crossing>, RoadError> {
        let Place { latitude_deg, longitude_deg } = center;
        if !center.is_valid() {
            return Err(RoadError::NotAPlace { what: "circle's middle", latitude_deg, longitude_deg });
        }
        if !(radius_m > 0.0 && radius_m.is_finite()) {
            return Err(RoadError::Radius(radius_m));
        }
        let around = Plane::new(center);
        let mut found = Vec::new();
        for &number in &self.boxes.within(self.plane.to_plane(center), radius_m * 1.01 + 1.0) {
            let segment = self.segments[number as usize];
            let (a, b) = (self.nodes[segment.from as usize].place, self.nodes[segment.to as usize].place);
            let (a, b) = (around.to_plane(a), around.to_plane(b));
            let side = (b.0 - a.0, b.1 - a.1);
            // |a + share · side| = radius
            let (square, half) = (side.0 * side.0 + side.1 * side.1, a.0 * side.0 + a.1 * side.1);
            let rest = half * half - square * (a.0 * a.0 + a.1 * a.1 - radius_m * radius_m);
            if rest <= 0.0 || square == 0.0 {
                continue;
            }
            for share in [-1.0, 1.0].map(|sign| (-half + sign * rest.sqrt()) / square) {
                if (0.0..1.0).contains(&share) {
                    let point = (a.0 + share * side.0, a.1 + share * side.1);
                    let outwards = (point.0 * side.0 + point.1 * side.1).signum();
                    let heading = (side.1 * outwards).atan2(side.0 * outwards);
                    let turned = point.1.atan2(point.0).rem_euclid(std::f64::consts::TAU);
                    let heading_deg = heading.to_degrees().rem_euclid(360.0);
                    let (place, way) = (around.to_place(point), segment.way);
                    found.push((turned, Crossing { place, heading_deg, way }));
                }
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.way.cmp(&b.1.way)));
        Ok(found.into_iter().map(|(_, crossing)| crossing).collect())
    }
}
