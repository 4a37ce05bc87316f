//! `aldis dds`: DDS domains, seen from outside, and the routes of bridges.

mod spy;
mod status;

use super::exit::Failure;
use clap::Subcommand;

/// DDS domains, and the routes of bridges to them.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  aldis dds spy --domain 7                     who is there, what does not come together, and every sample
  aldis dds spy --idl idl --for 10s            with the types of a folder, for ten seconds
  aldis dds ls --node 400 --service 30         the routes of a bridge, with both sides' quality of service")]
pub(crate) struct DdsArgs {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Watch a domain: a JSON object a line.
    Spy(spy::Spy),
    /// Show the routes of a bridge.
    Ls(status::Ls),
}

impl DdsArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self.what {
            What::Spy(args) => args.run(),
            What::Ls(args) => args.run(),
        }
    }
}
