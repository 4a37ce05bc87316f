//! Against every way around every corner, by plain geometry that shares nothing with the triangles.

mod visibility;

use super::instance::random_map;
use super::*;

fn always() -> Conditions {
    Conditions { vehicle: 1, on_water: false, altitude_m: (0.0, 0.0), time_ms: (0, 0) }
}

fn box_at(id: i64, kind: ZoneKind, (x, y): Point, (width, height): Point) -> Zone {
    let corners = vec![(x, y), (x + width, y), (x + width, y + height), (x, y + height)];
    Zone::new(id, kind, Boundary::Polygon(corners))
}

fn crosses(a: Point, b: Point, c: Point, d: Point) -> bool {
    let (of_c, of_d) = (mesh::orient(a, b, c), mesh::orient(a, b, d));
    let (of_a, of_b) = (mesh::orient(c, d, a), mesh::orient(c, d, b));
    of_c * of_d < 0.0 && of_a * of_b < 0.0
}

/// Whether a place is inside by the outlines' winding, its border left out or not.
fn is_free(outlines: &[Vec<Point>], place: Point) -> bool {
    let mut winding = 0;
    for ring in outlines {
        for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
            let side = mesh::orient(*a, *b, place);
            let between = (a.1 <= place.1) != (b.1 <= place.1);
            if between && (side > 0.0) == (b.1 > a.1) {
                winding += if b.1 > a.1 { 1 } else { -1 };
            }
        }
    }
    winding != 0
}

/// Whether a straight way crosses no side and its middles between touched corners are free.
fn is_clear(outlines: &[Vec<Point>], a: Point, b: Point) -> bool {
    let mut touched = vec![0.0, 1.0];
    for ring in outlines {
        for (c, d) in ring.iter().zip(ring.iter().cycle().skip(1)) {
            if crosses(a, b, *c, *d) {
                return false;
            }
            let square = (b.0 - a.0).powi(2) + (b.1 - a.1).powi(2);
            let share = ((c.0 - a.0) * (b.0 - a.0) + (c.1 - a.1) * (b.1 - a.1)) / square;
            if mesh::orient(a, b, *c) == 0.0 && share > 0.0 && share < 1.0 {
                touched.push(share);
            }
        }
    }
    touched.sort_by(f64::total_cmp);
    touched.windows(2).filter(|pair| pair[1] - pair[0] > 1e-9).all(|pair| {
        let share = f64::midpoint(pair[0], pair[1]);
        let middle = (a.0 + (b.0 - a.0) * share, a.1 + (b.1 - a.1) * share);
        is_free(outlines, middle) || on_border(outlines, middle)
    })
}

fn on_border(outlines: &[Vec<Point>], place: Point) -> bool {
    outlines.iter().any(|ring| {
        ring.iter().zip(ring.iter().cycle().skip(1)).any(|(a, b)| {
            let side = (b.0 - a.0, b.1 - a.1);
            let to = (place.0 - a.0, place.1 - a.1);
            let length = side.0.hypot(side.1);
            let share = (side.0 * to.0 + side.1 * to.1) / (length * length);
            (side.0 * to.1 - side.1 * to.0).abs() < 1e-6 * length && (0.0..=1.0).contains(&share)
        })
    })
}

/// The shortest way over all corners.
fn brute_force(outlines: &[Vec<Point>], start: Point, goal: Point) -> Option<f64> {
    let mut points = vec![start, goal];
    points.extend(outlines.iter().flatten());
    let mut lengths = vec![f64::INFINITY; points.len()];
    let mut done = vec![false; points.len()];
    lengths[0] = 0.0;
    while let Some(at) = (0..points.len())
        .filter(|&at| !done[at] && lengths[at].is_finite())
        .min_by(|&a, &b| lengths[a].total_cmp(&lengths[b]))
    {
        if at == 1 {
            return Some(lengths[1]);
        }
        done[at] = true;
        for next in 0..points.len() {
            let length = lengths[at] + search::distance(points[at], points[next]);
            if length < lengths[next] && is_clear(outlines, points[at], points[next]) {
                lengths[next] = length;
            }
        }
    }
    None
}

#[test]
fn ways_are_shortest_and_never_cut_a_zone() {
    let mut random = fastrand::Rng::with_seed(11);
    let (mut found, mut turned, mut apart) = (0, 0, 0);
    for _ in 0..8 {
        let map = random_map(&mut random, 4, 5_000.0);
        let Ok(space) = FreeSpace::new(&map, &always()) else { continue };
        let outlines = space.outlines();
        for _ in 0..4 {
            let mut place = || (random.f64() * 5_000.0, random.f64() * 5_000.0);
            let (start, goal) = (place(), place());
            assert_eq!(space.contains(start), is_free(&outlines, start), "{start:?}");
            if !(is_free(&outlines, start) && is_free(&outlines, goal)) {
                assert!(space.route(start, goal).is_err());
                continue;
            }
            match (space.route(start, goal), brute_force(&outlines, start, goal)) {
                (Ok(route), Some(length)) => {
                    let share = (route.length_m - length).abs() / length;
                    assert!(share < 1e-9, "{} but {length}: {start:?} {goal:?} {map:?}", route.length_m);
                    for pair in route.points.windows(2) {
                        assert!(is_clear(&outlines, pair[0], pair[1]), "{pair:?} {map:?}");
                        keeps_out(&map, pair[0], pair[1]);
                    }
                    found += 1;
                    turned += usize::from(route.points.len() > 2);
                }
                (Err(RouteError::Disconnected), None) => apart += 1,
                (ours, theirs) => panic!("{ours:?} but {theirs:?}: {start:?} {goal:?} {map:?}"),
            }
        }
    }
    assert!(found > 8 && turned > 3, "{found} ways, {turned} with turns, {apart} apart");
}

/// Samples of a way keep their distance from the zones as they were given.
fn keeps_out(map: &[Zone], a: Point, b: Point) {
    for zone in map.iter().filter(|zone| zone.kind == ZoneKind::KeepOut) {
        for sample in 0..=60 {
            let share = f64::from(sample) / 60.0;
            let place = (a.0 + (b.0 - a.0) * share, a.1 + (b.1 - a.1) * share);
            let room = match &zone.boundary {
                Boundary::Circle { center, radius_m } => search::distance(*center, place) - radius_m,
                _ => {
                    let corners = vec![zone::corners(zone).unwrap()];
                    let inside = is_free(&corners, place);
                    let sides = corners[0].iter().zip(corners[0].iter().cycle().skip(1));
                    let near = |(a, b): (&Point, &Point)| {
                        let (along, to) = ((b.0 - a.0, b.1 - a.1), (place.0 - a.0, place.1 - a.1));
                        let square = along.0 * along.0 + along.1 * along.1;
                        let share = ((along.0 * to.0 + along.1 * to.1) / square).clamp(0.0, 1.0);
                        search::distance(place, (a.0 + along.0 * share, a.1 + along.1 * share))
                    };
                    let least = sides.map(near).fold(f64::INFINITY, f64::min);
                    if inside { -least } else { least }
                }
            };
            assert!(room >= zone.padding_m, "{room} m from zone {}: {zone:?}", zone.id);
        }
    }
}

#[test]
fn what_is_wrong_is_told() {
    let map = [
        box_at(1, ZoneKind::KeepIn, (0.0, 0.0), (1000.0, 1000.0)),
        box_at(2, ZoneKind::KeepOut, (400.0, -10.0), (100.0, 1100.0)),
    ];
    let space = FreeSpace::new(&map, &always()).unwrap();
    let (west, east) = ((100.0, 500.0), (900.0, 500.0));
    assert_eq!(space.route(west, east), Err(RouteError::Disconnected));
    let inside = space.route((410.0, 500.0), west).unwrap_err();
    let RouteError::InKeepOut { zone, nearest, distance_m, .. } = inside else { panic!("{inside:?}") };
    assert!(zone == 2 && (nearest.0 - 399.998).abs() < 0.01 && (distance_m - 10.002).abs() < 0.01);
    let outside = space.route(west, (-5.0, 5.0)).unwrap_err();
    assert!(matches!(outside, RouteError::OutsideKeepIn { end: RouteEnd::Goal, .. }), "{outside:?}");
    assert_eq!(space.route((f64::NAN, 0.0), west), Err(RouteError::NotAPlace(RouteEnd::Start)));
    let all = [map[0].clone(), box_at(3, ZoneKind::KeepOut, (-9.0, -9.0), (2000.0, 2000.0))];
    assert_eq!(FreeSpace::new(&all, &always()).unwrap_err(), SpaceError::Empty);
    let line = Zone::new(4, ZoneKind::KeepOut, Boundary::Polygon(vec![(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)]));
    let told = FreeSpace::new(&[line], &always()).unwrap_err().to_string();
    assert!(told.contains("zone 4: its outline has no area"), "{told}");
}

#[test]
fn zones_hold_for_some_at_some_height_and_some_time() {
    let wall = box_at(2, ZoneKind::KeepOut, (400.0, -5_000.0), (100.0, 10_000.0));
    let (west, east) = ((0.0, 0.0), (1000.0, 0.0));
    let length = |zone: &Zone, conditions: Conditions| {
        FreeSpace::new(std::slice::from_ref(zone), &conditions).unwrap().route(west, east).unwrap().length_m
    };
    assert!(length(&wall, always()) > 9_000.0);
    let others = Zone { affected: vec![7], ..wall.clone() };
    let high = Zone { altitude_m: (500.0, 900.0), ..wall.clone() };
    let later = Zone { time_ms: (1_000, 2_000), ..wall.clone() };
    for zone in [&others, &high, &later] {
        assert_eq!(length(zone, always()), 1000.0);
    }
    assert!(length(&others, Conditions { vehicle: 7, ..always() }) > 9_000.0);
    assert!(length(&high, Conditions { altitude_m: (0.0, 600.0), ..always() }) > 9_000.0);
    assert!(length(&later, Conditions { time_ms: (0, 1_500), ..always() }) > 9_000.0);
    // A lake with an island, for boats alone.
    let lake = box_at(3, ZoneKind::Water, (-100.0, -100.0), (1200.0, 200.0));
    let boat = Conditions { on_water: true, ..always() };
    let space = FreeSpace::new(std::slice::from_ref(&lake), &boat).unwrap();
    assert!(space.contains(west) && !space.contains((0.0, 200.0)));
    assert!(FreeSpace::new(&[lake], &always()).unwrap().contains((0.0, 200.0)));
}

#[test]
fn a_ring_of_zones_keeps_its_hole() {
    let wall = |id, corner, size| box_at(id, ZoneKind::KeepOut, corner, size);
    let ring = [
        wall(1, (0.0, 0.0), (100.0, 10.0)),
        wall(2, (0.0, 90.0), (100.0, 10.0)),
        wall(3, (0.0, 0.0), (10.0, 100.0)),
        wall(4, (90.0, 0.0), (10.0, 100.0)),
    ];
    let space = FreeSpace::new(&ring, &always()).unwrap();
    assert!(space.contains((50.0, 50.0)), "the hole is free");
    assert_eq!(space.route((-50.0, 50.0), (50.0, 50.0)), Err(RouteError::Disconnected));
    assert_eq!(space.route((20.0, 50.0), (80.0, 50.0)).unwrap().length_m, 60.0);
}
