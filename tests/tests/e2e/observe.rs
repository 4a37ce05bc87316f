//! What people ask of a running fleet: health, log, recordings; and what a late joiner gets.

use aldis_tests::{Node, Site, aldis, until};
use std::thread;

#[test]
fn health_is_read_from_those_that_report_it_and_filtered() {
    let site = Site::new();
    let _nodes = site.start();
    let done = site.aldis(&["health", "--json"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let reports = done.json();
    for resource in ["eid1sid1", "eid1sid20", "eid400sid3", "eid400sid20"] {
        let of_resource = reports.iter().filter(|report| report["resource"] == resource).count();
        assert_eq!(of_resource, 1, "{resource} in {reports:?}");
    }
    let of_vehicle = site.aldis(&["health", "--json", "--of", "400", "--severity", "none,WARN"]).json();
    assert!(!of_vehicle.is_empty());
    assert!(of_vehicle.iter().all(|report| report["reporter"] == "eid400sid2"), "{of_vehicle:?}");
    let one = of_vehicle[0]["resource_id"].as_str().unwrap();
    assert_eq!(site.aldis(&["health", "--json", "--resource", one]).json().len(), 1);
    assert_eq!(site.aldis(&["health", "--json", "--severity", "FAIL", "--code", "POWER"]).stdout, "");
    assert_eq!(site.aldis(&["health", "--severity", "BAD"]).code, Some(2));
}

#[test]
fn the_health_of_a_node_that_ends_in_order_is_disposed() {
    let site = Site::new();
    let (_shore, mut vehicle) = site.start();
    vehicle.signal("TERM");
    assert!(vehicle.wait().success());
    until("the reports of the vehicle are gone", || {
        site.aldis(&["health", "--json", "--of", "400"]).stdout.is_empty().then_some(())
    });
    assert!(!site.aldis(&["health", "--json", "--of", "1"]).stdout.is_empty());
}

#[test]
fn the_log_of_a_node_is_asked_for_by_level_and_source() {
    let site = Site::new();
    let (shore, _vehicle) = site.start();
    let mut peer = site.peer(&shore, site.shore_uxas);
    // A frame of an entity that shore does not speak for is a warning.
    peer.send(b"+=+=+=+=23#@#@#@#@a$lmcp|a||300|61$x0123456!%!%!%!%1#?#?#?#?");
    until("the warning is logged", || {
        let done = site.aldis(&["log", "--json", "--level", "WARNING", "--source", "eid1sid3"]);
        assert_eq!(done.code, Some(0), "{done:?}");
        done.json().first().map(|entry| assert_eq!(entry["level"], "WARNING"))
    });
    let all = site.aldis(&["log", "--json"]).json();
    assert!(all.len() > 1);
    assert_eq!(site.aldis(&["log", "--json", "--last", "1"]).json(), all[all.len() - 1..]);
    assert_eq!(site.aldis(&["log", "--at", "500"]).code, Some(3));
    assert_eq!(site.aldis(&["log", "--source", "somebody"]).code, Some(2));
}

#[test]
fn a_recording_is_replayed_as_it_was() {
    let site = Site::new();
    let _nodes = site.start();
    let file = site.directory().path().join("watch.aldis");
    let file = file.to_str().unwrap();
    let recorded = site.aldis(&["record", file, "UMAA::SO::HealthReport", "--count", "6", "--json"]);
    assert_eq!(recorded.code, Some(0), "{recorded:?}");
    assert_eq!(recorded.json()[0]["envelopes"], 6);
    let again = site.aldis(&["record", file]);
    assert_eq!(again.code, Some(1), "an existing file is not written over: {again:?}");
    // Played back into a site of its own, where its sources are not.
    let elsewhere = Site::new();
    let _shore = elsewhere.start_shore();
    elsewhere.wait_for(1);
    thread::scope(|scope| {
        let heard = scope.spawn(|| {
            // Retained: whoever comes while the replay runs or before hears the last of each resource.
            elsewhere.aldis(&["sub", "UMAA::SO::HealthReport", "--json", "--for", "8s"])
        });
        let replayed = elsewhere.aldis(&["replay", file, "--speed", "2", "--json"]);
        assert_eq!(replayed.code, Some(0), "{replayed:?}");
        assert_eq!((&replayed.json()[0]["sent"], &replayed.json()[0]["skipped"]), (&6.into(), &0.into()));
        let heard = heard.join().unwrap().json();
        let again = heard.iter().filter(|envelope| envelope["node"] == 9000).count();
        assert_eq!(again, 6, "of {} heard", heard.len());
    });
    let torn = std::fs::read(file).unwrap();
    let short = elsewhere.directory().write("short.aldis", "ALDISREC");
    std::fs::write(&short, &torn[..torn.len() - 3]).unwrap();
    let replayed = elsewhere.aldis(&["replay", short.to_str().unwrap(), "--json"]);
    assert!(replayed.stderr.contains("ends inside the record"), "{replayed:?}");
    assert_eq!(replayed.json()[0]["sent"], 5);
}

#[test]
fn a_publisher_that_nobody_listened_to_is_heard_by_who_comes_and_comes_again() {
    let site = Site::new();
    // Without a bridge nobody but the subscribers of this test listens.
    let config = format!(
        "name = \"quiet\"\nfleet = \"fleet\"\nentities = [1]\n[bus]\nmode = \"router\"\nlisten = [\"tcp/127.0.0.1:{}\"]\n",
        site.bus
    );
    let _node = Node::start(&site.directory().write("quiet.toml", &config));
    site.wait_for(1);
    thread::scope(|scope| {
        scope.spawn(|| {
            let what = ["pub", "weather", "--content-type", "text", "--text", "calm"];
            site.aldis(&[&what[..], &["--rate", "200", "--count", "2000"]].concat())
        });
        // Each count takes longer than the second for which a publisher sends whatever it knows of listeners.
        for round in 0..2 {
            let heard = site.aldis(&["sub", "weather", "--count", "300", "--json", "--as", "9001"]).json();
            let numbers: Vec<_> =
                heard.iter().map(|envelope| envelope["sequence"].as_u64().unwrap()).collect();
            assert_eq!(numbers.len(), 300, "round {round}");
            assert!(numbers.windows(2).all(|pair| pair[1] == pair[0] + 1), "round {round}: {numbers:?}");
        }
    });
}

#[test]
fn a_late_joiner_gets_every_retained_instance_once_and_in_order() {
    let done = aldis(["bench", "join", "--instances", "400", "--rate", "100", "--json"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let result = &done.json()[0];
    assert_eq!((&result["complete"], &result["instances_seen"]), (&true.into(), &400.into()), "{result}");
    assert_eq!(
        (&result["twice_or_out_of_order"], &result["lost_afterwards"]),
        (&0.into(), &0.into()),
        "{result}"
    );
}
