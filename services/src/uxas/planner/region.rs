//! An operating region as free space for one vehicle.

use super::{PlannerConfig, plane};
use crate::plan::free_space::{Boundary, Conditions, FreeSpace, RouteError, Zone, ZoneKind};
use crate::plan::turning::{Pose, TurningSpace};
use crate::uxas::ground::{Ground, Point, middle};
use crate::uxas::vehicle::{Medium, Vehicle};
use crate::uxas::world::World;
use aldis_envelope::lmcp::Object;
use aldis_envelope::lmcp::cmasi::{AbstractZone, Circle, KeepInZone, KeepOutZone, Location3D, Rectangle};
use aldis_envelope::lmcp::impact::WaterZone;
use std::collections::BTreeMap;

/// How far free space reaches where nothing keeps vehicles in, in metres: as far as the plane carries.
const EVERYWHERE_M: f64 = 900_000.0;

/// How much farther than their padding ways stay from zones, in metres: who follows a way is not on it to the centimetre.
const STEERING_M: f64 = 0.5;

/// Turns tighter than this, in metres, are none.
pub(super) const RADIUS_MIN_M: f64 = 1.0;

/// How many ways and places are kept; then they begin anew.
const KNOWN_MAX: usize = 65_536;

/// A straight way: its corners, and its length.
pub(super) type Straight = Result<(Vec<Point>, f64), String>;

/// A region for a vehicle.
pub(in crate::uxas) struct Region {
    pub(super) vehicle: Vehicle,
    pub(in crate::uxas) ground: Ground,
    pub(in crate::uxas) space: FreeSpace,
    pub(super) turning: Turning,
    pub(super) compat: bool,
    pub(super) separation_m: f64,
    /// Straight ways that were found already, by the bits of their ends.
    known: BTreeMap<[u64; 4], Straight>,
    /// Places with headings on the plane, by the bits of what they are in degrees: the ends of options come in thousands of ways.
    poses: BTreeMap<[u64; 3], Pose>,
}

/// Free space with turns: made when the first route with waypoints is asked for.
pub(super) enum Turning {
    /// The vehicle turns on the spot.
    None,
    /// What it will be made of.
    Later(Vec<Zone>, Box<Conditions>),
    /// It is there.
    Made(Box<TurningSpace>),
}

/// Builds the free space of a region.
///
/// # Errors
/// What is wrong with the region's zones, in words.
pub(in crate::uxas) fn build(
    world: &World,
    region: i64,
    vehicle: Vehicle,
    start: Location3D,
    config: &PlannerConfig,
) -> Result<Region, String> {
    let mut objects = Vec::new();
    if let Some(named) = world.regions.get(&region) {
        for id in named.keep_in_areas.iter().chain(&named.keep_out_areas) {
            let zone = world
                .zones
                .get(id)
                .ok_or_else(|| format!("zone Id[{id}] of OperatingRegion Id[{region}] not available"))?;
            objects.push(zone.as_ref());
        }
    }
    if vehicle.medium == Medium::Surface && vehicle.water_area != 0 {
        let id = vehicle.water_area;
        let water = world.zones.get(&id);
        objects.push(
            water
                .ok_or_else(|| format!("water zone Id[{id}] of vehicle {} not available", vehicle.id))?
                .as_ref(),
        );
    }
    let origin = objects.iter().find_map(|zone| middle(&zone.get::<AbstractZone>()?.boundary));
    let ground = plane(&origin.unwrap_or(start), config.compat_cost);
    let mut zones = Vec::with_capacity(objects.len() + 1);
    for object in objects {
        let mut zone = zone(object, &ground, &vehicle)?;
        zone.padding_m += if config.compat_cost { 0.0 } else { STEERING_M };
        zones.push(zone);
    }
    let conditions = Conditions {
        vehicle: vehicle.id,
        on_water: vehicle.medium == Medium::Surface,
        // Heights over ground and over the sea are not told apart: there is no terrain.
        altitude_m: (f64::from(vehicle.altitude_m), f64::from(vehicle.altitude_m)),
        // Plans reach beyond any clock that is known: a zone that holds at some time is respected.
        time_ms: (i64::MIN, i64::MAX),
    };
    let is_kept = zones.iter().any(|zone| zone.kind == ZoneKind::KeepIn);
    if !is_kept {
        let e = EVERYWHERE_M;
        let frame = Boundary::Polygon(vec![(-e, -e), (e, -e), (e, e), (-e, e)]);
        zones.push(Zone::new(0, ZoneKind::KeepIn, frame));
    }
    let space = match config.compat_cost {
        true => FreeSpace::compat(&zones),
        false => FreeSpace::new(&zones, &conditions),
    };
    let space = space.map_err(|why| format!("OperatingRegion Id[{region}]: {why}"))?;
    let turning = match vehicle.turn_radius_m >= RADIUS_MIN_M && !config.compat_cost {
        true => Turning::Later(zones, Box::new(conditions)),
        false => Turning::None,
    };
    let (compat, separation_m) = (config.compat_cost, config.minimum_waypoint_separation_m.max(1.0));
    Ok(Region {
        vehicle,
        ground,
        space,
        turning,
        compat,
        separation_m,
        known: BTreeMap::new(),
        poses: BTreeMap::new(),
    })
}

/// A zone of a message on a plane.
fn zone(object: &dyn Object, ground: &Ground, vehicle: &Vehicle) -> Result<Zone, String> {
    let base: &AbstractZone = object.get().ok_or("a zone is none")?;
    let id = base.zone_id;
    let kind = if object.get::<KeepOutZone>().is_some() {
        ZoneKind::KeepOut
    } else if object.get::<WaterZone>().is_some() {
        ZoneKind::Water
    } else if object.get::<KeepInZone>().is_some() {
        ZoneKind::KeepIn
    } else {
        return Err(format!("zone {id} is a {}, which no planner knows", object.type_info().name));
    };
    let geometry = base.boundary.object();
    let outline = crate::uxas::ground::outline(&base.boundary, ground);
    let boundary =
        match (geometry.and_then(|g| g.get::<Circle>()), geometry.and_then(|g| g.get::<Rectangle>())) {
            (Some(circle), _) => {
                let center = circle
                    .center_point
                    .get()
                    .ok_or_else(|| format!("zone {id}: its circle has no middle"))?;
                Boundary::Circle { center: ground.point(center), radius_m: f64::from(circle.radius) }
            }
            _ => Boundary::Polygon(outline.ok_or_else(|| format!("zone {id}: it has no outline"))?),
        };
    let mut zone = Zone::new(id, kind, boundary);
    zone.padding_m = f64::from(base.padding).max(0.0);
    zone.affected.clone_from(&base.affected_aircraft);
    zone.time_ms = (base.start_time, base.end_time);
    if vehicle.medium == Medium::Air {
        zone.altitude_m = (f64::from(base.min_altitude), f64::from(base.max_altitude));
        if zone.altitude_m.1 <= zone.altitude_m.0 {
            // A band without height is one that was not given.
            zone.altitude_m = (f64::NEG_INFINITY, f64::INFINITY);
        }
    }
    Ok(zone)
}

impl Region {
    /// The shortest way without turns.
    pub(super) fn straight(&mut self, from: Point, to: Point) -> &Straight {
        let key = [from.0, from.1, to.0, to.1].map(f64::to_bits);
        if self.known.len() >= KNOWN_MAX {
            self.known.clear();
        }
        let (space, ground) = (&self.space, &self.ground);
        self.known.entry(key).or_insert_with(|| match space.route(from, to) {
            Ok(route) => Ok((route.points, route.length_m)),
            Err(why) => Err(in_degrees(&why, ground)),
        })
    }

    /// A place on the plane, with the direction of a heading in degrees.
    pub(super) fn pose(&mut self, at: &Location3D, heading_deg: f32) -> Pose {
        if self.poses.len() >= KNOWN_MAX {
            self.poses.clear();
        }
        let heading_deg = f64::from(heading_deg);
        let key = [at.latitude, at.longitude, heading_deg].map(f64::to_bits);
        let ground = &self.ground;
        *self.poses.entry(key).or_insert_with(|| {
            let (at, heading_rad) = ground.headed(at, heading_deg);
            Pose { at, heading_rad }
        })
    }

    /// The free space with turns, made where it is not yet; none for who turns on the spot.
    pub(super) fn turning(&mut self) -> Result<Option<&TurningSpace>, String> {
        if let Turning::Later(zones, conditions) = &self.turning {
            let made = TurningSpace::new(zones, conditions, self.vehicle.turn_radius_m);
            self.turning = Turning::Made(Box::new(made.map_err(|why| why.to_string())?));
        }
        Ok(match &self.turning {
            Turning::Made(space) => Some(space),
            _ => None,
        })
    }
}

/// Why there is no way, with its places in degrees.
pub(super) fn in_degrees(why: &RouteError, ground: &Ground) -> String {
    match why {
        RouteError::InKeepOut { end, zone, nearest, distance_m } => {
            let at = ground.location(*nearest);
            format!(
                "the {end} lies in keep-out zone {zone}: the nearest way out is at latitude {:.6}, longitude {:.6}, \
                 {distance_m:.1} m away",
                at.latitude, at.longitude
            )
        }
        RouteError::OutsideKeepIn { end, nearest, distance_m } => {
            let at = ground.location(*nearest);
            format!(
                "the {end} lies outside of what vehicles are kept in: the nearest way in is at latitude {:.6}, \
                 longitude {:.6}, {distance_m:.1} m away",
                at.latitude, at.longitude
            )
        }
        other => other.to_string(),
    }
}
