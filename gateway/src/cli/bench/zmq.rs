//! `aldis bench zmq`: ZeroMQ through a node, against a bare forwarder.

mod copy;
mod socket;

pub(super) use copy::ZmqCopy;

use super::super::exit::Failure;
use super::super::print_line;
use super::child::{Process, free_port};
use super::configured::Configured;
use super::load::{Frames, Pair, connect};
use super::rounds::{Figures, Rounds};
use super::statistics::{median, paired, rounded};
use aldis_envelope::codec::zmtp::{Framing, SocketType};
use serde_json::{Value, json};
use socket::opened;
use std::path::PathBuf;

/// What libzmq's own forwarder is in Python: without a limit, because at its limit a PUB socket loses messages.
const PROXY: &str = "import sys, zmq
context = zmq.Context()
pull, pub = context.socket(zmq.PULL), context.socket(zmq.PUB)
pull.setsockopt(zmq.RCVHWM, 0)
pub.setsockopt(zmq.SNDHWM, 0)
pull.bind('tcp://127.0.0.1:' + sys.argv[1])
pub.bind('tcp://127.0.0.1:' + sys.argv[2])
zmq.proxy(pull, pub)
";

/// ZeroMQ through a node: what a PUSH socket sends comes to a SUB socket, against a bare forwarder of ZeroMQ.
///
/// 255-byte AirVehicleState messages, four a write. The sides take turns; figures are medians over the rounds.
#[derive(clap::Args)]
pub(super) struct ZmqBench {
    /// Messages in each round.
    #[arg(long, default_value_t = 400_000)]
    messages: u64,
    /// Round trips in each round.
    #[arg(long, default_value_t = 10_000)]
    round_trips: u64,
    /// Rounds.
    #[arg(long, default_value_t = 5)]
    rounds: u32,
    /// Seven frames a message in place of one.
    #[arg(long)]
    multipart: bool,
    /// A Python interpreter with pyzmq: libzmq's own forwarder is measured too.
    #[arg(long, value_name = "PYTHON")]
    libzmq: Option<PathBuf>,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

/// A side of the measurement: a process that pulls and publishes.
struct Side {
    _process: Process,
    _config: Option<Configured>,
    pair: Pair,
}

impl Side {
    fn join(
        process: Process,
        config: Option<Configured>,
        ports: [u16; 2],
        frames: &Frames,
    ) -> Result<Self, Failure> {
        let [pull, publish] = ports;
        let receiving = opened(connect(publish)?, SocketType::Sub)?;
        let sending = opened(connect(pull)?, SocketType::Push)?;
        Ok(Self { _process: process, _config: config, pair: Pair::over(sending, receiving, frames)? })
    }
}

impl ZmqBench {
    pub(super) fn run(self) -> Result<(), Failure> {
        let framing = if self.multipart { Framing::Multipart } else { Framing::Single };
        let frames = Frames::zeromq(framing)?;
        let rounds = Rounds { rounds: self.rounds, messages: self.messages, round_trips: self.round_trips };
        let (mut node, mut copy) = (self.node(&frames)?, Self::copy(&frames)?);
        let (of_node, of_copy, of_libzmq) = match self.libzmq(&frames)? {
            None => {
                let [copy, node] = rounds.measure([&mut copy.pair, &mut node.pair], &frames)?;
                (node, copy, None)
            }
            Some(mut libzmq) => {
                let sides = [&mut copy.pair, &mut node.pair, &mut libzmq.pair];
                let [copy, node, libzmq] = rounds.measure(sides, &frames)?;
                (node, copy, Some(libzmq))
            }
        };
        let mut result = json!({
            "messages_per_s": median(&of_node.rates).round(),
            "rtt_p50_us": rounded(median(&of_node.p50)),
            "rtt_p99_us": rounded(median(&of_node.p99)),
            "lost": of_node.lost,
            "framing": if self.multipart { "multipart" } else { "single" },
            "message_bytes": frames.content_bytes(), "rounds": self.rounds, "messages": self.messages,
        });
        compare(&mut result, "copy", &of_node, &of_copy);
        if let Some(of_libzmq) = &of_libzmq {
            compare(&mut result, "libzmq", &of_node, of_libzmq);
        }
        print_line(if self.json { result.to_string() } else { format!("{result:#}") });
        match of_node.lost {
            0 => Ok(()),
            lost => Err(Failure::Failed(format!("{lost} messages were lost"))),
        }
    }

    fn node(&self, frames: &Frames) -> Result<Side, Failure> {
        let [pull, publish] = [free_port()?, free_port()?];
        let framing = if self.multipart { "multipart" } else { "single" };
        let bridge = format!(
            "kind = \"uxas-zmq\"\nframing = \"{framing}\"\npull = \"127.0.0.1:{pull}\"\n\
             publish = \"127.0.0.1:{publish}\""
        );
        let config = Configured::new(400, "", &bridge)?;
        Side::join(config.start()?, Some(config), [pull, publish], frames)
    }

    fn copy(frames: &Frames) -> Result<Side, Failure> {
        let ports = [free_port()?, free_port()?];
        let [pull, publish] = ports.map(|port| port.to_string());
        Side::join(Process::start(&["bench", "zmq-copy", &pull, &publish])?, None, ports, frames)
    }

    fn libzmq(&self, frames: &Frames) -> Result<Option<Side>, Failure> {
        let Some(python) = &self.libzmq else { return Ok(None) };
        let ports = [free_port()?, free_port()?];
        let [pull, publish] = ports.map(|port| port.to_string());
        let process = Process::start_other(python, &["-c", PROXY, &pull, &publish])?;
        Side::join(process, None, ports, frames).map(Some)
    }
}

/// Adds what a forwarder did, and how the node compares.
fn compare(result: &mut Value, name: &str, of_node: &Figures, of_other: &Figures) {
    result[format!("{name}_messages_per_s")] = json!(median(&of_other.rates).round());
    result[format!("{name}_rtt_p50_us")] = json!(rounded(median(&of_other.p50)));
    result[format!("{name}_lost")] = json!(of_other.lost);
    let ratio = rounded(paired(&of_node.rates, &of_other.rates));
    let trips = rounded(paired(&of_node.p50, &of_other.p50));
    // The bare forwarder is what the plain names mean, as in the other measurements.
    let prefix = if name == "copy" { String::new() } else { format!("{name}_") };
    result[format!("{prefix}ratio")] = json!(ratio);
    result[format!("{prefix}rtt_p50_ratio")] = json!(trips);
}
