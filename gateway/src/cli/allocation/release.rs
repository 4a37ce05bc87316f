//! `aldis release`: gives back what a running `aldis allocate` holds.

use super::super::call::CallArgs;
use super::super::exit::Failure;
use super::super::member::Join;
use super::super::within::Within;
use super::RELEASE;
use aldis_envelope::{Address, EntityId, ServiceId, Source};

/// Have a running `aldis allocate` give its resource back.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  aldis release\n  aldis release --holder 9000 --sid 100")]
pub(crate) struct Release {
    /// The entity that holds it. Default: the one that this command joins as.
    #[arg(long, value_name = "EID")]
    holder: Option<EntityId>,
    /// The service of the entity that holds it.
    #[arg(long, default_value = "100", value_name = "SID")]
    sid: ServiceId,
    /// How long to wait for its answer.
    #[arg(long, default_value = "5s")]
    within: Within,
    /// One JSON object a line.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    join: Join,
}

impl Release {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let holder = match self.holder {
            Some(holder) => holder,
            None => self.join.own()?,
        };
        let to = Address::Service(Source::new(holder, self.sid));
        CallArgs::request(to, RELEASE, self.within, self.json, self.join)?.run()
    }
}
