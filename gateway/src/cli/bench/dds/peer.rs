//! The two peers of the measurement: one that calls and one that answers, each a process with a participant of its own.

use super::super::super::exit::Failure;
use super::super::load::failed;
use super::super::serve_until_killed;
use aldis_dds::{
    History, Incoming, Limits, Participant, ParticipantConfig, Qos, Reader, Representation, Sending, Topic,
    TypeSource, Writer,
};
use aldis_envelope::description::Library;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// The content of a sample: what its payload and key take.
pub(in super::super) const CONTENT_BYTES: usize = 200;
/// Instances that samples are of, turn about.
const INSTANCES: i32 = 10;
/// The key of the sample that ends a load, and of its answer.
const LAST: i32 = -1;
/// How long a sample, or the meeting of the peers, may take.
const PATIENCE: Duration = Duration::from_secs(30);
const KEY_AT: usize = 8;

/// A sample of `aldis::Bench` in XCDR2: a number as its key, and bytes; in the first of them a count.
fn sample(key: i32, count: u64) -> Vec<u8> {
    let payload = CONTENT_BYTES - 8;
    let mut bytes = vec![0, 9, 0, 0];
    bytes.extend((CONTENT_BYTES as u32).to_le_bytes());
    bytes.extend(key.to_le_bytes());
    bytes.extend((payload as u32).to_le_bytes());
    bytes.extend(count.to_le_bytes());
    bytes.resize(8 + CONTENT_BYTES, 0xa5);
    bytes
}

fn key_of(cdr: &[u8]) -> i32 {
    cdr.get(KEY_AT..KEY_AT + 4).and_then(|key| key.try_into().ok()).map_or(0, i32::from_le_bytes)
}

fn count_of(cdr: &[u8]) -> u64 {
    cdr.get(KEY_AT + 8..KEY_AT + 16).and_then(|count| count.try_into().ok()).map_or(0, u64::from_le_bytes)
}

fn qos() -> Qos {
    Qos {
        reliable: true,
        history: History::KeepAll,
        durability_service: (History::KeepLast(1), Limits::default()),
        representations: vec![Representation::Xcdr2],
        autodispose: false,
        ..Qos::default()
    }
}

fn open(domain: u32) -> Result<(Participant, Arc<Library>), Failure> {
    let participant = Participant::open(&ParticipantConfig::loopback(domain)).map_err(failed("DDS"))?;
    Ok((participant, crate::config::bench_types()))
}

fn topic(participant: &Participant, library: &Library, name: &str) -> Result<Topic, Failure> {
    let type_name = crate::config::BENCH_TYPE;
    let source = TypeSource::Described { library, type_name, extensibility: None, told: true };
    Topic::new(participant, name, source).map_err(failed("a topic"))
}

/// Writes, waiting for confirmations where it must.
fn write(writer: &Writer, cdr: &[u8]) -> Result<(), Failure> {
    let started = Instant::now();
    while !writer.write(Sending::Sample, cdr, now()).map_err(failed("a sample"))? {
        writer.wait_for_acknowledgments(Duration::from_millis(20)).map_err(failed("confirmations"))?;
        if started.elapsed() > PATIENCE {
            return Err(Failure::Failed("readers confirm nothing".into()));
        }
    }
    Ok(())
}

/// The wall clock in nanoseconds, which source timestamps are.
fn now() -> i64 {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
}

/// The answering peer: each sample comes back, and the last of a load is answered with how many there were.
#[derive(clap::Args)]
pub(in super::super) struct DdsPeer {
    domain: u32,
    name: String,
}

impl DdsPeer {
    pub(in super::super) fn run(self) -> Result<(), Failure> {
        let (participant, library) = open(self.domain)?;
        let answer = topic(&participant, &library, &format!("{}Answer", self.name))?;
        let answer = Arc::new(Writer::new(&answer, &qos(), Box::new(|_| ())).map_err(failed("a writer"))?);
        let call = topic(&participant, &library, &format!("{}Call", self.name))?;
        let load = topic(&participant, &library, &format!("{}Load", self.name))?;
        let echo = answer.clone();
        let echoes = move |incoming: Incoming| {
            if let Incoming::Change(change) = incoming
                && change.is_sample
            {
                // What fails here is missed there.
                let _ = echo.write(Sending::Sample, &change.cdr, change.source_timestamp);
            }
            true
        };
        let seen = Mutex::new(0u64);
        let counts = move |incoming: Incoming| {
            if let Incoming::Change(change) = incoming
                && let Ok(mut seen) = seen.lock()
            {
                if key_of(&change.cdr) == LAST {
                    let _ = answer.write(Sending::Sample, &sample(LAST, *seen), change.source_timestamp);
                    *seen = 0;
                } else {
                    *seen += u64::from(change.is_sample);
                }
            }
            true
        };
        let _call =
            Reader::new(&call, &qos(), Box::new(echoes), Box::new(|_| ())).map_err(failed("a reader"))?;
        let _load =
            Reader::new(&load, &qos(), Box::new(counts), Box::new(|_| ())).map_err(failed("a reader"))?;
        serve_until_killed()
    }
}

/// The calling peer.
pub(super) struct Caller {
    call: Writer,
    load: Writer,
    _answers: Reader,
    answered: Receiver<(i32, u64)>,
}

impl Caller {
    /// Meets the answering peer of this name.
    pub(super) fn new(domain: u32, name: &str) -> Result<Self, Failure> {
        let (participant, library) = open(domain)?;
        let (tell, answered) = channel();
        let hears = move |incoming: Incoming| {
            if let Incoming::Change(change) = incoming
                && change.is_sample
            {
                // The measurement no longer listens where it has failed.
                let _ = tell.send((key_of(&change.cdr), count_of(&change.cdr)));
            }
            true
        };
        let answer = topic(&participant, &library, &format!("{name}Answer"))?;
        let answers =
            Reader::new(&answer, &qos(), Box::new(hears), Box::new(|_| ())).map_err(failed("a reader"))?;
        let writer = |what: &str| {
            let topic = topic(&participant, &library, &format!("{name}{what}"))?;
            Writer::new(&topic, &qos(), Box::new(|_| ())).map_err(failed("a writer"))
        };
        let mut caller = Self { call: writer("Call")?, load: writer("Load")?, _answers: answers, answered };
        caller.meet(name)?;
        Ok(caller)
    }

    /// Calls until both ways are there.
    fn meet(&mut self, name: &str) -> Result<(), Failure> {
        let started = Instant::now();
        for (loads, writer) in [(false, &self.call), (true, &self.load)] {
            loop {
                write(writer, &sample(if loads { LAST } else { 0 }, 0))?;
                if self.answered.recv_timeout(Duration::from_millis(100)).is_ok() {
                    break;
                }
                if started.elapsed() > PATIENCE {
                    return Err(Failure::Failed(format!(
                        "the peer `{name}` does not answer within {PATIENCE:?}"
                    )));
                }
            }
            while self.answered.recv_timeout(Duration::from_millis(300)).is_ok() {}
        }
        Ok(())
    }

    pub(super) fn round_trips(&mut self, count: u64) -> Result<Vec<Duration>, Failure> {
        let mut trips = Vec::new();
        for number in 0..count {
            let started = Instant::now();
            write(&self.call, &sample(number as i32 % INSTANCES, number))?;
            let answer = self.answered.recv_timeout(PATIENCE).map_err(failed("no answer"))?;
            if answer.1 != number {
                return Err(Failure::Failed(format!("answer {} to call {number}", answer.1)));
            }
            trips.push(started.elapsed());
        }
        Ok(trips)
    }

    /// Sends so many samples as fast as they go: how long until the peer has the last, and how many it saw.
    pub(super) fn load(&mut self, messages: u64) -> Result<(Duration, u64), Failure> {
        let mut bytes: Vec<Vec<u8>> = (0..INSTANCES).map(|key| sample(key, 0)).collect();
        let started = Instant::now();
        for number in 0..messages {
            write(&self.load, &bytes[number as usize % INSTANCES as usize])?;
        }
        bytes.clear();
        write(&self.load, &sample(LAST, 0))?;
        let (_, seen) =
            self.answered.recv_timeout(PATIENCE).map_err(failed("the last sample is not answered"))?;
        Ok((started.elapsed(), seen))
    }
}
