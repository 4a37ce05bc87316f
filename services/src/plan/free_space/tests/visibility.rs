//! The reference's eight maps. Where it flies through zones or leaves them out, ours is an error.

use super::*;
use crate::plan::flat_earth::FlatEarth;
use serde_json::Value;

/// A map as the reference read it, and what it answered line by line.
struct Map {
    origin: FlatEarth,
    zones: Vec<Zone>,
    vertices: Vec<Point>,
    queries: Vec<(Point, Point, f64, Value)>,
}

fn read(case: &Value) -> Map {
    let lines = case["input"].as_array().unwrap().iter().map(|line| line.as_str().unwrap());
    let mut answers = case["output"].as_array().unwrap().iter();
    let mut map = Map {
        origin: FlatEarth::new(0.0, 0.0),
        zones: Vec::new(),
        vertices: Vec::new(),
        queries: Vec::new(),
    };
    for line in lines {
        let (what, rest) = line.split_at(1);
        let numbers: Vec<f64> = rest.split_whitespace().map(|word| word.parse().unwrap()).collect();
        if what == "o" {
            map.origin = FlatEarth::new(numbers[0], numbers[1]);
            continue;
        }
        let answer = answers.next().unwrap();
        let place = |at: usize| map.origin.to_plane(numbers[at], numbers[at + 1]);
        match what {
            "p" => {
                let kind = if numbers[0] == 1.0 { ZoneKind::KeepIn } else { ZoneKind::KeepOut };
                let corners = (0..numbers[2] as usize).map(|corner| place(3 + corner * 2)).collect();
                let mut zone = Zone::new(map.zones.len() as i64, kind, Boundary::Polygon(corners));
                zone.padding_m = numbers[1];
                map.zones.push(zone);
            }
            "f" => {
                let vertex = |vertex: &Value| (vertex[0].as_f64().unwrap(), vertex[1].as_f64().unwrap());
                map.vertices = answer["verts"].as_array().unwrap().iter().map(vertex).collect();
            }
            "q" => {
                let query = (place(0), place(3), numbers[6], answer.clone());
                map.queries.push(query);
            }
            _ => panic!("{line}"),
        }
    }
    map
}

/// The reference's length: whole metres of each segment. The grid moves a corner by less than a thousandth of a metre, which
/// may carry a length over a whole metre, so corners are taken as they were given.
fn truncated(route: &Route, map: &Map) -> i64 {
    let corners = map.zones.iter().flat_map(|zone| zone::corners(zone).unwrap()).collect::<Vec<_>>();
    let given = |point: &Point| {
        let near = |corner: &&Point| search::distance(**corner, *point) < 1e-3;
        corners.iter().find(near).copied().unwrap_or(*point)
    };
    let points: Vec<Point> = route.points.iter().map(given).collect();
    points.windows(2).map(|pair| search::distance(pair[0], pair[1]) as i64).sum()
}

#[test]
fn maps_are_those_of_the_reference_or_repaired() {
    let Some(golden) = crate::plan::tests::golden("visibility_golden.json") else { return };
    let golden: Value = serde_json::from_str(&golden).unwrap();
    let cases = golden.as_object().unwrap();
    assert_eq!(cases.len(), 8);
    let (mut same, mut refused) = (0, Vec::new());
    for (name, case) in cases {
        let map = read(case);
        let space = FreeSpace::compat(&map.zones).unwrap();
        let frame = if map.zones.iter().any(|zone| zone.kind == ZoneKind::KeepIn) { 0 } else { 4 };
        // The reference loses holes: four walls around a place are one block to it.
        let holes = if name == "enclosed_goal" { 4 } else { 0 };
        assert_eq!(space.vertices(), map.vertices.len() + frame + holes, "{name}");
        let outlines = space.outlines();
        for vertex in &map.vertices {
            let apart = outlines.iter().flatten().map(|point| search::distance(*point, *vertex));
            // The reference's text and our grid each round to a thousandth of a metre.
            assert!(apart.fold(f64::INFINITY, f64::min) <= 1.5e-3, "{name}: {vertex:?} in {outlines:?}");
        }
        for (start, goal, speed, answer) in &map.queries {
            match space.route(*start, *goal) {
                Ok(route) => {
                    let length = truncated(&route, &map);
                    assert_eq!(length, answer["len_m"].as_i64().unwrap(), "{name}: {route:?}");
                    let cost = (length as f64 / speed * 1000.0) as i64;
                    assert!((cost - answer["cost_ms"].as_i64().unwrap()).abs() <= 1, "{name}: {route:?}");
                    same += 1;
                }
                Err(error) => refused.push((name.as_str(), error)),
            }
        }
    }
    let told: Vec<_> = refused
        .iter()
        .map(|(name, error)| {
            let what = match error {
                RouteError::InKeepOut { end, .. } => format!("{end:?} in a keep-out zone"),
                RouteError::OutsideKeepIn { end, .. } => format!("{end:?} outside"),
                other => other.to_string(),
            };
            format!("{name}: {what}")
        })
        .collect();
    // Repaired: the reference answers these with ways through zones or outside of what vehicles are kept in.
    let repaired = [
        "one_koz: Start in a keep-out zone",
        "one_koz: Goal in a keep-out zone",
        "kiz_koz: Goal outside",
        "kiz_koz: Start outside",
        "enclosed_goal: no way leads from the start to the goal: zones separate them",
    ];
    assert_eq!(told, repaired);
    assert_eq!(same, 20);
}
