//! A vehicle as planning sees it, from its configuration.

use crate::plan::turning::{radius_of_bank, radius_of_yaw_rate};
use aldis_envelope::lmcp::cmasi::{AirVehicleConfiguration, AltitudeType, EntityConfiguration, KeyValuePair};
use aldis_envelope::lmcp::vehicles::{GroundVehicleConfiguration, SurfaceVehicleConfiguration};
use aldis_envelope::lmcp::{Object, Ref};

/// Where a vehicle moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Medium {
    /// In the air.
    Air,
    /// On the water.
    Surface,
    /// On the ground.
    Ground,
}

impl Medium {
    /// The mailbox of the planners for it.
    pub fn mailbox(self) -> &'static str {
        match self {
            Self::Air => "AircraftPathPlanner",
            Self::Surface => "SurfacePathPlanner",
            Self::Ground => "GroundPathPlanner",
        }
    }
}

/// What planning needs of a vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vehicle {
    /// Its id.
    pub id: i64,
    /// Where it moves.
    pub medium: Medium,
    /// Its nominal speed, in metres a second.
    pub speed_m_per_s: f64,
    /// Its nominal altitude, in metres.
    pub altitude_m: f32,
    /// What that is measured from.
    pub altitude_type: AltitudeType,
    /// The radius of its tightest turn at nominal speed, in metres; 0: it turns on the spot.
    pub turn_radius_m: f64,
    /// The water zone of a boat; 0: none is named.
    pub water_area: i64,
}

impl Vehicle {
    /// The vehicle of a configuration; none where that is of something that does not move.
    ///
    /// The turn of an aircraft follows from its nominal bank angle. That of a boat is named in its `Info`, as
    /// `MinTurnRadius_m` or `MaxYawRate_deg_per_s`; without either the boat turns on the spot: bank means nothing for a hull.
    pub fn of(configuration: &dyn Object) -> Option<Self> {
        let entity: &EntityConfiguration = configuration.get()?;
        let speed = f64::from(entity.nominal_speed);
        let (medium, turn_radius_m, water_area) =
            if let Some(air) = configuration.get::<AirVehicleConfiguration>() {
                let bank =
                    air.nominal_flight_profile.get().map_or(0.0, |profile| f64::from(profile.max_bank_angle));
                let can_turn = bank > 0.0 && bank < 90.0;
                (Medium::Air, if can_turn { radius_of_bank(speed, bank.to_radians()) } else { 0.0 }, 0)
            } else if let Some(boat) = configuration.get::<SurfaceVehicleConfiguration>() {
                let yaw = named_in(&entity.info, "MaxYawRate_deg_per_s")
                    .map(|rate| radius_of_yaw_rate(speed, rate.to_radians()));
                let radius = named_in(&entity.info, "MinTurnRadius_m").or(yaw).unwrap_or(0.0);
                (Medium::Surface, radius, boat.water_area)
            } else {
                configuration.get::<GroundVehicleConfiguration>()?;
                (Medium::Ground, 0.0, 0)
            };
        let turn_radius_m = if turn_radius_m.is_finite() { turn_radius_m.max(0.0) } else { 0.0 };
        Some(Self {
            id: entity.id,
            medium,
            speed_m_per_s: speed,
            altitude_m: entity.nominal_altitude,
            altitude_type: entity.nominal_altitude_type,
            turn_radius_m,
            water_area,
        })
    }

    /// How long it needs for a way, in milliseconds; none where it does not move.
    pub fn time_ms(&self, metres: f64) -> Option<i64> {
        let time = metres / self.speed_m_per_s * 1000.0;
        (self.speed_m_per_s > 0.0 && time.is_finite()).then_some(time as i64)
    }

    /// The radius of a loiter that it can hold, in metres: what the reference takes for aircraft, twice the turn for boats.
    pub fn loiter_radius_m(&self) -> f64 {
        match self.medium {
            Medium::Air => (radius_of_bank(self.speed_m_per_s, 25.0_f64.to_radians()) / 100.0).ceil() * 100.0,
            Medium::Surface | Medium::Ground => 2.0 * self.turn_radius_m,
        }
    }
}

/// A positive number that a list of pairs names.
pub fn named_in(pairs: &[Ref<KeyValuePair>], key: &str) -> Option<f64> {
    let pair = pairs.iter().filter_map(|pair| pair.get()).find(|pair| pair.key == key)?;
    pair.value.trim().parse().ok().filter(|number: &f64| *number > 0.0 && number.is_finite())
}
