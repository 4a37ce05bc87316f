//! The PERCEIVE series: entities that perceive one another.

use super::Ref;
use super::cmasi::{Location3D, Task, VehicleAction, WavelengthBand};
use super::registry::table;
use super::schema::{Series, SeriesName, TypeInfo};

/// The series as the wire and the XML form know it.
pub const SERIES: Series = Series {
    name: SeriesName::new("PERCEIVE"),
    text: "PERCEIVE",
    namespace: "afrl.cmasi.perceive",
    version: 1,
};

/// Its types by their number.
pub(super) const TYPES_BY_ID: [&TypeInfo; 3] = table(&[TYPES]);

lmcp_types! {
    SERIES "afrl.cmasi.perceive";

    /// What one entity perceives of another.
    1 EntityPerception {
        perceived_entity_id "PerceivedEntityID": u32,
        perceiver_id "PerceiverID": u32,
        perceiver_payloads "PerceiverPayloads": Vec<u32>,
        velocity "Velocity" ["m/s"]: [f32; 3],
        velocity_error "VelocityError" ["m/s"]: [f32; 3],
        velocity_valid "VelocityValid": bool,
        attitude "Attitude" ["deg"]: [f32; 3],
        attitude_error "AttitudeError" ["deg"]: [f32; 3],
        attitude_valid "AttitudeValid": bool,
        location "Location": Ref<Location3D>,
        location_error "LocationError" ["m"]: [f32; 3],
        time_last_seen "TimeLastSeen" ["ms"]: i64,
    }

    /// Has a sensor follow an entity.
    2 TrackEntityAction: VehicleAction {
        entity_id "EntityID": u32,
        sensor_id "SensorID": u32,
        return_to_waypoint "ReturnToWaypoint": u32,
    }

    /// A task to follow an entity.
    3 TrackEntityTask: Task {
        entity_id "EntityID": u32,
        sensor_modality "SensorModality": WavelengthBand,
        ground_sample_distance "GroundSampleDistance" ["m"]: f32,
    }
}
