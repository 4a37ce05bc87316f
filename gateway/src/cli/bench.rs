//! `aldis bench`: measurements side by side, in one run.

mod bus;
mod child;
mod configured;
mod contention;
#[cfg(feature = "dds")]
mod dds;
mod join;
mod journal;
mod link;
mod lmcp;
mod load;
mod plan;
mod queue;
mod rounds;
mod service_node;
mod statistics;
mod umaa;
mod uxas;
mod zmq;

use super::exit::Failure;
use clap::Subcommand;

/// Measure this machine: each figure beside a peer's or the limit's, turn about in the same run.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  aldis bench bus --json\n  aldis bench uxas --json\n  aldis bench zmq --json\n  aldis bench lmcp --json\n  aldis bench join --instances 10000 --rate 1000 --json\n  aldis bench umaa --json\n  aldis bench journal --json\n  aldis bench plan --json\n  aldis bench link --profile L1 --json\n  aldis bench queue --json"
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
    /// From a ZeroMQ socket through a node to a ZeroMQ socket, against a bare forwarder.
    Zmq(zmq::ZmqBench),
    /// From a DDS domain through two gateways to another, against DDS alone.
    #[cfg(feature = "dds")]
    Dds(dds::DdsBench),
    /// The answering peer of `bench dds`.
    #[cfg(feature = "dds")]
    #[command(hide = true)]
    DdsPeer(dds::DdsPeer),
    /// A late joiner of many retained instances, while their writer keeps writing.
    Join(join::JoinBench),
    /// LMCP messages read and written on one core.
    Lmcp(lmcp::LmcpBench),
    /// UMAA's flow control and retained instances, beside raw Zenoh.
    Umaa(umaa::UmaaBench),
    /// Contended allocations between processes that are killed: never two holders, and right again within the lease.
    Contention(contention::Contention),
    /// A process of `bench contention`.
    #[command(hide = true)]
    ContentionPeer(contention::ContentionPeer),
    /// The provider of `bench umaa`.
    #[command(hide = true)]
    UmaaPeer(umaa::UmaaPeer),
    /// Records on disk a second, against plain writes and syncs; restarts.
    Journal(journal::JournalBench),
    /// How good and how fast plans are.
    Plan(plan::PlanBench),
    /// The lossy link against its table of goals, in virtual time, or with real processes.
    Link(link::LinkBench),
    /// A long queue for many vehicles: memory, and a restart.
    Queue(queue::QueueBench),
    /// The other process of `bench queue`.
    #[command(hide = true)]
    QueuePeer(queue::QueuePeer),
    /// The other process of `bench bus`.
    #[command(hide = true)]
    BusPeer(bus::BusPeer),
    /// The late joiner of `bench join`.
    #[command(hide = true)]
    Joiner(join::Joiner),
    /// The plain TCP copy of `bench uxas`.
    #[command(hide = true)]
    TcpCopy(uxas::TcpCopy),
    /// The bare forwarder of `bench zmq`.
    #[command(hide = true)]
    ZmqCopy(zmq::ZmqCopy),
    /// The other process of `bench journal`.
    #[command(hide = true)]
    JournalPeer(journal::JournalPeer),
}

impl Bench {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self.what {
            What::Bus(bench) => bench.run(),
            What::Uxas(bench) => bench.run(),
            What::Zmq(bench) => bench.run(),
            What::ZmqCopy(copy) => copy.run(),
            #[cfg(feature = "dds")]
            What::Dds(bench) => bench.run(),
            #[cfg(feature = "dds")]
            What::DdsPeer(peer) => peer.run(),
            What::Join(bench) => bench.run(),
            What::Joiner(joiner) => joiner.run(),
            What::Lmcp(bench) => bench.run(),
            What::Umaa(bench) => bench.run(),
            What::Contention(bench) => bench.run(),
            What::ContentionPeer(peer) => peer.run(),
            What::UmaaPeer(peer) => peer.run(),
            What::Journal(bench) => bench.run(),
            What::Plan(bench) => bench.run(),
            What::Link(bench) => bench.run(),
            What::Queue(bench) => bench.run(),
            What::QueuePeer(peer) => peer.run(),
            What::BusPeer(peer) => peer.run(),
            What::TcpCopy(copy) => copy.run(),
            What::JournalPeer(peer) => peer.run(),
        }
    }
}

/// The far side of a measurement serves until the measuring process kills it.
fn serve_until_killed() -> ! {
    loop {
        std::thread::park();
    }
}
