//! How a vehicle moves along a line to a waypoint, with a bounded turn.

use crate::uxas::ground::{Ground, Point, ahead, far, heading_deg};
use aldis_envelope::lmcp::cmasi::Location3D;

/// How far from its plane's origin a vehicle may be before it gets a new one, in metres.
const PLANE_M: f64 = 20_000.0;

/// How near one is to a place where one is, in metres.
const NEAR_M: f64 = 0.5;

/// The shortest distance within which a vehicle comes back to its line, in metres.
const BACK_MIN_M: f64 = 5.0;

/// A vehicle's motion.
pub(super) struct Motion {
    ground: Ground,
    at: Point,
    heading_deg: f64,
    speed_m_per_s: f64,
    /// The line that it follows: where it began, where it ends, and where it goes then.
    line: Option<(Point, Point, Option<Point>)>,
}

/// An angle from -180 to below 180 degrees.
fn turn_deg(angle: f64) -> f64 {
    (angle + 180.0).rem_euclid(360.0) - 180.0
}

impl Motion {
    pub(super) fn new(ground: Ground, at: Location3D, heading_deg: f64) -> Self {
        let at = ground.point(&at);
        Self { ground, at, heading_deg, speed_m_per_s: 0.0, line: None }
    }

    pub(super) fn location(&self) -> Location3D {
        self.ground.location(self.at)
    }

    pub(super) fn heading_deg(&self) -> f64 {
        self.heading_deg.rem_euclid(360.0)
    }

    pub(super) fn speed_m_per_s(&self) -> f64 {
        self.speed_m_per_s
    }

    /// Leaves its line: the next one begins where the vehicle is.
    pub(super) fn leave_line(&mut self) {
        self.line = None;
    }

    /// Heads for a place, and for another after that.
    pub(super) fn head_for(&mut self, to: &Location3D, after: Option<&Location3D>) {
        if far(self.at, (0.0, 0.0)) > PLANE_M {
            let here = self.location();
            (self.ground, self.at) = (Ground::new(&here, false), (0.0, 0.0));
            self.line = None;
        }
        let (to, after) = (self.ground.point(to), after.map(|at| self.ground.point(at)));
        // From waypoint to waypoint: what is left of the line before does not matter.
        let from = self.line.map_or(self.at, |(_, end, _)| end);
        self.line = Some((from, to, after));
    }

    /// Stays where it is.
    pub(super) fn rest(&mut self) {
        self.speed_m_per_s = 0.0;
    }

    /// Goes on along a circle.
    pub(super) fn circle(&mut self, speed: f64, radius_m: f64, seconds: f64) {
        self.speed_m_per_s = speed;
        self.heading_deg += (speed / radius_m.max(1.0) * seconds).to_degrees();
        self.at = ahead(self.at, self.heading_deg, speed * seconds);
    }

    /// Moves along the line; whether its end is passed.
    pub(super) fn step(&mut self, speed: f64, radius_m: f64, seconds: f64) -> bool {
        let Some((from, to, after)) = self.line else { return true };
        self.speed_m_per_s = speed;
        let length = far(from, to);
        let left = far(self.at, to);
        if length < NEAR_M || left < NEAR_M.max(speed * seconds) {
            if after.is_none() && radius_m < 1.0 {
                self.at = to;
            }
            return true;
        }
        let course = heading_deg(from, to);
        let way = ((to.0 - from.0) / length, (to.1 - from.1) / length);
        let gone = (self.at.0 - from.0) * way.0 + (self.at.1 - from.1) * way.1;
        // To the right of the line is positive.
        let aside = -(self.at.0 - from.0) * way.1 + (self.at.1 - from.1) * way.0;
        if gone >= length - self.short_of(course, to, after, radius_m, length) {
            return true;
        }
        let back = radius_m.max(BACK_MIN_M).max(speed);
        let wanted = match radius_m < 1.0 {
            true => heading_deg(self.at, to),
            false => course - aside.atan2(back).to_degrees(),
        };
        let most = if radius_m < 1.0 { 360.0 } else { (speed / radius_m * seconds).to_degrees() };
        let turn = turn_deg(wanted - self.heading_deg).clamp(-most, most);
        // Half of the turn before the step and half after: the middle of the arc's chord.
        self.at = ahead(self.at, self.heading_deg + turn / 2.0, speed * seconds);
        self.heading_deg += turn;
        false
    }

    /// How far before the end of a line the turn to the next begins: so that it ends on that, where there is room.
    fn short_of(&self, course: f64, to: Point, after: Option<Point>, radius_m: f64, length: f64) -> f64 {
        let Some(after) = after.filter(|after| far(to, *after) > NEAR_M) else { return 0.0 };
        let turn = turn_deg(heading_deg(to, after) - course).abs().min(150.0);
        (radius_m * (turn / 2.0).to_radians().tan()).min(length / 2.0).min(far(to, after) / 2.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_right_angle_is_turned_within_its_corner_and_no_tighter_than_may_be() {
        let origin = Location3D { latitude: 60.0, longitude: 20.0, ..Location3D::default() };
        let place = |point| Ground::new(&origin, false).location(point);
        let mut motion = Motion::new(Ground::new(&origin, false), origin.clone(), 0.0);
        motion.head_for(&place((1000.0, 0.0)), Some(&place((1000.0, 1000.0))));
        let (mut legs, mut most_turn, mut aside) = (0, 0.0_f64, 0.0_f64);
        for _ in 0..4000 {
            let before = motion.heading_deg;
            if motion.step(10.0, 100.0, 0.1) {
                legs += 1;
                if legs == 2 {
                    break;
                }
                motion.head_for(&place((1000.0, 1000.0)), None);
            }
            most_turn = most_turn.max(turn_deg(motion.heading_deg - before).abs());
            aside = aside.max(motion.at.0 - 1000.0);
        }
        assert_eq!(legs, 2);
        assert!(most_turn <= (10.0 / 100.0 * 0.1_f64).to_degrees() + 1e-9, "{most_turn}");
        assert!(aside < 12.0, "it swings out by {aside} m");
        assert!(far(motion.at, (1000.0, 1000.0)) < 20.0, "{:?}", motion.at);
    }
}
