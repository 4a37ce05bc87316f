//! How clear of a region's zones a vehicle is: measured from the messages, apart from what plans.

use super::ground::{Ground, Point, far, outline};
use super::vehicle::{Medium, Vehicle};
use super::world::World;
use aldis_envelope::lmcp::Object;
use aldis_envelope::lmcp::cmasi::{AbstractZone, Circle, KeepOutZone, Location3D};

/// How far a place is from the nearest zone that holds for a vehicle, beyond the zone's padding, in metres; below 0 where it
/// is too near or on the wrong side. None where no zone holds.
pub fn clearance_m(world: &World, region: i64, vehicle: &Vehicle, at: &Location3D) -> Option<f64> {
    let ground = Ground::new(at, false);
    let mut zones = world.zones_of(region);
    if vehicle.medium == Medium::Surface {
        zones.extend(world.zones.get(&vehicle.water_area).map(|zone| zone.as_ref()));
    }
    let clear = |zone: &&dyn Object| {
        let base = zone.get::<AbstractZone>()?;
        let holds = base.affected_aircraft.is_empty() || base.affected_aircraft.contains(&vehicle.id);
        let inside = inside_m(base, &ground)?;
        let clear = if zone.get::<KeepOutZone>().is_some() { -inside } else { inside };
        holds.then_some(clear - f64::from(base.padding))
    };
    zones.iter().filter_map(clear).min_by(f64::total_cmp)
}

/// How far inside of a zone the plane's origin is, in metres; below 0 outside.
fn inside_m(zone: &AbstractZone, ground: &Ground) -> Option<f64> {
    if let Some(circle) = zone.boundary.object().and_then(|boundary| boundary.get::<Circle>()) {
        return Some(f64::from(circle.radius) - far(ground.point(circle.center_point.get()?), (0.0, 0.0)));
    }
    let corners = outline(&zone.boundary, ground)?;
    let here: Point = (0.0, 0.0);
    let mut nearest = f64::INFINITY;
    let mut inside = false;
    for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        let way = (b.0 - a.0, b.1 - a.1);
        let square = (way.0 * way.0 + way.1 * way.1).max(f64::MIN_POSITIVE);
        let share = (((here.0 - a.0) * way.0 + (here.1 - a.1) * way.1) / square).clamp(0.0, 1.0);
        nearest = nearest.min(far((a.0 + way.0 * share, a.1 + way.1 * share), here));
        let crosses = (a.1 > here.1) != (b.1 > here.1);
        if crosses && here.0 < way.0 * (here.1 - a.1) / way.1 + a.0 {
            inside = !inside;
        }
    }
    Some(if inside { nearest } else { -nearest })
}
