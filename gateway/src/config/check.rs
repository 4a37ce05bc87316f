//! What no single value shows: values that contradict each other.

use super::bus::{Bus, Mode, Scouting};
use super::error::Fault;
use super::{Config, Locator};
use std::collections::BTreeMap;

/// All contradictions of a configuration, in the order of the file's tables.
pub(super) fn check(config: &Config) -> Vec<Fault> {
    let mut faults = Vec::new();
    joins(&config.bus, &mut faults);
    users(&config.bus, &mut faults);
    certificates(&config.bus, &mut faults);
    bridges(config, &mut faults);
    services(config, &mut faults);
    links(config, &mut faults);
    health(config, &mut faults);
    faults.extend(super::topic::check(&config.topics, config.journal.as_ref()));
    let journal = config.journal.as_ref().map_or(Ok(()), super::Journal::check);
    faults.extend(journal.err().map(|fault| fault.below("journal")));
    faults.extend(config.checked_arbitration().err());
    faults
}

fn joins(bus: &Bus, faults: &mut Vec<Fault>) {
    if bus.mode != Mode::Client {
        return;
    }
    if bus.connect.is_empty() && bus.scouting != Scouting::Multicast {
        faults.push(Fault::new(
            "bus.mode",
            "a client with nothing to connect to",
            "add connect = [\"tcp/127.0.0.1:7447\"], or choose mode = \"peer\"",
        ));
    }
    if !bus.listen.is_empty() {
        faults.push(Fault::new(
            "bus.listen",
            "a client does not listen",
            "leave `listen` out, or choose mode = \"peer\" or \"router\"",
        ));
    }
}

fn users(bus: &Bus, faults: &mut Vec<Fault>) {
    match (&bus.user, &bus.password_file) {
        (Some(user), None) => faults.push(Fault::new(
            "bus.user",
            format!("user `{user}` has no password"),
            "add password_file = \"…\", a file that holds the password alone",
        )),
        (None, Some(_)) => faults.push(Fault::new(
            "bus.password_file",
            "a password without a user",
            "add user = \"…\", or leave `password_file` out",
        )),
        _ => {}
    }
    if bus.dictionary_file.is_some() && bus.listen.is_empty() {
        faults.push(Fault::new(
            "bus.dictionary_file",
            "users are listed, but nobody can join: `listen` is empty",
            "add listen = [\"tcp/0.0.0.0:7447\"], or leave `dictionary_file` out",
        ));
    }
}

fn certificates(bus: &Bus, faults: &mut Vec<Fault>) {
    let tls = &bus.tls;
    let listens = bus.listen.iter().any(Locator::is_tls);
    let connects = bus.connect.iter().any(Locator::is_tls);
    let needed = [
        (listens, "listen_certificate", tls.listen_certificate.is_some()),
        (listens, "listen_private_key", tls.listen_private_key.is_some()),
        (listens && tls.enable_mtls, "root_ca_certificate", tls.root_ca_certificate.is_some()),
        (connects && tls.enable_mtls, "connect_certificate", tls.connect_certificate.is_some()),
        (connects && tls.enable_mtls, "connect_private_key", tls.connect_private_key.is_some()),
    ];
    for (_, key, _) in needed.iter().filter(|(needed, _, given)| *needed && !given) {
        let side = if key.starts_with("connect") { "connect" } else { "listen" };
        faults.push(Fault::new(
            format!("bus.{side}"),
            format!("a `tls/` locator without `{key}`"),
            format!("add {key} = \"….pem\" to [bus.tls]"),
        ));
    }
}

fn bridges(config: &Config, faults: &mut Vec<Fault>) {
    let mut names = BTreeMap::new();
    let mut services = BTreeMap::new();
    let mut listeners = BTreeMap::new();
    for (index, bridge) in config.bridges.iter().enumerate() {
        let path = |key: &str| format!("bridge.{index}.{key}");
        let common = bridge.common();
        if let Some(first) = names.insert(&common.name, index) {
            let message = format!("two bridges have the name `{}`", common.name);
            faults.push(Fault::new(
                path("name"),
                message,
                format!("rename one; bridge {} has it too", first + 1),
            ));
        }
        if let Some(first) = services.insert(common.service, &common.name) {
            let message = format!("two bridges have service {}", common.service);
            faults.push(Fault::new(path("service"), message, format!("give another; `{first}` has it too")));
        }
        let listens = bridge.listens().into_iter().filter(|(_, address)| address.port() != 0);
        for (key, address) in listens {
            if let Some(first) = listeners.insert(address, &common.name) {
                let message = format!("two bridges listen on {address}");
                let help = format!("take another port; `{first}` has this one");
                faults.push(Fault::new(path(key), message, help));
            }
        }
    }
}

fn services(config: &Config, faults: &mut Vec<Fault>) {
    let mut known = BTreeMap::new();
    for (index, service) in config.services.iter().enumerate() {
        let entity = service.entity().unwrap_or(config.entities.own());
        if !config.entities.contains(entity) {
            faults.push(Fault::new(
                format!("service.{index}.entity"),
                format!("this node does not speak for entity {entity}"),
                format!("add {entity} to `entities`, or leave `entity` out for the node's own"),
            ));
        }
        let id = service.service();
        if let Some(first) = known.insert((entity, id), index) {
            faults.push(Fault::new(
                format!("service.{index}.service"),
                format!("entity {entity} has service {id} twice"),
                format!("give another id; service table {} has it too", first + 1),
            ));
        }
    }
}

fn links(config: &Config, faults: &mut Vec<Fault>) {
    let mut known: Vec<(&str, aldis_envelope::EntityId)> = Vec::new();
    for (index, link) in config.links.iter().enumerate() {
        faults.extend(link.check(&config.entities).err().map(|fault| fault.below(&format!("link.{index}"))));
        let (name, peer) = (link.name.as_str(), link.peer);
        if known.iter().any(|(other, _)| *other == name) {
            let message = format!("two links have the name `{name}`");
            faults.push(Fault::new(format!("link.{index}.name"), message, "rename one"));
        }
        if known.iter().any(|(_, other)| *other == peer) {
            let message = format!("two links go to entity {peer}");
            let help = "keep one, and list both carriers in it: it changes from one to the other by itself";
            faults.push(Fault::new(format!("link.{index}.peer"), message, help));
        }
        known.push((name, peer));
    }
}

fn health(config: &Config, faults: &mut Vec<Fault>) {
    if let Err(fault) = config.health.check() {
        faults.push(fault.below("health"));
    }
}
