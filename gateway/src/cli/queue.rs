//! `aldis queue`: commands that wait to cross a link.

use super::exit::Failure;
use super::link::ask;
use super::member::Join;
use super::print_line;
use aldis_envelope::EntityId;
use aldis_envelope::aldis::{self, link};
use clap::Subcommand;
use serde_json::json;
use std::str::FromStr;

/// Commands that wait to cross a link, or are on the air.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  aldis queue ls --node 1
  aldis queue why 400/17         why is it still here?
  aldis queue cancel 400/17      take it back")]
pub(crate) struct QueueArgs {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// What waits.
    Ls(Ls),
    /// Why a command is still here.
    Why(One),
    /// Take a command back.
    Cancel(One),
}

#[derive(clap::Args)]
struct Where {
    /// The node: the entity on this side of the links.
    #[arg(long, default_value = "1")]
    node: EntityId,
    /// One JSON object a command.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    join: Join,
}

/// What waits.
#[derive(clap::Args)]
struct Ls {
    /// Only what is for this entity's link.
    #[arg(long)]
    peer: Option<EntityId>,
    /// At most so many.
    #[arg(long, default_value_t = 100)]
    limit: u32,
    #[command(flatten)]
    place: Where,
}

#[derive(clap::Args)]
struct One {
    /// The command: the peer of its link, a slash, its number there.
    id: Id,
    #[command(flatten)]
    place: Where,
}

/// A command's id: `400/17`.
#[derive(Debug, Clone, Copy)]
struct Id {
    peer: EntityId,
    number: u64,
}

impl FromStr for Id {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("`{text}` is not the id of a command: write 400/17, as `aldis queue ls` shows it");
        let (peer, number) = text.split_once('/').ok_or_else(wrong)?;
        Ok(Self { peer: peer.parse().map_err(|_| wrong())?, number: number.parse().map_err(|_| wrong())? })
    }
}

impl QueueArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self.what {
            What::Ls(ls) => {
                let asked = link::QueueQuery { peer: ls.peer, number: None, limit: ls.limit };
                let queued = ls.place.query(&asked)?;
                queued.iter().for_each(|command| ls.place.print(command));
                if queued.is_empty() && !ls.place.json {
                    print_line("nothing waits");
                }
                Ok(())
            }
            What::Why(one) => {
                let Id { peer, number } = one.id;
                let asked = link::QueueQuery { peer: Some(peer), number: Some(number), limit: 1 };
                match one.place.query(&asked)?.first() {
                    Some(command) => one.place.print(command),
                    None => return Err(one.gone()),
                }
                Ok(())
            }
            What::Cancel(one) => {
                let Id { peer, number } = one.id;
                let content = aldis::encode(&link::QueueCancel { peer, number });
                let Where { node, join, json } = &one.place;
                let cancelled: bool = ask(join, *node, link::QUEUE_CANCEL, content)?;
                if *json {
                    print_line(json!({ "id": format!("{peer}/{number}"), "cancelled": cancelled }));
                }
                if cancelled { Ok(()) } else { Err(one.gone()) }
            }
        }
    }
}

impl One {
    fn gone(&self) -> Failure {
        let Id { peer, number } = self.id;
        Failure::Failed(format!(
            "{peer}/{number} does not wait at node {}: it is through, or never was",
            self.place.node
        ))
    }
}

impl Where {
    fn query(&self, asked: &link::QueueQuery) -> Result<Vec<link::QueuedCommand>, Failure> {
        ask(&self.join, self.node, link::QUEUE_QUERY, aldis::encode(asked))
    }

    fn print(&self, command: &link::QueuedCommand) {
        let id = format!("{}/{}", command.peer, command.number);
        if self.json {
            print_line(json!({
                "id": id, "source": command.source, "descriptor": command.descriptor, "address": command.address,
                "bytes": command.bytes, "age_ms": command.age_ms, "left_ms": command.left_ms, "tries": command.tries,
                "why": command.why,
            }));
            return;
        }
        let left = command.left_ms.map_or("for ever".into(), |ms| format!("{:.0} s left", ms as f64 / 1e3));
        print_line(format_args!(
            "{id:<10} {} from {}, {} B, {:.0} s here, {left}: {}",
            command.descriptor,
            command.source,
            command.bytes,
            command.age_ms as f64 / 1e3,
            command.why
        ));
    }
}
