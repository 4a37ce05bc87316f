//! Mistakes in bridges over ZeroMQ, and what good ones become.

use super::*;
use crate::config::Config;

const TOP: &str = "name = \"a\"\nentities = [400]\n";
const ZMQ: &str = "[[bridge]]\nkind = \"uxas-zmq\"\nname = \"zmq\"\nservice = 21\n";

fn parse(sockets: &str) -> Result<Bridge, String> {
    let config = Config::parse("node.toml", &format!("{TOP}{ZMQ}{sockets}"));
    let config = config.map_err(|error| {
        let (line, _) = error.position().unwrap();
        format!("{line}: {}; {}", error.message(), error.cure())
    })?;
    Ok(config.bridges[0].clone())
}

#[test]
fn both_pairs_of_sockets_are_read() {
    let binds = "publish = \"127.0.0.1:5560\"\npull = \"127.0.0.1:5561\"\n";
    let Ok(Bridge::UxasZmq(bridge)) = parse(binds) else { panic!() };
    assert!(matches!(bridge.sockets, Sockets::PublishPull { publish, .. } if publish.port() == 5560));
    assert_eq!((bridge.framing, bridge.common.self_generated), (Framing::Single, false));
    let connects =
        "subscribe = \"10.0.0.1:5560\"\npush = \"10.0.0.1:5561\"\nframing = \"multipart\"\npeer = \"x\"";
    let Ok(Bridge::UxasZmq(bridge)) = parse(connects) else { panic!() };
    assert!(matches!(bridge.sockets, Sockets::SubscribePush { push, .. } if push.port() == 5561));
    assert_eq!(bridge.framing, Framing::Multipart);
    let written = serde_json::to_string(&bridge).unwrap();
    assert_eq!(serde_json::from_str::<UxasZmq>(&written).unwrap(), bridge);
}

#[test]
fn wrong_pairs_are_told_apart() {
    let one = "\"127.0.0.1:5560\"";
    for (sockets, told) in [
        (String::new(), "3: the bridge has no sockets; add `publish` and `pull`"),
        (format!("publish = {one}"), "7: `publish` without `pull`; add pull ="),
        (format!("push = {one}"), "7: `push` without `subscribe`; add subscribe ="),
        (format!("publish = {one}\npull = {one}"), "8: `publish` and `pull` are both 127.0.0.1:5560"),
        (format!("publish = {one}\npush = {one}"), "8: the bridge both binds and connects"),
        (
            format!("subscribe = \"127.0.0.1:0\"\npush = {one}"),
            "7: nobody can be reached at port 0; give the port",
        ),
        (format!("publish = {one}\npul = {one}"), "8: unknown field `pul`"),
        (format!("publish = {one}\npull = {one}\nframing = \"seven\""), "9: unknown variant `seven`"),
    ] {
        let error = parse(&sockets).unwrap_err();
        assert!(error.starts_with(told), "{error}");
    }
}

#[test]
fn two_bridges_do_not_listen_on_one_port() {
    let tcp = "[[bridge]]\nkind = \"uxas-tcp\"\nname = \"tcp\"\nservice = 20\nlisten = \"127.0.0.1:5561\"\n";
    let sockets = format!("publish = \"127.0.0.1:5560\"\npull = \"127.0.0.1:5561\"\n{tcp}");
    assert!(parse(&sockets).unwrap_err().contains("two bridges listen on 127.0.0.1:5561"));
}
