//! A process that is killed while it writes its journal.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

fn peer(directory: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_aldis"));
    command.args(["bench", "journal-peer"]).arg(directory).stdin(Stdio::null());
    command
}

/// Has a process write, kills it after so many groups, and gives the number of records that it said were on disk.
fn killed(directory: &Path, groups: usize) -> u64 {
    let mut writer = peer(directory).arg("--write").stdout(Stdio::piped()).spawn().expect("it starts");
    let mut said = BufReader::new(writer.stdout.take().expect("a pipe")).lines();
    let last = said.by_ref().take(groups).last().expect("it writes").expect("text");
    writer.kill().expect("it runs");
    // What it said before its end counts too; the last line may be cut.
    let rest: Vec<String> = said.map_while(Result::ok).collect();
    writer.wait().expect("it ends");
    let whole = rest.iter().rev().nth(1).unwrap_or(&last);
    whole.parse().expect("a number")
}

#[test]
fn nothing_that_was_acknowledged_is_lost_by_kill_9() {
    let directory = std::env::temp_dir().join(format!("aldis-killed-{}", std::process::id()));
    let mut before = 0;
    for groups in [1, 2, 3, 5, 8, 13, 21, 34] {
        let acknowledged = killed(&directory, groups);
        let output = peer(&directory).output().expect("it starts");
        let told: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let (records, next) = (told["records"].as_u64().unwrap(), told["next"].as_u64().unwrap());
        assert!(acknowledged > before, "it went on where it was: {acknowledged}, {before}");
        assert!(records >= acknowledged, "{acknowledged} acknowledged, {records} stand");
        assert_eq!((records, &told["is_whole"]), (next, &serde_json::Value::Bool(true)), "no hole: {told}");
        before = records;
    }
    std::fs::remove_dir_all(directory).expect("it is there");
}
