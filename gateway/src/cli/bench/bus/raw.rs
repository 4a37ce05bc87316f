//! Raw Zenoh: what the node is measured against.

use super::super::service_node::configuration;
use super::{LAST, PATIENCE, Side, content, ended};
use crate::cli::exit::Failure;
use crate::config::bus::zenoh_config;
use bytes::Bytes;
use std::sync::mpsc;
use std::time::{Duration, Instant};
use zenoh::qos::CongestionControl;
use zenoh::{Session, Wait};

const LOAD: &str = "raw/bench/1/100/-/bench/Load";
const DONE: &str = "raw/bench/2/100/-/bench/Done";
const PING: &str = "raw/bench/1/100/-/bench/Ping";
const PONG: &str = "raw/bench/2/100/-/bench/Pong";
/// As many bytes as the header of the node's messages has here.
const ATTACHMENT: [u8; 34] = [7; 34];

type Publisher = zenoh::pubsub::Publisher<'static>;

fn failed(why: zenoh::Error) -> Failure {
    Failure::Failed(format!("raw Zenoh: {why}"))
}

fn open(bus: &str) -> Result<Session, Failure> {
    let config = zenoh_config(&configuration(1, bus)?.bus).map_err(|why| Failure::Failed(why.to_string()))?;
    zenoh::open(config).wait().map_err(failed)
}

fn publisher(session: &Session, key: &'static str) -> Result<Publisher, Failure> {
    session.declare_publisher(key).congestion_control(CongestionControl::Block).wait().map_err(failed)
}

fn put(publisher: &Publisher, content: Bytes) -> zenoh::Result<()> {
    publisher.put(content).attachment(ATTACHMENT.to_vec()).wait()
}

/// The sending side.
pub(super) struct Raw {
    /// Kept open: all that is declared ends with it.
    _session: Session,
    load: Publisher,
    ping: Publisher,
    done: mpsc::Receiver<u64>,
    pong: mpsc::Receiver<()>,
    _subscribers: [zenoh::pubsub::Subscriber<()>; 2],
}

impl Raw {
    pub(super) fn listen(locator: &str) -> Result<Self, Failure> {
        let session = open(&format!("listen = [\"{locator}\"]"))?;
        let (tell_done, done) = mpsc::channel();
        let (tell_pong, pong) = mpsc::channel();
        let on_done = move |sample: zenoh::sample::Sample| {
            let count = sample.payload().to_bytes().as_ref().try_into().map(u64::from_le_bytes);
            let _ = tell_done.send(count.unwrap_or_default());
        };
        let on_pong = move |_| {
            let _ = tell_pong.send(());
        };
        for key in [DONE, PONG] {
            session.declare_keyexpr(key).wait().map_err(failed)?;
        }
        let subscribers = [
            session.declare_subscriber(DONE).callback(on_done).wait().map_err(failed)?,
            session.declare_subscriber(PONG).callback(on_pong).wait().map_err(failed)?,
        ];
        let (load, ping) = (publisher(&session, LOAD)?, publisher(&session, PING)?);
        Ok(Self { _session: session, load, ping, done, pong, _subscribers: subscribers })
    }

    /// Sends pings until one is answered.
    pub(super) fn wait_for_peer(&mut self) -> Result<(), Failure> {
        let until = Instant::now() + PATIENCE;
        while Instant::now() < until {
            put(&self.ping, content(100, false)).map_err(failed)?;
            if self.pong.recv_timeout(Duration::from_millis(100)).is_ok() {
                while self.pong.recv_timeout(Duration::from_millis(100)).is_ok() {}
                return Ok(());
            }
        }
        Err(ended(()))
    }
}

impl Side for Raw {
    fn load(&mut self, size: usize, messages: u64) -> Result<(Duration, u64), Failure> {
        let (usual, last) = (content(size, false), content(size, true));
        let start = Instant::now();
        for _ in 1..messages {
            put(&self.load, usual.clone()).map_err(failed)?;
        }
        put(&self.load, last).map_err(failed)?;
        let seen = self.done.recv_timeout(PATIENCE).map_err(ended)?;
        Ok((start.elapsed(), seen))
    }

    fn round_trips(&mut self, size: usize, count: u64) -> Result<Vec<Duration>, Failure> {
        let content = content(size, false);
        let mut trips = Vec::new();
        for _ in 0..count {
            let start = Instant::now();
            put(&self.ping, content.clone()).map_err(failed)?;
            self.pong.recv_timeout(PATIENCE).map_err(ended)?;
            trips.push(start.elapsed());
        }
        Ok(trips)
    }
}

/// The far side: counts, and answers.
pub(super) fn serve(connect: &str) -> Result<(), Failure> {
    let session = open(&format!("connect = [\"{connect}\"]"))?;
    let (done, pong) = (publisher(&session, DONE)?, publisher(&session, PONG)?);
    for key in [LOAD, PING] {
        session.declare_keyexpr(key).wait().map_err(failed)?;
    }
    let mut seen = 0u64;
    let on_load = move |sample: zenoh::sample::Sample| {
        seen += 1;
        if sample.payload().to_bytes().first() == Some(&LAST) {
            let _ = put(&done, Bytes::copy_from_slice(&std::mem::take(&mut seen).to_le_bytes()));
        }
    };
    let on_ping = move |sample: zenoh::sample::Sample| {
        let _ = put(&pong, Bytes::from(sample.payload().to_bytes().into_owned()));
    };
    let on_load = std::sync::Mutex::new(on_load);
    let _load = session
        .declare_subscriber(LOAD)
        .callback(move |sample| (on_load.lock().unwrap_or_else(std::sync::PoisonError::into_inner))(sample))
        .wait()
        .map_err(failed)?;
    let _ping = session.declare_subscriber(PING).callback(on_ping).wait().map_err(failed)?;
    crate::cli::bench::serve_until_killed()
}
