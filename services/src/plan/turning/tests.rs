//! Against zones as they were given, and against what is known of Dubins' words.

use super::*;
use crate::plan::free_space::instance::{anybody, nested_map, random_map};
use crate::plan::free_space::{Boundary, ZoneKind};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

fn pose(random: &mut fastrand::Rng, side: f64) -> Pose {
    Pose { at: (random.f64() * side, random.f64() * side), heading_rad: random.f64() * TAU }
}

fn shortest(from: Pose, to: Pose, radius: f64) -> f64 {
    words(from, to, radius).iter().map(|word| word.length_m).fold(f64::INFINITY, f64::min)
}

#[test]
fn the_shortest_word_is_the_least_of_all() {
    let mut random = fastrand::Rng::with_seed(5);
    for _ in 0..2000 {
        let (from, to) = (pose(&mut random, 500.0), pose(&mut random, 500.0));
        assert!((shortest_m(from, to, 60.0).unwrap() - shortest(from, to, 60.0)).abs() < 1e-6);
    }
}

#[test]
fn words_lead_to_the_goal_and_back_in_the_same_length() {
    let mut random = fastrand::Rng::with_seed(2);
    for _ in 0..2_000 {
        let (from, to) = (pose(&mut random, 8.0), pose(&mut random, 8.0));
        let turned = |pose: Pose| Pose { heading_rad: pose.heading_rad + PI, ..pose };
        let (there, back) = (shortest(from, to, 1.0), shortest(turned(to), turned(from), 1.0));
        assert!((there - back).abs() < 1e-9 * there, "{there} there, {back} back: {from:?} {to:?}");
        let all = words(from, to, 1.0);
        assert!(all.len() >= 2, "{all:?}");
        let distance = (to.at.0 - from.at.0).hypot(to.at.1 - from.at.1);
        assert!(there >= distance);
    }
}

#[test]
fn known_ways_have_their_length() {
    let at = |x: f64, y: f64, heading_rad: f64| Pose { at: (x, y), heading_rad };
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} but {b}");
    near(shortest(at(0.0, 0.0, 0.0), at(10.0, 0.0, 0.0), 2.0), 10.0);
    near(shortest(at(0.0, 0.0, 0.0), at(0.0, 4.0, PI), 2.0), 2.0 * PI);
    near(shortest(at(0.0, 0.0, 0.0), at(6.0, 1.0, FRAC_PI_2), 1.0), 5.0 + FRAC_PI_2);
    // Turning around on the spot takes three turns: a sixth of a circle out, five sixths around, a sixth in.
    near(shortest(at(0.0, 0.0, 0.0), at(0.0, 0.0, PI), 1.0), 7.0 * PI / 3.0);
    assert!((radius_of_bank(22.0, 20_f64.to_radians()) - 135.6).abs() < 0.01);
    near(radius_of_yaw_rate(5.0, 0.1), 50.0);
}

/// How far a place is inside a zone as it was given.
fn depth(zone: &Zone, place: Point) -> f64 {
    match &zone.boundary {
        Boundary::Circle { center, radius_m } => {
            radius_m + zone.padding_m - (place.0 - center.0).hypot(place.1 - center.1)
        }
        Boundary::Polygon(corners) => {
            let mut inside = false;
            let mut near = f64::INFINITY;
            for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
                let (along, to) = ((b.0 - a.0, b.1 - a.1), (place.0 - a.0, place.1 - a.1));
                let share = (along.0 * to.0 + along.1 * to.1) / (along.0 * along.0 + along.1 * along.1);
                let share = share.clamp(0.0, 1.0);
                near = near.min((to.0 - along.0 * share).hypot(to.1 - along.1 * share));
                if (a.1 <= place.1) != (b.1 <= place.1) {
                    inside ^= to.0 < along.0 * to.1 / along.1;
                }
            }
            zone.padding_m + if inside { near } else { -near }
        }
        Boundary::Rectangle { center, width_m, height_m, rotation_rad } => {
            let (sine, cosine) = rotation_rad.sin_cos();
            let (x, y) = (place.0 - center.0, place.1 - center.1);
            let (along, across) = ((x * cosine + y * sine).abs(), (y * cosine - x * sine).abs());
            let (beyond, beside) = (along - width_m / 2.0, across - height_m / 2.0);
            if beyond.max(beside) <= 0.0 {
                zone.padding_m - beyond.max(beside)
            } else {
                zone.padding_m - beyond.max(0.0).hypot(beside.max(0.0))
            }
        }
    }
}

#[test]
fn no_way_cuts_a_zone_and_all_turn_wide_enough() {
    let mut random = fastrand::Rng::with_seed(5);
    let (mut found, mut narrow) = (0, 0);
    for number in 0..8 {
        let map = match number % 2 {
            0 => random_map(&mut random, 8, 10_000.0),
            _ => nested_map(&mut random, 5, 10_000.0),
        };
        let Ok(space) = TurningSpace::new(&map, &anybody(), 135.6) else { continue };
        for _ in 0..6 {
            let (start, goal) = (pose(&mut random, 10_000.0), pose(&mut random, 10_000.0));
            let route = match space.route(start, goal) {
                Ok(route) => route,
                Err(TurningError::NarrowerThanTurn { .. }) => {
                    narrow += 1;
                    continue;
                }
                Err(_) => continue,
            };
            found += 1;
            let mut at = start.at;
            for piece in &route.pieces {
                let begin = piece.place(0.0);
                assert!((begin.0 - at.0).hypot(begin.1 - at.1) < 1e-3, "a gap before {piece:?}");
                at = piece.place(1.0);
                if let Piece::Arc { radius_m, .. } = piece {
                    assert_eq!(*radius_m, 135.6);
                }
                for place in check::samples(piece, 50) {
                    let zones = map.iter().filter(|zone| zone.kind == ZoneKind::KeepOut);
                    let cut = zones.map(|zone| depth(zone, place)).fold(f64::NEG_INFINITY, f64::max);
                    assert!(cut <= 0.0, "{cut} m inside: {place:?} of {piece:?}");
                    let kept = 0.0..=10_000.0;
                    assert!(kept.contains(&place.0) && kept.contains(&place.1), "{place:?} is out");
                }
            }
            let sum: f64 = route.pieces.iter().map(Piece::length_m).sum();
            assert!((sum - route.length_m).abs() < 1e-6 && (at.0 - goal.at.0).hypot(at.1 - goal.at.1) < 1e-3);
        }
    }
    assert!(found > 10 && narrow < found, "{found} ways, {narrow} too narrow");
}

#[test]
fn what_is_wrong_is_told() {
    let corners = vec![(0.0, 0.0), (100.0, 0.0), (100.0, 20.0), (0.0, 20.0)];
    let lane = [Zone::new(1, ZoneKind::KeepIn, Boundary::Polygon(corners))];
    let of = |radius| TurningSpace::new(&lane, &anybody(), radius).unwrap();
    let (start, back) =
        (Pose { at: (20.0, 10.0), heading_rad: 0.0 }, Pose { at: (20.0, 10.5), heading_rad: PI });
    assert!(of(4.0).route(start, back).is_ok());
    let told = of(40.0).route(start, back).unwrap_err();
    assert!(matches!(told, TurningError::NarrowerThanTurn { .. }), "{told}");
    assert!(matches!(of(0.0).route(start, back), Err(TurningError::Radius(_))));
    let nowhere = Pose { at: (20.0, 30.0), heading_rad: 0.0 };
    assert!(matches!(of(4.0).route(start, nowhere), Err(TurningError::Route(_))));
    let spun = Pose { heading_rad: f64::NAN, ..start };
    assert!(matches!(of(4.0).route(start, spun), Err(TurningError::Heading(_))));
}
