//! `aldis bench`: measurements side by side, in one run.

mod bus;
mod child;
mod plan;
mod statistics;
mod uxas;

use super::exit::Failure;
use clap::Subcommand;

/// Measure this machine: each figure beside a peer's or the limit's, turn about in the same run.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  aldis bench bus --json\n  aldis bench uxas --json\n  aldis bench plan --json"
)]
pub(crate) struct Bench {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// From a service of one node to a service of another process, against raw Zenoh.
    Bus(bus::BusBench),
    /// From a UxAS stream through a node to a UxAS stream, against a plain TCP copy.
    Uxas(uxas::UxasBench),
    /// How good and how fast plans are.
    Plan(plan::PlanBench),
    /// The other process of `bench bus`.
    #[command(hide = true)]
    BusPeer(bus::BusPeer),
    /// The plain TCP copy of `bench uxas`.
    #[command(hide = true)]
    TcpCopy(uxas::TcpCopy),
}

impl Bench {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self.what {
            What::Bus(bench) => bench.run(),
            What::Uxas(bench) => bench.run(),
            What::Plan(bench) => bench.run(),
            What::BusPeer(peer) => peer.run(),
            What::TcpCopy(copy) => copy.run(),
        }
    }
}
