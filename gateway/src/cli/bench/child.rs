//! Processes that a benchmark starts: this program again, killed when the measurement ends.

use super::super::exit::Failure;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// A process of this program.
pub(super) struct Process(Child);

fn failed(why: std::io::Error) -> Failure {
    Failure::Failed(format!("cannot start a second process: {why}"))
}

impl Process {
    /// Starts this program with other arguments.
    pub(super) fn start(args: &[&str]) -> Result<Self, Failure> {
        Self::start_other(&std::env::current_exe().map_err(failed)?, args)
    }

    /// Starts another program.
    pub(super) fn start_other(program: &Path, args: &[&str]) -> Result<Self, Failure> {
        let mut command = Command::new(program);
        command.args(args).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::inherit());
        Ok(Self(command.spawn().map_err(failed)?))
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
