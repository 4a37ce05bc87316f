//! A shore station and a vehicle, as `configs/` has them, on ports of their own.

use crate::{Directory, Done, Node, Peer, aldis, free_port, root, until};
use serde_json::Value;
use std::path::PathBuf;

/// Where the nodes of a test are: their files and their ports. Nothing runs until it is started.
#[derive(Debug)]
pub struct Site {
    directory: Directory,
    /// The port of shore on the bus.
    pub bus: u16,
    /// The port of shore's UxAS bridge.
    pub shore_uxas: u16,
    /// The port of the vehicle's UxAS bridge.
    pub vehicle_uxas: u16,
}

impl Site {
    /// A site with free ports.
    #[allow(clippy::new_without_default, reason = "free ports are no default value")]
    pub fn new() -> Self {
        let (bus, shore_uxas, vehicle_uxas) = (free_port(), free_port(), free_port());
        Self { directory: Directory::new(), bus, shore_uxas, vehicle_uxas }
    }

    /// The directory of its files.
    pub fn directory(&self) -> &Directory {
        &self.directory
    }

    /// `configs/shore.toml` with this site's ports, and further tables at its end.
    pub fn shore_config(&self, more: &str) -> PathBuf {
        let ports = [("127.0.0.1:7447", self.bus), ("127.0.0.1:5556", self.shore_uxas)];
        self.config("shore.toml", &ports, more)
    }

    /// `configs/vehicle-400.toml` with this site's ports, and further tables at its end.
    pub fn vehicle_config(&self, more: &str) -> PathBuf {
        let ports = [("127.0.0.1:7447", self.bus), ("127.0.0.1:5555", self.vehicle_uxas)];
        self.config("vehicle-400.toml", &ports, more)
    }

    fn config(&self, name: &str, ports: &[(&str, u16)], more: &str) -> PathBuf {
        let path = root().join("configs").join(name);
        let mut text =
            std::fs::read_to_string(&path).unwrap_or_else(|why| panic!("{}: {why}", path.display()));
        for (from, port) in ports {
            assert!(text.contains(from), "configs/{name} does not speak of {from}");
            text = text.replace(from, &format!("127.0.0.1:{port}"));
        }
        self.directory.write(name, &format!("{text}\n{more}"))
    }

    /// Starts shore.
    pub fn start_shore(&self) -> Node {
        Node::start(&self.shore_config(""))
    }

    /// Starts the vehicle.
    pub fn start_vehicle(&self) -> Node {
        Node::start(&self.vehicle_config(""))
    }

    /// Starts both and waits until they hear each other.
    pub fn start(&self) -> (Node, Node) {
        let nodes = (self.start_shore(), self.start_vehicle());
        self.wait_for(1);
        self.wait_for(400);
        nodes
    }

    /// Connects a peer to a bridge, and waits until the node knows it.
    pub fn peer(&self, node: &Node, port: u16) -> Peer {
        let peer = until("a bridge listens", || Peer::connect(port).ok());
        node.log().wait_for(&format!("{} is there", peer.name()));
        peer
    }

    /// Runs a command of the program that joins this site's bus.
    pub fn aldis(&self, args: &[&str]) -> Done {
        let connect = ["--connect".to_owned(), format!("tcp/127.0.0.1:{}", self.bus)];
        aldis(args.iter().map(|&arg| arg.to_owned()).chain(connect))
    }

    /// Waits until the node of an entity answers a ping over the bus.
    pub fn wait_for(&self, entity: u64) {
        let address = format!("eid{entity}sid1");
        until(&format!("{address} answers a ping"), || {
            (self.aldis(&["call", &address, "--ping"]).code == Some(0)).then_some(())
        });
    }

    /// What the node of an entity says of itself.
    ///
    /// # Panics
    /// When it does not answer.
    pub fn status(&self, entity: u64) -> Value {
        let address = format!("eid{entity}sid1");
        let done = self.aldis(&["call", &address, "--request", "aldis.NodeQuery", "--json"]);
        assert_eq!(done.code, Some(0), "{done:?}");
        done.json()[0]["content"].clone()
    }

    /// A counter of the node of an entity.
    ///
    /// # Panics
    /// When it has none of this name.
    pub fn counter(&self, entity: u64, name: &str) -> u64 {
        let status = self.status(entity);
        status["counters"][name].as_u64().unwrap_or_else(|| panic!("no counter `{name}` in {status}"))
    }

    /// Waits until a counter of a node has this value.
    ///
    /// # Panics
    /// When it goes beyond.
    pub fn wait_for_counter(&self, entity: u64, name: &str, value: u64) {
        until(&format!("{name} of {entity} becomes {value}"), || {
            let counted = self.counter(entity, name);
            assert!(counted <= value, "{name} of {entity} is {counted}, {value} at the most was expected");
            (counted == value).then_some(())
        });
    }
}
