//! OsmPlanner: ways of ground vehicles along the roads of an OpenStreetMap file.
//!
//! | what comes | what it does |
//! | --- | --- |
//! | zones, regions, configurations | keeps them |
//! | `RoutePlanRequest` in its mailbox, or to all for a ground vehicle that it knows | answers the sender with one plan for each route, always |
//! | `EgressRouteRequest` | answers the sender with where roads cross the circle, and their headings outwards |
//! | `RoadPointsRequest` | answers the sender with the places of the way along roads between each two |
//!
//! A way begins and ends on the road that is nearest, and passes no zone of its region. A route that cannot be has the cost -1 and
//! says why in `RouteError`. Configuration: `osm_file`, `ignore_one_way` (false).

use super::ground::Point;
use super::machine::{Heard, Machine, Post, pair};
use super::planner::{PlannerConfig, region};
use super::vehicle::{Medium, Vehicle};
use super::world::World;
use crate::plan::geodesy::Place;
use crate::plan::roads::{OneWay, RoadRoute, Roads, RoadsError};
use aldis_envelope::lmcp::cmasi::{
    AbstractZone, EntityConfiguration, Location3D, OperatingRegion, RemoveEntities, RemoveZones, Waypoint,
};
use aldis_envelope::lmcp::impact::LineOfInterest;
use aldis_envelope::lmcp::route::{
    EgressRouteRequest, EgressRouteResponse, RoadPointsRequest, RoadPointsResponse, RouteConstraints,
    RoutePlan, RoutePlanRequest, RoutePlanResponse,
};
use aldis_envelope::lmcp::{Ref, Struct, TypeInfo};
use bytes::Bytes;
use std::collections::BTreeMap;
use std::fmt;

/// How many regions' roads are kept.
const REGIONS_MAX: usize = 16;

/// How it is configured: roads that were read.
#[derive(Clone, PartialEq)]
pub struct OsmConfig {
    document: Bytes,
    one_way: OneWay,
}

impl fmt::Debug for OsmConfig {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "OsmConfig {{ {} bytes, {:?} }}", self.document.len(), self.one_way)
    }
}

impl OsmConfig {
    /// The roads of a document.
    ///
    /// # Errors
    /// What is wrong with the document.
    pub fn new(document: Bytes, one_way: OneWay) -> Result<Self, RoadsError> {
        Roads::read(&document)?;
        Ok(Self { document, one_way })
    }
}

/// The machine.
pub struct Osm {
    config: OsmConfig,
    world: World,
    /// The roads that a region leaves open, by region and vehicle; all of one version of the world.
    regions: BTreeMap<(i64, i64), Result<Roads, String>>,
    /// All roads.
    roads: Option<Roads>,
    version: u64,
}

impl Osm {
    /// A planner that knows no vehicle yet.
    pub fn new(config: OsmConfig) -> Self {
        let roads = Roads::read(&config.document).ok();
        Self { config, world: World::default(), regions: BTreeMap::new(), roads, version: 0 }
    }

    fn vehicle(&self, id: i64) -> Result<Vehicle, String> {
        let entity = self.world.configurations.get(&id);
        let entity =
            entity.ok_or_else(|| format!("EntityConfiguration for Entity Id[{id}] not available"))?;
        Vehicle::of(entity.as_ref()).ok_or_else(|| format!("entity {id} does not move"))
    }

    /// Opens the roads of a request's region; its key.
    fn prepare(&mut self, request: &RoutePlanRequest, vehicle: Vehicle) -> (i64, i64) {
        if self.version != self.world.version {
            (self.version, self.regions) = (self.world.version, BTreeMap::new());
        }
        let key = (request.operating_region, vehicle.id);
        if !self.regions.contains_key(&key) {
            if self.regions.len() >= REGIONS_MAX {
                self.regions.pop_first();
            }
            let opened = self.open(request, vehicle);
            self.regions.insert(key, opened);
        }
        key
    }

    /// The pieces of roads that no zone lies on.
    fn open(&self, request: &RoutePlanRequest, vehicle: Vehicle) -> Result<Roads, String> {
        let id = request.operating_region;
        let roads = Roads::read(&self.config.document).map_err(|why| why.to_string())?;
        if id == 0 {
            return Ok(roads);
        }
        if !self.world.regions.contains_key(&id) {
            return Err(format!("OperatingRegion Id[{id}] not available"));
        }
        let first =
            request.route_requests.iter().find_map(|asked| asked.get()?.start_location.get().cloned());
        let (first, config) = (first.unwrap_or_default(), PlannerConfig::default());
        let region = region::build(&self.world, id, vehicle, first, &config)?;
        let point = |place: Place| -> Point { region.ground.point(&location(place)) };
        Ok(roads.only(|from, to| region.space.sees(point(from), point(to))))
    }

    fn answer(&mut self, request: &RoutePlanRequest) -> RoutePlanResponse {
        let prepared =
            self.vehicle(request.vehicle_id).map(|vehicle| (vehicle, self.prepare(request, vehicle)));
        let route = |asked: &RouteConstraints| {
            let mut plan = RoutePlan { route_id: asked.route_id, ..RoutePlan::default() };
            let found = prepared.as_ref().map_err(Clone::clone).and_then(|(vehicle, key)| {
                let roads =
                    self.regions.get(key).ok_or("the region is gone")?.as_ref().map_err(Clone::clone)?;
                let way = self.way(roads, &asked.start_location, &asked.end_location)?;
                let time = vehicle.time_ms(way.length_m);
                Ok((
                    time.ok_or_else(|| format!("vehicle {} has no NominalSpeed", vehicle.id))?,
                    way,
                    *vehicle,
                ))
            });
            match found {
                Ok((cost, way, vehicle)) => {
                    plan.route_cost = cost;
                    if !request.is_cost_only_request {
                        plan.waypoints = waypoints(&way, &vehicle);
                    }
                }
                Err(why) => plan.route_error.push(pair("OsmPlanner", &why)),
            }
            Ref::new(plan)
        };
        let route_responses =
            request.route_requests.iter().filter_map(|asked| asked.get()).map(route).collect();
        RoutePlanResponse {
            response_id: request.request_id,
            associated_task_id: request.associated_task_id,
            vehicle_id: request.vehicle_id,
            operating_region: request.operating_region,
            route_responses,
        }
    }

    fn way(&self, roads: &Roads, from: &Ref<Location3D>, to: &Ref<Location3D>) -> Result<RoadRoute, String> {
        let place = |at: &Ref<Location3D>, what: &str| {
            at.get().map(place).ok_or_else(|| format!("the {what} of the route is not given"))
        };
        let (from, to) = (place(from, "start")?, place(to, "goal")?);
        roads.route(from, to, self.config.one_way).map_err(|why| why.to_string())
    }

    fn egress(&self, request: &EgressRouteRequest, post: &mut Post<'_>) -> EgressRouteResponse {
        let mut response =
            EgressRouteResponse { response_id: request.request_id, ..EgressRouteResponse::default() };
        let found = match (request.start_location.get(), &self.roads) {
            (Some(at), Some(roads)) => {
                roads.crossings(place(at), f64::from(request.radius)).map_err(|why| why.to_string())
            }
            _ => Err("StartLocation is not given".to_owned()),
        };
        match found {
            Ok(crossings) => {
                response.node_locations = crossings.iter().map(|at| Ref::new(location(at.place))).collect();
                response.headings = crossings.iter().map(|at| at.heading_deg as f32).collect();
            }
            // The answer has no place for a cause.
            Err(why) => post.note(crate::service::Level::Warning, format!("EgressRouteRequest: {why}")),
        }
        response
    }

    /// The ways between places; one that cannot be has no points.
    fn points(&self, request: &RoadPointsRequest, post: &mut Post<'_>) -> RoadPointsResponse {
        let mut lines = Vec::new();
        for asked in request.road_points_requests.iter().filter_map(|asked| asked.get()) {
            let found = self.roads.as_ref().ok_or_else(|| "there are no roads".to_owned());
            let found = found.and_then(|roads| self.way(roads, &asked.start_location, &asked.end_location));
            let places = found.map(|way| way.places).unwrap_or_else(|why| {
                let text = format!("RoadPointsRequest {}: {why}", asked.road_points_id);
                post.note(crate::service::Level::Warning, text);
                Vec::new()
            });
            lines.push(Ref::new(LineOfInterest {
                line_id: asked.road_points_id,
                line: places.into_iter().map(|at| Ref::new(location(at))).collect(),
                ..LineOfInterest::default()
            }));
        }
        RoadPointsResponse { response_id: request.request_id, road_points_responses: lines }
    }
}

fn place(at: &Location3D) -> Place {
    Place { latitude_deg: at.latitude, longitude_deg: at.longitude }
}

fn location(place: Place) -> Location3D {
    Location3D { latitude: place.latitude_deg, longitude: place.longitude_deg, ..Location3D::default() }
}

/// The places after the start.
fn waypoints(way: &RoadRoute, vehicle: &Vehicle) -> Vec<Ref<Waypoint>> {
    let places = if way.places.len() > 1 { &way.places[1..] } else { &way.places };
    let last = places.len() as i64;
    let waypoint = |(&at, number): (&Place, i64)| {
        Ref::new(Waypoint {
            base: Location3D {
                altitude: vehicle.altitude_m,
                altitude_type: vehicle.altitude_type,
                ..location(at)
            },
            number,
            next_waypoint: (number + 1).min(last),
            speed: vehicle.speed_m_per_s as f32,
            ..Waypoint::default()
        })
    };
    places.iter().zip(1..).map(waypoint).collect()
}

impl Machine for Osm {
    fn hears(&self) -> Vec<&'static TypeInfo> {
        vec![
            RoutePlanRequest::TYPE,
            EgressRouteRequest::TYPE,
            RoadPointsRequest::TYPE,
            AbstractZone::TYPE,
            OperatingRegion::TYPE,
            EntityConfiguration::TYPE,
            RemoveZones::TYPE,
            RemoveEntities::TYPE,
        ]
    }

    fn mailboxes(&self) -> Vec<String> {
        vec![Medium::Ground.mailbox().to_owned()]
    }

    fn take(&mut self, heard: &Heard<'_>, post: &mut Post<'_>) {
        if let Some(request) = heard.object.get::<RoutePlanRequest>() {
            let known = self.world.configurations.get(&request.vehicle_id);
            if known
                .and_then(|entity| Vehicle::of(entity.as_ref()))
                .is_some_and(|one| one.medium != Medium::Ground)
            {
                return;
            }
            let response = self.answer(request);
            post.reply(heard.source, &response);
        } else if let Some(request) = heard.object.get::<EgressRouteRequest>() {
            let response = self.egress(request, post);
            post.reply(heard.source, &response);
        } else if let Some(request) = heard.object.get::<RoadPointsRequest>() {
            let response = self.points(request, post);
            post.reply(heard.source, &response);
        } else {
            self.world.take(heard.object);
        }
    }
}

#[cfg(test)]
mod tests;
