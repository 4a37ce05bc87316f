//! Nodes of a measurement, from configurations made for it.

use super::super::exit::Failure;
use super::child::Process;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

/// A configuration file that goes with the measurement.
pub(super) struct Configured(PathBuf);

impl Configured {
    /// A node of an entity with lines for its bus and one bridge.
    pub(super) fn new(entity: u64, bus: &str, bridge: &str) -> Result<Self, Failure> {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let text = format!(
            "name = \"bench-{entity}\"\nfleet = \"bench\"\nentities = [{entity}]\n[bus]\n{bus}\n[log]\nlevel = \"warn\"\n\
             [[bridge]]\nname = \"uxas\"\nservice = 20\n{bridge}\n"
        );
        let (process, number) = (std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        let path = std::env::temp_dir().join(format!("aldis-bench-{process}-{entity}-{number}.toml"));
        std::fs::write(&path, text)
            .map_err(|why| Failure::Failed(format!("cannot write {}: {why}", path.display())))?;
        Ok(Self(path))
    }

    /// Starts the node.
    pub(super) fn start(&self) -> Result<Process, Failure> {
        Process::start(&["run", &self.0.display().to_string()])
    }
}

impl Drop for Configured {
    fn drop(&mut self) {
        // What is left behind in the directory for temporary files does no harm.
        let _ = std::fs::remove_file(&self.0);
    }
}
