//! `aldis bench bus`: what the node costs on top of Zenoh.

mod node;
mod raw;

use super::super::exit::Failure;
use super::super::print_line;
use super::child::{Process, free_port};
use super::statistics::{median, paired, percentile, rounded};
use serde_json::json;
use std::time::Duration;

/// The first byte of the last message of a load.
const LAST: u8 = 1;

/// From a service of one node to a service of another process, against raw Zenoh.
///
/// Raw is a declared publisher and a subscriber that has declared the key, with the same payload, the same size of
/// attachment and the same congestion control (Block). The two take turns; figures are medians over the rounds.
#[derive(clap::Args)]
pub(super) struct BusBench {
    /// Messages in each round.
    #[arg(long, default_value_t = 1_000_000)]
    messages: u64,
    /// Round trips in each round.
    #[arg(long, default_value_t = 10_000)]
    round_trips: u64,
    /// Rounds.
    #[arg(long, default_value_t = 5)]
    rounds: u32,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

/// The other process of `bench bus`.
#[derive(clap::Args)]
pub(super) struct BusPeer {
    #[arg(long)]
    connect: String,
    #[arg(long)]
    raw: bool,
}

/// One side of a measurement: raw Zenoh or the node.
trait Side {
    /// Sends messages of a size as fast as they go: how long until the far side has seen the last, and how many it saw.
    fn load(&mut self, size: usize, messages: u64) -> Result<(Duration, u64), Failure>;
    /// Sends one message after the other, each when the answer to the former came.
    fn round_trips(&mut self, size: usize, count: u64) -> Result<Vec<Duration>, Failure>;
}

/// The figures of one side.
#[derive(Default)]
struct Figures {
    rates: Vec<f64>,
    p50: Vec<f64>,
    p99: Vec<f64>,
    lost: u64,
}

impl BusBench {
    pub(super) fn run(self) -> Result<(), Failure> {
        let (raw_port, node_port) = (free_port()?, free_port()?);
        let locator = |port: u16| format!("tcp/127.0.0.1:{port}");
        let mut raw = raw::Raw::listen(&locator(raw_port))?;
        let _raw_peer = Process::start(&["bench", "bus-peer", "--raw", "--connect", &locator(raw_port)])?;
        raw.wait_for_peer()?;
        let mut node = node::Sender::listen(&locator(node_port))?;
        let _node_peer = Process::start(&["bench", "bus-peer", "--connect", &locator(node_port)])?;
        node.wait_for_peer()?;
        let mut ratios = serde_json::Map::new();
        let (mut details, mut lost) = (serde_json::Map::new(), 0);
        for size in [100, 1024] {
            let [of_raw, of_node] = self.loads([&mut raw, &mut node], size)?;
            let ratio = paired(&of_node.rates, &of_raw.rates);
            lost += of_raw.lost + of_node.lost;
            ratios.insert(size.to_string(), rounded(ratio).into());
            let rates = json!({ "raw_per_s": median(&of_raw.rates).round(), "node_per_s": median(&of_node.rates).round() });
            details.insert(size.to_string(), rates);
        }
        let [of_raw, of_node] = self.trips([&mut raw, &mut node])?;
        let result = json!({
            "throughput_ratio": ratios,
            "throughput": details,
            "lost": lost,
            "rtt_p99_ratio": rounded(paired(&of_node.p99, &of_raw.p99)),
            "rtt_p50_ratio": rounded(paired(&of_node.p50, &of_raw.p50)),
            "rtt_us": { "raw_p50": median(&of_raw.p50), "raw_p99": median(&of_raw.p99),
                        "node_p50": median(&of_node.p50), "node_p99": median(&of_node.p99) },
            "rounds": self.rounds, "messages": self.messages, "round_trips": self.round_trips,
        });
        node.leave()?;
        print_line(if self.json { result.to_string() } else { format!("{result:#}") });
        if lost > 0 { Err(Failure::Failed(format!("{lost} messages were lost"))) } else { Ok(()) }
    }

    fn loads(&self, mut sides: [&mut dyn Side; 2], size: usize) -> Result<[Figures; 2], Failure> {
        let mut figures = [Figures::default(), Figures::default()];
        for round in 0..=self.rounds {
            for (side, figures) in sides.iter_mut().zip(&mut figures) {
                // The first round warms up and does not count.
                let messages = if round == 0 { self.messages / 10 } else { self.messages };
                let (took, seen) = side.load(size, messages)?;
                figures.lost += messages - seen;
                if round > 0 {
                    figures.rates.push(messages as f64 / took.as_secs_f64());
                }
            }
        }
        Ok(figures)
    }

    fn trips(&self, mut sides: [&mut dyn Side; 2]) -> Result<[Figures; 2], Failure> {
        let mut figures = [Figures::default(), Figures::default()];
        for round in 0..=self.rounds {
            for (side, figures) in sides.iter_mut().zip(&mut figures) {
                let mut trips = side.round_trips(100, self.round_trips)?;
                if round > 0 {
                    figures.p50.push(percentile(&mut trips, 0.50).as_secs_f64() * 1e6);
                    figures.p99.push(percentile(&mut trips, 0.99).as_secs_f64() * 1e6);
                }
            }
        }
        Ok(figures)
    }
}

impl BusPeer {
    pub(super) fn run(self) -> Result<(), Failure> {
        if self.raw { raw::serve(&self.connect) } else { node::serve(&self.connect) }
    }
}

/// Round trips of raw Zenoh to another process, for other measurements to stand beside.
pub(super) struct RawTrips {
    raw: raw::Raw,
    _peer: Process,
}

impl RawTrips {
    /// Starts the other process.
    pub(super) fn start() -> Result<Self, Failure> {
        let locator = format!("tcp/127.0.0.1:{}", free_port()?);
        let mut raw = raw::Raw::listen(&locator)?;
        let peer = Process::start(&["bench", "bus-peer", "--raw", "--connect", &locator])?;
        raw.wait_for_peer()?;
        Ok(Self { raw, _peer: peer })
    }

    /// Sends one message after the other, each when the answer to the former came.
    pub(super) fn round_trips(&mut self, size: usize, count: u64) -> Result<Vec<Duration>, Failure> {
        self.raw.round_trips(size, count)
    }
}

/// The content of a message of a load.
fn content(size: usize, last: bool) -> bytes::Bytes {
    let mut content = vec![0; size];
    content[0] = if last { LAST } else { 0 };
    content.into()
}

fn ended<E>(_: E) -> Failure {
    Failure::Failed("the other process does not answer within 60 s".into())
}

/// How long a measurement may take.
const PATIENCE: Duration = Duration::from_secs(60);
