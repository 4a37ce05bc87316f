//! Planning mathematics: who does what, and by which way.
//!
//! Pure functions over plain values, callable without a bus. What takes long is cut by a budget of steps, never by time,
//! so that a plan depends on its request alone.

pub mod algebra;
pub mod assignment;
pub mod flat_earth;
pub mod free_space;
pub mod geodesy;
pub mod line_search;
pub mod route_file;
pub mod sensor;
pub mod turning;

/// A golden of the reference, which lies beside the project and is no part of it; without it tests say that they were
/// skipped.
#[cfg(test)]
pub(crate) fn golden(name: &str) -> Option<String> {
    use std::io::Write;
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/uxas/golden");
    let path = root.join(name);
    if !path.exists() {
        // Not by `eprintln!`, which the test harness keeps to itself when a test passes.
        let _ = writeln!(std::io::stderr(), "SKIPPED: {} is not there", path.display());
        return None;
    }
    Some(std::fs::read_to_string(path).unwrap())
}
