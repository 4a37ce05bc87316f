//! Calls by eid and sid, between processes, with the exit codes that `aldis --help` documents.

use aldis_tests::{Done, Site, aldis, free_port};
use std::time::Duration;

/// The last line of `--json`: how it ended.
fn ending(done: &Done) -> serde_json::Value {
    done.json().pop().unwrap_or_else(|| panic!("nothing was written: {done:?}"))
}

#[test]
fn a_ping_is_answered_with_its_round_trip() {
    let site = Site::new();
    let _nodes = site.start();
    let done = site.aldis(&["call", "eid400sid1", "--ping", "--json"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let [answer, ending] = &done.json()[..] else { panic!("{done:?}") };
    assert_eq!((&answer["from"], &answer["descriptor"]), (&"eid400sid1".into(), &"aldis.Pong".into()));
    let round_trip = answer["round_trip_ms"].as_f64().unwrap();
    assert!(round_trip > 0.0 && round_trip < 2_000.0, "{round_trip} ms");
    assert_eq!((&ending["ok"], &ending["answers"]), (&true.into(), &1.into()));
}

#[test]
fn every_service_and_bridge_of_an_entity_answers_a_ping() {
    let site = Site::new();
    let _nodes = site.start();
    let done = site.aldis(&["call", "eid400sidall", "--ping", "--json", "--within", "20s"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let mut answers = done.json();
    assert_eq!(answers.pop().unwrap()["answers"], 4);
    let mut from: Vec<_> = answers.iter().map(|answer| answer["from"].as_str().unwrap()).collect();
    from.sort_unstable();
    assert_eq!(from, ["eid400sid1", "eid400sid2", "eid400sid20", "eid400sid3"]);
    assert!(
        done.took < Duration::from_secs(15),
        "it ends with the last answer, not at the deadline: {:?}",
        done.took
    );
}

#[test]
fn an_absent_service_is_told_at_once() {
    let site = Site::new();
    let _nodes = site.start();
    for absent in ["eid400sid99", "eid500sid1", "eid500sidall"] {
        let done = site.aldis(&["call", absent, "--ping", "--json", "--within", "25s"]);
        assert_eq!(done.code, Some(3), "{absent}: {done:?}");
        assert!(done.took < Duration::from_secs(15), "{absent}: {:?}", done.took);
        assert!(done.stderr.contains("nobody is there"), "{absent}: {done:?}");
        assert_eq!(ending(&done)["ok"], false);
        assert!(ending(&done)["reason"].as_str().unwrap().contains("nobody is there"));
    }
}

#[test]
fn a_silent_service_is_told_at_the_deadline() {
    let site = Site::new();
    let (_shore, vehicle) = site.start();
    vehicle.signal("STOP");
    let within = Duration::from_millis(700);
    let done = site.aldis(&["call", "eid400sid1", "--ping", "--json", "--within", "700ms"]);
    assert_eq!(done.code, Some(4), "{done:?}");
    assert!(done.took >= within, "it was not waited for: {:?}", done.took);
    assert!(ending(&done)["reason"].as_str().unwrap().contains("deadline"), "{done:?}");
    vehicle.signal("CONT");
    site.wait_for(400);
}

#[test]
fn an_unknown_request_is_refused_with_its_name() {
    let site = Site::new();
    let _nodes = site.start();
    for service in ["eid400sid1", "eid400sid2", "eid400sid3", "eid400sid20"] {
        let done = site.aldis(&["call", service, "--request", "nobody.Knows", "--json", "--within", "20s"]);
        assert_eq!(done.code, Some(1), "{service}: {done:?}");
        let reason = ending(&done)["reason"].clone();
        assert_eq!(reason, "not understood: nobody.Knows", "{service}");
        assert!(done.took < Duration::from_secs(15), "{service}: {:?}", done.took);
    }
}

#[test]
fn a_forbidden_call_is_answered_with_the_reason_and_a_rule_permits_it() {
    let site = Site::new();
    let _shore = site.start_shore();
    let rule = "[[allow]]\nfrom = [7]\nservice = 3\nrequests = [\"aldis.Allowed\"]\n";
    let _vehicle = aldis_tests::Node::start(&site.vehicle_config(rule));
    site.wait_for(400);
    let call = |entity: &str, service: &str, request: &str| {
        let args = ["call", service, "--request", request, "--json", "--within", "20s", "--as", entity];
        let done = site.aldis(&args);
        assert_eq!(done.code, Some(1), "{done:?}");
        ending(&done)["reason"].as_str().unwrap().to_owned()
    };
    let reason = call("7", "eid400sid3", "aldis.Kill");
    assert!(reason.starts_with("not allowed: `aldis.Kill` administers the node"), "{reason}");
    assert!(reason.contains("entity 7") && reason.contains("[[allow]]"), "{reason}");
    assert_eq!(
        call("7", "eid400sid3", "aldis.Allowed"),
        "not understood: aldis.Allowed",
        "the rule permits it"
    );
    assert!(call("7", "eid400sid2", "aldis.Allowed").starts_with("not allowed: "), "for this service alone");
    assert_eq!(call("9000", "eid400sid3", "aldis.Kill"), "not understood: aldis.Kill", "an operator may");
    assert_eq!(site.counter(400, "calls_forbidden"), 2);
}

#[test]
fn without_a_bus_the_exit_code_says_so() {
    let locator = format!("tcp/127.0.0.1:{}", free_port());
    let fails = |command: &[&str]| {
        let done = aldis(command.iter().copied().chain(["--connect", &locator]));
        assert_eq!(done.code, Some(5), "{command:?}: {done:?}");
        assert!(done.stderr.contains(&locator) && done.stdout.is_empty(), "{command:?}: {done:?}");
    };
    let commands =
        [&["call", "eid400sid1", "--ping"][..], &["fleet"], &["pub", "a.B", "--text", "x"], &["sub"]];
    // All at once, because each waits as long as it may.
    std::thread::scope(|scope| {
        for command in &commands {
            scope.spawn(|| fails(command));
        }
    });
}

#[test]
fn the_fleet_is_shown_to_machines() {
    let site = Site::new();
    let _nodes = site.start();
    let done = site.aldis(&["fleet", "--json"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let nodes: Vec<_> = done.json().iter().map(|node| node["node"].as_u64().unwrap()).collect();
    assert_eq!(nodes, [1, 400], "{done:?}");
    let vehicle = &done.json()[1];
    assert_eq!(vehicle["entities"], serde_json::json!([400, 100]));
    assert_eq!(vehicle["counters"]["uxas.imported"], 0, "{vehicle:#}");
}
