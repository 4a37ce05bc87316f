//! How links do, for people and machines.

use super::ask;
use crate::cli::exit::Failure;
use crate::cli::member::Join;
use crate::cli::{print_line, run};
use aldis_envelope::EntityId;
use aldis_envelope::aldis::{self, link};
use serde_json::{Value, json};
use std::sync::mpsc;
use std::time::Duration;

/// How the links of a node do.
#[derive(clap::Args)]
pub(super) struct Ls {
    /// The node: the entity on this side of the links.
    #[arg(long, default_value = "1")]
    node: EntityId,
    /// One JSON object a link.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    join: Join,
}

/// The same, again and again, until it is stopped.
#[derive(clap::Args)]
pub(super) struct Watch {
    #[command(flatten)]
    ls: Ls,
    /// How often to look.
    #[arg(long, default_value = "1s")]
    every: crate::cli::within::Within,
    /// How often in all. Default: until it is stopped.
    #[arg(long)]
    times: Option<u64>,
}

/// Begin or end radio silence: a silent link hears and sends nothing; commands wait.
#[derive(clap::Args)]
pub(super) struct SilenceArgs {
    /// `on` or `off`.
    #[arg(value_parser = ["on", "off"])]
    silence: String,
    /// The link to this entity. Default: all links of the node.
    #[arg(long)]
    peer: Option<EntityId>,
    #[command(flatten)]
    ls: Ls,
}

fn object(status: &link::LinkStatus) -> Value {
    let carriers = status.carriers.iter().map(|carrier| {
        json!({
            "id": carrier.id, "up": carrier.up, "in_use": carrier.in_use, "heard_ms_ago": carrier.heard_ms_ago,
            "round_trip_ms": carrier.round_trip_ms, "loss_out": f64::from(carrier.loss_out_permille) / 1e3,
            "loss_in": f64::from(carrier.loss_in_permille) / 1e3, "rate_bytes_per_s": carrier.rate, "mtu": carrier.mtu,
        })
    });
    let counters: serde_json::Map<String, Value> =
        status.counters.iter().map(|(name, value)| (name.clone(), (*value).into())).collect();
    json!({
        "name": status.name, "peer": status.peer, "behind": status.behind, "heard": status.heard,
        "silent": status.silent, "durable": status.durable, "keyed": status.keyed,
        "carriers": carriers.collect::<Vec<_>>(),
        "waiting": { "commands": status.commands, "states": status.states, "bulk_bytes": status.bulk_bytes },
        "services": status.services.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "counters": counters,
    })
}

fn print(status: &link::LinkStatus) {
    let word = |set: bool, word: &'static str| if set { word } else { "" };
    let heard = if status.heard { "heard" } else { "NOT HEARD" };
    let marks = [
        word(status.silent, ", silent"),
        word(!status.keyed, ", no keys"),
        word(!status.durable, ", volatile"),
    ];
    print_line(format_args!("{}: entity {}, {heard}{}", status.name, status.peer, marks.concat()));
    for carrier in &status.carriers {
        let state = match (carrier.up, carrier.in_use) {
            (false, _) => "down",
            (true, true) => "in use",
            (true, false) => "spare",
        };
        let ago = carrier.heard_ms_ago.map_or("never".into(), |ms| format!("{:.1} s ago", ms as f64 / 1e3));
        print_line(format_args!(
            "  carrier {:<2} {state:<7} heard {ago:<11} round trip {} ms, loss {:.0} % out {:.0} % in, {} B/s, frames to {} B",
            carrier.id,
            carrier.round_trip_ms,
            f64::from(carrier.loss_out_permille) / 10.0,
            f64::from(carrier.loss_in_permille) / 10.0,
            carrier.rate,
            carrier.mtu
        ));
    }
    print_line(format_args!(
        "  waiting: {} commands, {} states, {} bytes of bulk; {} services behind it",
        status.commands,
        status.states,
        status.bulk_bytes,
        status.services.len()
    ));
}

impl Ls {
    pub(super) fn run(self) -> Result<(), Failure> {
        let statuses: Vec<link::LinkStatus> = ask(&self.join, self.node, link::LINK_QUERY, Vec::new())?;
        self.print(&statuses);
        Ok(())
    }

    fn print(&self, statuses: &[link::LinkStatus]) {
        for status in statuses {
            if self.json { print_line(object(status)) } else { print(status) }
        }
        if statuses.is_empty() && !self.json {
            print_line(format_args!("node {} has no links", self.node));
        }
    }
}

impl Watch {
    pub(super) fn run(self) -> Result<(), Failure> {
        let (stop, stopped) = mpsc::channel();
        run::watch_signals(move || {
            let _ = stop.send(());
        })?;
        let mut left = self.times;
        while left != Some(0) {
            let statuses: Vec<link::LinkStatus> =
                ask(&self.ls.join, self.ls.node, link::LINK_QUERY, Vec::new())?;
            if !self.ls.json {
                print_line("\x1b[H\x1b[2J");
            }
            self.ls.print(&statuses);
            left = left.map(|left| left - 1);
            let wait = if left == Some(0) { Duration::ZERO } else { self.every.0 };
            if stopped.recv_timeout(wait) != Err(mpsc::RecvTimeoutError::Timeout) {
                break;
            }
        }
        Ok(())
    }
}

impl SilenceArgs {
    pub(super) fn run(self) -> Result<(), Failure> {
        let asked = link::Silence { peer: self.peer, silent: self.silence == "on" };
        let content = aldis::encode(&asked);
        let statuses: Vec<link::LinkStatus> = ask(&self.ls.join, self.ls.node, link::LINK_SILENCE, content)?;
        self.ls.print(&statuses);
        Ok(())
    }
}
