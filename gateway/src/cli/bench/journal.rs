//! `aldis bench journal`: records on disk a second, beside plain writes and syncs of the same bytes; restarts.

mod peer;

pub(super) use peer::{JournalPeer, resident_kib};

use super::super::exit::Failure;
use super::super::print_line;
use super::statistics::{median, paired, percentile, rounded};
use crate::journal::{JournalThread, seed};
use aldis_services::journal::{Batch, JournalConfig, JournalEvent};
use serde_json::{Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Records on disk a second, against plain writes and syncs of the same bytes in as many pieces; restarts with many records.
///
/// The two take turns; figures are medians over the rounds.
#[derive(clap::Args)]
pub(super) struct JournalBench {
    /// Records in each round.
    #[arg(long, default_value_t = 200_000)]
    records: u32,
    /// Bytes of a record's value.
    #[arg(long, default_value_t = 200)]
    bytes: usize,
    /// Records that may wait for their acknowledgement.
    #[arg(long, default_value_t = 4_000)]
    window: u64,
    /// Rounds.
    #[arg(long, default_value_t = 5)]
    rounds: u32,
    /// Restarts with so many records.
    #[arg(long, value_delimiter = ',', default_values_t = [100_000, 1_000_000])]
    restart: Vec<u32>,
    /// Where to write. Default: the directory for temporary files.
    #[arg(long)]
    directory: Option<PathBuf>,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

/// A directory that goes with the measurement.
pub(super) struct Scratch(pub(super) PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        // What is left behind in the directory for temporary files does no harm.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

pub(super) fn failed(why: impl std::fmt::Display) -> Failure {
    Failure::Failed(why.to_string())
}

/// A journal that is told of by a channel.
pub(super) struct Told {
    pub(super) thread: JournalThread,
    pub(super) events: Receiver<JournalEvent>,
}

impl Told {
    /// Opens a journal and gives each record that stands to `record`.
    pub(super) fn open(directory: &Path, record: &mut dyn FnMut(&[u8], &[u8])) -> Result<Self, Failure> {
        let (tell, events) = channel();
        let config = JournalConfig { limit_bytes: 8 << 30, ..JournalConfig::new(seed()) };
        let thread = JournalThread::start(directory, config, move |told: &mut Vec<JournalEvent>| {
            // Nobody listens any more where the measurement has ended.
            told.drain(..).for_each(|event| tell.send(event).unwrap_or_default());
        });
        let told = Self { thread: thread.map_err(failed)?, events };
        loop {
            match told.events.recv().map_err(failed)? {
                JournalEvent::Recovered { key, value, .. } => record(&key, &value),
                JournalEvent::RecoveredAll(_) => return Ok(told),
                JournalEvent::Unusable(why) => return Err(failed(why)),
                _ => {}
            }
        }
    }

    /// The number up to which all is on disk.
    pub(super) fn written(&self) -> Result<u64, Failure> {
        match self.events.recv().map_err(failed)? {
            JournalEvent::Written { up_to } => Ok(up_to),
            JournalEvent::Refused { reason, .. } => Err(failed(reason)),
            other => Err(Failure::Failed(format!("unexpected: {other:?}"))),
        }
    }
}

/// One record.
pub(super) fn record(key: u32, bytes: usize) -> Batch {
    let mut batch = Batch::new();
    batch.put(1, key.to_be_bytes().to_vec(), vec![key as u8; bytes]);
    batch
}

/// What a round took, in how many groups.
struct Round {
    took: Duration,
    groups: u64,
}

impl JournalBench {
    pub(super) fn run(self) -> Result<(), Failure> {
        let base = self.directory.clone().unwrap_or_else(std::env::temp_dir);
        let scratch = Scratch(base.join(format!("aldis-bench-journal-{}", std::process::id())));
        let (mut rates, mut plain, mut groups) = (Vec::new(), Vec::new(), Vec::new());
        for round in 0..=self.rounds {
            let of_journal = self.journal(&scratch.0.join(format!("round-{round}")))?;
            let of_plain = self.plain(&scratch.0.join(format!("plain-{round}")), of_journal.groups)?;
            // The first round warms up and does not count.
            if round > 0 {
                rates.push(f64::from(self.records) / of_journal.took.as_secs_f64());
                plain.push(f64::from(self.records) / of_plain.as_secs_f64());
                groups.push(of_journal.groups as f64);
            }
        }
        let [alone, synced] = self.one_by_one(&scratch.0)?;
        let restarts: Result<Vec<Value>, Failure> =
            self.restart.iter().map(|&records| self.restart(&scratch.0, records)).collect();
        let result = json!({
            "records_per_s": median(&rates).round(), "plain_records_per_s": median(&plain).round(),
            "ratio": rounded(paired(&rates, &plain)), "groups": median(&groups),
            "one_p50_us": rounded(alone * 1e6), "plain_one_p50_us": rounded(synced * 1e6),
            "one_p50_ratio": rounded(alone / synced),
            "restarts": restarts?,
            "record_bytes": self.bytes, "records": self.records, "window": self.window, "rounds": self.rounds,
        });
        print_line(if self.json { result.to_string() } else { format!("{result:#}") });
        Ok(())
    }

    fn journal(&self, directory: &Path) -> Result<Round, Failure> {
        let mut told = Told::open(directory, &mut |_, _| {})?;
        let begin = Instant::now();
        let (mut written, mut groups) = (0, 0);
        for key in 0..self.records {
            let number = told.thread.append(record(key, self.bytes)).map_err(failed)?;
            while number - written >= self.window {
                written = told.written()?;
                groups += 1;
            }
        }
        while written < u64::from(self.records) {
            written = told.written()?;
            groups += 1;
        }
        Ok(Round { took: begin.elapsed(), groups })
    }

    /// The same bytes by plain writes and syncs, in as many pieces.
    fn plain(&self, path: &Path, groups: u64) -> Result<Duration, Failure> {
        let piece = vec![1_u8; (self.bytes * self.records as usize).div_ceil(groups.max(1) as usize)];
        let mut file = std::fs::File::create(path).map_err(failed)?;
        let begin = Instant::now();
        for _ in 0..groups {
            file.write_all(&piece).and_then(|()| file.sync_data()).map_err(failed)?;
        }
        Ok(begin.elapsed())
    }

    /// How long one record takes alone, and a plain write and sync, in seconds.
    fn one_by_one(&self, directory: &Path) -> Result<[f64; 2], Failure> {
        let mut told = Told::open(&directory.join("one"), &mut |_, _| {})?;
        let mut file = std::fs::File::create(directory.join("plain-one")).map_err(failed)?;
        let bytes = vec![1_u8; self.bytes];
        let (mut alone, mut synced) = (Vec::new(), Vec::new());
        for key in 0..1_000 {
            let begin = Instant::now();
            let number = told.thread.append(record(key, self.bytes)).map_err(failed)?;
            while told.written()? < number {}
            alone.push(begin.elapsed());
            let begin = Instant::now();
            file.write_all(&bytes).and_then(|()| file.sync_data()).map_err(failed)?;
            synced.push(begin.elapsed());
        }
        Ok([alone, synced].map(|mut samples| percentile(&mut samples, 0.5).as_secs_f64()))
    }

    /// Fills a journal and has another process open it.
    fn restart(&self, directory: &Path, records: u32) -> Result<Value, Failure> {
        let directory = directory.join(format!("restart-{records}"));
        let mut told = Told::open(&directory, &mut |_, _| {})?;
        let mut written = 0;
        for key in 0..records {
            let number = told.thread.append(record(key, self.bytes)).map_err(failed)?;
            while number - written >= self.window {
                written = told.written()?;
            }
        }
        drop(told);
        peer::opened_by_another(&directory)
    }
}
