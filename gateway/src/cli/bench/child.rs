//! Processes that a benchmark starts: this program again, killed when the measurement ends.

use super::super::exit::Failure;
use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::process::{Child, Command, Stdio};

/// A process of this program.
pub(super) struct Process(Child);

impl Process {
    /// Starts this program with other arguments.
    pub(super) fn start(args: &[&str]) -> Result<Self, Failure> {
        let failed = |why: std::io::Error| Failure::Failed(format!("cannot start a second process: {why}"));
        let program = std::env::current_exe().map_err(failed)?;
        let mut command = Command::new(program);
        command.args(args).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::inherit());
        Ok(Self(command.spawn().map_err(failed)?))
    }

    /// Waits for the next line that it prints.
    pub(super) fn line(&mut self) -> Result<String, Failure> {
        let mut line = String::new();
        if let Some(stdout) = self.0.stdout.as_mut() {
            // One line at a time, and no more than it: the reader's own buffer is not kept.
            BufReader::with_capacity(1, stdout)
                .read_line(&mut line)
                .map_err(|why| Failure::Failed(format!("the second process cannot be read: {why}")))?;
        }
        if line.is_empty() { Err(Failure::Failed("the second process ended early".into())) } else { Ok(line) }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A TCP port that nobody uses now.
pub(super) fn free_port() -> Result<u16, Failure> {
    let port = TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr());
    port.map(|address| address.port()).map_err(|why| Failure::Failed(format!("no free port: {why}")))
}
