//! `aldis pub`: messages into the fleet.

mod posts;

use super::content::{content_type, descriptor};
use super::exit::Failure;
use super::member::{Desk, Join, Member};
use super::print_line;
use aldis_envelope::{Address, ContentType, Descriptor, Label, Message, Monotonic, Now};
use aldis_services::{Input, Outbox};
use posts::{Post, total_span};
use serde_json::json;
use std::path::PathBuf;
use std::sync::{Arc, mpsc};
use std::time::Duration;

/// Publish messages.
///
/// LMCP objects from XML or JSON go out under their own descriptors: broadcast, or to the address where one is given.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis pub afrl.cmasi.KeyValuePair --file pair.lmcp
  aldis pub eid400sid37 --descriptor afrl.cmasi.KeyValuePair --file pair.lmcp
  aldis pub weather --content-type text --text calm --count 10 --rate 2
  aldis pub --lmcp-xml task.xml                   what the file holds, each under its own descriptor
  aldis pub --lmcp-xml scenario.xml --timed       each object when the scenario says
  aldis pub eid400sid37 --lmcp-json task.json")]
pub(crate) struct Publish {
    /// Where to: a message type (broadcast), a mailbox, `eid400sid37`, `eid400sidall` or `eid400`.
    #[arg(required_unless_present_any = ["lmcp_xml", "lmcp_json"])]
    address: Option<Address>,
    /// What it is; by default the address.
    #[arg(long, value_parser = descriptor, conflicts_with_all = ["lmcp_xml", "lmcp_json"])]
    descriptor: Option<Descriptor>,
    /// What the content is written in.
    #[arg(long, default_value = "lmcp", value_parser = content_type, conflicts_with_all = ["lmcp_xml", "lmcp_json"])]
    content_type: ContentType,
    #[command(flatten)]
    content: Content,
    /// Each object of an XML file when its attribute `Time` says, in seconds from the start; one without at once.
    #[arg(long, conflicts_with_all = ["text", "file", "lmcp_json"])]
    timed: bool,
    /// How many times.
    #[arg(long, default_value_t = 1)]
    count: u64,
    /// How often, per second.
    #[arg(long, default_value_t = 10.0)]
    rate: f64,
    /// One JSON object at the end.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    join: Join,
}

/// Where the content comes from.
#[derive(clap::Args)]
#[group(required = true, multiple = false)]
struct Content {
    /// The content, as text.
    #[arg(long)]
    text: Option<String>,
    /// The content, as a file.
    #[arg(long)]
    file: Option<PathBuf>,
    /// An XML file: every LMCP object in it, a scenario's too.
    #[arg(long, value_name = "FILE")]
    lmcp_xml: Option<PathBuf>,
    /// A JSON file of LMCP objects, as `aldis lmcp decode` prints them.
    #[arg(long, value_name = "FILE")]
    lmcp_json: Option<PathBuf>,
}

struct Publisher {
    posts: Vec<Post>,
    /// How many messages went out, and how many there are in all rounds.
    sent: u64,
    total: u64,
    period: Duration,
    start: Option<Monotonic>,
    done: mpsc::Sender<()>,
}

impl Publisher {
    /// The next message and when it goes out, counted from the start.
    fn next(&self) -> Option<(&Post, Duration)> {
        let each = self.posts.len() as u64;
        let post = self.posts.get((self.sent % each.max(1)) as usize).filter(|_| self.sent < self.total)?;
        Some((post, post.after.saturating_add(rounds(self.period, self.sent / each))))
    }
}

fn rounds(period: Duration, count: u64) -> Duration {
    Duration::try_from_secs_f64(period.as_secs_f64() * count as f64).unwrap_or(Duration::MAX)
}

impl Desk for Publisher {
    fn take(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        if matches!(input, Input::Bus(true)) {
            self.start.get_or_insert(now.monotonic);
        }
        let Some(start) = self.start.filter(|_| self.sent < self.total) else { return };
        while let Some((post, due)) = self.next()
            && start + due <= now.monotonic
        {
            let (address, descriptor) = (post.address.clone(), post.descriptor.clone());
            let label = Label::limitedcast(address, post.content_type.clone(), descriptor, out.source());
            let instance = post.instance.clone();
            out.send(Message { instance, ..Message::new(Arc::new(label), post.content.clone()) });
            self.sent += 1;
        }
        if self.sent == self.total {
            // The command no longer listens where it has been cut off.
            let _ = self.done.send(());
        }
    }
    fn next_deadline(&self) -> Option<Monotonic> {
        let (start, (_, due)) = (self.start?, self.next()?);
        Some(start + due)
    }
}

impl Publish {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let period = Duration::try_from_secs_f64(1.0 / self.rate)
            .map_err(|_| Failure::Usage(format!("--rate {}: a number above 0", self.rate)))?;
        let posts = self.posts()?;
        let (done, is_done) = mpsc::channel();
        let bytes: usize = posts.iter().map(|post| post.content.len()).sum();
        let span = total_span(&posts).saturating_add(rounds(period, self.count));
        let total = self.count.saturating_mul(posts.len() as u64);
        let publisher = Publisher { posts, sent: 0, total, period, start: None, done };
        if total > 0 {
            let member = Member::join(&self.join, Vec::new(), publisher)?;
            let patience = super::JOIN_WITHIN.saturating_add(span);
            let published = is_done.recv_timeout(patience).map_err(|_| self.join.unreachable());
            member.leave()?;
            published?;
        }
        if self.json {
            print_line(json!({ "address": self.address, "published": total, "bytes": bytes }));
        }
        Ok(())
    }
}
