//! `aldis sim`: the simulator, in virtual time.

mod crash;
mod hostile;
mod link;
mod umaa;

use super::exit::Failure;
use clap::Subcommand;

/// Simulate in virtual time; a failure is replayed from its seed.
#[derive(clap::Args)]
pub(crate) struct Sim {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// UMAA commands and ResourceAllocation over many nodes, watched from outside.
    Umaa(umaa::Umaa),
    /// Lossy links drawn from seeds, with crashes, outages and wrong clocks.
    Link(link::SimLink),
    /// Both ends of a link are killed at moments of chance, with torn writes.
    Crash(crash::SimCrash),
    /// Frames of strangers, given to a link.
    Hostile(hostile::SimHostile),
}

impl Sim {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self.what {
            What::Umaa(args) => args.run(),
            What::Link(args) => args.run(),
            What::Crash(args) => args.run(),
            What::Hostile(args) => args.run(),
        }
    }
}
