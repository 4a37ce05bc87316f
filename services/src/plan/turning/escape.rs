//! Ways that begin or end with a turn aside: where a border lies close ahead, no corner of a straight way shows that one.

use super::{Piece, Pose, TurningRoute, TurningSpace, check};
use std::f64::consts::{FRAC_PI_2, PI};

impl TurningSpace {
    /// The shortest of the ways that turn aside first, or last, or both, by a quarter or a half of a circle.
    pub(super) fn aside(&self, start: Pose, goal: Pose) -> Option<TurningRoute> {
        let back = |pose: Pose| Pose { heading_rad: pose.heading_rad + PI, ..pose };
        let first = self.turns(start);
        // A turn before the goal is one after it, backwards.
        let last: Vec<Piece> = self.turns(back(goal)).iter().map(Piece::back).collect();
        let (starts, goals) = (first.iter().map(Some), last.iter().map(Some));
        let one = starts.clone().map(|turn| (turn, None)).chain(goals.clone().map(|turn| (None, turn)));
        let both = starts.flat_map(|turn| goals.clone().map(move |last| (turn, last)));
        self.shortest_of(start, goal, one).or_else(|| self.shortest_of(start, goal, both))
    }

    fn shortest_of<'a>(
        &self,
        start: Pose,
        goal: Pose,
        turns: impl Iterator<Item = (Option<&'a Piece>, Option<&'a Piece>)>,
    ) -> Option<TurningRoute> {
        let found = turns.filter_map(|(first, last)| {
            let from = first.map_or(start, |turn| turn.pose(1.0));
            let to = last.map_or(goal, |turn| turn.pose(0.0));
            let between = self.shortest(from, to)?;
            let ends = [first, last].into_iter().flatten().map(Piece::length_m);
            let length_m = between.length_m + ends.sum::<f64>();
            let pieces = first.copied().into_iter().chain(between.pieces).chain(last.copied()).collect();
            Some(TurningRoute { pieces, length_m })
        });
        found.min_by(|a, b| a.length_m.total_cmp(&b.length_m))
    }

    /// The turns aside that stay clear.
    fn turns(&self, pose: Pose) -> Vec<Piece> {
        let (sine, cosine) = pose.heading_rad.sin_cos();
        let radius_m = self.radius_m;
        let all = [(1.0, FRAC_PI_2), (-1.0, FRAC_PI_2), (1.0, PI), (-1.0, PI)];
        let turns = all.map(|(side, amount)| Piece::Arc {
            center: (pose.at.0 - sine * radius_m * side, pose.at.1 + cosine * radius_m * side),
            radius_m,
            from_rad: pose.heading_rad - side * FRAC_PI_2,
            sweep_rad: side * amount,
        });
        turns.into_iter().filter(|turn| check::is_clear(&self.space, turn)).collect()
    }
}
