//! What is asked: tasks, their options, and how long each vehicle needs from one to another.

use crate::plan::algebra::{AlgebraError, Unnamed};
use std::collections::BTreeMap;

/// The longest time that is taken for one, in milliseconds: three centuries. The reference writes times beyond it where it
/// found no way.
pub const TIME_MS_MAX: i64 = 10_000_000_000_000;

/// What a plan must make small first; the other of the two is made small next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Objective {
    /// When the last vehicle has finished.
    #[default]
    MinMax,
    /// The sum over the vehicles of when each has finished.
    Cumulative,
}

/// What `.` means between vehicles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precedence {
    /// It orders the choice of tasks, as in the reference: on one vehicle the order holds, another vehicle does not wait.
    #[default]
    Choice,
    /// What comes later starts when what comes earlier is complete, whoever does it: vehicles wait.
    Temporal,
}

/// One way to do a task.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TaskOption {
    /// How long it takes once the vehicle is there, in milliseconds.
    pub cost_ms: i64,
    /// The vehicles that can do it; empty means all.
    pub eligible: Vec<i64>,
}

/// A task.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Task {
    /// How its options are related, as process algebra.
    pub composition: String,
    /// Its options by id.
    pub options: BTreeMap<i64, TaskOption>,
}

/// How long a vehicle needs from the end of an option, or from where it is, to the start of another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Travel {
    /// The vehicle.
    pub vehicle: i64,
    /// Task and option it comes from; none is where it is at first.
    pub from: Option<(i64, i64)>,
    /// Task and option it goes to.
    pub to: (i64, i64),
    /// How long, in milliseconds; negative means that there is no way.
    pub time_ms: i64,
}

/// A request for an assignment. Ways that are not told do not exist.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Request {
    /// How the tasks are related, as process algebra; empty means all, in any order.
    pub relationships: String,
    /// The vehicles.
    pub vehicles: Vec<i64>,
    /// The tasks by id.
    pub tasks: BTreeMap<i64, Task>,
    /// The ways; those of others than these vehicles and options are not looked at.
    pub travel: Vec<Travel>,
    /// What must be small.
    pub objective: Objective,
    /// What `.` means between vehicles.
    pub precedence: Precedence,
    /// What becomes of tasks that the relationships leave out.
    pub unnamed: Unnamed,
}

/// A request that cannot be understood.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RequestError {
    /// A mistake in the relationships or a composition.
    #[error(transparent)]
    Algebra(#[from] AlgebraError),
    /// Nobody to do it.
    #[error("the request names no vehicle")]
    NoVehicle,
    /// Nothing to do.
    #[error("the request names no task")]
    NoTask,
    /// A vehicle named twice.
    #[error("vehicle {0} is named twice")]
    VehicleTwice(i64),
    /// An option that takes less than no time.
    #[error("option {option} of task {task} costs {cost_ms} ms: a cost is 0 or more")]
    NegativeCost {
        /// The task.
        task: i64,
        /// The option.
        option: i64,
        /// Its cost.
        cost_ms: i64,
    },
    /// A way told twice with different times.
    #[error(
        "the way of vehicle {} to task {} option {} is told twice: {} ms and {other_ms} ms", .travel.vehicle, .travel.to.0,
        .travel.to.1, .travel.time_ms
    )]
    WayTwice {
        /// The way.
        travel: Travel,
        /// The other time.
        other_ms: i64,
    },
    /// More than fits into memory.
    #[error("{vehicles} vehicles and {options} options are too many: their ways would need more than 1 GB")]
    TooLarge {
        /// How many vehicles.
        vehicles: usize,
        /// How many options.
        options: usize,
    },
}
