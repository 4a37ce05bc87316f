//! Foreign peers in Python: an interpreter of a virtual environment under `target/`, with the packages wanted.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, PoisonError, mpsc};
use std::time::Duration;

/// With this variable set to 1 an absent peer is a failure.
const REQUIRED: &str = "ALDIS_REQUIRE_PEERS";

/// How long making the environment and installing a package may take each, where the network is slow or a black hole.
const STEP_WITHIN: Duration = Duration::from_secs(120);

/// The directory that cargo builds into: the tests' own program lies in `<target>/<profile>/deps`.
///
/// # Panics
/// Where the program lies elsewhere.
fn target_directory() -> PathBuf {
    let program = std::env::current_exe().expect("the tests' own program has a path");
    program.ancestors().nth(3).expect("cargo builds tests three levels deep").to_owned()
}

/// The Python interpreter with these packages (`name==version`), installed at the first use and kept. None where that
/// cannot be: then the test is skipped, and says so.
///
/// # Panics
/// Where `ALDIS_REQUIRE_PEERS=1` and the peer is absent.
pub fn with_packages(packages: &[&str]) -> Option<PathBuf> {
    found_or_skipped(&packages.join(", "), environment(packages))
}

/// The Python interpreter alone, on the same terms.
///
/// # Panics
/// Where `ALDIS_REQUIRE_PEERS=1` and there is none.
pub fn plain() -> Option<PathBuf> {
    let mut version = Command::new("python3");
    let found = run("look for python3", version.arg("--version"));
    found_or_skipped("python3", found.map(|()| PathBuf::from("python3")))
}

/// Says loudly why a test is skipped, past the capture of its output.
fn found_or_skipped(peer: &str, found: Result<PathBuf, String>) -> Option<PathBuf> {
    use std::io::Write;
    match found {
        Ok(python) => Some(python),
        Err(why) if std::env::var_os(REQUIRED).is_some_and(|value| value == "1") => {
            panic!("{REQUIRED}=1, but the peer {peer} is absent: {why}");
        }
        Err(why) => {
            // A test that cannot say so is skipped all the same.
            let _ = writeln!(std::io::stderr(), "SKIPPED: no {peer}: {why}");
            None
        }
    }
}

/// Sought once in a process, found or not: where the network is absent, each attempt takes its time.
fn environment(packages: &[&str]) -> Result<PathBuf, String> {
    static SOUGHT: Mutex<BTreeMap<String, Result<PathBuf, String>>> = Mutex::new(BTreeMap::new());
    let mut sought = SOUGHT.lock().unwrap_or_else(PoisonError::into_inner);
    let name = packages.join("+");
    sought.entry(name).or_insert_with_key(|name| kept_or_made(name, packages)).clone()
}

/// Made under a name of its own and then renamed: of several processes that make it at once one wins, and none ever
/// sees half of it.
fn kept_or_made(name: &str, packages: &[&str]) -> Result<PathBuf, String> {
    let peers = target_directory().join("python");
    let place = peers.join(name);
    let python = |place: &Path| place.join("bin").join("python");
    if python(&place).exists() {
        return Ok(python(&place));
    }
    std::fs::create_dir_all(&peers).map_err(|why| format!("cannot make {}: {why}", peers.display()))?;
    let draft = peers.join(format!("draft-{}", std::process::id()));
    let made = make(&draft, packages).and_then(|()| match std::fs::rename(&draft, &place) {
        Err(why) if !python(&place).exists() => Err(format!("cannot keep it: {why}")),
        _ => Ok(python(&place)),
    });
    // Where it has been kept, there is no draft any more.
    let _ = std::fs::remove_dir_all(&draft);
    made
}

fn make(draft: &Path, packages: &[&str]) -> Result<(), String> {
    run("make a virtual environment", Command::new("python3").args(["-m", "venv"]).arg(draft))?;
    let mut install = Command::new(draft.join("bin").join("python"));
    install.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-input"]);
    install.args(["--only-binary", ":all:", "--timeout", "20", "--retries", "1"]).args(packages);
    run("install it", &mut install)
}

/// Runs a command to its end, within [`STEP_WITHIN`].
fn run(doing: &str, command: &mut Command) -> Result<(), String> {
    let failed = |why: &dyn std::fmt::Display| format!("{doing}: {why}");
    let piped = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = piped.spawn().map_err(|why| failed(&why))?;
    let said = end_of(&mut child).recv_timeout(STEP_WITHIN);
    if said.is_err() {
        // It may just have ended by itself.
        let _ = child.kill();
    }
    let status = child.wait().map_err(|why| failed(&why))?;
    match said {
        Ok(_) if status.success() => Ok(()),
        Ok(said) => Err(failed(&said.lines().last().unwrap_or("it failed and says nothing"))),
        Err(_) => Err(failed(&format_args!("not done after {STEP_WITHIN:?}"))),
    }
}

/// Everything that a child says on standard error, once it has ended.
fn end_of(child: &mut Child) -> mpsc::Receiver<String> {
    let (tell, told) = mpsc::channel();
    if let Some(mut errors) = child.stderr.take() {
        std::thread::spawn(move || {
            let mut said = Vec::new();
            let _ = errors.read_to_end(&mut said);
            let _ = tell.send(String::from_utf8_lossy(&said).into_owned());
        });
    }
    told
}
