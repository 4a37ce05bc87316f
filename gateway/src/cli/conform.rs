//! `aldis conform`: watches a bus, or a recording, and says clause by clause what of the ICD held.

use super::exit::Failure;
use super::member::{Desk, Join, Member};
use super::print_line;
use super::within::Within;
use aldis_envelope::codec::recording::Reader;
use aldis_envelope::{Monotonic, Now, Prefix};
use aldis_services::conform::{Bounds, Decoder, Monitor, Report, Verdict, Watcher};
use aldis_services::{Input, Outbox};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::{Duration, Instant};

/// Watch UMAA traffic and report, clause by clause of the ICD, what was held and what was broken.
///
/// Exit code 1 where a clause was broken.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis conform --for 5m                      a running fleet, for five minutes
  aldis conform                               until it is stopped
  aldis conform --file watch.aldis --format junit > conform.xml")]
pub(crate) struct Conform {
    /// A recording of `aldis record` in place of a running fleet.
    #[arg(long)]
    file: Option<PathBuf>,
    /// Watch for so long. Default: until it is stopped.
    #[arg(long = "for", conflicts_with = "file")]
    span: Option<Within>,
    /// How the report is written.
    #[arg(long, default_value = "text")]
    format: Format,
    /// One JSON object, as `--format json`.
    #[arg(long, conflicts_with = "format")]
    json: bool,
    /// How much later what one writer says may come beside what another says.
    #[arg(long, default_value = "500ms")]
    slack: Within,
    #[command(flatten)]
    join: Join,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// For people.
    Text,
    /// One JSON object.
    Json,
    /// JUnit XML: a test case a clause.
    Junit,
}

/// Hands what the bus says to the watcher.
struct Watching {
    watcher: Arc<Mutex<Option<Watcher>>>,
    /// From when what comes is judged.
    judges_from: Option<Monotonic>,
    /// Whether it has been told that what comes is judged.
    judges: bool,
    tell: mpsc::Sender<Told>,
}

/// What the desk and the signals tell the command.
enum Told {
    Joined,
    Judges,
    Stop,
}

impl Desk for Watching {
    fn take(&mut self, now: Now, input: Input<'_>, _: &mut Outbox) {
        if matches!(input, Input::Bus(true)) {
            // The command no longer listens where it has been cut off.
            let _ = self.tell.send(Told::Joined);
        }
        let mut watcher = self.watcher.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(watcher) = watcher.as_mut() else { return };
        match input {
            Input::HistoryComplete(_) => {
                watcher.history_complete(now.monotonic);
                self.judges_from = watcher.judges_from();
            }
            Input::Message(envelope) if envelope.message.call.is_none() => {
                watcher.message(now.monotonic, envelope);
            }
            Input::Token(writer, false) => watcher.vanished(now.monotonic, writer),
            Input::Deadline if !self.judges && self.judges_from.is_some_and(|from| from <= now.monotonic) => {
                self.judges = true;
                let _ = self.tell.send(Told::Judges);
            }
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.judges_from.filter(|_| !self.judges)
    }
}

impl Conform {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let monitor = Monitor::new(Bounds { slack: self.slack.0, ..Bounds::default() }, []);
        let report = match &self.file {
            Some(file) => replayed(file, monitor)?,
            None => self.watch(monitor)?,
        };
        match (self.json, self.format) {
            (true, _) | (_, Format::Json) => print_line(report.json()),
            (_, Format::Junit) => print_line(report.junit()),
            (_, Format::Text) => print_line(report.to_string().trim_end()),
        }
        match report.count(Verdict::Broken) {
            0 => Ok(()),
            broken => Err(Failure::Failed(format!("{broken} clauses were broken"))),
        }
    }

    fn watch(&self, monitor: Monitor) -> Result<Report, Failure> {
        let (tell, told) = mpsc::channel();
        let watcher = Watcher::joining(monitor, Decoder::new([]));
        let shared = Arc::new(Mutex::new(Some(watcher)));
        let desk = Watching { watcher: shared.clone(), judges_from: None, judges: false, tell: tell.clone() };
        let prefixes = Prefix::new("UMAA::").into_iter().collect();
        let member = Member::join(&self.join, prefixes, desk)?;
        let joined = told.recv_timeout(super::JOIN_WITHIN);
        let started = Instant::now();
        if joined.is_ok() {
            super::run::watch_signals(move || {
                let _ = tell.send(Told::Stop);
            })?;
            let wait = self.span.map_or(Duration::MAX, |span| span.0);
            // A session that comes back ends nothing.
            while let Ok(news @ (Told::Joined | Told::Judges)) =
                told.recv_timeout(wait.saturating_sub(started.elapsed()))
            {
                if matches!(news, Told::Judges) {
                    eprintln!("aldis: what the fleet retains is known; what comes from now on is judged");
                }
            }
        }
        member.leave()?;
        joined.map_err(|_| self.join.unreachable())?;
        let watcher = shared.lock().unwrap_or_else(PoisonError::into_inner).take();
        let watcher = watcher.ok_or_else(|| Failure::Failed("the monitor is gone".into()))?;
        Ok(watcher.finish(Monotonic::since_start(started.elapsed())))
    }
}

/// What a recording shows. Its first envelopes may be history: the recording does not say which.
fn replayed(file: &std::path::Path, monitor: Monitor) -> Result<Report, Failure> {
    let bytes = super::content::read_file(file)?;
    let wrong = |why: &dyn std::fmt::Display| Failure::Usage(format!("{}: {why}", file.display()));
    let reader = Reader::new(&bytes).map_err(|why| wrong(&why))?;
    let mut watcher = Watcher::from_the_start(monitor, Decoder::new([]));
    let (mut first, mut last) = (None, Monotonic::START);
    for record in reader {
        let (received, envelope) = match record {
            Ok(record) => record,
            Err(why) => {
                eprintln!("aldis: {}: {why}", file.display());
                continue;
            }
        };
        let start = *first.get_or_insert(received.0);
        let elapsed = u64::try_from(received.0.saturating_sub(start)).unwrap_or_default();
        last = Monotonic::since_start(Duration::from_nanos(elapsed)).max(last);
        watcher.message(last, &envelope);
    }
    Ok(watcher.finish(last))
}
