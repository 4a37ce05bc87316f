//! Against the reference's six shapes and its recorded search of a river.

use super::*;
use crate::plan::flat_earth::FlatEarth;

/// The metres of line for each point that the reference keeps.
const SPACING_M: f64 = 200.0;

fn points(value: &serde_json::Value) -> Vec<Point> {
    let point = |point: &serde_json::Value| (point[0].as_f64().unwrap(), point[1].as_f64().unwrap());
    value.as_array().unwrap().iter().map(point).collect()
}

#[track_caller]
fn same(ours: &[Point], theirs: &serde_json::Value, what: &str) {
    let theirs = points(theirs);
    assert_eq!(ours.len(), theirs.len(), "{what}: {ours:?}");
    let apart = ours.iter().zip(&theirs).map(|(a, b)| far(*a, *b)).fold(0.0, f64::max);
    assert!(apart <= 1e-3, "{what}: {apart} m apart: {ours:?} but {theirs:?}");
}

#[test]
fn shapes_are_those_of_the_reference() {
    let Some(golden) = crate::plan::tests::golden("dpss_golden.txt") else { return };
    let lines: Vec<_> = golden.lines().collect();
    assert_eq!(lines.len(), 12);
    for case in lines.chunks_exact(2) {
        let numbers: Vec<f64> = case[0].split(' ').skip(1).map(|word| word.parse().unwrap()).collect();
        let line: Vec<_> = numbers[5..].chunks_exact(3).map(|point| (point[0], point[1])).collect();
        let search = LineSearch {
            azimuth_rad: numbers[0].to_radians(),
            elevation_rad: numbers[1].to_radians(),
            height_m: numbers[2],
            detail: Detail::Spacing(SPACING_M),
        };
        let found = search.path(&line).unwrap();
        let golden: serde_json::Value = serde_json::from_str(case[1]).unwrap();
        same(&found.line, &golden["planned"], case[0]);
        same(&found.path, &golden["forward"], case[0]);
        same(&found.stares, &golden["stare"], case[0]);
        assert!((found.length_m - golden["length"].as_f64().unwrap()).abs() <= 1e-3);
    }
}

/// The river of the recorded task, in degrees.
fn river() -> Vec<(f64, f64)> {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = path.join("../../shared/uxas/waterway-trace/05.LineSearchTask");
    let text = std::fs::read_to_string(path).unwrap();
    let all = |tag: &str| -> Vec<f64> {
        let open = format!("<{tag}>");
        let parts = text.split(&open).skip(1);
        parts.map(|part| part.split('<').next().unwrap().parse().unwrap()).collect()
    };
    all("Latitude").into_iter().zip(all("Longitude")).collect()
}

#[test]
fn the_river_costs_what_the_reference_found() {
    let Some(golden) = crate::plan::tests::golden("waterway_today_golden.json") else { return };
    let golden: serde_json::Value = serde_json::from_str(&golden).unwrap();
    let river = river();
    assert_eq!(river.len(), 90);
    // The origin is the first place that the reference converted: of the river, or of a vehicle. The recorded run had the first.
    let origin = FlatEarth::new(river[0].0, river[0].1);
    for (case, height_m, back) in [
        ("400 forward", 700.0, false),
        ("400 reverse", 700.0, true),
        ("500 forward", 1000.0, false),
        ("500 reverse", 1000.0, true),
    ] {
        let mut line: Vec<_> = river.iter().map(|place| origin.to_plane(place.0, place.1)).collect();
        if back {
            line.reverse();
        }
        let (azimuth_rad, elevation_rad) = (35_f64.to_radians(), -60_f64.to_radians());
        let search = LineSearch { azimuth_rad, elevation_rad, height_m, detail: Detail::Spacing(SPACING_M) };
        let found = search.path(&line).unwrap();
        let golden = &golden["origin_first_road_point"][case];
        assert_eq!(
            (found.length_m / 22.0 * 1000.0) as i64,
            golden["option_cost_ms"].as_i64().unwrap(),
            "{case}"
        );
        let places = golden["path_latlon"].as_array().unwrap();
        assert_eq!(found.path.len(), places.len(), "{case}");
        for (point, place) in found.path.iter().zip(places) {
            let (latitude, longitude) = origin.to_degrees(point.0, point.1);
            let apart = (latitude - place[0].as_f64().unwrap())
                .abs()
                .max((longitude - place[1].as_f64().unwrap()).abs());
            assert!(apart <= 1e-9, "{case}: {apart}°");
        }
    }
}

#[test]
fn detail_within_a_distance_keeps_the_line_in_sight() {
    let bend = |at: i32| (f64::from(at) * 20.0, (f64::from(at) / 9.0).sin() * 150.0);
    let line: Vec<_> = (0..=100).map(bend).collect();
    let search = |metres| LineSearch {
        azimuth_rad: 0.8,
        elevation_rad: -1.0,
        height_m: 50.0,
        detail: Detail::Within(metres),
    };
    let (coarse, fine) = (search(60.0).path(&line).unwrap(), search(5.0).path(&line).unwrap());
    assert!(coarse.line.len() < fine.line.len() && fine.line.len() < line.len() / 2);
    for point in &line {
        let near = |&metres: &f64| far(along(&fine.line, metres), *point);
        let metres: Vec<f64> = (0..3000).map(f64::from).collect();
        assert!(metres.iter().map(near).fold(f64::INFINITY, f64::min) <= 5.5);
    }
}

#[test]
fn lines_without_length_are_refused() {
    let search =
        LineSearch { azimuth_rad: 0.0, elevation_rad: -1.0, height_m: 9.0, detail: Detail::Spacing(200.0) };
    assert_eq!(search.path(&[(1.0, 1.0), (1.0, 1.0)]), Err(LineSearchError::NoLength));
    assert_eq!(search.path(&[(1.0, 1.0), (f64::NAN, 1.0)]), Err(LineSearchError::NotAPlace(1)));
}
