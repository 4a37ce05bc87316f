//! Real processes: a node, commands of `aldis`, and peers in Python; every wait has its bound.

use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{OnceLock, mpsc};
use std::time::{Duration, Instant, SystemTime};
use tempfile::TempDir;

/// How long anything may take that is not expected to fail: far more than it takes, on a machine that does much else.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// The fleet of these tests.
pub(crate) const FLEET: &str = "interop";

/// The program, built as the tests were. What lies there is used if it is newer than its sources; otherwise cargo
/// builds it.
fn aldis() -> &'static Path {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT.get_or_init(|| {
        let tests = std::env::current_exe().expect("a path");
        let profile = tests.ancestors().nth(2).expect("cargo builds tests three levels deep");
        let program = profile.join("aldis");
        let sources = ["Cargo.lock", "envelope", "services", "gateway"].map(|part| newest(&repository(part)));
        let built = std::fs::metadata(&program).and_then(|file| file.modified());
        if built.is_ok_and(|built| sources.iter().all(|source| *source < built)) {
            return program;
        }
        let mut build = Command::new(env!("CARGO"));
        // Build scripts of dependencies look at what cargo says of the package under test, and would run again.
        let of_the_package =
            |name: &str| name.starts_with("CARGO_PKG_") || name.starts_with("CARGO_MANIFEST_");
        std::env::vars().filter(|(name, _)| of_the_package(name)).for_each(|(name, _)| {
            build.env_remove(name);
        });
        build.args(["build", "--quiet", "--package", "aldis"]);
        build.arg("--target-dir").arg(aldis_tests::python::target_directory());
        if profile.ends_with("release") {
            build.arg("--release");
        }
        assert!(build.status().expect("cargo runs").success(), "cargo cannot build aldis");
        program
    })
}

/// When a file, or the newest source in a directory, was written.
fn newest(path: &Path) -> SystemTime {
    let children = std::fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path());
    let sources =
        children.filter(|path| path.is_dir() || path.extension().is_some_and(|e| e == "rs" || e == "toml"));
    let own =
        std::fs::metadata(path).ok().filter(std::fs::Metadata::is_file).and_then(|file| file.modified().ok());
    sources.map(|path| newest(&path)).chain(own).max().unwrap_or(SystemTime::UNIX_EPOCH)
}

/// A file of the repository.
pub(crate) fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// A process that ends with its owner, and the lines that it writes.
pub(crate) struct Running {
    child: Child,
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
        Self { child, lines }
    }

    /// The next line, as JSON; none at the end.
    pub(crate) fn next(&self) -> Option<Value> {
        match self.lines.recv_timeout(PATIENCE) {
            Ok(line) => Some(serde_json::from_str(&line).unwrap_or_else(|_| panic!("not JSON: {line}"))),
            Err(mpsc::RecvTimeoutError::Disconnected) => None,
            Err(mpsc::RecvTimeoutError::Timeout) => panic!("nothing more within {PATIENCE:?}"),
        }
    }

    /// Ends its input, and waits until it has ended.
    pub(crate) fn end_input(mut self) {
        drop(self.child.stdin.take());
        while self.next().is_some() {}
        assert!(self.child.wait().expect("it ends").success());
    }

    /// Asks it to end in order.
    pub(crate) fn terminate(&self) {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").arg(id).status().expect("kill runs").success());
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A node, `aldis run`, that others join.
pub(crate) struct Node {
    pub(crate) process: Running,
    locator: String,
    directory: TempDir,
}

impl Node {
    /// Entity 400 as a router. The port was free a moment ago; where somebody else took it meanwhile, another is tried.
    pub(crate) fn start() -> Self {
        let started = (0..3).find_map(|_| Self::try_start());
        started.expect("a node finds a free port in three attempts")
    }

    fn try_start() -> Option<Self> {
        let port = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a free port").port();
        let locator = format!("tcp/127.0.0.1:{port}");
        let directory = tempfile::tempdir().expect("a directory");
        let config = directory.path().join("node.toml");
        let text = format!(
            "fleet = \"{FLEET}\"\nname = \"node-400\"\nentities = [400]\n\
             [bus]\nmode = \"router\"\nlisten = [\"{locator}\"]\n[health]\nreport_period_ms = 200\n"
        );
        std::fs::write(&config, text).expect("the configuration is written");
        let log = std::fs::File::create(directory.path().join("log")).expect("a log");
        let process = Running::start(Command::new(aldis()).arg("run").arg(&config).stderr(log));
        let node = Self { process, locator, directory };
        let begin = Instant::now();
        // It is joined before it is ready: that it answers is the sign.
        while !node.aldis(&["call", "eid400sid1", "--ping"]).status.success() {
            assert!(begin.elapsed() < PATIENCE, "the node does not answer: {}", node.log());
            if node.log().contains("in use") {
                return None;
            }
        }
        Some(node)
    }

    fn log(&self) -> String {
        std::fs::read_to_string(self.directory.path().join("log")).unwrap_or_default()
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(aldis());
        command.args(args).args(["--connect", &self.locator, "--fleet", FLEET]);
        command
    }

    /// Runs a command of `aldis` to its end; each has a bound of its own.
    pub(crate) fn aldis(&self, args: &[&str]) -> Output {
        self.command(args).stdin(Stdio::null()).output().expect("aldis runs")
    }

    /// The lines of a command of `aldis`, which ends well.
    pub(crate) fn aldis_json(&self, args: &[&str]) -> Vec<Value> {
        let output = self.aldis(args);
        assert!(output.status.success(), "aldis {args:?}: {}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8(output.stdout).expect("UTF-8");
        text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
    }

    /// Starts a command of `aldis` that goes on.
    pub(crate) fn start_aldis(&self, args: &[&str]) -> Running {
        Running::start(&mut self.command(args))
    }

    /// Starts the example peer.
    pub(crate) fn start_peer(&self, python: &Path, args: &[&str]) -> Running {
        self.start_script(python, &repository("envelope/examples/peer.py"), args)
    }

    /// Starts a script of these tests.
    pub(crate) fn start_foreign(&self, python: &Path, args: &[&str]) -> Running {
        self.start_script(python, &repository("tests/tests/interop/foreign.py"), args)
    }

    fn start_script(&self, python: &Path, script: &Path, args: &[&str]) -> Running {
        let mut command = python_command(python);
        Running::start(command.arg(script).args(["--connect", &self.locator, "--fleet", FLEET]).args(args))
    }
}

/// Python with the examples to import, which leaves no compiled files in the repository.
fn python_command(python: &Path) -> Command {
    let mut command = Command::new(python);
    command.env("PYTHONPATH", repository("envelope/examples")).env("PYTHONDONTWRITEBYTECODE", "1");
    command
}

/// What a script of these tests writes for what it is given, line by line.
pub(crate) fn lines_of(python: &Path, script: &str, args: &[&str], input: &str) -> Vec<Value> {
    use std::io::Write;
    let mut command = python_command(python);
    let mut running = Running::start(command.arg(repository("tests/tests/interop").join(script)).args(args));
    let mut stdin = running.child.stdin.take().expect("it is piped");
    // It ends by itself where the input ends; should it end sooner, the lines that are missing tell.
    let _ = stdin.write_all(input.as_bytes());
    drop(stdin);
    let begin = Instant::now();
    let lines: Vec<_> = std::iter::from_fn(|| running.next()).collect();
    assert!(running.child.wait().expect("it ends").success(), "{script} failed after {:?}", begin.elapsed());
    lines
}
