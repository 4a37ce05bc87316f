//! The life of a node: wrong configurations, ports in use, the end, and comings and goings.

use aldis_tests::{Node, Peer, Received, Site, aldis, delimited, frame, until};
use std::net::{Ipv4Addr, TcpListener};
use std::time::{Duration, Instant};

#[test]
fn a_wrong_configuration_is_told_with_its_place_and_cure_and_nothing_starts() {
    let site = Site::new();
    let good = std::fs::read_to_string(site.shore_config("")).unwrap();
    let line_of = |text: &str, part: &str| text.lines().position(|line| line.contains(part)).unwrap() + 1;
    for (from, to, message, cure) in [
        ("entities = [1]", "entitys = [1]", "unknown field `entitys`", "did you mean `entities`?"),
        ("service = 20", "service = 5", "service 5 is not a bridge's", "bridges have 20 to 99"),
        (
            "dialect = \"openuxas\"",
            "dialect = \"klingon\"",
            "unknown variant `klingon`",
            "known here: openuxas, slides",
        ),
        ("mode = \"router\"", "mode = \"ruoter\"", "unknown variant `ruoter`", "did you mean `router`?"),
    ] {
        let wrong = good.replace(from, to);
        assert_ne!(wrong, good, "{from}");
        let path = site.directory().write("wrong.toml", &wrong);
        let done = aldis(["run".as_ref(), path.as_os_str()]);
        assert_eq!(done.code, Some(2), "{done:?}");
        let place = format!("wrong.toml:{}:", line_of(&wrong, to));
        for part in [message, cure, &place] {
            assert!(done.stderr.contains(part), "`{part}` in:\n{}", done.stderr);
        }
        assert!(!done.stderr.contains("entity 1 of fleet"), "nothing was started: {}", done.stderr);
        assert!(Peer::connect(site.shore_uxas).is_err());
    }
    let done = aldis(["run".as_ref(), site.directory().path().join("absent.toml").as_os_str()]);
    assert_eq!(done.code, Some(2), "{done:?}");
}

#[test]
fn a_port_of_a_bridge_in_use_is_said_once_and_tried_again() {
    let site = Site::new();
    let other = TcpListener::bind((Ipv4Addr::LOCALHOST, site.shore_uxas)).unwrap();
    let shore = site.start_shore();
    let trouble = format!("cannot listen on 127.0.0.1:{}", site.shore_uxas);
    shore.log().wait_for(&trouble);
    site.wait_for(1);
    let bridge =
        |site: &Site| site.status(1)["services"].as_array().unwrap().last().unwrap()["state"].clone();
    assert!(bridge(&site).as_str().unwrap().contains(&trouble), "{}", bridge(&site));
    drop(other);
    let _peer = site.peer(&shore, site.shore_uxas);
    assert_eq!(shore.log().count(&trouble), 1, "{}", shore.log().text());
    assert_eq!(bridge(&site), format!("listening on 127.0.0.1:{}, 1 peer", site.shore_uxas));
}

#[test]
fn a_port_of_the_bus_in_use_is_said_once_and_tried_again() {
    let site = Site::new();
    let other = TcpListener::bind((Ipv4Addr::LOCALHOST, site.bus)).unwrap();
    let shore = site.start_shore();
    shore.log().wait_for("no session on the bus");
    // The bridge works without the bus.
    let [mut first, mut second] = [0, 1].map(|_| site.peer(&shore, site.shore_uxas));
    let message = delimited("a.B", 1, 61, b"x");
    first.send(&frame(&message));
    assert_eq!(second.receive(), Received(message.into()));
    drop(other);
    site.wait_for(1);
    assert_eq!(shore.log().count("no session on the bus"), 1, "{}", shore.log().text());
}

#[test]
fn a_signal_ends_a_node_in_order_and_in_time() {
    for signal in ["TERM", "INT"] {
        let site = Site::new();
        let (mut shore, mut vehicle) = site.start();
        let _peer = site.peer(&shore, site.shore_uxas);
        for node in [&mut vehicle, &mut shore] {
            let warnings = node.log().count("WARN");
            let started = Instant::now();
            node.signal(signal);
            let status = node.wait();
            assert_eq!(status.code(), Some(0), "{signal}: {}", node.log().text());
            assert!(started.elapsed() < Duration::from_secs(5), "{signal}: {:?}", started.elapsed());
            assert_eq!(
                node.log().count("WARN"),
                warnings,
                "an orderly end warns of nothing: {}",
                node.log().text()
            );
        }
    }
}

#[test]
fn a_node_that_finds_no_bus_ends_in_order_too() {
    let site = Site::new();
    let mut vehicle = site.start_vehicle();
    vehicle.log().wait_for("no session on the bus");
    vehicle.signal("TERM");
    assert_eq!(vehicle.wait().code(), Some(0), "{}", vehicle.log().text());
}

/// Sends until something comes out on the other side; then what comes is one stream without holes.
fn flows(from: &mut Peer, to: &mut Peer, run: u64) {
    let message =
        |number: u64| delimited("afrl.cmasi.AirVehicleState", 100, 61, format!("{run} {number}").as_bytes());
    let mut sent = 0;
    until("telemetry flows", || {
        from.send(&frame(&message(sent)));
        sent += 1;
        to.is_waiting().then_some(())
    });
    let first: u64 = {
        let received = to.receive();
        let text = std::str::from_utf8(received.payload()).unwrap().to_owned();
        text.strip_prefix(&format!("{run} ")).unwrap_or_else(|| panic!("{text}")).parse().unwrap()
    };
    for number in first + 1..sent {
        assert_eq!(to.receive(), Received(message(number).into()));
    }
}

#[test]
fn telemetry_flows_whoever_comes_first_and_again_after_a_restart() {
    let site = Site::new();
    let vehicle = site.start_vehicle();
    vehicle.log().wait_for("no session on the bus");
    let mut on_board = site.peer(&vehicle, site.vehicle_uxas);
    let mut shore = site.start_shore();
    for run in 0..3 {
        let mut at_shore = site.peer(&shore, site.shore_uxas);
        flows(&mut on_board, &mut at_shore, run);
        if run == 0 {
            shore.signal("TERM");
            assert_eq!(shore.wait().code(), Some(0));
        } else {
            shore.crash();
        }
        shore = site.start_shore();
    }
    let mut at_shore = site.peer(&shore, site.shore_uxas);
    flows(&mut on_board, &mut at_shore, 3);
}

#[test]
fn telemetry_flows_again_after_the_vehicle_came_back() {
    let site = Site::new();
    let (shore, vehicle) = site.start();
    let mut at_shore = site.peer(&shore, site.shore_uxas);
    flows(&mut site.peer(&vehicle, site.vehicle_uxas), &mut at_shore, 0);
    vehicle.crash();
    let vehicle = Node::start(&site.vehicle_config(""));
    flows(&mut site.peer(&vehicle, site.vehicle_uxas), &mut at_shore, 1);
    assert_eq!(site.counter(1, "lost"), 0);
}
