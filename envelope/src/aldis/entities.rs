//! The latest states of vehicles, with their ages.

use crate::id::{EntityId, Source};
use serde::{Deserialize, Serialize};

/// Asks for the states of vehicles; no content. Sent to a service that holds them, or to the mailbox of this name, where each
/// of them answers.
pub const STATES_QUERY: &str = "aldis.EntityStatesQuery";
/// The answer to a [`STATES_QUERY`]: an [`EntityStates`]; several where there are many.
pub const STATES: &str = "aldis.EntityStates";

/// States that a service holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EntityStates {
    /// The entity that holds them.
    pub held_by: EntityId,
    /// One a vehicle, in the order of their ids.
    pub states: Vec<HeldState>,
}

/// The latest state of a vehicle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HeldState {
    /// The vehicle, as its messages name it.
    pub vehicle: i64,
    /// The full name of the message, as `afrl.vehicles.SurfaceVehicleState`.
    pub descriptor: String,
    /// Who sent it.
    pub source: Source,
    /// How long ago it came here, in milliseconds, by the clock of who holds it.
    pub heard_ms: u64,
    /// How long ago it was sent, in milliseconds: by the sender's clock, on a way without links as far as the clocks agree; what a link
    /// brought has the age that the link measured. Never below 0.
    pub age_ms: u64,
    /// Latitude, WGS-84 degrees, north positive; none where the message has no location.
    pub latitude_deg: Option<f64>,
    /// Longitude, WGS-84 degrees, east positive.
    pub longitude_deg: Option<f64>,
    /// Altitude in metres, above what the message says.
    pub altitude_m: Option<f32>,
    /// Heading in degrees from north, to the right.
    pub heading_deg: f32,
    /// Speed over ground in metres a second.
    pub groundspeed_m_per_s: f32,
    /// The waypoint that it goes to; 0 where it follows none.
    pub waypoint: i64,
    /// The tasks that it works on.
    pub tasks: Vec<i64>,
}
