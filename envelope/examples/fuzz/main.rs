//! Feeds wrong bytes to every decoder: messages of all types with seeded mistakes in them, and random bytes.
//!
//! ```text
//! cargo run --release -p aldis-envelope --example fuzz                      10 million inputs a decoder
//! cargo run --release -p aldis-envelope --example fuzz -- lmcp 100000       one decoder, so many inputs
//! cargo run --release -p aldis-envelope --example fuzz -- lmcp 1 42 317     input 317 of seed 42 again
//! ```
//!
//! Prints one JSON object a decoder, and fails where one panicked or misread. `peak_per_byte` is the most memory that
//! an input took at a time, in bytes for each of its own, among inputs of at least 512 bytes; `peak_short` is the most
//! that a shorter one took, in bytes. What a decoder works with and what it returns are counted together. `over`
//! counts inputs that took more than the larger of four times their length and 2 KiB.

mod corpus;
mod decoders;
mod mutate;
mod samples;

use corpus::Corpus;
use decoders::{DECODERS, Decoder, Outcome};
use fastrand::Rng;
use peak_alloc::PeakAlloc;
use serde_json::{Value, json};
use std::error::Error;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// What is printed of a decoder.
#[derive(Default)]
struct Tally {
    inputs: u64,
    accepted: u64,
    panics: u64,
    misread: u64,
    over: u64,
    peak_per_byte: f64,
    peak_short: usize,
    bytes_max: usize,
    /// The first input that panicked or was misread.
    first_failure: Option<u64>,
}

impl Tally {
    fn count(&mut self, index: u64, bytes: usize, peak: usize, outcome: Option<Outcome>) {
        use aldis_envelope::lmcp::{MEMORY_FACTOR, MEMORY_FLOOR};
        self.inputs += 1;
        self.bytes_max = self.bytes_max.max(bytes);
        self.accepted += u64::from(outcome == Some(Outcome::Accepted));
        self.panics += u64::from(outcome.is_none());
        self.misread += u64::from(outcome == Some(Outcome::Misread));
        if matches!(outcome, None | Some(Outcome::Misread)) {
            self.first_failure = self.first_failure.or(Some(index));
        }
        self.over += u64::from(peak > (MEMORY_FACTOR * bytes).max(MEMORY_FLOOR));
        if bytes < MEMORY_FLOOR / MEMORY_FACTOR {
            self.peak_short = self.peak_short.max(peak);
        } else {
            self.peak_per_byte = self.peak_per_byte.max(peak as f64 / bytes as f64);
        }
    }

    fn json(&self, decoder: &str, seed: u64) -> Value {
        json!({
            "decoder": decoder, "seed": seed, "inputs": self.inputs, "accepted": self.accepted,
            "panics": self.panics, "misread": self.misread, "first_failure": self.first_failure,
            "peak_per_byte": (self.peak_per_byte * 1e3).round() / 1e3, "peak_short": self.peak_short,
            "over": self.over, "longest": self.bytes_max,
        })
    }
}

/// Feeds inputs to a decoder. Each is made from the seed and its own number, so that any can be made again.
fn fuzz(decoder: &Decoder, corpus: &Corpus, seed: u64, inputs: std::ops::Range<u64>) -> Tally {
    let samples = (decoder.samples)(corpus);
    let (mut tally, mut input) = (Tally::default(), Vec::new());
    for index in inputs {
        let mut random = Rng::with_seed(seed ^ index.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        mutate::make(&mut random, samples, &mut input);
        if let Some(mend) = decoder.mend {
            mend(&mut random, &mut input);
        }
        let mut peak = 0;
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            (decoder.read)(&input, &mut |work| {
                let before = MEMORY.current_usage();
                MEMORY.reset_peak_usage();
                work();
                peak = MEMORY.peak_usage() - before;
            })
        }));
        tally.count(index, input.len(), peak, outcome.ok());
    }
    tally
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let args: Vec<_> = std::env::args().skip(1).collect();
    let number = |place: usize, default: u64| args.get(place).map_or(Ok(default), |text| text.parse::<u64>());
    let (inputs, seed, first) = (number(1, 10_000_000)?, number(2, 1)?, number(3, 0)?);
    let wanted = args.first().map_or("all", String::as_str);
    let chosen: Vec<_> =
        DECODERS.iter().filter(|decoder| wanted == "all" || wanted == decoder.name).collect();
    if chosen.is_empty() {
        let names: Vec<_> = DECODERS.iter().map(|decoder| decoder.name).collect();
        return Err(format!("no decoder `{wanted}`: all, {}", names.join(", ")).into());
    }
    let corpus = Corpus::new(seed)?;
    let mut failed = false;
    for decoder in chosen {
        let tally = fuzz(decoder, &corpus, seed, first..first + inputs);
        failed |= tally.panics + tally.misread > 0;
        writeln!(std::io::stdout().lock(), "{}", tally.json(decoder.name, seed))?;
    }
    Ok(if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}
