//! `aldis link`: links of running nodes, and bad links to try them on.

mod ask;
mod emulate;
mod plan;
pub(super) mod relay;
mod show;

use super::call::CallArgs;
use super::exit::Failure;
use super::member::Join;
use super::within::Within;
use aldis_envelope::{Address, EntityId, ServiceId, Source};
use clap::Subcommand;

pub(super) use ask::ask;
#[cfg(feature = "dds")]
pub(super) use ask::ask_service;
pub(super) use emulate::profile;
pub(super) use plan::starving;

/// Links of nodes, and bad links to try them on.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  aldis link ls --node 1                     how shore's links do
  aldis link watch --node 1                  the same, drawn anew each second
  aldis link ping 400                        a call through the link, with its tickets
  aldis link silence on --node 400           radio silence
  aldis link plan configs/vehicle-400.toml   what a load costs, before anything is sent
  aldis link emulate L1 --listen 127.0.0.1:7600 --a 127.0.0.1:7500 --b 127.0.0.1:7501")]
pub(crate) struct LinkArgs {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// How the links of a node do.
    Ls(show::Ls),
    /// The same, again and again.
    Watch(show::Watch),
    /// Call the node at the other end, and say how the call gets on.
    Ping(Ping),
    /// Begin or end radio silence.
    Silence(show::SilenceArgs),
    /// What the messages of a configuration cost on its links, and what starves.
    Plan(plan::Plan),
    /// Relay datagrams as a bad link would.
    Emulate(emulate::Emulate),
}

impl LinkArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self.what {
            What::Ls(args) => args.run(),
            What::Watch(args) => args.run(),
            What::Ping(args) => args.run(),
            What::Silence(args) => args.run(),
            What::Plan(args) => args.run(),
            What::Emulate(args) => args.run(),
        }
    }
}

/// Call the node at the other end, and say how the call gets on.
#[derive(clap::Args)]
struct Ping {
    /// The entity at the other end of a link.
    entity: EntityId,
    /// How long to wait.
    #[arg(long, default_value = "30s")]
    within: Within,
    /// One JSON object a line.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    join: Join,
}

impl Ping {
    fn run(self) -> Result<(), Failure> {
        let to = Address::Service(Source::new(self.entity, ServiceId::NODE));
        CallArgs::ping(to, self.within, self.json, self.join).run()
    }
}
