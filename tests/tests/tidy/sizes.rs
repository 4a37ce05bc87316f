//! A file is a room: one that outgrows its walls is to be divided.

use crate::sources::{Source, all, none};

/// The most lines of a file with code.
const CODE_LINES_MAX: usize = 400;
/// The most lines of a file with tests alone.
const TEST_LINES_MAX: usize = 600;

#[test]
fn no_file_outgrows_its_room() {
    let too_long = |source: Source| {
        let (lines, test) = (source.text.lines().count(), source.is_test());
        let max = if test { TEST_LINES_MAX } else { CODE_LINES_MAX };
        let complaint = || {
            let path = &source.path;
            format!("{path}: {lines} lines, {max} fit: move what belongs together into a file of its own")
        };
        (lines > max).then(complaint)
    };
    none(&all().into_iter().filter(Source::is_rust).filter_map(too_long).collect::<Vec<_>>());
}
