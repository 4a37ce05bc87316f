//! What the tests of planning share.

/// A golden of the reference, which lies beside the project and is no part of it; without it tests say that they were
/// skipped.
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
