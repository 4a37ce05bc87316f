//! Planning mathematics: who does what, and by which way.
//!
//! Pure functions over plain values, callable without a bus. What takes long is cut by a budget of steps, never by time,
//! so that a plan depends on its request alone.

pub mod algebra;
pub mod area_search;
pub mod assignment;
pub mod flat_earth;
pub mod free_space;
pub mod geodesy;
pub mod line_search;
pub mod pattern_search;
pub mod roads;
pub mod route_file;
pub mod search_plan;
pub mod sensor;
pub mod turning;

#[cfg(test)]
mod tests;
