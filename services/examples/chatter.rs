//! Runs the simulator's own workload over many seeds: `cargo run --release -p aldis-services --example chatter -- [COUNT] [FIRST]`.
//!
//! Prints each seed in which something was wrong with the end of its trace, and at the end how much was run.

use aldis_services::sim::chatter::Chatter;
use aldis_services::sim::{Options, run};
use std::io::Write;
use std::process::ExitCode;
use std::time::Duration;

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1).filter_map(|argument| argument.parse::<u64>().ok());
    let (count, first) = (arguments.next().unwrap_or(1000), arguments.next().unwrap_or(0));
    let (mut lasted, mut events, mut wrong, mut hash) = (Duration::ZERO, 0, 0, 0_u64);
    let mut out = std::io::stdout().lock();
    for seed in first..first + count {
        let Ok(report) = run(&Chatter::default(), seed, Options::draw(seed)) else { continue };
        lasted += report.lasted;
        events += report.events;
        hash = hash.rotate_left(1) ^ report.hash;
        if !report.violations.is_empty() {
            wrong += 1;
            // A reader that is gone ends nothing here.
            let _ = writeln!(out, "{report}\n{}", report.trace);
        }
    }
    let hours = lasted.as_secs_f64() / 3600.0;
    let _ = writeln!(
        out,
        "{{\"seeds\":{count},\"first\":{first},\"wrong\":{wrong},\"virtual_hours\":{hours:.1},\"events\":{events},\"hash\":\"{hash:016x}\"}}"
    );
    if wrong == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
