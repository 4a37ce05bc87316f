//! `aldis lmcp`: LMCP messages in files, without a bus.

mod decode;
mod encode;
mod input;
mod verify;

pub(super) use input::{objects_of_json, objects_of_xml};

use super::exit::Failure;
use clap::Subcommand;

/// Read, write and check LMCP messages in files.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis lmcp decode state.lmcp
  aldis lmcp encode scenario.xml -o scenario.lmcp
  aldis lmcp verify messages/ scenarios/ --json
  aldis lmcp encode task.xml | aldis lmcp decode - --json")]
pub(crate) struct Lmcp {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// LMCP to JSON.
    Decode(decode::Decode),
    /// JSON or XML to LMCP.
    Encode(encode::Encode),
    /// Check that messages and XML files come back as they were.
    Verify(verify::Verify),
}

impl Lmcp {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self.what {
            What::Decode(args) => args.run(),
            What::Encode(args) => args.run(),
            What::Verify(args) => args.run(),
        }
    }
}
