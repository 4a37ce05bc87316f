//! Measures the lossy link against its table of goals, in virtual time:
//! `cargo run --release -p aldis-services --example link_bench -- L1 0.1 G1 G2`.

#![allow(clippy::print_stdout, reason = "it is a program")]

use aldis_services::sim::link::{Bench, Profile, bench};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let keyed = arguments.iter().any(|argument| argument == "keys");
    let mut words = arguments.iter().filter(|argument| *argument != "keys");
    let profile = words.next().map_or(Some(Profile::L1), |name| Profile::named(name));
    let Some(profile) = profile else { panic!("no such link: L1, L2, L3, L4 or WiFi") };
    let part = words.next().map_or(1.0, |part| part.parse().expect("how much of the measurement, 0 to 1"));
    let seed = words.next().map_or(1, |seed| seed.parse().expect("a seed"));
    let only = words.cloned().collect();
    for row in bench(&Bench { profile, keyed, part, seed, only }) {
        let met = if row.met { "met   " } else { "MISSED" };
        println!("{:4} {met} {}\n            {}", row.name, row.measured, row.goal);
        row.reason.iter().for_each(|reason| println!("            why: {reason}"));
    }
}
