//! `aldis bench uxas`: a UxAS stream through a node, against a plain TCP copy.

mod copy;
mod load;

pub(super) use copy::TcpCopy;

use super::super::exit::Failure;
use super::super::print_line;
use super::child::{Process, free_port};
use super::statistics::{median, paired, percentile, rounded};
use load::{Frames, Pair};
use serde_json::json;
use std::path::PathBuf;

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

/// A configuration file that goes with the measurement.
struct Configured(PathBuf);

impl Configured {
    fn new(entity: u64, bus: &str, port: u16) -> Result<Self, Failure> {
        let text = format!(
            "name = \"bench-{entity}\"\nfleet = \"bench\"\nentities = [{entity}]\n[bus]\n{bus}\n[log]\nlevel = \"warn\"\n\
             [[bridge]]\nkind = \"uxas-tcp\"\nname = \"uxas\"\nservice = 20\nlisten = \"127.0.0.1:{port}\"\n"
        );
        let path =
            std::env::temp_dir().join(format!("aldis-bench-{}-{entity}-{port}.toml", std::process::id()));
        std::fs::write(&path, text)
            .map_err(|why| Failure::Failed(format!("cannot write {}: {why}", path.display())))?;
        Ok(Self(path))
    }

    fn start(&self) -> Result<Process, Failure> {
        Process::start(&["run", &self.0.display().to_string()])
    }
}

impl Drop for Configured {
    fn drop(&mut self) {
        // What is left behind in the directory for temporary files does no harm.
        let _ = std::fs::remove_file(&self.0);
    }
}

#[derive(Default)]
struct Figures {
    rates: Vec<f64>,
    p50: Vec<f64>,
    p99: Vec<f64>,
    lost: u64,
}

impl UxasBench {
    pub(super) fn run(self) -> Result<(), Failure> {
        let (copy_port, node_port) = (free_port()?, free_port()?);
        let _copy = Process::start(&["bench", "tcp-copy", &copy_port.to_string()])?;
        let alone = Configured::new(400, "", node_port)?;
        let _node = alone.start()?;
        let frames = Frames::new()?;
        let mut copy = Pair::connect(copy_port, copy_port, &frames)?;
        let mut node = Pair::connect(node_port, node_port, &frames)?;
        let [of_copy, of_node] = self.measure([&mut copy, &mut node], &frames)?;
        let relay = self.relay(&frames)?;
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

    fn measure(&self, mut sides: [&mut Pair; 2], frames: &Frames) -> Result<[Figures; 2], Failure> {
        let mut figures = [Figures::default(), Figures::default()];
        for round in 0..=self.rounds {
            for (side, figures) in sides.iter_mut().zip(&mut figures) {
                self.round(side, frames, round > 0, figures)?;
            }
        }
        Ok(figures)
    }

    fn round(
        &self,
        side: &mut Pair,
        frames: &Frames,
        counts: bool,
        figures: &mut Figures,
    ) -> Result<(), Failure> {
        // The first round warms up and does not count.
        let (messages, trips) = if counts {
            (self.messages, self.round_trips)
        } else {
            (self.messages / 10, self.round_trips / 10)
        };
        let (took, seen) = side.load(frames, messages)?;
        let mut trips = side.round_trips(frames, trips)?;
        figures.lost += messages.saturating_sub(seen);
        if counts {
            figures.rates.push(messages as f64 / took.as_secs_f64());
            figures.p50.push(percentile(&mut trips, 0.50).as_secs_f64() * 1e6);
            figures.p99.push(percentile(&mut trips, 0.99).as_secs_f64() * 1e6);
        }
        Ok(())
    }

    /// Two nodes with Zenoh between them.
    fn relay(&self, frames: &Frames) -> Result<Figures, Failure> {
        let (near_port, far_port, bus_port) = (free_port()?, free_port()?, free_port()?);
        let far = Configured::new(
            1,
            &format!("mode = \"router\"\nlisten = [\"tcp/127.0.0.1:{bus_port}\"]"),
            far_port,
        )?;
        let near = Configured::new(
            400,
            &format!("mode = \"client\"\nconnect = [\"tcp/127.0.0.1:{bus_port}\"]"),
            near_port,
        )?;
        let (_far, _near) = (far.start()?, near.start()?);
        let mut pair = Pair::connect(near_port, far_port, frames)?;
        let mut figures = Figures::default();
        for round in 0..=self.rounds {
            self.round(&mut pair, frames, round > 0, &mut figures)?;
        }
        Ok(figures)
    }
}
