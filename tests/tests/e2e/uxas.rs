//! Configurations of OpenUxAS, and services that UxAS has, in real processes.

use aldis_envelope::lmcp::cmasi::{
    AirVehicleState, EntityState, KeyValuePair, ServiceStatus, ServiceStatusType,
};
use aldis_envelope::lmcp::{self, Object, Ref};
use aldis_tests::{Directory, Node, Site, aldis, delimited, frame, free_port, root, shared, until};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// The configurations that come with OpenUxAS.
fn configurations(directory: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            configurations(&path, found);
        } else if name.contains("cfg") && name.ends_with(".xml") {
            found.push(path);
        }
    }
}

/// The text with every port of this machine replaced by a free one.
fn with_free_ports(text: &str) -> String {
    let mut lines = Vec::new();
    for line in text.lines() {
        let address = line.split('"').nth(1).filter(|address| {
            let port = address.rsplit_once(':').map(|(_, port)| port.parse::<u16>());
            !line.starts_with('#') && matches!(port, Some(Ok(_)))
        });
        lines.push(match address {
            Some(address) => line.replace(address, &format!("127.0.0.1:{}", free_port())),
            None => line.to_owned(),
        });
    }
    lines.join("\n")
}

/// Imports a configuration, runs what came of it, and returns how its services and bridges are.
fn run_imported(file: &Path) -> Vec<String> {
    let directory = Directory::new();
    let done = aldis([Path::new("uxas"), Path::new("import"), file]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let bus = format!("tcp/127.0.0.1:{}", free_port());
    let kept = directory.path().display().to_string();
    let lines = with_free_ports(&done.stdout);
    let lines = lines.lines().map(|line| match line.strip_prefix("directory = ") {
        Some(was) if was.contains("SavedMessages") => format!("directory = \"{kept}\""),
        _ => line.to_owned(),
    });
    let text = lines.collect::<Vec<_>>().join("\n");
    let config = directory.write("node.toml", &format!("{text}\n[bus]\nlisten = [\"{bus}\"]\n"));
    let mut node = Node::start(&config);
    let entity = until("the node says of which entity it is", || {
        let log = node.log().text();
        Some(log.split_once(": entity ")?.1.split(' ').next()?.to_owned())
    });
    let address = format!("eid{entity}sid1");
    let status = until("the node answers", || {
        let done = aldis(["call", &address, "--request", "aldis.NodeQuery", "--json", "--connect", &bus]);
        (done.code == Some(0)).then(|| done.json()[0]["content"].clone())
    });
    let services = status["services"].as_array().unwrap();
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    let states =
        services.iter().map(|service| format!("{}: {}", text(&service["name"]), text(&service["state"])));
    let states = states.collect();
    node.signal("TERM");
    assert!(node.wait().success(), "{}", file.display());
    states
}

/// A service runs; a bridge listens, or looks for its peer, which is not there.
fn is_well(state: &str) -> bool {
    let (name, state) = state.split_once(": ").unwrap();
    let of_bridges = ["listening on ", "publishing on ", "cannot connect to ", "connecting to "];
    state == "running" || name.starts_with("uxas-") && of_bridges.iter().any(|begin| state.starts_with(begin))
}

#[test]
fn every_configuration_of_openuxas_runs_with_all_services_that_there_are() {
    let Some(scenarios) = shared("uxas/scenarios") else { return };
    let mut files = Vec::new();
    configurations(&scenarios, &mut files);
    assert!(files.len() >= 19, "{files:?}");
    let left = Mutex::new(files);
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some(file) = { left.lock().unwrap().pop() } {
                    let states = run_imported(&file);
                    // Health, log, node and manager at the least.
                    assert!(states.len() >= 4, "{}: {states:?}", file.display());
                    let wrong: Vec<_> = states.iter().filter(|state| !is_well(state)).collect();
                    assert!(wrong.is_empty(), "{}: {wrong:?}", file.display());
                }
            });
        }
    });
}

#[test]
fn a_configuration_of_openuxas_is_run_as_it_is() {
    let directory = Directory::new();
    let file = directory.write(
        "cfg_Test.xml",
        "<UxAS EntityID=\"100\"><Service Type=\"TaskManagerService\"/><Service Type=\"Unheard\"/></UxAS>",
    );
    let mut node = Node::start(&file);
    node.log().wait_for("cfg_Test.xml:1: Service Unheard has no equivalent");
    node.log().wait_for("uxas-100: entity 100 of fleet fleet");
    node.signal("TERM");
    assert!(node.wait().success());
}

fn lmcp_frame(object: &dyn Object) -> Vec<u8> {
    let content = lmcp::encode(object).unwrap();
    frame(&delimited(object.type_info().full_name, 1, 61, &content))
}

fn state(vehicle: i64, heading: f32) -> Vec<u8> {
    let mut state = AirVehicleState::default();
    let base = (&mut state as &mut dyn Object).get_mut::<EntityState>().unwrap();
    (base.id, base.heading) = (vehicle, heading);
    lmcp_frame(&state)
}

#[test]
fn states_are_held_with_their_ages_and_recorded_and_errors_of_services_are_health() {
    let site = Site::new();
    let kept = site.directory().path().join("kept");
    let more = format!(
        "[[service]]\nkind = \"recorder\"\nservice = 121\ndirectory = \"{}\"\naddresses = [\"afrl\"]\nmessages_per_file = 2\n",
        kept.display()
    );
    let mut node = Node::start(&site.shore_config(&more));
    site.wait_for(1);
    let mut peer = site.peer(&node, site.shore_uxas);
    let info = vec![Ref::new(KeyValuePair { key: "no region".into(), ..Default::default() })];
    let error = ServiceStatus { status_type: ServiceStatusType::Error, info, ..Default::default() };
    for bytes in [state(400, 10.0), state(500, 20.0), state(400, 30.0), lmcp_frame(&error)] {
        peer.send(&bytes);
    }
    let states = until("both vehicles are held", || {
        let done = site.aldis(&["fleet", "--states", "--within", "500ms", "--json"]);
        let states = if done.code == Some(0) { done.json() } else { Vec::new() };
        (states.len() == 2 && states[0]["heading_deg"] == 30.0).then_some(states)
    });
    let ids: Vec<&Value> = states.iter().map(|state| &state["vehicle"]).collect();
    assert_eq!((ids[0].as_i64(), ids[1].as_i64()), (Some(400), Some(500)));
    assert!(states.iter().all(|state| state["age_ms"].as_u64() >= state["heard_ms"].as_u64()), "{states:?}");
    let health = site.aldis(&["health", "--json", "--severity", "FAIL"]).json();
    assert_eq!(health.len(), 1, "{health:?}");
    assert_eq!(health[0]["resource"], "eid1sid61");
    assert!(health[0]["status"].as_str().unwrap().ends_with("no region"), "{health:?}");
    node.signal("TERM");
    assert!(node.wait().success());
    let mut files: Vec<_> = std::fs::read_dir(&kept).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert_eq!(files.len(), 2, "four messages, two a file: {files:?}");
}

#[test]
fn a_mission_ends_with_its_control_and_says_why() {
    let scenario = root().join("configs/scenarios/loss-of-control");
    let done = aldis(["simulate".as_ref(), scenario.as_os_str(), "--json".as_ref()]);
    assert_eq!(done.code, Some(1), "{done:?}");
    let told: Value = serde_json::from_str(&done.stdout).unwrap();
    let complete: Vec<_> = told["tasks"].as_array().unwrap().iter().map(|task| &task["task"]).collect();
    assert_eq!(complete, [1], "the second was under way");
    assert_eq!(told["lost"][0]["vehicle"], 471);
    let why = told["lost"][0]["why"].as_str().unwrap();
    assert!(why.contains("control is lost of `autopilot`") && why.contains("took over"), "{why}");
    assert_eq!(told["vehicles"][0]["speed_m_per_s"], 0.0, "it holds its place");
}

#[test]
fn a_scenario_is_done_across_bad_links() {
    let scenario = root().join("configs/scenarios/escort");
    let done = aldis([
        "simulate".as_ref(),
        scenario.as_os_str(),
        "--link".as_ref(),
        "L1".as_ref(),
        "--json".as_ref(),
    ]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let told: Value = serde_json::from_str(&done.stdout).unwrap();
    assert_eq!(told["tasks"].as_array().unwrap().len(), 1);
    assert!(told["link_bytes"].as_u64().unwrap() > 10_000, "{told}");
}
