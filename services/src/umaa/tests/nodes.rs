//! The same services in whole nodes of the simulator: an arbiter and its provider on a vehicle, two consumers ashore.

use super::asking::{Asking, Handle, Part, Seen};
use super::bus::{guids, source};
use super::sea::{
    AUTOPILOT, Controlling, arbiter, autopilot, captain, control_told, guid, settings, steersman,
};
use super::vector::{provider, steer};
use crate::event::Event;
use crate::node::NodeConfig;
use crate::registry;
use crate::service::{Outbox, Service, ServiceSpec};
use crate::sim::{NodeHandle, World};
use crate::umaa::allocation::{Arbiter, Arbitration, Guard, GuardSettings, Plan};
use crate::umaa::command::{ConsumerSettings, ProviderSettings};
use aldis_envelope::{BootId, EntityId, Fleet, Now, Prefix, Source};
use std::sync::Arc;
use std::time::Duration;

fn spec(at: Source, make: impl Fn() -> Box<dyn Service> + Send + Sync + 'static) -> ServiceSpec {
    ServiceSpec { source: at, name: "test".into(), factory: Arc::new(make) }
}

fn node(entity: EntityId, services: Vec<ServiceSpec>) -> NodeConfig {
    let mut all = registry::built_in(entity, &guids(), Duration::from_secs(5));
    all.extend(services);
    NodeConfig {
        fleet: Fleet::new("blue").unwrap(),
        entities: vec![entity],
        boot: BootId(1),
        topics: Vec::new(),
        reliable: true,
        operators: Vec::new(),
        allow: Vec::new(),
        import: vec![Prefix::all()],
        export: vec![Prefix::all()],
        services: all,
        bridges: Vec::new(),
        links: Vec::new(),
    }
}

fn shore(world: &mut World, number: u64) -> (NodeHandle, Handle<Controlling>) {
    let (at, handle) = (captain(number), Handle::<Controlling>::default());
    let given = handle.clone();
    let spec = spec(at, move || {
        let part = Controlling::new(at, guids(), ConsumerSettings::default());
        Box::new(Asking { part, handle: given.clone() })
    });
    (world.add(node(at.entity, vec![spec])).unwrap(), handle)
}

/// Has a consumer ashore do something, and lets three seconds pass.
fn order<P: Part>(
    world: &mut World,
    (of, at): (NodeHandle, Source),
    handle: &Handle<P>,
    wish: impl FnOnce(&mut P, Now, &mut Outbox) + Send + 'static,
) {
    handle.wish(wish);
    // Wakes the service.
    world.give(of, Event::Job(at, 0, Ok(Box::new(()))));
    world.run_for(Duration::from_secs(3));
}

fn plan(course: f64, seconds: u32) -> Plan<super::vector::VectorCommand> {
    Plan {
        arbiter: guid(arbiter()),
        resource: AUTOPILOT,
        duration: Some(Duration::from_secs(4)),
        provider: guid(steersman()),
        command: steer(course, seconds, ""),
    }
}

#[test]
fn consumers_contend_across_nodes() {
    let mut world = World::new(3, (Duration::from_millis(1), Duration::from_millis(5)));
    let (one_node, one) = shore(&mut world, 1);
    let (two_node, two) = shore(&mut world, 2);
    let asked = Seen::default();
    let given = asked.clone();
    let arbitration = Arbitration::new(settings(autopilot())).unwrap();
    let on_board = vec![
        spec(arbiter(), move || Box::new(Arbiter::new(arbiter(), &guids(), arbitration.clone()))),
        spec(steersman(), move || {
            let guard = Guard::new(steersman(), guids(), GuardSettings::new(AUTOPILOT));
            provider(steersman(), &guids(), ProviderSettings::default(), guard, given.clone())
        }),
    ];
    let vehicle = world.add(node(source(400, 1).entity, on_board)).unwrap();
    world.run_for(Duration::from_secs(1));
    order(&mut world, (one_node, captain(1)), &one, |consumer, now, out| {
        consumer.start(now, plan(10.0, 60), out).unwrap();
    });
    assert_eq!(control_told(one.take()), "allocated ISSUED COMMANDED EXECUTING status");
    order(&mut world, (two_node, captain(2)), &two, |consumer, now, out| {
        consumer.start(now, plan(20.0, 2), out).unwrap();
    });
    let lost = control_told(one.take());
    assert!(lost.contains("lost:FAILED/INTERRUPTED") && lost.ends_with("FAILED/INTERRUPTED"), "{lost}");
    world.run_for(Duration::from_secs(5));
    assert_eq!(control_told(two.take()), "allocated ISSUED COMMANDED EXECUTING status Completed");
    assert_eq!(*asked.lock().unwrap(), ["start 10", "stop 10 Broken", "start 20"]);
    for of in [vehicle, one_node] {
        let counters = world.node(of).counters();
        assert_eq!((counters.lost, counters.crashes, counters.refused_headers), (0, 0, 0));
    }
}
