//! Imports run in one direction, between packages and inside `services`.

use crate::sources::{Source, below, none};
use aldis_tests::root;
use std::collections::BTreeSet;

/// The packages, low to high, with those of ours that each may name.
const PACKAGES: [(&str, &[&str]); 3] = [
    ("envelope", &[]),
    ("services", &["aldis-envelope"]),
    ("gateway", &["aldis-dds", "aldis-envelope", "aldis-services"]),
];

/// The modules of `services`, low to high. A module imports from lower rows alone, never from its own row, so that no
/// circle can be.
const LAYERS: [&[&str]; 9] = [
    &["journal", "service"],
    &["allow", "calls", "counters", "dds", "notes", "streams"],
    &["destinations", "link", "map", "plan", "umaa"],
    &["event"],
    &["bridge", "labels"],
    &["conform", "domain", "entities", "health", "log", "manager", "player", "recorder", "track", "uxas"],
    &["host", "registry"],
    &["node"],
    &["sim"],
];

/// Modules that must not know each other, whatever their rows: the monitor would share the mistakes of what it watches.
const STRANGERS: [(&str, &str); 1] = [("conform", "umaa")];

fn layer(module: &str) -> Option<usize> {
    LAYERS.iter().position(|row| row.contains(&module))
}

/// `services/src/node/deliver.rs` is in `node`.
fn module_of(path: &str) -> &str {
    let path = path.trim_start_matches("services/src/");
    path.split('/').next().unwrap_or_default().trim_end_matches(".rs")
}

/// How many modules deep a file lies: 1 for `services/src/node.rs`, 2 for `services/src/node/deliver.rs`.
fn depth(path: &str) -> usize {
    path.trim_start_matches("services/src/").split('/').count()
}

/// The modules at the root of the crate that a line names, by `crate::` or by enough `super::`.
fn named(line: &str, depth: usize) -> BTreeSet<String> {
    let up = "super::".repeat(depth);
    let paths = ["crate::", up.as_str()];
    let after = paths.iter().flat_map(|path| line.split(path).skip(1));
    let grouped = after.flat_map(|rest| match rest.strip_prefix('{') {
        Some(group) => group.split('}').next().unwrap_or_default().split(',').collect::<Vec<_>>(),
        None => vec![rest],
    });
    let word =
        |text: &str| text.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    grouped.map(word).filter(|word| word.starts_with(char::is_lowercase)).collect()
}

fn complaints(source: &Source) -> Vec<String> {
    let module = module_of(&source.path);
    let Some(own) = layer(module) else {
        return vec![format!(
            "{}: `{module}` has no row in LAYERS: give it the lowest that its imports allow",
            source.path
        )];
    };
    let mut complaints = Vec::new();
    for (number, line) in source.code() {
        for import in named(line, depth(&source.path)).iter().filter(|import| *import != module) {
            if STRANGERS.contains(&(module, import)) {
                complaints.push(format!(
                    "{}:{number}: `{module}` uses `{import}`, which it must not know",
                    source.path
                ));
            }
            if layer(import).is_none_or(|layer| layer >= own) {
                complaints.push(format!(
                    "{}:{number}: `{module}` uses `{import}`, which is not below it: move what both need lower",
                    source.path
                ));
            }
        }
    }
    complaints
}

#[test]
fn modules_of_services_import_downwards_alone() {
    let mut sources = below("services/src");
    sources.retain(|source| source.path != "services/src/lib.rs" && !source.is_test());
    let modules: BTreeSet<_> = sources.iter().map(|source| module_of(&source.path)).collect();
    let gone = LAYERS.concat().into_iter().filter(|module| !modules.contains(module));
    let gone = gone.map(|module| format!("LAYERS names `{module}`, which is gone: take it out"));
    none(&sources.iter().flat_map(complaints).chain(gone).collect::<Vec<_>>());
}

#[test]
fn packages_name_lower_ones_alone() {
    for (package, allowed) in PACKAGES {
        let manifest = root().join(package).join("Cargo.toml");
        let manifest = std::fs::read_to_string(&manifest).expect("a package has a manifest");
        let ours = manifest.lines().filter(|line| line.starts_with("aldis"));
        let names: BTreeSet<_> = ours.filter_map(|line| line.split(['.', ' ', '=']).next()).collect();
        assert_eq!(
            names,
            allowed.iter().copied().collect(),
            "{package}/Cargo.toml: packages of ours that it names"
        );
    }
}

#[test]
fn imports_are_found_however_they_are_written() {
    let all = |line, depth| named(line, depth).into_iter().collect::<Vec<_>>().join(" ");
    assert_eq!(all("use crate::event::{BridgeId, Effect};", 2), "event");
    assert_eq!(all("use crate::{host::Hosted, sim};", 1), "host sim");
    assert_eq!(all("let a = crate::calls::Alive::default();", 1), "calls");
    assert_eq!(all("use super::super::node::Node;", 2), "node");
    assert_eq!(all("use super::{Node, Origin};", 2), "");
    assert_eq!(all("use super::node::Node;", 1), "node");
}
