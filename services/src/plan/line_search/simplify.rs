//! Fewer points with little loss.

use super::{Point, direction, far, length, turn};

/// Points are dropped at once that turn less than this, in degrees, …
const TURN_MIN_DEG: f64 = 0.1;

/// … and are nearer than this to the chord of their neighbours, in metres.
const CHORD_MIN_M: f64 = 1.0;

/// How much of a line's detail is kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Detail {
    /// One point for so many metres of the line, and two at least: as the reference does, whatever is lost.
    Spacing(f64),
    /// As few points as can be without any point of the line being farther than this from the result, in metres: less than half
    /// the footprint keeps the line in sight.
    Within(f64),
}

/// The line with fewer points; its ends stay.
pub(super) fn simplified(line: &[Point], detail: Detail) -> Vec<Point> {
    let line = without_straight(line);
    let (keep, within) = match detail {
        Detail::Spacing(metres) => {
            let count = (length(&line) / metres.max(f64::MIN_POSITIVE)) as usize;
            (count.max(2), f64::INFINITY)
        }
        Detail::Within(metres) => (2, metres),
    };
    let mut kept: Vec<usize> = (0..line.len()).collect();
    let mut losses: Vec<f64> = (0..line.len()).map(|at| loss(&line, &kept, at)).collect();
    while kept.len() > keep {
        let least = (1..kept.len() - 1).min_by(|&a, &b| losses[a].total_cmp(&losses[b]));
        let Some(at) = least.filter(|&at| losses[at] <= within) else { break };
        kept.remove(at);
        losses.remove(at);
        for near in [at - 1, at] {
            losses[near] = loss(&line, &kept, near);
        }
    }
    kept.into_iter().map(|at| line[at]).collect()
}

fn without_straight(line: &[Point]) -> Vec<Point> {
    let mut kept = vec![line[0]];
    for pair in line.windows(2).skip(1) {
        let (before, at, after) = (kept[kept.len() - 1], pair[0], pair[1]);
        let bend = turn(direction(before, at), direction(at, after)).abs();
        if bend >= TURN_MIN_DEG.to_radians() || from_chord(at, before, after) >= CHORD_MIN_M {
            kept.push(at);
        }
    }
    kept.push(line[line.len() - 1]);
    kept
}

/// How far the line would be from its simplification at most, around a kept point that is taken away.
fn loss(line: &[Point], kept: &[usize], at: usize) -> f64 {
    if at == 0 || at + 1 >= kept.len() {
        return f64::INFINITY;
    }
    let (before, after) = (kept[at - 1], kept[at + 1]);
    let gap = line[before + 1..after].iter();
    gap.map(|&point| from_chord(point, line[before], line[after])).fold(0.0, f64::max)
}

/// The distance of a point from a chord.
fn from_chord(point: Point, from: Point, to: Point) -> f64 {
    let (along, aside) = ((to.0 - from.0, to.1 - from.1), (point.0 - from.0, point.1 - from.1));
    let square = along.0 * along.0 + along.1 * along.1;
    let share = (along.0 * aside.0 + along.1 * aside.1) / square;
    let share = if square > 0.0 { share.clamp(0.0, 1.0) } else { 0.0 };
    far(point, (from.0 + share * along.0, from.1 + share * along.1))
}
