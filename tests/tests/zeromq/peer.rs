//! The peer in Python: a process that is told what to do, line by line.

use aldis_tests::{PATIENCE, python, root};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc;

/// Python with the binding of libzmq.
pub(crate) fn pyzmq() -> Option<PathBuf> {
    python::with_packages(&["pyzmq==27.3.0"])
}

/// A UxAS on ZeroMQ. It is killed when it is dropped.
pub(crate) struct Uxas {
    child: Child,
    stdin: ChildStdin,
    lines: mpsc::Receiver<String>,
}

impl Uxas {
    /// One that connects (PUSH and SUB) or binds (PUB and PULL), with the ports that it sends to and receives from.
    pub(crate) fn start(
        python: &Path,
        kind: &str,
        framing: &str,
        [out, into]: [u16; 2],
        topic: &str,
    ) -> Self {
        let mut command = Command::new(python);
        command.arg(root().join("tests/tests/zeromq/uxas.py")).args([kind, framing]);
        command.args([out, into].map(|port| format!("tcp://127.0.0.1:{port}"))).arg(topic);
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("Python starts");
        let (tell, lines) = mpsc::channel();
        let written = BufReader::new(child.stdout.take().expect("it is piped"));
        std::thread::spawn(move || {
            written.lines().map_while(Result::ok).try_for_each(|line| tell.send(line))
        });
        let uxas = Self { stdin: child.stdin.take().expect("it is piped"), child, lines };
        assert_eq!(uxas.heard(), "ready");
        uxas
    }

    /// Has it do something.
    pub(crate) fn tell(&mut self, command: &Value) {
        writeln!(self.stdin, "{command}").expect("it listens");
    }

    /// What it says next.
    pub(crate) fn heard(&self) -> Value {
        let line = self.lines.recv_timeout(PATIENCE).expect("it says something");
        serde_json::from_str(&line).expect("it speaks JSON")
    }

    /// Sends a message of these frames.
    pub(crate) fn send(&mut self, frames: &[&str]) {
        self.tell(&json!(["send", frames]));
    }

    /// The next message that comes.
    pub(crate) fn receive(&mut self) -> Value {
        self.tell(&json!(["receive"]));
        self.heard()
    }
}

impl Drop for Uxas {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
