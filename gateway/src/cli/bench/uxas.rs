//! `aldis bench uxas`: a UxAS stream through a node, against a plain TCP copy.

mod copy;

pub(super) use copy::TcpCopy;

use super::super::exit::Failure;
use super::super::print_line;
use super::child::{Process, free_port};
use super::configured::Configured;
use super::load::{Frames, Pair};
use super::rounds::{Figures, Rounds};
use super::statistics::{median, paired, rounded};
use serde_json::json;

/// From a UxAS stream through a node to a UxAS stream, against a plain TCP copy.
///
/// 255-byte AirVehicleState messages, four frames a write. The two take turns; figures are medians over the rounds.
#[derive(clap::Args)]
pub(super) struct UxasBench {
    /// Messages in each round.
    #[arg(long, default_value_t = 400_000)]
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

fn configured(entity: u64, bus: &str, port: u16) -> Result<Configured, Failure> {
    let bridge = format!("kind = \"uxas-tcp\"\nlisten = \"127.0.0.1:{port}\"");
    Configured::new(entity, bus, &bridge)
}

impl UxasBench {
    pub(super) fn run(self) -> Result<(), Failure> {
        let (copy_port, node_port) = (free_port()?, free_port()?);
        let _copy = Process::start(&["bench", "tcp-copy", &copy_port.to_string()])?;
        let alone = configured(400, "", node_port)?;
        let _node = alone.start()?;
        let frames = Frames::stream()?;
        let mut copy = Pair::connect(copy_port, copy_port, &frames)?;
        let mut node = Pair::connect(node_port, node_port, &frames)?;
        let rounds = Rounds { rounds: self.rounds, messages: self.messages, round_trips: self.round_trips };
        let [of_copy, of_node] = rounds.measure([&mut copy, &mut node], &frames)?;
        let relay = Self::relay(&rounds, &frames)?;
        let lost = of_copy.lost + of_node.lost + relay.lost;
        let result = json!({
            "messages_per_s": median(&of_node.rates).round(),
            "copy_messages_per_s": median(&of_copy.rates).round(),
            "ratio": rounded(paired(&of_node.rates, &of_copy.rates)),
            "lost": lost,
            "rtt_p50_us": rounded(median(&of_node.p50)),
            "rtt_p99_us": rounded(median(&of_node.p99)),
            "rtt_p50_ratio": rounded(paired(&of_node.p50, &of_copy.p50)),
            "relay_messages_per_s": median(&relay.rates).round(),
            "message_bytes": frames.content_bytes(), "rounds": self.rounds, "messages": self.messages,
        });
        print_line(if self.json { result.to_string() } else { format!("{result:#}") });
        if lost > 0 { Err(Failure::Failed(format!("{lost} messages were lost"))) } else { Ok(()) }
    }

    /// Two nodes with Zenoh between them.
    fn relay(rounds: &Rounds, frames: &Frames) -> Result<Figures, Failure> {
        let (near_port, far_port, bus_port) = (free_port()?, free_port()?, free_port()?);
        let far =
            configured(1, &format!("mode = \"router\"\nlisten = [\"tcp/127.0.0.1:{bus_port}\"]"), far_port)?;
        let near = configured(
            400,
            &format!("mode = \"client\"\nconnect = [\"tcp/127.0.0.1:{bus_port}\"]"),
            near_port,
        )?;
        let (_far, _near) = (far.start()?, near.start()?);
        let mut pair = Pair::connect(near_port, far_port, frames)?;
        let [figures] = rounds.measure([&mut pair], frames)?;
        Ok(figures)
    }
}
