//! Two nodes on buses of their own, joined by a link over UDP.

use aldis_tests::{Directory, Node, aldis, free_port, until};
use std::net::UdpSocket;

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
