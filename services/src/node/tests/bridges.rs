//! Several bridges of one node, and what they keep from one another.

use super::*;

/// A node of entity 1 with three bridges, of which the first two lead to one peer; each has a peer with credit.
fn three() -> (World, NodeHandle) {
    let mut config = config(&[1], Vec::new());
    for (place, peer) in [Some("uxas"), Some("uxas"), None].into_iter().enumerate() {
        let spec = bridge(1);
        let source = source(1, 20 + place as u64);
        config.bridges.push(BridgeSpec {
            source,
            name: format!("bridge-{place}"),
            peer: peer.map(str::to_owned),
            ..spec
        });
    }
    let mut world = World::new(1, (MILLISECOND, MILLISECOND));
    let node = world.add(config).unwrap();
    for place in 0..3 {
        world.give(node, Event::Peer(BridgeId(place), PeerId(10), PeerEvent::Up("taker".into(), 1_000)));
        world.give(node, Event::Peer(BridgeId(place), PeerId(20), PeerEvent::Gives("giver".into())));
    }
    world.run_for(MILLISECOND);
    world.sent(node);
    (world, node)
}

fn receivers(world: &mut World, node: NodeHandle) -> Vec<usize> {
    world
        .sent(node)
        .into_iter()
        .map(|(bridge, peer, ..)| {
            assert_eq!(peer, PeerId(10), "who gives alone gets nothing");
            bridge.0
        })
        .collect()
}

#[test]
fn what_came_from_a_named_peer_never_returns_to_it_by_any_bridge() {
    let (mut world, node) = three();
    let give = |world: &mut World, bridge| {
        let message = Bytes::from_static(b"a.B$lmcp|a.B||1|61$x");
        world.give(node, Event::Peer(BridgeId(bridge), PeerId(20), PeerEvent::Message(message)));
        world.run_for(MILLISECOND);
    };
    give(&mut world, 0);
    assert_eq!(receivers(&mut world, node), [2]);
    give(&mut world, 1);
    assert_eq!(receivers(&mut world, node), [2]);
    give(&mut world, 2);
    assert_eq!(
        receivers(&mut world, node),
        [0, 1, 2],
        "a bridge without a named peer gives to its other peers"
    );
}

#[test]
fn what_a_peer_did_not_want_is_not_counted_as_exported() {
    let (mut world, node) = three();
    let message = Bytes::from_static(b"a.B$lmcp|a.B||1|61$x");
    let parts: Vec<_> =
        ["a.B", "lmcp", "a.B", "", "1", "61", "x"].map(|part| Bytes::from_static(part.as_bytes())).to_vec();
    world.give(node, Event::Peer(BridgeId(2), PeerId(20), PeerEvent::Message(message)));
    world.give(node, Event::Peer(BridgeId(2), PeerId(20), PeerEvent::Parts(parts)));
    world.give(node, Event::Peer(BridgeId(0), PeerId(10), PeerEvent::Unwanted(1)));
    let bad = crate::event::BadInput::SeveralFrames(7);
    world.give(node, Event::Peer(BridgeId(2), PeerId(20), PeerEvent::Bad(bad)));
    let counters: BTreeMap<_, _> = world.node(node).all_counters().into_iter().collect();
    assert_eq!((counters["bridge-0.exported"], counters["bridge-0.not_subscribed"]), (1, 1));
    assert_eq!((counters["bridge-1.exported"], counters["bridge-2.imported"]), (2, 2));
    assert_eq!(counters["bridge-2.framing_wrong"], 1);
}
