//! `<Bridge …>`.

use super::Import;
use super::toml::{list, quoted};
use super::tree::Element;
use std::collections::BTreeSet;
use std::net::SocketAddr;

/// Attributes that every bridge of OpenUxAS reads.
const COMMON: [&str; 2] = ["Type", "ConsiderSelfGenerated"];

/// Writes a bridge with a service id; says whether it has one.
pub(super) fn bridge(element: &Element, service: u32, import: &mut Import<'_>) -> bool {
    let kind = element.attribute("Type").unwrap_or_default();
    let written = match kind {
        "LmcpObjectNetworkTcpBridge" => tcp(element, import),
        "LmcpObjectNetworkSerialBridge" => serial(element, import),
        "LmcpObjectNetworkPublishPullBridge" => {
            sockets(element, [("AddressPUB", "publish"), ("AddressPULL", "pull")], import)
        }
        "LmcpObjectNetworkSubscribePushBridge" => {
            sockets(element, [("AddressSUB", "subscribe"), ("AddressPUSH", "push")], import)
        }
        "LmcpObjectNetworkZeroMqZyreBridge" => {
            Err("nodes of a fleet find and hear each other on the bus: give them `connect`, or `scouting`"
                .to_owned())
        }
        _ => Err("no bridge of this name is known".to_owned()),
    };
    match written {
        Err(why) => {
            import.remark(element.line, format!("{} has no equivalent: {why}", element.title()));
            false
        }
        Ok(keys) => {
            import.out.table("bridge", &format!("Line {}: {kind}", element.line));
            for (key, value) in keys {
                import.out.key(key, value);
            }
            import.out.key("name", quoted(&format!("uxas-{service}")));
            import.out.key("service", service);
            // OpenUxAS makes what enters by TCP its own unless it is told otherwise.
            let by_default = kind == "LmcpObjectNetworkTcpBridge";
            let own = element.attribute("ConsiderSelfGenerated").map_or(by_default, is_true);
            import.out.key("self_generated", own);
            let export = subscriptions(element, "SubscribeToMessage", import);
            import.out.key("export", export);
            true
        }
    }
}

type Keys = Vec<(&'static str, String)>;

fn tcp(element: &Element, import: &mut Import<'_>) -> Result<Keys, String> {
    import.unread(element, &[&COMMON[..], &["TcpAddress", "Server"]].concat());
    let key = if element.attribute("Server").is_some_and(is_true) { "listen" } else { "connect" };
    Ok(vec![("kind", quoted("uxas-tcp")), (key, address(element, "TcpAddress")?)])
}

fn serial(element: &Element, import: &mut Import<'_>) -> Result<Keys, String> {
    import.unread(element, &[&COMMON[..], &["TtyDevice", "BaudRate"]].concat());
    let device = element.attribute("TtyDevice").ok_or("it has no `TtyDevice`")?;
    let baud = element.attribute("BaudRate").unwrap_or("57600");
    let baud = baud.parse::<u32>().map_err(|_| format!("`{baud}` is no speed"))?;
    Ok(vec![("kind", quoted("uxas-serial")), ("device", quoted(device)), ("baud", baud.to_string())])
}

fn sockets(
    element: &Element,
    keys: [(&'static str, &'static str); 2],
    import: &mut Import<'_>,
) -> Result<Keys, String> {
    import.unread(element, &[&COMMON[..], &keys.map(|(attribute, _)| attribute)].concat());
    let mut out = vec![("kind", quoted("uxas-zmq"))];
    for (attribute, key) in keys {
        out.push((key, address(element, attribute)?));
    }
    Ok(out)
}

/// `tcp://*:5560` as `"0.0.0.0:5560"`.
fn address(element: &Element, attribute: &str) -> Result<String, String> {
    let text = element.attribute(attribute).ok_or_else(|| format!("it has no `{attribute}`"))?;
    let place = text.strip_prefix("tcp://").ok_or_else(|| format!("`{text}` is no TCP address"))?;
    let place = match place.rsplit_once(':') {
        Some(("*", port)) => format!("0.0.0.0:{port}"),
        Some(("localhost", port)) => format!("127.0.0.1:{port}"),
        _ => place.to_owned(),
    };
    match place.parse::<SocketAddr>() {
        Ok(address) => Ok(quoted(&address.to_string())),
        Err(_) => Err(format!("`{text}` is no address with a port; give an IP address in place of a name")),
    }
}

/// The message types of the children of one name, as a list of prefixes.
fn subscriptions(element: &Element, child: &str, import: &mut Import<'_>) -> String {
    let mut prefixes = BTreeSet::new();
    for found in &element.children {
        match found.attribute("MessageType") {
            Some(prefix) if found.name == child => match aldis_envelope::Prefix::new(prefix) {
                Ok(_) => drop(prefixes.insert(prefix)),
                Err(why) => import.remark(found.line, format!("a subscription is left out: {why}")),
            },
            _ => import
                .remark(found.line, format!("`{}` of {} is not understood", found.name, element.title())),
        }
    }
    // The usual way to write "everything" for a matcher that refuses the empty text.
    let letters: BTreeSet<String> = ('a'..='z').chain('A'..='Z').map(String::from).collect();
    if letters.iter().all(|letter| prefixes.contains(letter.as_str())) {
        return list([""]);
    }
    list(prefixes)
}

/// As OpenUxAS reads it.
pub(super) fn is_true(text: &str) -> bool {
    text.eq_ignore_ascii_case("true") || text == "1"
}
