//! A made-up town: ways, closed roads, the ways out of it.

use super::{Osm, OsmConfig};
use crate::plan::geodesy::{Place, Plane};
use crate::plan::roads::OneWay;
use crate::service::{Action, Outbox};
use crate::uxas::machine::{Heard, Machine, Post};
use aldis_envelope::lmcp::cmasi::{Circle, KeepOutZone, Location3D, OperatingRegion};
use aldis_envelope::lmcp::route::{
    EgressRouteRequest, EgressRouteResponse, RoadPointsConstraints, RoadPointsRequest, RoadPointsResponse,
    RouteConstraints, RoutePlan, RoutePlanRequest, RoutePlanResponse,
};
use aldis_envelope::lmcp::vehicles::{GroundVehicleConfiguration, SurfaceVehicleConfiguration};
use aldis_envelope::lmcp::{Object, Ref, decode};
use aldis_envelope::{EntityId, Monotonic, Now, ServiceId, Source, Wall};
use bytes::Bytes;

const TOWN: &[u8] = include_bytes!("town.osm");

const CAR: i64 = 700;
const BOAT: i64 = 400;

fn source() -> Source {
    Source::new(EntityId::new(100).unwrap(), ServiceId::new(104).unwrap())
}

fn hear(osm: &mut Osm, object: &dyn Object) -> Vec<Box<dyn Object>> {
    let mut out = Outbox::new(source());
    let now = Now { monotonic: Monotonic::START, wall: Wall(0) };
    osm.take(&Heard { object, source: source() }, &mut Post::new(now, &mut out));
    let sent = out.drain().filter_map(|action| match action {
        Action::Send(message) => decode(&message.content).ok(),
        _ => None,
    });
    sent.collect()
}

fn at(latitude: f64, longitude: f64) -> Ref<Location3D> {
    Ref::new(Location3D { latitude, longitude, ..Location3D::default() })
}

fn metres(a: (f64, f64), b: (f64, f64)) -> f64 {
    let place = |(latitude_deg, longitude_deg)| Place { latitude_deg, longitude_deg };
    Plane::new(place(a)).distance_m(place(a), place(b))
}

/// The zone of the town, around a place.
fn zone(latitude: f64, longitude: f64) -> KeepOutZone {
    let around = Circle { center_point: at(latitude, longitude), radius: 100.0, ..Circle::default() };
    let mut zone = KeepOutZone::default();
    (zone.zone_id, zone.boundary) = (5, Ref::new(around));
    zone
}

/// A planner that knows a car, a boat, and a region in which a zone lies on the road to the west.
fn town() -> Osm {
    let mut osm = Osm::new(OsmConfig::new(Bytes::from_static(TOWN), OneWay::Respect).unwrap());
    let mut car = GroundVehicleConfiguration::default();
    (car.id, car.nominal_speed) = (CAR, 10.0);
    let mut boat = SurfaceVehicleConfiguration::default();
    (boat.id, boat.nominal_speed) = (BOAT, 10.0);
    let zone = zone(60.005, 20.0);
    let region = OperatingRegion { id: 9, keep_out_areas: vec![5], ..OperatingRegion::default() };
    for object in [&car as &dyn Object, &boat, &zone, &region] {
        assert!(hear(&mut osm, object).is_empty());
    }
    osm
}

/// The plans of a vehicle's routes, with their waypoints.
fn routes(osm: &mut Osm, vehicle: i64, region: i64, ends: &[[(f64, f64); 2]]) -> Vec<RoutePlan> {
    let asked = ends.iter().zip(1..).map(|(&[from, to], route_id)| {
        Ref::new(RouteConstraints {
            route_id,
            start_location: at(from.0, from.1),
            end_location: at(to.0, to.1),
            ..RouteConstraints::default()
        })
    });
    let request = RoutePlanRequest {
        request_id: 3,
        vehicle_id: vehicle,
        operating_region: region,
        route_requests: asked.collect(),
        is_cost_only_request: false,
        ..RoutePlanRequest::default()
    };
    let sent = hear(osm, &request);
    let response = sent.first().and_then(|told| told.get::<RoutePlanResponse>());
    let plans = response.map(|response| response.route_responses.as_slice()).unwrap_or_default();
    plans.iter().filter_map(|plan| plan.get().cloned()).collect()
}

fn why(plan: &RoutePlan) -> &str {
    assert_eq!((plan.route_cost, plan.waypoints.len()), (-1, 0));
    plan.route_error[0].get().unwrap().value.as_str()
}

#[test]
fn a_car_goes_along_roads_and_around_the_closed_one() {
    let mut osm = town();
    let (middle, north, west) = ((60.0, 20.0), (60.01, 20.0), (60.0, 19.98));
    let [free, closed] = [0, 9].map(|region| routes(&mut osm, CAR, region, &[[middle, north]]).remove(0));
    let cost = |metres: f64| (metres / 10.0 * 1000.0) as i64;
    assert_eq!(free.route_cost, cost(metres(middle, north)));
    // By the lane in the west, which leads this way.
    let around = metres(middle, west) + metres(west, north);
    assert!((closed.route_cost - cost(around)).abs() <= 1, "{} {}", closed.route_cost, cost(around));
    let list: Vec<_> = closed.waypoints.iter().map(|at| at.get().unwrap()).collect();
    let last = list.last().unwrap();
    assert_eq!((list.len(), last.latitude, last.longitude, last.next_waypoint), (2, 60.01, 20.0, 2));
    assert!(list.iter().all(|at| at.speed == 10.0));
    // A one-way road is driven its way alone.
    let lane = metres(west, north);
    let [there, back] =
        [[west, north], [north, west]].map(|ends| routes(&mut osm, CAR, 0, &[ends]).remove(0));
    assert!((there.route_cost - cost(lane)).abs() <= 1);
    assert!(back.route_cost > cost(lane) + 10_000, "{}", back.route_cost);
}

#[test]
fn each_route_is_answered_and_boats_are_left_to_others() {
    let mut osm = town();
    let plans = routes(&mut osm, CAR, 0, &[[(60.0, 20.0), (60.1, 20.005)], [(60.0, 20.0), (60.0, 20.01)]]);
    assert!(why(&plans[0]).contains("to way 104"), "{:?}", plans[0]);
    assert!(plans[1].route_cost > 0);
    assert!(why(&routes(&mut osm, 701, 0, &[[(60.0, 20.0), (60.0, 20.01)]])[0]).contains("Entity Id[701]"));
    assert!(why(&routes(&mut osm, CAR, 4, &[[(60.0, 20.0), (60.0, 20.01)]])[0]).contains("Region Id[4]"));
    assert!(routes(&mut osm, BOAT, 0, &[[(60.0, 20.0), (60.0, 20.01)]]).is_empty());
    // What changes is seen by the next request.
    let elsewhere = zone(60.05, 20.05);
    hear(&mut osm, &elsewhere);
    let opened = routes(&mut osm, CAR, 9, &[[(60.0, 20.0), (60.01, 20.0)]]).remove(0);
    assert_eq!(opened.route_cost, (metres((60.0, 20.0), (60.01, 20.0)) / 10.0 * 1000.0) as i64);
}

#[test]
fn ways_out_of_a_place_and_the_points_between_two() {
    let mut osm = town();
    let request = EgressRouteRequest { request_id: 4, start_location: at(60.0, 20.0), radius: 300.0 };
    let sent = hear(&mut osm, &request);
    let egress = sent[0].get::<EgressRouteResponse>().unwrap();
    assert_eq!((egress.response_id, egress.node_locations.len()), (4, 4));
    for (found, wanted) in egress.headings.iter().zip([0.0_f32, 90.0, 180.0, 270.0]) {
        let apart = (found - wanted + 180.0).rem_euclid(360.0) - 180.0;
        assert!(apart.abs() < 0.1, "{:?}", egress.headings);
    }
    for at in &egress.node_locations {
        let at = at.get().unwrap();
        assert!((metres((60.0, 20.0), (at.latitude, at.longitude)) - 300.0).abs() < 0.01);
    }
    let asked = [(1, (60.0, 20.02)), (2, (60.1, 20.005))].map(|(road_points_id, (latitude, longitude))| {
        let (start_location, end_location) = (at(60.01, 20.0), at(latitude, longitude));
        Ref::new(RoadPointsConstraints { road_points_id, start_location, end_location })
    });
    let sent = hear(&mut osm, &RoadPointsRequest { request_id: 6, road_points_requests: asked.to_vec() });
    let told = sent[0].get::<RoadPointsResponse>().unwrap();
    let counts: Vec<_> =
        told.road_points_responses.iter().map(|line| line.get().unwrap().line.len()).collect();
    assert_eq!((told.response_id, counts), (6, vec![3, 0]));
}

#[test]
fn a_file_without_roads_is_told() {
    assert!(OsmConfig::new(Bytes::from_static(b"<osm/>"), OneWay::Respect).is_err());
}
