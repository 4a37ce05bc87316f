//! A DDS peer in Python, and two domains with a gateway each.

use aldis_tests::{Node, PATIENCE, Site, python, root};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc;
use std::time::Instant;

/// Cyclone DDS on this machine alone.
const LOOPBACK: &str = r#"<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast><Interfaces>
<NetworkInterface address="127.0.0.1"/></Interfaces></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>60</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"#;

/// A domain that no other test of this run has.
pub(crate) fn domain() -> u32 {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    100 + (std::process::id() % 4) * 30 + NEXT.fetch_add(1, Ordering::Relaxed) % 30
}

/// Python with Cyclone DDS; none where it cannot be had.
pub(crate) fn cyclonedds() -> Option<PathBuf> {
    python::with_packages(&["cyclonedds==11.0.1"])
}

/// What a process writes, line by line.
fn lines_of(stdout: ChildStdout) -> mpsc::Receiver<String> {
    let (tell, lines) = mpsc::channel();
    let written = BufReader::new(stdout);
    std::thread::spawn(move || written.lines().map_while(Result::ok).try_for_each(|line| tell.send(line)));
    lines
}

/// `aldis dds spy`: each change as its writer sent it, in order.
pub(crate) struct Spy {
    child: Child,
    lines: mpsc::Receiver<String>,
}

impl Spy {
    /// Everything that it shows until the first line that is such.
    pub(crate) fn until(&self, mut last: impl FnMut(&Value) -> bool) -> Vec<Value> {
        let mut seen = Vec::new();
        loop {
            let line = self.lines.recv_timeout(PATIENCE).expect("it shows something within the time");
            let shown: Value = serde_json::from_str(&line).unwrap_or_else(|_| panic!("not JSON: {line}"));
            let is_last = last(&shown);
            seen.push(shown);
            if is_last {
                return seen;
            }
        }
    }
}

impl Drop for Spy {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A DDS peer that does what it is told.
pub(crate) struct Peer {
    child: Child,
    stdin: ChildStdin,
    lines: mpsc::Receiver<String>,
}

impl Peer {
    pub(crate) fn start(python: &PathBuf, domain: u32) -> Self {
        let mut command = Command::new(python);
        command.arg(root().join("tests/python/dds/peer.py")).arg(domain.to_string());
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("Python starts");
        let lines = lines_of(child.stdout.take().expect("it is piped"));
        let stdin = child.stdin.take().expect("it is piped");
        let peer = Self { child, stdin, lines };
        assert_eq!(peer.next(), json!(["ready"]));
        peer
    }

    pub(crate) fn tell(&mut self, line: &Value) {
        writeln!(self.stdin, "{line}").expect("it reads its input");
    }

    /// The next line.
    pub(crate) fn any(&self) -> Value {
        let line = self.lines.recv_timeout(PATIENCE).expect("it says something within the time");
        serde_json::from_str(&line).unwrap_or_else(|_| panic!("not JSON: {line}"))
    }

    /// The next line, but what nodes say of themselves: their GUIDs begin with zeros.
    pub(crate) fn next(&self) -> Value {
        let started = Instant::now();
        loop {
            assert!(started.elapsed() < PATIENCE, "it says nothing but the nodes' health");
            let said = self.any();
            let source = &said[2]["source"];
            let source = source.as_str().or_else(|| source["id"].as_str()).unwrap_or_default();
            if !source.starts_with("00000000") || *source == crate::id(0) {
                return said;
            }
        }
    }

    /// The next changes of a topic: their states and what of the sample is asked for.
    pub(crate) fn changes(&self, count: usize, of: impl Fn(&Value) -> Value) -> Vec<(String, Value)> {
        let read = |_| {
            let line = self.next();
            (line[1].as_str().expect("a state").to_owned(), of(&line))
        };
        (0..count).map(read).collect()
    }

    /// Waits for an answer; what it hears before is of no interest.
    fn answers(&self, answer: &Value) {
        let started = Instant::now();
        while self.any() != *answer {
            assert!(started.elapsed() < PATIENCE, "{answer} is not said within the time");
        }
    }

    pub(crate) fn writer(&mut self, topic: &str, kind: &str, qos: Value) {
        self.tell(&json!(["writer", topic, format!("{kind} {topic}"), qos]));
        self.answers(&json!(["writer", topic]));
    }

    pub(crate) fn reader(&mut self, topic: &str, kind: &str, qos: Value) {
        self.tell(&json!(["reader", topic, format!("{kind} {topic}"), qos]));
        self.answers(&json!(["reader", topic]));
    }

    pub(crate) fn matched(&mut self, topic: &str, count: usize) {
        self.tell(&json!(["matched", topic, count]));
        self.answers(&json!(["matched", topic, count]));
    }

    /// Everything that it says until the first line that is such.
    pub(crate) fn until(&mut self, last: impl Fn(&Value) -> bool) -> Vec<Value> {
        let mut seen = Vec::new();
        loop {
            seen.push(self.next());
            if seen.last().is_some_and(&last) {
                return seen;
            }
        }
    }

    pub(crate) fn change(&mut self, what: &str, topic: &str, members: Value, at: i64) {
        self.tell(&json!([what, topic, members, at]));
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Shore and a vehicle, each with a DDS domain beside it.
pub(crate) struct Stage {
    pub(crate) site: Site,
    pub(crate) python: PathBuf,
    pub(crate) domains: [u32; 2],
    pub(crate) shore: Option<Node>,
    pub(crate) vehicle: Option<Node>,
}

impl Stage {
    pub(crate) fn new(more: &str) -> Option<Self> {
        Self::of_versions([more, more])
    }

    /// With what is said of the shore's bridge and of the vehicle's.
    pub(crate) fn of_versions([shore, vehicle]: [&str; 2]) -> Option<Self> {
        let mut stage = Self::without_nodes()?;
        stage.start_shore(shore);
        stage.start_vehicle(vehicle);
        Some(stage)
    }

    fn without_nodes() -> Option<Self> {
        let python = cyclonedds()?;
        let stage =
            Self { site: Site::new(), python, domains: [domain(), domain()], shore: None, vehicle: None };
        stage.site.directory().write("loopback.xml", LOOPBACK);
        Some(stage)
    }

    /// With a folder of IDL on both sides.
    pub(crate) fn with_idl(text: &str) -> Option<Self> {
        let mut stage = Self::without_nodes()?;
        std::fs::create_dir(stage.site.directory().path().join("idl")).expect("the directory is ours");
        stage.site.directory().write("idl/types.idl", text);
        stage.start_shore("idl = \"idl\"");
        stage.start_vehicle("idl = \"idl\"");
        Some(stage)
    }

    /// With a bridge for each of two partitions on both sides.
    pub(crate) fn in_partitions([first, second]: [&str; 2]) -> Option<Self> {
        let mut stage = Self::without_nodes()?;
        let more = |stage: &Self, place: usize| {
            let other = stage.bridge(place, &format!("partition = {second:?}"));
            let other = other.replace("\"dds\"\nservice = 30", "\"dds-2\"\nservice = 31");
            format!("partition = {first:?}\n{other}")
        };
        let (shore, vehicle) = (more(&stage, 0), more(&stage, 1));
        stage.start_shore(&shore);
        stage.start_vehicle(&vehicle);
        Some(stage)
    }

    /// A participant that only looks, with further arguments.
    pub(crate) fn spy(&self, place: usize, more: &[&str]) -> Spy {
        let domain = self.domains[place].to_string();
        let mut command = Command::new(aldis_tests::program());
        command.args(["dds", "spy", "--domain", &domain, "--cyclonedds"]);
        command.arg(self.site.directory().path().join("loopback.xml")).args(more);
        let mut child = command.stdout(Stdio::piped()).stdin(Stdio::null()).spawn().expect("it starts");
        let lines = lines_of(child.stdout.take().expect("it is piped"));
        Spy { child, lines }
    }

    fn bridge(&self, place: usize, more: &str) -> String {
        format!(
            "[[bridge]]\nkind = \"dds\"\nname = \"dds\"\nservice = 30\ndomain = {}\ncyclonedds = \"loopback.xml\"\n{more}\n",
            self.domains[place]
        )
    }

    pub(crate) fn start_shore(&mut self, more: &str) {
        let config = self.site.shore_config(&self.bridge(0, more));
        self.shore = Some(Node::start(&config));
        self.site.wait_for(1);
    }

    pub(crate) fn start_vehicle(&mut self, more: &str) {
        let config = self.site.vehicle_config(&self.bridge(1, more));
        self.vehicle = Some(Node::start(&config));
        self.site.wait_for(400);
    }

    pub(crate) fn peer(&self, place: usize) -> Peer {
        Peer::start(&self.python, self.domains[place])
    }
}
