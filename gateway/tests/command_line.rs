//! The program as a user meets it first. That it stands here makes cargo build the program for all other tests.

use std::process::{Command, Output};

fn aldis(args: &[&str]) -> Output {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    Command::new(env!("CARGO_BIN_EXE_aldis"))
        .args(args)
        .current_dir(root)
        .output()
        .expect("the program starts")
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("text")
}

#[test]
fn help_teaches_by_example_and_tells_the_exit_codes() {
    let help = stdout(&aldis(&["--help"]));
    for part in ["aldis demo", "aldis run configs/shore.toml", "Exit codes", "3 nobody is there"] {
        assert!(help.contains(part), "{part}: {help}");
    }
    for verb in ["run", "check", "acl", "pub", "sub", "call", "fleet", "demo", "lmcp", "bench", "conform"] {
        assert!(stdout(&aldis(&[verb, "--help"])).contains("Example"), "{verb}");
    }
}

#[test]
fn every_configuration_is_good() {
    let mut args = vec!["check".to_owned(), "--json".to_owned()];
    let configs = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../configs")).unwrap();
    args.extend(
        configs.map(|file| file.unwrap().path().display().to_string()).filter(|path| path.ends_with(".toml")),
    );
    let count = args.len() - 2;
    let checked = aldis(&args.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(checked.status.success(), "{}", stdout(&checked));
    assert!(count >= 3);
    assert_eq!(stdout(&checked).lines().filter(|line| line.contains("\"ok\":true")).count(), count);
}

#[test]
fn schema_and_access_control_are_json() {
    let schema: serde_json::Value = serde_json::from_str(&stdout(&aldis(&["schema"]))).unwrap();
    assert!(schema["properties"]["entities"].is_object());
    let acl = stdout(&aldis(&["acl", "configs/shore.toml", "configs/vehicle-400.toml"]));
    let acl: serde_json::Value = serde_json::from_str(&acl).unwrap();
    assert_eq!(acl["access_control"]["default_permission"], "deny");
}

#[test]
fn wrong_usage_starts_nothing() {
    for args in [
        &["call", "eid4x", "--ping"][..],
        &["nonsense"],
        &["call", "eid4"],
        &["call", "a", "--ping", "--within", "2"],
    ] {
        let output = aldis(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(!output.stderr.is_empty());
    }
    let missing = aldis(&["run", "configs/none.toml"]);
    assert_eq!(missing.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&missing.stderr).contains("none.toml"));
}

#[test]
fn a_simulated_fleet_is_recorded_and_judged() {
    let file = concat!(env!("CARGO_TARGET_TMPDIR"), "/sim.aldis");
    let _ = std::fs::remove_file(file);
    let run = aldis(&["sim", "umaa", "--seed", "0", "--record", file, "--conform", "--json"]);
    let run: serde_json::Value = serde_json::from_str(&stdout(&run)).unwrap();
    assert_eq!((&run["violations"], &run["conform"]["clauses_broken"]), (&0.into(), &0.into()), "{run}");
    assert_eq!((&run["illegal"], &run["illegal_rejected"]), (&396.into(), &396.into()));
    let judged = aldis(&["conform", "--file", file, "--json"]);
    let report: serde_json::Value = serde_json::from_str(&stdout(&judged)).unwrap();
    assert_eq!(report["clauses_broken"], 0, "{report}");
    assert!(report["observations"].as_u64().unwrap() > 300, "{report}");
    assert!(judged.status.success());
    let unknown = aldis(&["sim", "umaa", "--plant", "nothing"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&unknown.stderr).contains("stale-guard"));
}

#[test]
fn a_scenario_is_planned_and_done_and_what_cannot_be_is_told() {
    for name in ["channel", "rendezvous", "escort", "blockade"] {
        let done = aldis(&["simulate", &format!("configs/scenarios/{name}"), "--seconds", "3600", "--json"]);
        let told: serde_json::Value = serde_json::from_str(&stdout(&done)).unwrap();
        assert!(done.status.success(), "{name}: {told}");
        assert!(!told["tasks"].as_array().unwrap().is_empty(), "{name}: {told}");
    }
    let none = aldis(&["plan", "configs/scenarios/inside-keep-out", "--json"]);
    assert_eq!(none.status.code(), Some(1));
    let last = stdout(&none).lines().last().map(str::to_owned).unwrap();
    let told: serde_json::Value = serde_json::from_str(&last).unwrap();
    let why = told["errors"][0].as_str().unwrap();
    assert!(why.contains("keep-out zone 2: the nearest way out is at latitude"), "{why}");
}
