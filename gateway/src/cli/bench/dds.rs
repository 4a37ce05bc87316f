//! `aldis bench dds`: DDS through two gateways and the fleet's bus, against DDS alone.

mod peer;

pub(super) use peer::DdsPeer;

use super::super::exit::Failure;
use super::super::print_line;
use super::child::{Process, free_port};
use super::load::failed;
use super::rounds::Figures;
use super::statistics::{median, paired, percentile, rounded};
use aldis_dds::ParticipantConfig;
use peer::Caller;
use serde_json::json;
use std::path::PathBuf;

/// DDS, gateway, Zenoh, gateway, DDS: 200-byte keyed samples, reliable, against two processes on one domain.
///
/// The two take turns; figures are medians over the rounds.
#[derive(clap::Args)]
pub(super) struct DdsBench {
    /// Messages in each round.
    #[arg(long, default_value_t = 100_000)]
    messages: u64,
    /// Round trips in each round.
    #[arg(long, default_value_t = 5_000)]
    round_trips: u64,
    /// Rounds.
    #[arg(long, default_value_t = 5)]
    rounds: u32,
    /// The first of two domains that nobody else uses.
    #[arg(long, default_value_t = 160)]
    domain: u32,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

/// What a gateway is configured by. It goes with the measurement.
struct Files(Vec<PathBuf>);

impl Files {
    fn write(&mut self, name: &str, text: &str) -> Result<String, Failure> {
        let path = std::env::temp_dir().join(format!("aldis-bench-dds-{}-{name}", std::process::id()));
        std::fs::write(&path, text).map_err(failed("a configuration"))?;
        let shown = path.display().to_string();
        self.0.push(path);
        Ok(shown)
    }

    /// Starts a gateway with its domain.
    fn gateway(&mut self, entity: u32, domain: u32, bus: &str, cyclonedds: &str) -> Result<Process, Failure> {
        let text = format!(
            "name = \"bench-{entity}\"\nfleet = \"bench-dds\"\nentities = [{entity}]\n[bus]\n{bus}\n[log]\nlevel = \"warn\"\n\
             [[bridge]]\nkind = \"dds\"\nname = \"dds\"\nservice = 20\ndomain = {domain}\nallow = [\"bridged*\"]\n\
             cyclonedds = {cyclonedds:?}\n"
        );
        let path = self.write(&format!("{entity}.toml"), &text)?;
        Process::start(&["run", &path])
    }
}

impl Drop for Files {
    fn drop(&mut self) {
        for path in &self.0 {
            // What is left behind in the directory for temporary files does no harm.
            let _ = std::fs::remove_file(path);
        }
    }
}

impl DdsBench {
    pub(super) fn run(self) -> Result<(), Failure> {
        let (near, far) = (self.domain, self.domain + 1);
        let mut files = Files(Vec::new());
        let xml = ParticipantConfig::loopback(near).xml.unwrap_or_default();
        let cyclonedds = files.write("cyclonedds.xml", &xml)?;
        let port = free_port()?;
        let listen = format!("listen = [\"tcp/127.0.0.1:{port}\"]");
        let connect = format!("mode = \"client\"\nconnect = [\"tcp/127.0.0.1:{port}\"]");
        let router = format!("mode = \"router\"\n{listen}");
        let _near_gateway = files.gateway(400, near, &router, &cyclonedds)?;
        let _far_gateway = files.gateway(500, far, &connect, &cyclonedds)?;
        let start = |domain: u32, name| Process::start(&["bench", "dds-peer", &domain.to_string(), name]);
        let (_alone, _bridged) = (start(near, "alone")?, start(far, "bridged")?);
        let mut sides = [Caller::new(near, "alone")?, Caller::new(near, "bridged")?];
        let mut figures = [Figures::default(), Figures::default()];
        for round in 0..=self.rounds {
            for (side, figures) in sides.iter_mut().zip(&mut figures) {
                self.round(side, figures, round > 0)?;
            }
        }
        let [alone, bridged] = &figures;
        let result = json!({
            "rtt_p50_ratio": rounded(paired(&bridged.p50, &alone.p50)),
            "rtt_p99_ratio": rounded(paired(&bridged.p99, &alone.p99)),
            "throughput_ratio": rounded(paired(&bridged.rates, &alone.rates)),
            "lost": alone.lost + bridged.lost,
            "alone": { "messages_per_s": median(&alone.rates).round(), "rtt_p50_us": rounded(median(&alone.p50)),
                       "rtt_p99_us": rounded(median(&alone.p99)) },
            "bridged": { "messages_per_s": median(&bridged.rates).round(), "rtt_p50_us": rounded(median(&bridged.p50)),
                         "rtt_p99_us": rounded(median(&bridged.p99)) },
            "sample_bytes": peer::CONTENT_BYTES, "rounds": self.rounds, "messages": self.messages,
            "round_trips": self.round_trips,
        });
        print_line(if self.json { result.to_string() } else { format!("{result:#}") });
        match alone.lost + bridged.lost {
            0 => Ok(()),
            lost => Err(Failure::Failed(format!("{lost} samples were lost"))),
        }
    }

    fn round(&self, side: &mut Caller, figures: &mut Figures, counts: bool) -> Result<(), Failure> {
        // The first round warms up and does not count.
        let part = if counts { 1 } else { 10 };
        let mut trips = side.round_trips(self.round_trips / part)?;
        let messages = self.messages / part;
        let (took, seen) = side.load(messages)?;
        figures.lost += messages.saturating_sub(seen);
        if counts {
            figures.rates.push(messages as f64 / took.as_secs_f64());
            figures.p50.push(percentile(&mut trips, 0.50).as_secs_f64() * 1e6);
            figures.p99.push(percentile(&mut trips, 0.99).as_secs_f64() * 1e6);
        }
        Ok(())
    }
}
