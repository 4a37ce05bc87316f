//! Two nodes with journals on buses of their own, joined by links over carriers that lose, are cut, or are other networks; and nodes that
//! are killed.

use aldis_tests::{Directory, Done, Node, Peer, aldis, delimited, frame, free_port, until};
use std::net::{SocketAddr, UdpSocket};
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

/// Of such topics every sample is kept.
const TOPIC: &str = "UMAA::SO::Custody::CustodyCommandStatus";

fn udp() -> SocketAddr {
    UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap()
}

fn connect(bus: u16) -> String {
    format!("tcp/127.0.0.1:{bus}")
}

/// Shore, whose commands come from a UxAS, and a vehicle that keeps them on a persistent topic.
struct Pair {
    directory: Directory,
    shore: PathBuf,
    vehicle: PathBuf,
    buses: [u16; 2],
    uxas: u16,
}

impl Pair {
    /// `carriers` are the tables of the carriers of shore and of the vehicle.
    fn new(carriers: [&str; 2]) -> Self {
        let directory = Directory::new();
        let (buses, uxas) = ([free_port(), free_port()], free_port());
        let node = |entity: u64, peer: u64, bus: u16, carrier: &str| {
            format!(
                "name = \"n{entity}\"\nentities = [{entity}, {}]\noperators = [9000]\n[journal]\npath = \"kept-{entity}\"\n\
                 [bus]\nmode = \"router\"\nlisten = [\"{}\"]\n[[link]]\nname = \"link\"\npeer = {peer}\n\
                 entities = [{peer}, {}]\n{carrier}\
                 [[link.rule]]\ndescriptor = \"{TOPIC}\"\nclass = \"command\"\nlifespan_s = 900\n",
                entity + 100,
                connect(bus),
                peer + 100,
            )
        };
        let bridge = format!(
            "[[bridge]]\nkind = \"uxas-tcp\"\nname = \"uxas\"\nservice = 20\nlisten = \"127.0.0.1:{uxas}\"\nexport = []\n"
        );
        let topic = format!("[[topic]]\nprefix = \"{TOPIC}\"\ndurability = \"persistent\"\n");
        let shore = format!("{}{bridge}", node(1, 400, buses[0], carriers[0]));
        let vehicle = format!("{}{topic}", node(400, 1, buses[1], carriers[1]));
        let (shore, vehicle) =
            (directory.write("shore.toml", &shore), directory.write("vehicle.toml", &vehicle));
        Self { directory, shore, vehicle, buses, uxas }
    }

    fn aldis(&self, end: usize, args: &[&str]) -> Done {
        let connect = ["--connect".to_owned(), connect(self.buses[end])];
        aldis(args.iter().map(|&arg| arg.to_owned()).chain(connect))
    }

    /// What a node says of its link.
    fn status(&self, end: usize) -> Option<serde_json::Value> {
        let entity = ["1", "400"][end];
        self.aldis(end, &["link", "ls", "--node", entity, "--json"]).json().into_iter().next()
    }

    fn peer(&self, shore: &Node) -> Peer {
        let peer = until("the bridge listens", || Peer::connect(self.uxas).ok());
        shore.log().wait_for(&format!("{} is there", peer.name()));
        peer
    }

    /// How many commands wait at shore.
    fn waiting(&self) -> usize {
        self.aldis(0, &["queue", "ls", "--limit", "1000", "--json"]).json().len()
    }

    /// What the vehicle keeps, in its order.
    fn kept(&self, count: usize) -> Vec<String> {
        let count = count.to_string();
        let done = self.aldis(1, &["sub", TOPIC, "--count", &count, "--for", "20s", "--json"]);
        let of = |line: &serde_json::Value| {
            let hex = line["content"]["hex"].as_str().unwrap_or_default().to_owned();
            let digit = |at: usize| u8::from_str_radix(&hex[at..at + 2], 16).unwrap();
            String::from_utf8((0..hex.len()).step_by(2).map(digit).collect()).unwrap()
        };
        done.json().iter().map(of).collect()
    }
}

fn udp_carrier(listen: SocketAddr, peer: SocketAddr) -> String {
    format!(
        "[[link.carrier]]\nkind = \"udp\"\nlisten = \"{listen}\"\npeer = \"{peer}\"\nrate_bytes_per_s = 20000\n\
         mtu = 256\nround_trip_ms = 20\nloss_percent = 30\n"
    )
}

/// A bad link between two addresses, as a process.
fn relay(listen: SocketAddr, a: SocketAddr, b: SocketAddr) -> Relay {
    let mut command = std::process::Command::new(aldis_tests::program());
    command.args(["link", "emulate", "L1", "--delay-ms", "10", "--rate", "20000", "--seed", "5"]);
    command.args(["--listen", &listen.to_string(), "--a", &a.to_string(), "--b", &b.to_string()]);
    command.stdin(std::process::Stdio::null()).stdout(std::process::Stdio::null());
    Relay(command.spawn().unwrap())
}

struct Relay(std::process::Child);

impl Drop for Relay {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What came of commands: those that are not there, and those that are there more than once.
fn judge(kept: &[String], sent: u64) -> (u64, u64) {
    let times = |number: u64| kept.iter().filter(|content| **content == format!("command {number}")).count();
    let lost = (1..=sent).filter(|number| times(*number) == 0).count() as u64;
    let twice = (1..=sent).filter(|number| times(*number) > 1).count() as u64;
    (lost, twice)
}

/// `ALDIS_KILLS=50` kills fifty times.
#[test]
fn what_is_accepted_is_kept_once_whoever_is_killed() {
    let kills: u64 = std::env::var("ALDIS_KILLS").ok().and_then(|text| text.parse().ok()).unwrap_or(3);
    let (ends, between) = ([udp(), udp()], udp());
    let carriers = ends.map(|end| udp_carrier(end, between));
    let pair = Pair::new([&carriers[0], &carriers[1]]);
    let _relay = relay(between, ends[0], ends[1]);
    let start = |end: usize| Some(Node::start([&pair.shore, &pair.vehicle][end]));
    let mut nodes = [start(0), start(1)];
    let seed = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos() as u64;
    let mut random = fastrand::Rng::with_seed(seed);
    let (mut sent, mut of_this_life) = (0, 0);
    let mut peer = pair.peer(nodes[0].as_ref().unwrap());
    for kill in 1..=kills {
        for _ in 0..random.u64(1..12) {
            sent += 1;
            of_this_life += 1;
            let content = format!("command {sent}");
            peer.send(&frame(&delimited(TOPIC, 1, 61, content.as_bytes())));
        }
        until("shore has accepted all", || {
            let accepted = pair.status(0)?["counters"]["commands_accepted"].as_u64()?;
            (accepted >= of_this_life).then_some(())
        });
        let end = random.usize(0..2);
        nodes[end].take().unwrap().crash();
        nodes[end] = start(end);
        if end == 0 {
            of_this_life = 0;
            peer = pair.peer(nodes[0].as_ref().unwrap());
        }
        println!("kill {kill} of {kills}: {}, {sent} commands so far", ["shore", "vehicle"][end]);
    }
    until("all is through", || (pair.waiting() == 0).then_some(()));
    nodes[1].take().unwrap().crash();
    nodes[1] = start(1);
    until("the vehicle is back", || pair.status(1));
    let kept = pair.kept(sent as usize);
    let (lost, twice) = judge(&kept, sent);
    println!("{kills} kills, {sent} commands accepted: {lost} lost, {twice} twice; seed {seed}");
    assert_eq!((lost, twice), (0, 0), "seed {seed}: {kept:?}");
    drop(pair.directory);
}

/// Sends commands one after the other, and waits until the vehicle keeps them all.
fn send(pair: &Pair, peer: &mut Peer, numbers: std::ops::RangeInclusive<u64>) {
    for number in numbers {
        let content = format!("command {number}");
        peer.send(&frame(&delimited(TOPIC, 1, 61, content.as_bytes())));
    }
    until("all is through", || {
        let status = pair.status(0)?;
        (status["waiting"]["commands"] == 0).then_some(())
    });
}

#[test]
fn a_carrier_over_zenoh_carries_commands() {
    let port = free_port();
    let carrier = |side: &str| {
        format!(
            "[[link.carrier]]\nkind = \"zenoh\"\n{side} = [\"{}\"]\nrate_bytes_per_s = 20000\n",
            connect(port)
        )
    };
    let pair = Pair::new([&carrier("listen_zenoh"), &carrier("connect")]);
    let (shore, _vehicle) = (Node::start(&pair.shore), Node::start(&pair.vehicle));
    let mut peer = pair.peer(&shore);
    until("shore hears the vehicle", || (pair.status(0)?["heard"] == true).then_some(()));
    send(&pair, &mut peer, 1..=20);
    assert_eq!(judge(&pair.kept(20), 20), (0, 0));
    let status = pair.status(1).unwrap();
    assert_eq!(status["counters"]["commands_received"], 20, "{status}");
}

#[test]
fn a_cut_of_the_preferred_carrier_loses_nothing_and_doubles_nothing() {
    let (ends, between) = ([udp(), udp()], udp());
    let spare = [udp(), udp()];
    let carriers = [0, 1]
        .map(|end| format!("{}{}", udp_carrier(ends[end], between), udp_carrier(spare[end], spare[1 - end])));
    let pair = Pair::new([&carriers[0], &carriers[1]]);
    let mut preferred = Some(relay(between, ends[0], ends[1]));
    let (shore, _vehicle) = (Node::start(&pair.shore), Node::start(&pair.vehicle));
    let mut peer = pair.peer(&shore);
    let in_use = |place: usize| {
        until(&format!("carrier {place} is in use"), || {
            (pair.status(0)?["carriers"][place]["in_use"] == true).then_some(())
        });
    };
    in_use(0);
    for round in 0..3 {
        let first = 1 + round * 100;
        for number in first..first + 50 {
            let content = format!("command {number}");
            peer.send(&frame(&delimited(TOPIC, 1, 61, content.as_bytes())));
        }
        // While they are on the air the preferred carrier goes, or comes back.
        preferred = match preferred.take() {
            Some(relay) => {
                drop(relay);
                None
            }
            None => Some(relay(between, ends[0], ends[1])),
        };
        in_use(usize::from(preferred.is_none()));
        send(&pair, &mut peer, first + 50..=first + 99);
    }
    assert_eq!(judge(&pair.kept(300), 300), (0, 0));
    let received = pair.status(1).unwrap()["counters"]["commands_received"].clone();
    assert_eq!(received, 300);
}
