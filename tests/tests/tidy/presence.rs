//! What must be there, and in order.

use crate::sources::{all, none};
use aldis_tests::{aldis, root};

/// What a reader looks for first, and who it is for.
const ROOMS: [(&str, &str); 6] = [
    ("README.md", "what it is and how to use it, for users"),
    ("ARCHITECTURE.md", "where things are and what must hold, for developers"),
    ("CHANGELOG.md", "what changed, for those who update"),
    ("LICENSE-MIT", "one of the two licences"),
    ("LICENSE-APACHE", "one of the two licences"),
    (".ci/run", "what a change must pass"),
];

#[test]
fn the_files_that_a_reader_looks_for_are_there() {
    let files = all();
    let missing = |(name, what): &(&str, &str)| {
        let found = files.iter().any(|file| file.path == *name && file.text.lines().count() > 2);
        (!found).then(|| format!("{name} is missing or empty: {what}"))
    };
    none(&ROOMS.iter().filter_map(missing).collect::<Vec<_>>());
}

#[test]
fn every_configuration_of_the_project_is_good() {
    let mut configs: Vec<_> = all().into_iter().map(|file| file.path).collect();
    configs.retain(|path| path.starts_with("configs/") && path.ends_with(".toml"));
    // What a scenario says of control is no machine's configuration: simulations of it are tested.
    configs.retain(|path| !path.starts_with("configs/scenarios/"));
    assert!(configs.len() >= 3, "configurations: {configs:?}");
    let paths = configs.iter().map(|path| root().join(path).display().to_string());
    let done = aldis(["check", "--json"].map(str::to_owned).into_iter().chain(paths));
    let wrong: Vec<_> = done.json().into_iter().filter(|told| told["ok"] != true).collect();
    assert!(done.code == Some(0) && wrong.is_empty(), "{wrong:#?}");
    assert_eq!(done.json().len(), configs.len());
}
