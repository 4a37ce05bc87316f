//! The VEHICLES series: vehicles that do not fly.

use super::cmasi::{EntityConfiguration, EntityState};
use super::registry::table;
use super::schema::{Series, SeriesName, TypeInfo};

/// The series as the wire and the XML form know it.
pub const SERIES: Series =
    Series { name: SeriesName::new("VEHICLES"), text: "VEHICLES", namespace: "afrl.vehicles", version: 1 };

/// Its types by their number.
pub(super) const TYPES_BY_ID: [&TypeInfo; 6] = table(&[TYPES]);

lmcp_types! {
    SERIES "afrl.vehicles";

    /// What a ground vehicle is able to do.
    1 GroundVehicleConfiguration: EntityConfiguration {
        road_graph_id "RoadGraphID": i64,
        minimum_speed "MinimumSpeed" ["m/s"]: f32,
        maximum_speed "MaximumSpeed" ["m/s"]: f32,
        energy_rate "EnergyRate" ["%/s"]: f32,
    }

    /// The state of a ground vehicle.
    2 GroundVehicleState: EntityState {}

    /// What a boat is able to do.
    3 SurfaceVehicleConfiguration: EntityConfiguration {
        water_area "WaterArea": i64,
        minimum_speed "MinimumSpeed" ["m/s"]: f32,
        maximum_speed "MaximumSpeed" ["m/s"]: f32,
        energy_rate "EnergyRate" ["%/s"]: f32,
        max_bank_angle "MaxBankAngle" ["deg"]: f32,
        max_bank_rate "MaxBankRate" ["deg/s"]: f32,
    }

    /// The state of a boat.
    4 SurfaceVehicleState: EntityState {
        bank_angle "BankAngle" ["deg"]: f32,
        speed "Speed" ["m/s"]: f32,
    }

    /// A sensor that stays where it is.
    5 StationarySensorConfiguration: EntityConfiguration {}

    /// The state of a sensor that stays where it is.
    6 StationarySensorState: EntityState {}
}
