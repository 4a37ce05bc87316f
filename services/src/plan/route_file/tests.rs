//! Requests as files hold them.

use super::*;
use crate::plan::roads::Roads;

const BOAT: &str = r#"{
        "start": {"latitude": 60.0, "longitude": 179.97, "heading": 90},
        "goal": {"latitude": 60.0, "longitude": -179.97, "heading": 90},
        "turn_radius_m": 50,
        "zones": [{"id": 7, "kind": "keep_out", "circle": [60.0, 180.0, 500], "padding_m": 50}]
    }"#;

#[test]
fn a_boat_goes_around_a_zone_on_the_antimeridian() {
    let file: RouteFile = serde_json::from_str(BOAT).unwrap();
    let turning = file.plan().unwrap();
    let straight = RouteFile { turn_radius_m: None, ..file.clone() }.plan().unwrap();
    assert!(turning.arcs > 0 && straight.arcs == 0 && turning.length_m > straight.length_m);
    // Around a circle of 550 m half way along 3 346 m: by both tangents and the arc between them.
    let (half, radius) = (1_673.0_f64, 550.0_f64);
    let ideal = 2.0 * ((half * half - radius * radius).sqrt() + radius * (radius / half).asin());
    assert!((straight.length_m / ideal - 1.0).abs() < 0.01, "{} but {ideal}", straight.length_m);
    let plane = Plane::new(Place { latitude_deg: 60.0, longitude_deg: 180.0 });
    for place in turning.places.iter().chain(&straight.places) {
        let point = plane.to_plane(*place);
        assert!(point.0.hypot(point.1) >= 550.0, "{place:?}");
    }
}

#[test]
fn what_is_wrong_is_told_in_degrees() {
    let mut file: RouteFile = serde_json::from_str(BOAT).unwrap();
    file.start.longitude = 180.0;
    let told = file.plan().unwrap_err().to_string();
    assert!(told.contains("start lies in keep-out zone 7") && told.contains("latitude"), "{told}");
    file.zones[0].circle = None;
    assert_eq!(file.plan(), Err(RouteFileError::Outline(7)));
    file.goal.latitude = 91.0;
    assert!(file.plan().unwrap_err().to_string().contains("the goal: latitude 91"));
}

#[test]
fn speed_and_bank_angle_or_yaw_rate_give_the_turn() {
    let mut file: RouteFile = serde_json::from_str(BOAT).unwrap();
    let radius = |file: &RouteFile| file.turn_radius_m();
    assert_eq!(radius(&file), Ok(Some(50.0)));
    let plain = file.plan().unwrap();
    file.speed_m_per_s = Some(5.0);
    assert_eq!(radius(&file), Ok(Some(50.0)));
    (file.turn_radius_m, file.yaw_rate_deg_per_s) = (None, Some(0.1_f64.to_degrees()));
    assert!((radius(&file).unwrap().unwrap() - 50.0).abs() < 1e-9);
    assert!((file.plan().unwrap().length_m - plain.length_m).abs() < 1e-3);
    file.bank_angle_deg = Some(20.0);
    assert!(radius(&file).unwrap_err().to_string().contains("given twice"));
    (file.yaw_rate_deg_per_s, file.speed_m_per_s) = (None, Some(22.0));
    assert!((radius(&file).unwrap().unwrap() - 135.6).abs() < 0.01);
    file.bank_angle_deg = Some(90.0);
    assert!(radius(&file).unwrap_err().to_string().contains("`bank_angle_deg` of 90"));
    file.speed_m_per_s = None;
    assert!(radius(&file).unwrap_err().to_string().contains("need `speed_m_per_s`"));
}

#[test]
fn roads_lead_around_zones() {
    let node = |id: u8, longitude: f64, latitude: f64| {
        format!("<node id='{id}' lat='{latitude}' lon='{longitude}'/>")
    };
    let road = |id: u8, nodes: [u8; 3]| {
        let nodes: String = nodes.iter().map(|node| format!("<nd ref='{node}'/>")).collect();
        format!("<way id='{id}'>{nodes}<tag k='highway' v='track'/></way>")
    };
    // A straight road through the zone, and one around it.
    let places = [node(1, 179.97, 60.0), node(2, 180.0, 60.0), node(3, -179.97, 60.0), node(4, 180.0, 60.02)];
    let roads = || {
        let text = format!("<osm>{}{}{}</osm>", places.concat(), road(1, [1, 2, 3]), road(2, [1, 4, 3]));
        Roads::read(text.as_bytes()).unwrap()
    };
    let mut file: RouteFile = serde_json::from_str(BOAT).unwrap();
    assert_eq!(file.plan_on_roads(roads()).unwrap().nodes, [1, 4, 3]);
    file.zones[0].kind = KindRow::KeepIn;
    assert!(file.plan_on_roads(roads()).unwrap_err().to_string().contains("no road is open"));
    file.zones.clear();
    assert_eq!(file.plan_on_roads(roads()).unwrap().nodes, [1, 2, 3]);
}
