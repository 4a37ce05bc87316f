//! Tasks: what each kind of task offers, as pure functions of the task, the entities and the geometry.
//!
//! A [`Kind`] says what it wants to know of sensors and roads, which ways there are to do the task ([`Offer`]), how the
//! waypoints of the way that was chosen are finished, and what the vehicle is told while it is at it. The course of the
//! messages around it is the same for all kinds; see [`life`].

mod angles;
pub mod composition;
mod kinds;
pub mod life;
pub mod state;
mod waypoints;

pub use kinds::{is_known, kind_of};
pub use waypoints::stay;

use super::ground::Ground;
use super::vehicle::Vehicle;
use super::world::World;
use crate::plan::algebra::Expression;
use aldis_envelope::lmcp::Object;
use aldis_envelope::lmcp::cmasi::{EntityState, Location3D, WavelengthBand, Waypoint};
use aldis_envelope::lmcp::uxtask::SensorFootprint;
use std::collections::BTreeMap;

/// The first option of a task has this id, as in the reference.
pub const FIRST_OPTION: i64 = 10;

/// The most ways of giving several vehicles a place each that a task offers.
pub const ARRANGEMENTS_MAX: usize = 64;

/// What a kind looks at.
pub struct View<'a> {
    /// All that is known.
    pub world: &'a World,
    /// The vehicles that may do the task and are asked for, by id.
    pub vehicles: Vec<Vehicle>,
    /// The options that the configuration gives this task.
    pub settings: &'a BTreeMap<String, String>,
    /// Whether the earth is flat, as in the reference.
    pub compat: bool,
}

impl View<'_> {
    /// A setting of the task that is a number.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.settings.get(name)?.trim().parse().ok().filter(|number: &f64| number.is_finite())
    }

    /// A setting of the task that is a truth value.
    pub fn flag(&self, name: &str) -> bool {
        self.settings
            .get(name)
            .is_some_and(|text| matches!(text.trim().to_lowercase().as_str(), "true" | "1"))
    }

    /// The plane around a place.
    pub fn ground(&self, origin: &Location3D) -> Ground {
        Ground::new(origin, self.compat)
    }

    /// The vehicles by speed and altitude: those of a group need the same time.
    pub fn groups(&self) -> Vec<Vec<Vehicle>> {
        let mut groups: BTreeMap<(i64, i64), Vec<Vehicle>> = BTreeMap::new();
        for vehicle in &self.vehicles {
            let key =
                ((vehicle.speed_m_per_s * 10.0).round() as i64, f64::from(vehicle.altitude_m).round() as i64);
            groups.entry(key).or_default().push(*vehicle);
        }
        groups.into_values().collect()
    }
}

/// What a task wants to know of a vehicle's sensors.
#[derive(Debug, Clone, PartialEq)]
pub struct Look {
    /// The vehicle.
    pub vehicle: i64,
    /// The elevation of the look, in radians; negative is down.
    pub elevation_rad: f64,
    /// The ground that a pixel may cover, in metres; 0: any.
    pub ground_sample_distance_m: f32,
    /// The bands of light.
    pub bands: Vec<WavelengthBand>,
}

/// What a task has learned before it offers anything.
#[derive(Debug, Clone, Default)]
pub struct Seen {
    /// What sensors see.
    pub footprints: Vec<SensorFootprint>,
    /// Where roads leave the place that was asked about.
    pub egress: Vec<Location3D>,
}

/// A piece of way within a task.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// Where it begins.
    pub from: Location3D,
    /// Where it ends.
    pub to: Location3D,
    /// The headings at both, in degrees; none: they do not matter.
    pub headings: Option<(f32, f32)>,
}

/// What is done within an option.
#[derive(Debug, Clone, PartialEq)]
pub enum Within {
    /// The vehicle passes these places; it takes so many milliseconds.
    Places(Vec<Location3D>, i64),
    /// The vehicle goes by these pieces of way; a planner says how, and how long it takes.
    Stretches(Vec<Stretch>),
}

/// One way to do a task.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// The number of the option.
    pub id: i64,
    /// Who can do it; never empty.
    pub eligible: Vec<i64>,
    /// Where it begins.
    pub start: Location3D,
    /// The heading there, in degrees.
    pub start_heading: f32,
    /// Where it ends.
    pub end: Location3D,
    /// The heading there, in degrees.
    pub end_heading: f32,
    /// What is done.
    pub within: Within,
}

/// The ways to do a task.
#[derive(Debug, Clone, PartialEq)]
pub struct Offer {
    /// How they are related.
    pub composition: Expression<i64>,
    /// The ways.
    pub choices: Vec<Choice>,
}

/// A kind of task.
pub trait Kind: Send {
    /// What it lacks to be planned at all, in words: an area that is not known.
    ///
    /// # Errors
    /// What is missing.
    fn ready(&self, _world: &World) -> Result<(), String> {
        Ok(())
    }

    /// What about it is probably not meant so, in words.
    fn doubts(&self) -> Vec<String> {
        Vec::new()
    }

    /// What it wants to know of sensors.
    fn looks(&self, _view: &View<'_>) -> Vec<Look> {
        Vec::new()
    }

    /// The place and distance of which it wants to know the roads out.
    fn egress(&self) -> Option<(Location3D, f32)> {
        None
    }

    /// The ways to do it.
    ///
    /// # Errors
    /// Why there is none, in words.
    fn offer(&self, view: &View<'_>, seen: &Seen) -> Result<Offer, String>;

    /// Finishes the waypoints of an option: altitudes, actions.
    fn finish(&self, _view: &View<'_>, _vehicle: &Vehicle, _choice: &Choice, _waypoints: &mut Vec<Waypoint>) {
    }

    /// Whether all that do it are to begin at the same time.
    fn begins_together(&self) -> bool {
        false
    }

    /// What the vehicle is told while it is at it, given its state.
    fn steer(&self, _view: &View<'_>, _vehicle: &Vehicle, _state: &EntityState) -> Vec<Box<dyn Object>> {
        Vec::new()
    }

    /// The place that a vehicle follows while it is at it, if the task moves.
    fn follows(&self, _view: &View<'_>, _vehicle: &Vehicle) -> Option<Location3D> {
        None
    }
}
