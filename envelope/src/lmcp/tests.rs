//! Tests of the whole protocol: against the reference's bytes, against hostile bytes, round trips.

mod golden;
mod hostile;
mod json;
mod model;
mod roundtrip;
mod xml;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// A folder of the reference's data, which lies beside the project and is no part of it: tests that
/// need it pass without, and say so.
fn shared(folder: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/uxas").join(folder);
    if !path.exists() {
        // Not by `eprintln!`, which the test harness keeps to itself when a test passes.
        let _ = writeln!(std::io::stderr(), "SKIPPED: {} is not there", path.display());
        return None;
    }
    Some(path)
}

/// The files of a folder and below it whose names end with `.extension`, sorted.
fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path, extension));
        } else if path.extension().is_some_and(|it| it == extension) {
            found.push(path);
        }
    }
    found.sort();
    found
}

#[expect(clippy::disallowed_methods, reason = "a test reads the reference's files")]
fn read(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap()
}

/// One message of each type, every field set, from the reference; none when it is not there.
fn golden_messages() -> &'static [Vec<u8>] {
    static MESSAGES: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
        let paths = shared("lmcp").map(|folder| files(&folder, "lmcp")).unwrap_or_default();
        paths.iter().map(|path| read(path)).collect()
    });
    &MESSAGES
}
