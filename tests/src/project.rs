//! Where the project's files are.

use std::io::Write;
use std::path::{Path, PathBuf};

/// The root of the workspace.
///
/// # Panics
/// Never: this package is a directory of the workspace.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the package is a directory of the workspace")
}

/// A file of the data that lie beside the project on the machines of its developers; where they are absent, none, and
/// it says loudly that a test was skipped.
pub fn shared(path: &str) -> Option<PathBuf> {
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared")).join(path);
    if file.exists() {
        return Some(file);
    }
    let test = std::thread::current().name().unwrap_or_default().to_owned();
    // Written past the test's captured output, which nobody sees when the test passes.
    let _ = writeln!(std::io::stderr(), "SKIPPED: {test}: there is no {}", file.display());
    None
}
