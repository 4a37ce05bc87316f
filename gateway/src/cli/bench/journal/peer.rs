//! The other process of `aldis bench journal`: opens a journal and tells what is in it, or writes until it is killed.

use super::super::super::exit::Failure;
use super::super::super::print_line;
use super::{Told, failed, record};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

/// The other process of `bench journal`.
#[derive(clap::Args)]
pub(in super::super) struct JournalPeer {
    /// The journal.
    directory: PathBuf,
    /// Write records with rising keys until killed, and say after each group what is on disk.
    #[arg(long)]
    write: bool,
}

impl JournalPeer {
    pub(in super::super) fn run(self) -> Result<(), Failure> {
        let before = resident_kib();
        let begin = Instant::now();
        let (mut records, mut next, mut is_whole) = (0_u64, 0, true);
        let told = Told::open(&self.directory, &mut |key, value| {
            records += 1;
            let key = key.try_into().map(u32::from_be_bytes).unwrap_or_default();
            is_whole &= value.iter().all(|byte| *byte == key as u8);
            next = next.max(key + 1);
        })?;
        if self.write {
            return write(told, next);
        }
        let resident = resident_kib().saturating_sub(before);
        print_line(json!({
            "records": records, "restart_s": begin.elapsed().as_secs_f64(), "resident_kib": resident,
            "next": next, "is_whole": is_whole,
        }));
        Ok(())
    }
}

fn write(mut told: Told, first: u32) -> Result<(), Failure> {
    let mut written = 0;
    for key in first.. {
        let number = told.thread.append(record(key, 100 + key as usize % 200)).map_err(failed)?;
        while number - written >= 100 {
            written = told.written()?;
            print_line(u64::from(first) + written);
        }
    }
    Ok(())
}

/// The memory of this process that is in use, in KiB; zero where the system does not tell.
pub(in super::super) fn resident_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap_or_default();
    line.trim().trim_end_matches(" kB").parse().unwrap_or_default()
}

/// What another process says of a journal.
pub(super) fn opened_by_another(directory: &Path) -> Result<Value, Failure> {
    let program = std::env::current_exe().map_err(failed)?;
    let mut command = Command::new(program);
    command.args(["bench", "journal-peer"]).arg(directory).stdin(Stdio::null()).stderr(Stdio::inherit());
    let output = command.output().map_err(failed)?;
    let mut told: Value = serde_json::from_slice(&output.stdout).map_err(failed)?;
    told["resident_mib"] = json!((told["resident_kib"].as_f64().unwrap_or_default() / 102.4).round() / 10.0);
    Ok(told)
}
