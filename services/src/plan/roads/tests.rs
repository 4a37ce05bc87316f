//! A small town, a grid against every way there is, and documents that are none.

use super::*;

/// A square of roads of 0.01°, a one-way diagonal, a lone road, a footpath that is no road.
const TOWN: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<osm version="0.6" generator="hand">
 <bounds minlat="59.9" minlon="10" maxlat="60.1" maxlon="10.2"/>
 <way id="10"><nd ref="1"/><nd ref="2"/><nd ref="3"/><tag k="highway" v="residential"/></way>
 <node id="1" lat="60.00" lon="10.00"/>
 <node id="2" lat="60.00" lon="10.01"><tag k="name" v="corner &amp; more"/></node>
 <node id="3" lat="60.01" lon="10.01"/>
 <node id="4" lat="60.01" lon="10.00"/>
 <node id="5" lat="60.05" lon="10.00"/>
 <node id="6" lat="60.05" lon="10.01"/>
 <node id="7" lat="60.001" lon="10.00" visible="true"/>
 <way id="11"><nd ref="3"/><nd ref="4"/><nd ref="1"/><nd ref="99"/><tag k="highway" v="track"/></way>
 <way id="12"><nd ref="1"/><nd ref="3"/><tag k="oneway" v="yes"/><tag k="highway" v="service"/></way>
 <way id="13"><nd ref="5"/><nd ref="6"/><tag k="highway" v="path"/></way>
 <way id="14"><nd ref="7"/><nd ref="2"/><tag k="building" v="yes"/></way>
 <way id="15" action="delete"><nd ref="1"/><nd ref="5"/><tag k="highway" v="road"/></way>
 <relation id="16"><member type="way" ref="10" role=""/><tag k="highway" v="no"/></relation>
</osm>"#;

fn place(latitude_deg: f64, longitude_deg: f64) -> Place {
    Place { latitude_deg, longitude_deg }
}

fn metres(a: Place, b: Place) -> f64 {
    Plane::new(a).distance_m(a, b)
}

#[test]
fn ways_in_town_are_shortest_and_respect_one_way_roads() {
    let roads = Roads::read(TOWN.as_bytes()).unwrap();
    assert_eq!((roads.nodes(), roads.segments(), roads.missing_nodes()), (6, 6, 1));
    let corners = [place(60.0, 10.0), place(60.0, 10.01), place(60.01, 10.01), place(60.01, 10.0)];
    let there = roads.route(corners[0], corners[2], OneWay::Respect).unwrap();
    assert_eq!(there.places, [corners[0], corners[2]]);
    assert!((there.length_m - metres(corners[0], corners[2])).abs() < 1e-6);
    let back = roads.route(corners[2], corners[0], OneWay::Respect).unwrap();
    assert!(back.nodes == [3, 2, 1] || back.nodes == [3, 4, 1], "{back:?}");
    let around = metres(corners[0], corners[3]) + metres(corners[3], corners[2]);
    assert!((back.length_m - around).abs() < 0.2, "{back:?}");
    let ignored = roads.route(corners[2], corners[0], OneWay::Ignore).unwrap();
    assert!((ignored.length_m - there.length_m).abs() < 1e-6);
    // Beside the road, half way.
    let start = place(59.999, 10.005);
    let on = roads.nearest(start).unwrap();
    assert!(on.way == 10 && (on.distance_m - 111.4).abs() < 0.1, "{on:?}");
    let along = roads.route(start, place(60.0, 10.008), OneWay::Respect).unwrap();
    assert!(along.nodes.is_empty() && (along.on_road_m - 167.4).abs() < 0.2, "{along:?}");
    assert!((along.length_m - along.on_road_m - on.distance_m).abs() < 0.02);
}

#[test]
fn closed_roads_and_lone_roads_are_told() {
    let roads = Roads::read(TOWN.as_bytes()).unwrap();
    let (town, lone) = (place(60.0, 10.0), place(60.05, 10.005));
    let told = roads.route(town, lone, OneWay::Ignore).unwrap_err().to_string();
    assert!(told.contains("to way 13, the nearest to the goal"), "{told}");
    let told = roads.route(place(91.0, 0.0), lone, OneWay::Ignore).unwrap_err().to_string();
    assert!(told.contains("the start is no place: latitude 91"), "{told}");
    let open = roads.only(|a, b| a.latitude_deg > 60.0 || b.latitude_deg > 60.0);
    let around = open.route(town, place(60.0, 10.01), OneWay::Ignore).unwrap();
    assert_eq!(around.nodes, [1, 3, 2]);
    assert_eq!(around.places[around.places.len() - 1], place(60.0, 10.01));
    let none = open.only(|_, _| false);
    assert_eq!(none.route(town, lone, OneWay::Ignore), Err(RoadError::NoRoad));
    assert!(none.crossings(town, 5.0).unwrap().is_empty());
}

#[test]
fn roads_cross_a_circle_outwards() {
    let roads = Roads::read(TOWN.as_bytes()).unwrap();
    let center = place(60.0, 10.01);
    let found = roads.crossings(center, 200.0).unwrap();
    let headings: Vec<_> = found.iter().map(|crossing| crossing.heading_deg.round()).collect();
    assert_eq!(headings, [0.0, 270.0], "{found:?}");
    assert!(found.iter().all(|crossing| (metres(center, crossing.place) - 200.0).abs() < 1e-3));
    assert!(roads.crossings(center, f64::NAN).unwrap_err().to_string().contains("NaN"));
}

/// Roads in rows and columns, some left out, some one way.
fn grid(random: &mut fastrand::Rng, side: i64) -> String {
    let mut text = "<osm>".to_owned();
    for at in 0..side * side {
        let (row, column) = (at / side, at % side);
        let latitude = 60.0 + row as f64 * 0.001 + random.f64() * 3e-4;
        let longitude = -179.998 + column as f64 * 0.002 + random.f64() * 6e-4;
        // Over the antimeridian.
        let longitude = if longitude > -179.99 { longitude } else { longitude + 360.0 };
        text += &format!("<node id='{at}' lat='{latitude}' lon='{longitude}'/>");
        for next in [(column + 1 < side).then_some(at + 1), (row + 1 < side).then_some(at + side)] {
            if let Some(next) = next.filter(|_| random.u32(..5) != 0) {
                let one_way = ["no", "yes", "-1"][random.usize(..3)];
                let tags = format!("<tag k='highway' v='x'/><tag k='oneway' v='{one_way}'/>");
                text += &format!("<way id='{at}'><nd ref='{at}'/><nd ref='{next}'/>{tags}</way>");
            }
        }
    }
    text + "</osm>"
}

#[test]
fn no_way_is_shorter_and_no_road_nearer() {
    let mut random = fastrand::Rng::with_seed(6);
    let (mut found, mut apart) = (0, 0);
    for _ in 0..12 {
        let roads = Roads::read(grid(&mut random, 7).as_bytes()).unwrap();
        // Every way, by Floyd's and Warshall's steps.
        let count = roads.nodes.len();
        let mut all = vec![vec![f64::INFINITY; count]; count];
        (0..count).for_each(|at| all[at][at] = 0.0);
        for segment in &roads.segments {
            let (from, to) = (segment.from as usize, segment.to as usize);
            if segment.forth {
                all[from][to] = all[from][to].min(segment.metres);
            }
            if segment.back {
                all[to][from] = all[to][from].min(segment.metres);
            }
        }
        for over in 0..count {
            for from in 0..count {
                for to in 0..count {
                    all[from][to] = all[from][to].min(all[from][over] + all[over][to]);
                }
            }
        }
        for _ in 0..40 {
            let (from, to) = (random.usize(..count), random.usize(..count));
            let (start, goal) = (roads.nodes[from].place, roads.nodes[to].place);
            match roads.route(start, goal, OneWay::Respect) {
                Ok(route) => {
                    let best = all[from][to];
                    assert!((route.on_road_m - best).abs() < 1e-6, "{} but {best}", route.on_road_m);
                    found += 1;
                }
                Err(RoadError::Disconnected { .. }) => {
                    assert!(all[from][to].is_infinite());
                    apart += 1;
                }
                Err(other) => panic!("{other}"),
            }
            let point = (random.f64() * 1000.0 - 500.0, random.f64() * 1000.0 - 500.0);
            let nearest = roads.nearest(roads.plane.to_place(point)).unwrap();
            for segment in 0..roads.segments.len() as u32 {
                for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
                    let other = roads.plane.to_plane(roads.place_on(segment, share));
                    let distance = (other.0 - point.0).hypot(other.1 - point.1);
                    assert!(distance > nearest.distance_m - 0.01, "{distance} but {nearest:?}");
                }
            }
        }
    }
    assert!(found > 200 && apart > 20, "{found} ways, {apart} apart");
}

#[test]
fn documents_that_are_none_are_refused_with_the_line() {
    let told = |text: &str| Roads::read(text.as_bytes()).err().unwrap().to_string();
    let road = |nodes: &str| {
        format!("<osm>\n{nodes}\n<way id='1'><nd ref='1'/><nd ref='2'/><tag k='highway' v='x'/></way></osm>")
    };
    assert!(told("<gpx/>").contains("first element is `gpx`"));
    assert!(told("").contains("no road"));
    assert!(told("<osm><way id='1'>").contains("cut off"));
    assert!(told("<osm>\n\n<way></osm>").starts_with("line 3: "));
    assert!(told("<osm>\n<way id='x'/></osm>").contains("line 2: `id` = `x` is none"));
    assert!(told("<osm>\n<way/></osm>").contains("line 2: a `way` without `id`"));
    assert!(told(&road("")).contains("no road"));
    assert!(told(&road("<node id='1' lat='95' lon='0'/>")).contains("line 2: `lat` = `95` is none"));
    assert!(told(&road("<node id='1' lat='NaN' lon='0'/>")).contains("`lat` = `NaN`"));
    assert!(told(&road("<node id='1' lat='5' lon='inf'/>")).contains("lat"));
    let twice = "<node id='1' lat='5' lon='5'/><node id='1' lat='6' lon='5'/>";
    assert!(told(&road(twice)).contains("node 1 is elsewhere"));
    assert!(told(&"<osm>".repeat(50)).contains("too deep"));
    assert!(Roads::read(b"<osm>\xff").err().unwrap().to_string().contains("not UTF-8"));
    let bomb = "<!DOCTYPE osm [<!ENTITY a 'b'><!ENTITY c '&a;&a;'>]><osm><way id='&c;'/></osm>";
    assert!(told(bomb).contains("line 1: "));
}

#[test]
fn no_cut_and_no_changed_byte_makes_it_panic() {
    let mut random = fastrand::Rng::with_seed(1);
    for end in 0..TOWN.len() {
        let _ = Roads::read(&TOWN.as_bytes()[..end]);
    }
    for _ in 0..3_000 {
        let mut bytes = TOWN.as_bytes().to_vec();
        for _ in 0..random.usize(1..4) {
            let at = random.usize(..bytes.len());
            bytes[at] = random.u8(..);
        }
        if let Ok(roads) = Roads::read(&bytes) {
            let _ = roads.route(place(60.0, 10.0), place(60.01, 10.01), OneWay::Respect);
        }
    }
}
