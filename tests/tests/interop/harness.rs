//! A node and peers in Python beside it, as real processes; every wait has its bound.

use aldis_tests::{Directory, Done, Log, Node, PATIENCE, aldis, free_port, program, root};
use serde_json::Value;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc;
use std::time::Instant;

/// The fleet of these tests.
pub(crate) const FLEET: &str = "interop";

/// A process that ends with its owner, and the JSON lines that it writes.
pub(crate) struct Running {
    child: Child,
    stdin: Option<ChildStdin>,
    lines: mpsc::Receiver<String>,
}

impl Running {
    fn start(command: &mut Command) -> Self {
        let piped = command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = piped.spawn().expect("the process starts");
        let (tell, lines) = mpsc::channel();
        let written = BufReader::new(child.stdout.take().expect("it is piped"));
        std::thread::spawn(move || {
            written.lines().map_while(Result::ok).try_for_each(|line| tell.send(line))
        });
        Self { stdin: child.stdin.take(), child, lines }
    }

    /// The next line; none at the end.
    pub(crate) fn next(&self) -> Option<Value> {
        match self.lines.recv_timeout(PATIENCE) {
            Ok(line) => Some(serde_json::from_str(&line).unwrap_or_else(|_| panic!("not JSON: {line}"))),
            Err(mpsc::RecvTimeoutError::Disconnected) => None,
            Err(mpsc::RecvTimeoutError::Timeout) => panic!("nothing more within {PATIENCE:?}"),
        }
    }

    /// Writes a line to its input.
    pub(crate) fn tell(&mut self, line: &Value) {
        let stdin = self.stdin.as_mut().expect("its input has not ended");
        writeln!(stdin, "{line}").expect("it reads its input");
    }

    /// Sends it a signal by its name, such as `TERM`.
    pub(crate) fn signal(&self, signal: &str) {
        let process = self.child.id().to_string();
        let sent = Command::new("kill").args([&format!("-{signal}"), &process]).status();
        assert!(sent.expect("kill runs").success(), "signal {signal} for process {process}");
    }

    /// Waits for its end, and gives what it still writes and its exit code.
    pub(crate) fn end(mut self) -> (Vec<Value>, Option<i32>) {
        let rest = std::iter::from_fn(|| self.next()).collect();
        (rest, self.child.wait().expect("a child can be waited for").code())
    }

    /// Ends its input, and gives what it still writes until it ends well.
    pub(crate) fn finish(mut self) -> Vec<Value> {
        self.stdin = None;
        let rest = std::iter::from_fn(|| self.next()).collect();
        assert!(self.child.wait().expect("a child can be waited for").success());
        rest
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A watch over the fleet by `aldis conform`.
pub(crate) struct Watch(Running);

impl Watch {
    /// Ends it, and gives its report.
    pub(crate) fn report(self) -> Value {
        self.0.signal("INT");
        let (mut said, code) = self.0.end();
        assert_eq!(said.len(), 1, "{said:?}");
        let report = said.remove(0);
        assert_eq!(code, Some(i32::from(report["clauses_broken"] != 0)), "{report}");
        report
    }
}

/// Entity 400, a router that others join.
pub(crate) struct Fleet {
    pub(crate) node: Node,
    locator: String,
    directory: Directory,
}

impl Fleet {
    pub(crate) fn start() -> Self {
        Self::start_as(400)
    }

    /// The same with another entity in its place.
    pub(crate) fn start_as(entity: u64) -> Self {
        let locator = format!("tcp/127.0.0.1:{}", free_port());
        let directory = Directory::new();
        let text = format!(
            "fleet = \"{FLEET}\"\nname = \"node-{entity}\"\nentities = [{entity}]\n\
             [bus]\nmode = \"router\"\nlisten = [\"{locator}\"]\n[health]\nreport_period_ms = 200\n"
        );
        let node = Node::start(&directory.write("node.toml", &text));
        let fleet = Self { node, locator, directory };
        let begin = Instant::now();
        // It can be joined before it is ready: that it answers is the sign.
        while fleet.aldis(&["call", &format!("eid{entity}sid1"), "--ping"]).code != Some(0) {
            assert!(begin.elapsed() < PATIENCE, "the node does not answer");
        }
        fleet
    }

    /// Starts a further node that joins it: the head of its configuration, and its tables.
    pub(crate) fn start_node(&self, name: &str, head: &str, tables: &str) -> Node {
        let bus = format!("[bus]\nmode = \"client\"\nconnect = [\"{}\"]\n", self.locator);
        let text = format!("fleet = \"{FLEET}\"\nname = \"{name}\"\n{head}\n{bus}{tables}");
        Node::start(&self.directory.write(&format!("{name}.toml"), &text))
    }

    /// A file for a peer to write, in the directory of this fleet.
    pub(crate) fn file(&self, name: &str) -> String {
        self.directory.path().join(name).display().to_string()
    }

    fn joining<'a>(&'a self, args: &[&'a str]) -> Vec<&'a str> {
        [args, &["--connect", &self.locator, "--fleet", FLEET]].concat()
    }

    /// Runs a command of `aldis` to its end.
    pub(crate) fn aldis(&self, args: &[&str]) -> Done {
        aldis(self.joining(args))
    }

    /// Starts a command of `aldis` that goes on.
    pub(crate) fn start_aldis(&self, args: &[&str]) -> Running {
        Running::start(Command::new(program()).args(self.joining(args)))
    }

    /// Starts a watch, and waits until it judges.
    pub(crate) fn watch(&self) -> Watch {
        let mut command = Command::new(program());
        command.args(self.joining(&["conform", "--json", "--as", "9900"])).stderr(Stdio::piped());
        let mut running = Running::start(&mut command);
        Log::follow(running.child.stderr.take().expect("it is piped")).wait_for("is judged");
        Watch(running)
    }

    /// Starts the example peer.
    pub(crate) fn start_peer(&self, python: &Path, args: &[&str]) -> Running {
        self.start_script(python, "envelope/examples/peer.py", args)
    }

    /// Starts the peer of these tests.
    pub(crate) fn start_foreign(&self, python: &Path, args: &[&str]) -> Running {
        self.start_script(python, "tests/tests/interop/foreign.py", args)
    }

    /// Starts the consumer or provider of the UMAA figures.
    pub(crate) fn start_umaa(&self, python: &Path, args: &[&str]) -> Running {
        self.start_script(python, "tests/python/figures.py", args)
    }

    fn start_script(&self, python: &Path, script: &str, args: &[&str]) -> Running {
        Running::start(script_command(python, script).args(self.joining(&[])).args(args))
    }
}

/// A script with the examples to import; it leaves no compiled files in the repository.
fn script_command(python: &Path, script: &str) -> Command {
    let mut command = Command::new(python);
    command.env("PYTHONPATH", root().join("envelope/examples")).env("PYTHONDONTWRITEBYTECODE", "1");
    command.arg(root().join(script));
    command
}

/// What a script of these tests writes for what it is given, line by line.
pub(crate) fn lines_of(python: &Path, script: &str, args: &[&str], input: String) -> Vec<Value> {
    let script = format!("tests/tests/interop/{script}");
    let mut running = Running::start(script_command(python, &script).args(args));
    let mut stdin = running.stdin.take().expect("it is piped");
    // On a thread of its own, because neither side waits for the other. Where it ends sooner, missing lines tell.
    let writer = std::thread::spawn(move || stdin.write_all(input.as_bytes()));
    let lines = running.finish();
    let _ = writer.join();
    lines
}
