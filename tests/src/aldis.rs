//! The `aldis` program: built once, run as often as needed.

use crate::{Log, PATIENCE, root, until};
use serde_json::Value;
use std::ffi::OsStr;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// The program, built with the profile and in the target directory of the running test.
///
/// # Panics
/// When it cannot be built.
pub fn program() -> &'static PathBuf {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        let test = std::env::current_exe().expect("a test knows its own file");
        // target/<profile>/deps/<test>
        let directory = test.ancestors().nth(2).expect("a test lies in target/<profile>/deps");
        let target = directory.parent().expect("a profile's directory lies in the target directory");
        let profile = match directory.file_name().and_then(OsStr::to_str) {
            Some("debug") | None => "dev",
            Some(profile) => profile,
        };
        let mut cargo = Command::new(env!("CARGO"));
        // With `--workspace` and `--examples` the dependencies have the features of `cargo test --workspace`: else all
        // of them would be built a second time.
        cargo.args(["build", "--quiet", "--offline", "--workspace", "--bin", "aldis", "--examples"]);
        if cfg!(feature = "dds") {
            cargo.args(["--features", "aldis/dds,aldis-tests/dds"]);
        }
        cargo.args(["--profile", profile, "--target-dir"]).arg(target).current_dir(root());
        // Cargo tells a test about its package. Build scripts that look at that (ring's does) would run again, and what
        // hangs on them, here and in the next `cargo test`.
        let of_this_package =
            |name: &String| name.starts_with("CARGO_MANIFEST_") || name.starts_with("CARGO_PKG_");
        for name in std::env::vars().map(|(name, _)| name).filter(of_this_package) {
            cargo.env_remove(name);
        }
        let built = cargo.output().expect("cargo runs");
        let said = String::from_utf8_lossy(&built.stderr);
        assert!(built.status.success(), "the program cannot be built: {cargo:?}\n{said}");
        directory.join(format!("aldis{}", std::env::consts::EXE_SUFFIX))
    })
}

/// What a run of the program left.
#[derive(Debug)]
pub struct Done {
    /// Its exit code; none when a signal ended it.
    pub code: Option<i32>,
    /// What it wrote to standard output.
    pub stdout: String,
    /// What it wrote to standard error.
    pub stderr: String,
    /// How long it ran.
    pub took: Duration,
}

impl Done {
    /// The lines of standard output, each a JSON value.
    ///
    /// # Panics
    /// When a line is none.
    pub fn json(&self) -> Vec<Value> {
        let read = |line| serde_json::from_str(line).unwrap_or_else(|why| panic!("{why}: {line}\n{self:?}"));
        self.stdout.lines().map(read).collect()
    }
}

/// Runs the program to its end.
///
/// # Panics
/// When it does not end within [`PATIENCE`].
pub fn aldis<S: AsRef<OsStr>>(args: impl IntoIterator<Item = S>) -> Done {
    let mut command = Command::new(program());
    command.args(args).env_remove("RUST_LOG").stdin(Stdio::null());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let started = Instant::now();
    let mut child = command.spawn().expect("the program starts");
    let stdout = Log::follow(child.stdout.take().expect("standard output is a pipe"));
    let stderr = Log::follow(child.stderr.take().expect("standard error is a pipe"));
    if !(stdout.wait_for_end() && stderr.wait_for_end()) {
        let _ = child.kill();
        let _ = child.wait();
        panic!("{command:?} did not end within {PATIENCE:?}:\n{}\n{}", stdout.text(), stderr.text());
    }
    let status = until("the program has closed its output and ends", || {
        child.try_wait().expect("a child can be waited for")
    });
    Done { code: status.code(), stdout: stdout.text(), stderr: stderr.text(), took: started.elapsed() }
}
