//! RoutePlannerVisibility: ways of single vehicles through an operating region.
//!
//! | what comes | what it does |
//! | --- | --- |
//! | zones, regions, configurations | keeps them; what was prepared for older ones is dropped and made anew when asked for |
//! | `RoutePlanRequest`, to all or in a mailbox of its own | answers the sender with one plan for each route, always |
//!
//! A route that cannot be has the cost -1 and says why in `RouteError`; the others of its batch have theirs. Ways keep
//! clear of zones on their turns too, and cost what they are long. Configuration: `mailboxes` (those of air and surface
//! vehicles), `turn_radius_offset_m` (0), `minimum_waypoint_separation_m` (50), `compat_cost` (false: the reference's
//! flat earth, straight ways, whole metres).

pub(super) mod region;
mod route;

use super::ground::Ground;
use super::machine::{Heard, Machine, Post};
use super::vehicle::Vehicle;
use super::world::World;
use aldis_envelope::lmcp::cmasi::{
    AbstractZone, EntityConfiguration, Location3D, OperatingRegion, RemoveEntities, RemoveZones,
};
use aldis_envelope::lmcp::route::{RoutePlan, RoutePlanRequest, RoutePlanResponse};
use aldis_envelope::lmcp::{Ref, Struct, TypeInfo};
use region::Region;
use std::collections::BTreeMap;

/// How many prepared regions are kept.
const REGIONS_MAX: usize = 64;

/// How it is configured.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannerConfig {
    /// The mailboxes that it reads.
    pub mailboxes: Vec<String>,
    /// How much wider than they must vehicles turn, in metres.
    pub turn_radius_offset_m: f64,
    /// How far apart waypoints on turns are at least, in metres.
    pub minimum_waypoint_separation_m: f64,
    /// Whether it measures as the reference does.
    pub compat_cost: bool,
}

impl Default for PlannerConfig {
    fn default() -> Self {
        Self {
            mailboxes: ["AircraftPathPlanner", "SurfacePathPlanner"].map(str::to_owned).to_vec(),
            turn_radius_offset_m: 0.0,
            minimum_waypoint_separation_m: 50.0,
            compat_cost: false,
        }
    }
}

/// The machine.
pub struct Planner {
    config: PlannerConfig,
    world: World,
    /// What was prepared, by region and vehicle; all of one version of the world.
    regions: BTreeMap<(i64, i64), Result<Region, String>>,
    version: u64,
}

impl Planner {
    /// A planner that knows no region yet.
    pub fn new(config: PlannerConfig) -> Self {
        Self { config, world: World::default(), regions: BTreeMap::new(), version: 0 }
    }

    fn answer(&mut self, request: &RoutePlanRequest) -> RoutePlanResponse {
        if self.version != self.world.version {
            (self.version, self.regions) = (self.world.version, BTreeMap::new());
        }
        let mut routes = Vec::with_capacity(request.route_requests.len());
        let prepared = self.prepare(request);
        for asked in request.route_requests.iter().filter_map(|asked| asked.get()) {
            let mut plan = RoutePlan { route_id: asked.route_id, ..RoutePlan::default() };
            let found = match &prepared {
                Ok(key) => match self.regions.get_mut(key) {
                    Some(Ok(region)) => region.route(asked, request.is_cost_only_request),
                    _ => Err("the region is gone".to_owned()),
                },
                Err(why) => Err(why.clone()),
            };
            match found {
                Ok((cost, waypoints)) => (plan.route_cost, plan.waypoints) = (cost, waypoints),
                Err(why) => plan.route_error.push(super::machine::pair("RoutePlanner", &why)),
            }
            routes.push(Ref::new(plan));
        }
        RoutePlanResponse {
            response_id: request.request_id,
            associated_task_id: request.associated_task_id,
            vehicle_id: request.vehicle_id,
            operating_region: request.operating_region,
            route_responses: routes,
        }
    }

    /// Prepares the region for the vehicle of a request.
    fn prepare(&mut self, request: &RoutePlanRequest) -> Result<(i64, i64), String> {
        let (id, who) = (request.operating_region, request.vehicle_id);
        let key = (id, who);
        if !self.regions.contains_key(&key) {
            if self.regions.len() >= REGIONS_MAX {
                self.regions.pop_first();
            }
            let made = self.region(request);
            self.regions.insert(key, made);
        }
        match self.regions.get(&key) {
            Some(Err(why)) => Err(why.clone()),
            _ => Ok(key),
        }
    }

    fn region(&self, request: &RoutePlanRequest) -> Result<Region, String> {
        let (id, who) = (request.operating_region, request.vehicle_id);
        let configuration = self.world.configurations.get(&who);
        let configuration =
            configuration.ok_or_else(|| format!("EntityConfiguration for Entity Id[{who}] not available"))?;
        let mut vehicle =
            Vehicle::of(configuration.as_ref()).ok_or_else(|| format!("entity {who} does not move"))?;
        if vehicle.speed_m_per_s.is_nan() || vehicle.speed_m_per_s <= 0.0 {
            return Err(format!("vehicle {who} has no NominalSpeed: routes cannot be timed"));
        }
        if vehicle.turn_radius_m > 0.0 {
            vehicle.turn_radius_m += self.config.turn_radius_offset_m;
        }
        if id != 0 && !self.world.regions.contains_key(&id) {
            return Err(format!("OperatingRegion Id[{id}] not available"));
        }
        let first =
            request.route_requests.iter().find_map(|asked| asked.get()?.start_location.get().cloned());
        region::build(&self.world, id, vehicle, first.unwrap_or_default(), &self.config)
    }
}

impl Machine for Planner {
    fn hears(&self) -> Vec<&'static TypeInfo> {
        vec![
            RoutePlanRequest::TYPE,
            AbstractZone::TYPE,
            OperatingRegion::TYPE,
            EntityConfiguration::TYPE,
            RemoveZones::TYPE,
            RemoveEntities::TYPE,
        ]
    }

    fn mailboxes(&self) -> Vec<String> {
        self.config.mailboxes.clone()
    }

    fn take(&mut self, heard: &Heard<'_>, post: &mut Post<'_>) {
        if let Some(request) = heard.object.get::<RoutePlanRequest>() {
            let response = self.answer(request);
            post.reply(heard.source, &response);
        } else {
            self.world.take(heard.object);
        }
    }
}

/// The plane of a region, around a place.
fn plane(origin: &Location3D, compat: bool) -> Ground {
    Ground::new(origin, compat)
}
