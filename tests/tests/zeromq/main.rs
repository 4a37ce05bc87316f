//! A node and a foreign ZeroMQ: libzmq, by its binding for Python. Sockets that connect, sockets that bind, both framings.

mod peer;
mod waterway;

use aldis_tests::{Node, Site, free_port};
use peer::{Uxas, pyzmq};
use serde_json::json;
use std::path::PathBuf;

/// Shore with a ZeroMQ bridge, and the ports of its two sockets.
struct Stage {
    site: Site,
    node: Node,
    ports: [u16; 2],
    python: PathBuf,
}

const HEAD: &str = "afrl.cmasi.KeyValuePair$lmcp|afrl.cmasi.KeyValuePair||1|61$";

impl Stage {
    /// A node with sockets of these names: those that others connect to, or those that connect.
    fn new([into, out]: [&str; 2], framing: &str, more: &str) -> Option<Self> {
        Self::of_entity(1, [into, out], framing, more)
    }

    /// The same as another entity beside shore.
    fn of_entity(entity: u64, [into, out]: [&str; 2], framing: &str, more: &str) -> Option<Self> {
        let python = pyzmq()?;
        let (site, ports) = (Site::new(), [free_port(), free_port()]);
        let bridge = format!(
            "[[bridge]]\nkind = \"uxas-zmq\"\nname = \"zmq\"\nservice = 21\nframing = \"{framing}\"\n\
             {into} = \"127.0.0.1:{}\"\n{out} = \"127.0.0.1:{}\"\n{more}\n",
            ports[0], ports[1]
        );
        let config = site.shore_config(&bridge);
        if entity != 1 {
            let text = std::fs::read_to_string(&config).expect("it was written");
            let text = text.replace("\nentities = [1]\n", &format!("\nentities = [{entity}, 1]\n"));
            site.directory().write("shore.toml", &text);
        }
        let node = Node::start(&config);
        site.wait_for(entity);
        Some(Self { site, node, ports, python })
    }

    /// A peer that fits a node whose sockets bind, once the node knows both of its connections.
    fn connected(&self, framing: &str, topic: &str) -> Uxas {
        let uxas = Uxas::start(&self.python, "connect", framing, self.ports, topic);
        self.node.log().wait_for("(PULL) is there");
        self.node.log().wait_for("(PUB) is there");
        uxas
    }

    fn counter(&self, name: &str) -> u64 {
        self.site.counter(1, &format!("zmq.{name}"))
    }
}

/// Sends messages until one comes back: a subscription takes effect some time after the connection. Says how many.
fn warm_up(uxas: &mut Uxas) -> u64 {
    uxas.tell(&json!(["warm"]));
    uxas.heard().as_u64().expect("a number")
}

#[test]
fn messages_go_through_pull_and_pub_in_both_framings_and_none_is_lost() {
    for framing in ["single", "multipart"] {
        let Some(stage) = Stage::new(["pull", "publish"], framing, "") else { return };
        let mut uxas = stage.connected(framing, "");
        let before = warm_up(&mut uxas);
        uxas.tell(&json!(["flood", 20_000, 0]));
        let heard = uxas.heard();
        assert_eq!((&heard["came"], &heard["altered"]), (&json!(20_000), &json!(0)), "{framing}");
        assert_eq!((stage.counter("imported"), stage.counter("framing_wrong")), (before + 20_000, 0));
        assert_eq!((stage.counter("shed_full"), stage.counter("shed_stalled")), (0, 0));
    }
}

#[test]
fn a_frame_of_the_other_kind_is_dropped_and_counted() {
    let seven = ["afrl.cmasi.KeyValuePair", "lmcp", "afrl.cmasi.KeyValuePair", "", "1", "61", "x"];
    let one = format!("{HEAD}x");
    let frames: [&[&str]; 2] = [&[one.as_str()], &seven];
    for (place, framing) in ["single", "multipart"].into_iter().enumerate() {
        let Some(stage) = Stage::new(["pull", "publish"], framing, "") else { return };
        let mut uxas = stage.connected(framing, "");
        warm_up(&mut uxas);
        uxas.send(frames[1 - place]);
        uxas.send(&["too", "few"]);
        uxas.send(frames[place]);
        assert_eq!(uxas.receive(), json!(frames[place]), "{framing}");
        let counted = (stage.counter("framing_wrong"), stage.counter("refused_malformed"));
        assert_eq!(counted, if framing == "single" { (2, 0) } else { (1, 1) });
    }
}

#[test]
fn a_subscriber_gets_what_it_asked_for_and_what_the_filter_lets_out() {
    let filter = "export = [\"afrl.cmasi\"]";
    let Some(stage) = Stage::new(["pull", "publish"], "single", filter) else { return };
    let mut uxas = stage.connected("single", "afrl.cmasi.K");
    let before = warm_up(&mut uxas);
    let seen = stage.counter("exported");
    assert!(seen <= before);
    for kind in ["afrl.cmasi.Circle", "afrl.cmasi.KeyValuePairs", "afrl.impact.Kind", "afrl.cmasi.Key"] {
        uxas.send(&[&format!("{kind}$lmcp|{kind}||0|0$x")]);
    }
    let received = [uxas.receive(), uxas.receive()].map(|frames| frames[0].clone());
    assert_eq!(received[0], "afrl.cmasi.KeyValuePairs$lmcp|afrl.cmasi.KeyValuePairs||1|21$x");
    assert_eq!(received[1], "afrl.cmasi.Key$lmcp|afrl.cmasi.Key||1|21$x");
    assert_eq!((stage.counter("not_subscribed"), stage.counter("sources_assigned")), (before - seen + 1, 4));
    assert_eq!(stage.counter("exported"), seen + 2);
}

#[test]
fn sockets_that_connect_speak_to_sockets_that_bind_and_never_return_what_came() {
    let Some(stage) = Stage::new(["subscribe", "push"], "single", "import = [\"afrl.\"]") else { return };
    let mut uxas = Uxas::start(&stage.python, "bind", "single", stage.ports, "");
    stage.node.log().wait_for("(SUB) is there");
    stage.node.log().wait_for("(PUSH) is there");
    let mut at_shore = stage.site.peer(&stage.node, stage.site.shore_uxas);
    // A publisher drops what nobody has asked for yet: it repeats itself until it is heard.
    let came = aldis_tests::until("the subscription is there", || {
        uxas.send(&[&format!("{HEAD}x")]);
        at_shore.is_waiting().then(|| at_shore.receive())
    });
    assert_eq!(came.head(), HEAD);
    at_shore.send(&aldis_tests::frame(&aldis_tests::delimited("afrl.cmasi.Circle", 1, 62, b"back")));
    let first = uxas.receive();
    assert_eq!(
        first[0], "afrl.cmasi.Circle$lmcp|afrl.cmasi.Circle||1|62$back",
        "and not what it sent itself"
    );
}

#[test]
fn two_bridges_to_one_peer_do_not_echo() {
    let Some(stage) = Stage::new(["pull", "publish"], "single", "peer = \"uxas\"") else { return };
    let mut uxas = stage.connected("single", "");
    let mut at_shore = stage.site.peer(&stage.node, stage.site.shore_uxas);
    let mut from_shore = |payload: &[u8]| {
        at_shore.send(&aldis_tests::frame(&aldis_tests::delimited("afrl.cmasi.Circle", 1, 62, payload)));
    };
    aldis_tests::until("the subscription is there", || {
        from_shore(b"first");
        (stage.counter("exported") > 0).then_some(())
    });
    uxas.send(&[&format!("{HEAD}x")]);
    assert_eq!(at_shore.receive().head(), HEAD);
    at_shore.send(&aldis_tests::frame(&aldis_tests::delimited("afrl.cmasi.Circle", 1, 62, b"last")));
    loop {
        let received = uxas.receive()[0].as_str().expect("text").to_owned();
        assert!(received.starts_with("afrl.cmasi.Circle$"), "it came from there: {received}");
        if received.ends_with("$last") {
            return;
        }
    }
}
