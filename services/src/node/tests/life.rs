//! Services that come and go, and the manager that has them do so.

use super::*;
use crate::manager::Maker;
use aldis_envelope::lmcp;
use aldis_envelope::lmcp::uxnative::{CreateNewService, KillService};

/// A node of entity 1 with a manager that makes probes, and a bridge whose one peer tells it what to do.
fn managed() -> (World, NodeHandle, Seen) {
    let (made, seen) = probe(source(1, 100), &["for.probes"], idle());
    let factory = made.factory.clone();
    let maker = Maker::new(move |source, create| match create.xml_configuration.as_str() {
        "probe" => Ok(ServiceSpec { source, name: "probe".into(), factory: factory.clone() }),
        other => Err(format!("there is no `{other}`")),
    });
    let guids = Guids::new(&Fleet::new("blue").unwrap(), GuidForm::Readable);
    let manager = registry::service(source(1, 100), "manager", registry::Kind::Manager(maker), &guids);
    let mut config = config(&[1], vec![manager]);
    config.bridges.push(bridge(1));
    let mut world = World::new(1, (MILLISECOND, MILLISECOND));
    let node = world.add(config).unwrap();
    world.give(node, Event::Peer(BridgeId(0), PeerId(1), PeerEvent::Up("peer".into(), 1 << 30)));
    world.run_for(Duration::from_millis(100));
    (world, node, seen)
}

fn ask(world: &mut World, node: NodeHandle, from: u64, object: &dyn lmcp::Object) {
    let name = object.type_info().full_name;
    let head = format!("{name}$lmcp|{name}||{from}|61$");
    let message = [head.as_bytes(), &lmcp::encode(object).unwrap()].concat();
    world.give(node, Event::Peer(BridgeId(0), PeerId(2), PeerEvent::Message(message.into())));
    world.run_for(MILLISECOND);
}

fn create(id: i64, what: &str) -> CreateNewService {
    CreateNewService { service_id: id, xml_configuration: what.into(), ..Default::default() }
}

fn ids(world: &World, node: NodeHandle) -> Vec<String> {
    let status = world.node(node).status(Now { monotonic: Monotonic::START, wall: aldis_envelope::Wall(0) });
    status.services.iter().map(|s| format!("{} {}", s.source.service, s.state)).collect()
}

/// What went out to the peer, by descriptor.
fn told(world: &mut World, node: NodeHandle) -> Vec<String> {
    world.sent(node).into_iter().map(|(_, _, label, _)| label.descriptor().to_owned()).collect()
}

#[test]
fn a_manager_tells_the_start_and_has_services_come_and_go() {
    let (mut world, node, seen) = managed();
    assert_eq!(told(&mut world, node), ["uxas.messages.uxnative.StartupComplete"]);
    let before = ids(&world, node);
    ask(&mut world, node, 1, &create(200, "probe"));
    assert!(ids(&world, node).contains(&"200 running".to_owned()));
    let message = Bytes::from_static(b"for.probes$lmcp|for.probes||1|61$x");
    world.give(node, Event::Peer(BridgeId(0), PeerId(2), PeerEvent::Message(message.clone())));
    assert_eq!(seen.lock().unwrap().last().unwrap(), "eid1sid61 for.probes b\"x\"");
    ask(&mut world, node, 1, &KillService { service_id: 200 });
    assert_eq!(seen.lock().unwrap().last().unwrap(), "shutdown");
    assert_eq!(ids(&world, node), before);
    let count = seen.lock().unwrap().len();
    world.give(node, Event::Peer(BridgeId(0), PeerId(2), PeerEvent::Message(message)));
    assert_eq!(seen.lock().unwrap().len(), count, "what is gone hears nothing");
}

#[test]
fn what_cannot_be_is_told_and_changes_nothing() {
    let (mut world, node, _) = managed();
    ask(&mut world, node, 1, &create(200, "probe"));
    let before = ids(&world, node);
    told(&mut world, node);
    for wrong in [create(200, "probe"), create(3, "probe"), create(0, "probe"), create(201, "other")] {
        ask(&mut world, node, 1, &wrong);
    }
    for wrong in [-1, 0, 1, 2, 20, 100, 999, i64::MAX] {
        ask(&mut world, node, 1, &KillService { service_id: wrong });
    }
    assert_eq!(ids(&world, node), before);
    let errors = told(&mut world, node).iter().filter(|name| *name == "afrl.cmasi.ServiceStatus").count();
    assert_eq!(errors, 5, "two services that cannot be made, three ids that are none");
}

#[test]
fn a_foreign_entity_stops_nothing() {
    let (fleet_of_two, services) = (&[1, 2][..], Vec::new());
    let (mut world, node, _) = managed();
    let mut other = config(&fleet_of_two[1..], services);
    other.bridges.push(bridge(2));
    let far = world.add(other).unwrap();
    world.run_for(Duration::from_secs(1));
    ask(&mut world, node, 1, &create(200, "probe"));
    let before = ids(&world, node);
    let kill = lmcp::encode(&KillService { service_id: 200 }).unwrap();
    let head = b"uxas.messages.uxnative.KillService$lmcp|uxas.messages.uxnative.KillService||2|61$";
    let message = [&head[..], &kill].concat();
    world.give(far, Event::Peer(BridgeId(0), PeerId(1), PeerEvent::Message(message.into())));
    world.run_for(Duration::from_secs(1));
    assert_eq!(ids(&world, node), before);
    ask(&mut world, node, 2, &KillService { service_id: 200 });
    assert_eq!(ids(&world, node), before, "nor does who says so on the node's own bridge");
    assert!(told(&mut world, node).contains(&"uxas.messages.uxnative.EntityJoin".to_owned()));
}

#[test]
fn a_service_that_comes_and_goes_a_thousand_times_leaves_nothing() {
    let (mut world, node, _) = managed();
    let once = |world: &mut World, id: i64| {
        ask(world, node, 1, &create(id, "probe"));
        ask(world, node, 1, &KillService { service_id: id });
    };
    let kept = |world: &World| {
        let node = world.node(node);
        let expressions = node.subscriptions.len();
        (node.services.len(), expressions, node.awake.len(), node.work.len(), node.publishers.len())
    };
    (0..10).for_each(|_| once(&mut world, 200));
    let before = kept(&world);
    (0..990).for_each(|round| once(&mut world, 200 + round % 7));
    assert_eq!(kept(&world), before);
    assert_eq!(
        ids(&world, node).len(),
        5,
        "health, log, node, the manager and the bridge: {:?}",
        ids(&world, node)
    );
}
