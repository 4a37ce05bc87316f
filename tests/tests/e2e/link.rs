//! Two nodes on buses of their own, joined by a link over UDP.

use aldis_tests::{Directory, Node, aldis, free_port, until};
use std::net::UdpSocket;
use std::process::Stdio;

fn rule(address: &str) -> String {
    format!("[[link.rule]]\naddress = \"{address}\"\nclass = \"command\"\nlifespan_s = 60\n")
}

/// Shore's and the vehicle's configurations, and the port of shore's bus.
fn configs(directory: &Directory) -> (std::path::PathBuf, std::path::PathBuf, u16) {
    let bus = free_port();
    let udp = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap());
    directory.write("key", &"5a".repeat(32));
    let link = |peer: &str, own: usize| {
        let (listen, to) = (udp[own], udp[1 - own]);
        // Shore finds the vehicle where its frames come from.
        let to = if own == 1 { format!("peer = \"{to}\"\n") } else { String::new() };
        format!(
            "[[link]]\nname = \"link\"\n{peer}\n[[link.key]]\nnumber = 1\nfile = \"key\"\n[[link.carrier]]\nkind = \"udp\"\n\
             listen = \"{listen}\"\n{to}rate_bytes_per_s = 100000\n"
        )
    };
    let shore = format!(
        "name = \"shore\"\nentities = [1]\noperators = [9000]\n[bus]\nmode = \"router\"\nlisten = [\"tcp/127.0.0.1:{bus}\"]\n{}{}",
        link("peer = 400", 0),
        rule("eid400")
    );
    let vehicle = format!(
        "name = \"vehicle\"\nentities = [400]\n[bus]\nmode = \"peer\"\n{}{}{}",
        link("peer = 1\nentities = [1, 9000]", 1),
        rule("eid1"),
        rule("eid9000")
    );
    (directory.write("shore.toml", &shore), directory.write("vehicle.toml", &vehicle), bus)
}

#[test]
fn a_call_crosses_and_its_tickets_are_told() {
    let directory = Directory::new();
    let (shore, vehicle, bus) = configs(&directory);
    let (_shore, _vehicle) = (Node::start(&shore), Node::start(&vehicle));
    let connect = format!("tcp/127.0.0.1:{bus}");
    let status = until("shore hears the vehicle, and what runs there", || {
        let said = aldis(["link", "ls", "--json", "--connect", &connect]);
        let status = said.json().into_iter().next()?;
        let services = status["services"].as_array().is_some_and(|services| !services.is_empty());
        (status["heard"] == true && services).then_some(status)
    });
    assert_eq!((&status["keyed"], &status["durable"]), (&true.into(), &false.into()), "{status}");
    let called =
        ["call", "eid400sid1", "--ping", "--wait", "--within", "20s", "--json", "--connect", &connect];
    let called = aldis(called);
    assert_eq!(called.code, Some(0), "{called:?}");
    let lines = called.json();
    let ticket = |text: &str| lines.iter().any(|l| l["ticket"].as_str().is_some_and(|t| t.starts_with(text)));
    assert!(ticket("accepted") && ticket("on air") && ticket("delivered"), "{lines:?}");
    assert!(lines.iter().any(|line| line["from"] == "eid400sid1"), "{lines:?}");
    let silent = aldis(["link", "silence", "on", "--json", "--connect", &connect]);
    assert_eq!(silent.code, Some(0), "{silent:?}");
    let queued = until("a call waits for the end of the silence", || {
        let waits = ["call", "eid400sid1", "--ping", "--within", "2s", "--connect", &connect];
        assert_eq!(aldis(waits).code, Some(4));
        let listed = aldis(["queue", "ls", "--json", "--connect", &connect]).json();
        Some(listed)
    });
    // Its caller has given up, and with it its lifespan has ended: nothing waits for ever.
    assert!(
        queued.iter().all(|command| command["left_ms"].as_u64().is_some_and(|left| left < 2_000)),
        "{queued:?}"
    );
}

/// The project's own example of a link, on ports of its own, with a bad link between. `ALDIS_LINK=L1` has the delay and the rate of a
/// radio; without it both are a tenth as bad, and the loss is the same.
#[test]
fn control_a_call_and_health_cross_a_bad_link_from_the_command_line() {
    let directory = Directory::new();
    let udp = [(); 3].map(|()| UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap());
    let (bus, on_board) = (free_port(), free_port());
    let whole = std::env::var("ALDIS_LINK").is_ok_and(|name| name == "L1");
    let config = |name: &str| {
        let path = aldis_tests::root().join("configs/link").join(name);
        let mut text = std::fs::read_to_string(path).unwrap();
        for (from, to) in [
            ("127.0.0.1:7447", format!("127.0.0.1:{bus}")),
            ("127.0.0.1:7448", format!("127.0.0.1:{on_board}")),
            ("127.0.0.1:7500", udp[0].to_string()),
            ("127.0.0.1:7501", udp[1].to_string()),
            ("127.0.0.1:7502", udp[2].to_string()),
        ] {
            text = text.replace(from, &to);
        }
        if !whole {
            text = text.replace("= 1_200", "= 12_000").replace("round_trip_ms = 600", "round_trip_ms = 60");
        }
        directory.write(name, &text)
    };
    let (shore, vehicle) = (config("shore.toml"), config("vehicle-401.toml"));
    let mut relay = std::process::Command::new(aldis_tests::program());
    relay.args(["link", "emulate", "L1", "--seed", "3", "--listen", &udp[1].to_string()]);
    relay.args(["--a", &udp[0].to_string(), "--b", &udp[2].to_string()]);
    if !whole {
        relay.args(["--delay-ms", "30", "--rate", "12000"]);
    }
    let mut relay = relay.stdin(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
    let (_shore, _vehicle) = (Node::start(&shore), Node::start(&vehicle));
    let connect = format!("tcp/127.0.0.1:{bus}");
    let run = |args: &[&str]| aldis(args.iter().copied().chain(["--connect", &connect, "--json"]));
    until("shore knows what runs on the vehicle", || {
        let status = run(&["link", "ls"]).json().into_iter().next()?;
        status["services"].as_array().filter(|services| services.len() >= 4).map(drop)
    });
    let called = run(&["call", "eid401sid1", "--request", "aldis.NodeQuery", "--within", "60s", "--wait"]);
    assert_eq!(called.code, Some(0), "{called:?}");
    let reports = until("the vehicle's health is known on shore", || {
        let reports = run(&["health", "--of", "401"]).json();
        (reports.len() >= 3).then_some(reports)
    });
    assert!(reports.iter().any(|report| report.to_string().contains("journal: start 1")), "{reports:?}");
    until("the arbiter's report is known on shore", || run(&["priority"]).json().into_iter().next());
    let held = run(&["allocate", "401:autopilot", "--for", "2s"]);
    assert_eq!(held.code, Some(0), "{held:?}");
    let states: Vec<_> =
        held.json().iter().filter_map(|line| line["state"].as_str().map(str::to_owned)).collect();
    assert_eq!(states, ["ISSUED", "COMMANDED", "EXECUTING"], "{held:?}");
    assert_eq!(held.json().last().unwrap()["outcome"], "COMPLETED", "{held:?}");
    let status = run(&["link", "ls"]).json().into_iter().next().unwrap();
    let loss = ["loss_out", "loss_in"].map(|way| status["carriers"][0][way].as_f64().unwrap());
    let loss = loss[0].max(loss[1]);
    assert!(status["durable"] == true && loss > 0.05, "{status}");
    relay.kill().unwrap();
    relay.wait().unwrap();
}
