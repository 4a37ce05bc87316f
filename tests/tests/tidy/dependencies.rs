//! What the pure packages are built on, and what no package may do.

use crate::sources::{all, none};
use aldis_tests::root;
use std::process::Command;

/// Crates that do what a pure package must not: runtimes, sockets, files, threads, chance.
const IMPURE: [&str; 24] = [
    "async-",
    "crossbeam",
    "futures",
    "getrandom",
    "libc",
    "mio",
    "nix",
    "parking_lot",
    "polling",
    "quinn",
    "rand",
    "rand_core",
    "rayon",
    "redb",
    "rustix",
    "serialport",
    "signal-hook",
    "smol",
    "socket2",
    "tempfile",
    "threadpool",
    "tokio",
    "windows",
    "zenoh",
];

fn tree(package: &str) -> String {
    let args = ["tree", "--offline", "--package", package, "--edges", "normal", "--prefix", "none"];
    let tree = Command::new(env!("CARGO")).args(args).current_dir(root()).output().expect("cargo runs");
    assert!(tree.status.success(), "cargo tree: {}", String::from_utf8_lossy(&tree.stderr));
    String::from_utf8(tree.stdout).expect("cargo writes UTF-8")
}

fn impure(tree: &str) -> Vec<&str> {
    let is_impure = |name: &&str| {
        let family = |known: &&str| {
            name.strip_prefix(*known)
                .is_some_and(|rest| rest.is_empty() || known.ends_with('-') || rest.starts_with(['-', '_']))
        };
        IMPURE.iter().any(family)
    };
    tree.lines().filter_map(|line| line.split(' ').next()).filter(is_impure).collect()
}

#[test]
fn the_pure_packages_stand_on_pure_crates() {
    for package in ["aldis-envelope", "aldis-services"] {
        let tree = tree(package);
        assert!(tree.contains("postcard"), "this is no tree:\n{tree}");
        let impure = impure(&tree);
        assert!(
            impure.is_empty(),
            "{package} is built on {impure:?}: take them out, or do it in the gateway"
        );
    }
}

#[test]
fn the_gateway_is_not_pure() {
    assert!(impure(&tree("aldis")).contains(&"zenoh"), "this test would miss what it looks for");
}

#[test]
fn unsafe_code_is_forbidden_in_every_package() {
    let files = all();
    let manifest = |path: &str| {
        let found = files.iter().find(|file| file.path == path);
        &found.unwrap_or_else(|| panic!("there is no {path}")).text
    };
    let section = |text: &str, name: &str| {
        let after = text.split(&format!("\n[{name}]\n")).nth(1).unwrap_or_default().to_owned();
        after.split("\n[").next().unwrap_or_default().to_owned()
    };
    let workspace = manifest("Cargo.toml");
    let lints = section(workspace, "workspace.lints.rust");
    assert!(lints.contains("unsafe_code = \"forbid\""), "Cargo.toml must forbid unsafe code to all packages");
    let members =
        workspace.split("members = [").nth(1).and_then(|list| list.split(']').next()).unwrap_or_default();
    let members: Vec<_> =
        members.split(',').map(|name| name.trim().trim_matches('"').trim_end_matches('*')).collect();
    assert!(
        members.contains(&"envelope") && members.contains(&"gateway"),
        "these are no packages: {members:?}"
    );
    let free = members.iter().filter(|member| {
        !section(manifest(&format!("{member}/Cargo.toml")), "lints").contains("workspace = true")
    });
    let complaint =
        |member| format!("{member}/Cargo.toml does not inherit the lints: add [lints] workspace = true");
    none(&free.map(complaint).collect::<Vec<_>>());
}
