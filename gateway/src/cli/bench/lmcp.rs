//! `aldis bench lmcp`: LMCP messages read and written on one core.

mod messages;

use super::super::content::read_file;
use super::super::exit::Failure;
use super::super::print_line;
use super::statistics::{median, paired, rounded};
use aldis_envelope::lmcp::{self, Header, Object};
use serde_json::json;
use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;

/// LMCP messages read and written on one core.
///
/// An AirVehicleState with everything in it, and a MissionCommand of 75 waypoints. Each round measures all of them in
/// turn, 500 messages at a time; figures are medians, `header_ratio` that of neighbouring rounds.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  aldis bench lmcp --file state.lmcp --json")]
pub(super) struct LmcpBench {
    /// A message to decode instead, such as one of the reference.
    #[arg(long)]
    file: Option<PathBuf>,
    /// Messages in each round; of the mission a twentieth.
    #[arg(long, default_value_t = 500_000)]
    messages: u32,
    /// Rounds.
    #[arg(long, default_value_t = 7)]
    rounds: u32,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

/// Messages a second, by round.
#[derive(Default)]
struct Rates {
    header: Vec<f64>,
    position: Vec<f64>,
    decode: Vec<f64>,
    encode: Vec<f64>,
    mission_decode: Vec<f64>,
    mission_encode: Vec<f64>,
}

impl LmcpBench {
    pub(super) fn run(self) -> Result<(), Failure> {
        let failed = |why: &dyn std::fmt::Display| Failure::Failed(format!("the message: {why}"));
        let message = match &self.file {
            Some(file) => read_file(file)?.to_vec(),
            None => lmcp::encode(&messages::state()).map_err(|why| failed(&why))?,
        };
        let object = lmcp::decode(&message).map_err(|why| failed(&why))?;
        let mission = lmcp::encode(&messages::mission()).map_err(|why| failed(&why))?;
        let mission_object = lmcp::decode(&mission).map_err(|why| failed(&why))?;
        let mut rates = Rates::default();
        for round in 0..=self.rounds {
            // The first round warms up and does not count.
            let measured = self.round(&message, object.as_ref(), &mission, mission_object.as_ref());
            if round > 0 {
                rates.add(measured);
            }
        }
        let rate = |figures: &[f64]| median(figures).round();
        let result = json!({
            "type": object.type_info().full_name, "message_bytes": message.len(),
            "decode_per_s": rate(&rates.decode),
            "header_per_s": rate(&rates.header),
            "header_ratio": rounded(paired(&rates.header, &rates.decode)),
            "position_per_s": rate(&rates.position),
            "encode_per_s": rate(&rates.encode),
            "mission": {
                "waypoints": messages::WAYPOINTS, "message_bytes": mission.len(),
                "decode_per_s": rate(&rates.mission_decode), "encode_per_s": rate(&rates.mission_encode),
            },
            "rounds": self.rounds, "messages": self.messages,
        });
        print_line(if self.json { result.to_string() } else { format!("{result:#}") });
        Ok(())
    }

    /// The rates of one round: header, position, decode, encode, and both ways of the mission.
    fn round(&self, message: &[u8], object: &dyn Object, mission: &[u8], plan: &dyn Object) -> [f64; 6] {
        let (many, few) = (self.messages, (self.messages / 20).max(1));
        let mut buffer = Vec::new();
        [
            per_second(many, || drop(black_box(Header::peek(black_box(message))))),
            per_second(many, || _ = black_box(lmcp::position(black_box(message)))),
            per_second(many, || drop(black_box(lmcp::decode(black_box(message))))),
            per_second(many, || drop(black_box(lmcp::encode_into(black_box(object), &mut buffer)))),
            per_second(few, || drop(black_box(lmcp::decode(black_box(mission))))),
            per_second(few, || drop(black_box(lmcp::encode_into(black_box(plan), &mut buffer)))),
        ]
    }
}

impl Rates {
    fn add(&mut self, [header, position, decode, encode, mission_decode, mission_encode]: [f64; 6]) {
        self.header.push(header);
        self.position.push(position);
        self.decode.push(decode);
        self.encode.push(encode);
        self.mission_decode.push(mission_decode);
        self.mission_encode.push(mission_encode);
    }
}

/// How many messages are measured at a time: so few that the machine seldom does something else meanwhile.
const SLICE: u32 = 500;

/// How often a second some work is done: the median over slices of it.
fn per_second(times: u32, mut work: impl FnMut()) -> f64 {
    let rates: Vec<_> = (0..times.div_ceil(SLICE))
        .map(|_| {
            let start = Instant::now();
            for _ in 0..SLICE {
                work();
            }
            f64::from(SLICE) / start.elapsed().as_secs_f64()
        })
        .collect();
    median(&rates)
}
