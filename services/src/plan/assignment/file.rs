//! A request as a file holds it.

use super::request::{Objective, Precedence, Request, Task, TaskOption, Travel};
use crate::plan::algebra::Unnamed;
use serde::Deserialize;
use std::collections::BTreeMap;

/// The form of a request in a file: `rel`, `V`, `tasks` and `rows`; other fields are for people.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub struct RequestFile {
    /// The relationships between tasks, as process algebra.
    #[serde(default)]
    pub rel: String,
    /// The vehicles.
    #[serde(rename = "V")]
    pub vehicles: Vec<i64>,
    /// By task id: its composition, and its options.
    pub tasks: BTreeMap<i64, (String, BTreeMap<i64, OptionRow>)>,
    /// The ways.
    pub rows: Vec<WayRow>,
}

/// An option: its cost in milliseconds and its eligible vehicles, empty for all.
pub type OptionRow = (i64, Vec<i64>);

/// A way: vehicle, task and option it comes from (0 and 0: where the vehicle is), task and option it goes to, milliseconds.
pub type WayRow = (i64, i64, i64, i64, i64, i64);

impl RequestFile {
    /// The request that it asks for.
    pub fn request(self, objective: Objective, precedence: Precedence, unnamed: Unnamed) -> Request {
        let option = |(id, (cost_ms, eligible))| (id, TaskOption { cost_ms, eligible });
        let tasks = self.tasks.into_iter().map(|(id, (composition, options))| {
            let options = options.into_iter().map(option).collect();
            (id, Task { composition, options })
        });
        let way = |(vehicle, task, option, to_task, to_option, time_ms)| {
            let from = ((task, option) != (0, 0)).then_some((task, option));
            Travel { vehicle, from, to: (to_task, to_option), time_ms }
        };
        Request {
            relationships: self.rel,
            vehicles: self.vehicles,
            tasks: tasks.collect(),
            travel: self.rows.into_iter().map(way).collect(),
            objective,
            precedence,
            unnamed,
        }
    }
}
