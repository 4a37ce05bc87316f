//! Nodes as real processes.

use crate::{Log, PATIENCE, program};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};

/// A running `aldis run`. It is killed when it is dropped; where its test fails, its log is shown.
#[derive(Debug)]
pub struct Node {
    child: Child,
    log: Log,
    config: String,
}

impl Node {
    /// Starts a node.
    ///
    /// # Panics
    /// When the process cannot be started.
    pub fn start(config: &Path) -> Self {
        let mut command = Command::new(program());
        command.arg("run").arg(config).env_remove("RUST_LOG");
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the program starts");
        let log = Log::follow(child.stderr.take().expect("standard error is a pipe"));
        Self { child, log, config: config.display().to_string() }
    }

    /// What it writes about itself.
    pub fn log(&self) -> &Log {
        &self.log
    }

    /// Sends a signal by its name, such as `TERM`.
    ///
    /// # Panics
    /// When it cannot be sent.
    pub fn signal(&self, signal: &str) {
        let process = self.child.id().to_string();
        let sent = Command::new("kill").args([&format!("-{signal}"), &process]).status();
        assert!(sent.expect("kill runs").success(), "signal {signal} for process {process}");
    }

    /// Waits for its end.
    ///
    /// # Panics
    /// When it does not end within [`PATIENCE`].
    pub fn wait(&mut self) -> ExitStatus {
        assert!(self.log.wait_for_end(), "{} did not end within {PATIENCE:?}", self.config);
        self.child.wait().expect("a child can be waited for")
    }

    /// Ends it at once, as a failing machine would, and waits until it is gone.
    pub fn crash(mut self) {
        self.end();
    }

    fn end(&mut self) {
        // It fails where the process has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        self.end();
        if std::thread::panicking() {
            eprintln!("--- log of {}\n{}\n---", self.config, self.log.text());
        }
    }
}
