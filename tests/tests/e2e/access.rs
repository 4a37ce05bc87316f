//! The access control that `aldis acl` prints, in a router that is an Aldis node: who may say what.

use crate::zenoh_client::{Ear, open};
use aldis_tests::{Directory, Node, Peer, aldis, delimited, frame, free_port, until};
use std::collections::BTreeSet;
use std::path::PathBuf;
use zenoh::query::{ConsolidationMode, QueryTarget};
use zenoh::{Session, Wait};

const USERS: &str = "shore:secret-1\nvehicle-400:secret-400\n9000:secret-9000\n";
const VEHICLE: (&str, &str) = ("vehicle-400", "secret-400");
const OPERATOR: (&str, &str) = ("9000", "secret-9000");

/// A router with access control, and what joins it. The nodes are configured, and started where a test wants them.
struct Fleet {
    directory: Directory,
    bus: u16,
    shore_uxas: u16,
    vehicle_uxas: u16,
    _router: Node,
}

impl Fleet {
    fn start() -> Self {
        let directory = Directory::new();
        let (bus, shore_uxas, vehicle_uxas) = (free_port(), free_port(), free_port());
        directory.write("users.txt", USERS);
        let listen = format!("mode = \"router\"\nlisten = [\"tcp/127.0.0.1:{bus}\"]");
        let guard = "dictionary_file = \"users.txt\"\nzenoh_config = \"access.json5\"";
        let router = config(&directory, "router", "2", &format!("{listen}\n{guard}"), None);
        let mut configs = vec![router.clone()];
        for (name, entities, port) in [("shore", "1", shore_uxas), ("vehicle-400", "400, 100", vehicle_uxas)]
        {
            let (_, password) = USERS
                .lines()
                .find_map(|line| line.split_once(':').filter(|(user, _)| *user == name))
                .unwrap();
            directory.write(&format!("{name}.password"), &format!("{password}\n"));
            let join = format!("mode = \"client\"\nconnect = [\"tcp/127.0.0.1:{bus}\"]");
            let user = format!("user = \"{name}\"\npassword_file = \"{name}.password\"");
            configs.push(config(&directory, name, entities, &format!("{join}\n{user}"), Some(port)));
        }
        let printed = aldis(["acl".into()].into_iter().chain(configs));
        assert_eq!(printed.code, Some(0), "{printed:?}");
        directory.write("access.json5", &printed.stdout);
        let router = Node::start(&router);
        until("the router listens", || Peer::connect(bus).ok());
        Self { directory, bus, shore_uxas, vehicle_uxas, _router: router }
    }

    /// Starts a node and connects a peer to its bridge.
    fn node(&self, name: &str, port: u16) -> (Node, Peer) {
        let node = Node::start(&self.directory.path().join(format!("{name}.toml")));
        let peer = until("the bridge listens", || Peer::connect(port).ok());
        node.log().wait_for(&format!("{} is there", peer.name()));
        (node, peer)
    }

    fn open(&self, user: (&str, &str)) -> Session {
        until("the session opens", || open(self.bus, Some(user)))
    }
}

fn config(directory: &Directory, name: &str, entities: &str, bus: &str, bridge: Option<u16>) -> PathBuf {
    let head = format!("name = \"{name}\"\nentities = [{entities}]\noperators = [1, 9000]\n[bus]\n{bus}\n");
    let bridge = bridge.map(|port| {
        format!(
            "[[bridge]]\nkind = \"uxas-tcp\"\nname = \"uxas\"\nservice = 20\nlisten = \"127.0.0.1:{port}\"\n"
        )
    });
    directory.write(&format!("{name}.toml"), &(head + &bridge.unwrap_or_default()))
}

/// An operator that hears all that a client says, once it does.
fn listening(operator: &Session, vehicle: &Session, expression: &str, own: &str) -> Ear {
    let ear = Ear::on_samples(operator, expression);
    until("the operator hears the vehicle", || {
        vehicle.put(own.to_owned(), "ready?").wait().unwrap();
        ear.hears_something().then_some(())
    });
    ear
}

#[test]
fn two_nodes_talk_through_the_router() {
    let fleet = Fleet::start();
    let (_shore, mut at_shore) = fleet.node("shore", fleet.shore_uxas);
    let (_vehicle, mut on_board) = fleet.node("vehicle-400", fleet.vehicle_uxas);
    passes(&mut on_board, &mut at_shore, 100);
    passes(&mut at_shore, &mut on_board, 1);
}

fn passes(from: &mut Peer, to: &mut Peer, entity: u64) {
    let message = delimited("a.B", entity, 61, b"through the router");
    until("messages pass the router", || {
        from.send(&frame(&message));
        to.is_waiting().then_some(())
    });
    assert_eq!(to.receive().0, message);
}

#[test]
fn the_command_line_joins_as_an_operator_with_its_password_and_not_without() {
    let fleet = Fleet::start();
    let (_vehicle, _) = fleet.node("vehicle-400", fleet.vehicle_uxas);
    fleet.directory.write("operator.password", OPERATOR.1);
    let join = format!("mode = \"client\"\nconnect = [\"tcp/127.0.0.1:{}\"]", fleet.bus);
    let user = "user = \"9000\"\npassword_file = \"operator.password\"";
    let operator = config(&fleet.directory, "operator", "9000", &format!("{join}\n{user}"), None);
    let call = ["call", "eid400sid1", "--ping", "--config"].map(PathBuf::from);
    until("the vehicle answers", || (aldis(call.iter().chain([&operator])).code == Some(0)).then_some(()));
    let done = aldis(["call", "eid400sid1", "--ping", "--connect", &format!("tcp/127.0.0.1:{}", fleet.bus)]);
    assert_eq!(done.code, Some(5), "{done:?}");
    assert!(open(fleet.bus, Some(("vehicle-400", "wrong"))).is_none(), "a wrong password opens nothing");
    assert!(open(fleet.bus, None).is_none(), "no user opens nothing");
}

#[test]
fn a_client_puts_and_deletes_as_its_own_entities_alone() {
    let fleet = Fleet::start();
    let (vehicle, operator) = (fleet.open(VEHICLE), fleet.open(OPERATOR));
    for space in ["", "@writer/", "@state/", "@ack/", "@link/"] {
        let key = |entity: u64, what: &str| format!("aldis/fleet/{space}{entity}/61/-/{what}");
        let ear = listening(&operator, &vehicle, &format!("aldis/fleet/{space}**"), &key(400, "ready"));
        let send = |entity: u64, what: &str| {
            vehicle.put(key(entity, what), "x").wait().unwrap();
            vehicle.delete(key(entity, what)).wait().unwrap();
            let publisher = vehicle.declare_publisher(key(entity, what)).wait().unwrap();
            publisher.put("x").wait().unwrap();
            publisher.delete().wait().unwrap();
        };
        for (entity, what) in
            [(500, "a"), (1, "a"), (4000, "a"), (400, "eid500"), (100, "own"), (500, "b"), (400, "own")]
        {
            send(entity, what);
        }
        vehicle.put(key(400, "end"), "x").wait().unwrap();
        let mut heard = ear.upto(&format!("PUT {}", key(400, "end")));
        heard.retain(|said| !said.ends_with("/ready") && !said.ends_with("/end"));
        // The router is a node itself and says now and then what it reads.
        heard.retain(|said| !said.contains("/2/1/"));
        let expected = [key(400, "eid500"), key(100, "own"), key(400, "own")];
        let expected = expected
            .iter()
            .flat_map(|key| ["PUT", "DELETE", "PUT", "DELETE"].map(|kind| format!("{kind} {key}")));
        assert_eq!(heard, expected.collect::<Vec<_>>(), "in space `{space}`");
    }
}

#[test]
fn a_client_shows_tokens_of_its_own_entities_alone() {
    let fleet = Fleet::start();
    let (vehicle, operator) = (fleet.open(VEHICLE), fleet.open(OPERATOR));
    let ear = Ear::on_tokens(&operator, "aldis/fleet/@alive/*/*");
    let key = |entity: u64, service: u64| format!("aldis/fleet/@alive/{entity}/{service}");
    let show = |key: &String| vehicle.liveliness().declare_token(key.clone()).wait().unwrap();
    let keys = [key(500, 1), key(400, 1), key(500, 2), key(100, 1), key(1, 3), key(400, 2)];
    let tokens = keys.each_ref().map(show);
    let shown = [key(400, 1), key(100, 1), key(400, 2)];
    // The router's node shows its own, when it does.
    let own = |said: &String| !said.contains("@alive/2/");
    let expected = shown.each_ref().map(|key| format!("PUT {key}"));
    let mut heard = Vec::new();
    while !expected.iter().all(|said| heard.contains(said)) {
        heard.extend(Some(ear.next()).filter(own));
    }
    assert_eq!(heard.len(), expected.len(), "{heard:?}");
    let asked = operator.liveliness().get("aldis/fleet/@alive/*/*").wait().unwrap();
    let alive = asked.into_iter().map(|reply| reply.result().unwrap().key_expr().to_string()).filter(own);
    assert_eq!(alive.collect::<BTreeSet<_>>(), BTreeSet::from(shown.clone()));
    // Withdrawn one after the other, because Zenoh does not say in which order many go.
    for (token, key) in tokens.into_iter().zip(keys) {
        token.undeclare().wait().unwrap();
        if shown.contains(&key) {
            let gone = format!("DELETE {key}");
            let mut heard = ear.upto(&gone);
            heard.retain(own);
            assert_eq!(heard, [gone]);
        }
    }
}

#[test]
fn a_client_answers_as_its_own_entities_alone() {
    let fleet = Fleet::start();
    let (vehicle, operator) = (fleet.open(VEHICLE), fleet.open(OPERATOR));
    for space in ["", "@state/"] {
        let key = |entity: u64| format!("aldis/fleet/{space}{entity}/61/-/a");
        let every = format!("aldis/fleet/{space}*/61/-/a");
        let _queryables = [key(500), key(400), every.clone()].map(|expression| {
            let answers: Vec<String> = [500, 400, 1, 100].map(key).into();
            let answer = move |query: zenoh::query::Query| {
                for key in &answers {
                    // Zenoh itself refuses answers outside of what was asked for.
                    let _ = query.reply(key.clone(), "x").wait();
                }
            };
            vehicle.declare_queryable(expression).callback(answer).wait().unwrap()
        });
        let asked = |expression: &str| {
            let get = operator.get(expression.to_owned()).target(QueryTarget::All);
            let replies = get.consolidation(ConsolidationMode::None).wait().unwrap();
            let keys =
                replies.into_iter().filter_map(|reply| Some(reply.result().ok()?.key_expr().to_string()));
            keys.collect::<BTreeSet<_>>().into_iter().collect::<Vec<_>>()
        };
        until("the vehicle's own answers come", || (!asked(&key(400)).is_empty()).then_some(()));
        assert_eq!(asked(&key(400)), [key(400)]);
        assert_eq!(
            asked(&every),
            [key(100), key(400)],
            "what the vehicle may answer, of all that it answers"
        );
        assert_eq!(asked(&key(500)), [] as [String; 0]);
    }
}
