//! What the fleet retains of some topics, read until it is complete.

use super::exit::Failure;
use super::member::{Desk, Join, Member};
use aldis_envelope::{Address, Change, Envelope, KeyHash, Now, Prefix};
use aldis_services::{Input, Outbox};
use std::collections::BTreeMap;
use std::sync::mpsc;
use std::time::Duration;

/// How long the nodes may take to tell what they retain: longer than a node waits for them.
const TELL_WITHIN: Duration = Duration::from_secs(7);

/// The newest sample of every instance that is alive.
#[derive(Default)]
pub(super) struct Retained {
    samples: BTreeMap<(Address, Option<KeyHash>), Envelope>,
    /// Whether every node that is known has told all of it.
    pub(super) complete: bool,
}

impl Retained {
    /// Joins the fleet, waits for what it retains, and leaves.
    pub(super) fn read(join: &Join, topics: &[&str]) -> Result<Self, Failure> {
        let prefixes = topics.iter().map(|topic| Prefix::new(topic)).collect::<Result<Vec<_>, _>>();
        let prefixes = prefixes.map_err(|why| Failure::Usage(why.to_string()))?;
        let (tell, told) = mpsc::channel();
        let member = Member::join(join, prefixes, Reader { retained: Self::default(), joined: false, tell })?;
        let read = told.recv_timeout(TELL_WITHIN);
        member.leave()?;
        read.map_err(|_| join.unreachable())?.ok_or_else(|| join.unreachable())
    }

    /// The samples, by topic and instance.
    pub(super) fn samples(&self) -> impl Iterator<Item = &Envelope> {
        self.samples.values()
    }

    fn take(&mut self, envelope: &Envelope) {
        let message = &envelope.message;
        let key = (message.label.address.clone(), message.instance.as_ref().map(|instance| instance.hash));
        if message.change == Change::Put {
            self.samples.insert(key, envelope.clone());
        } else {
            self.samples.remove(&key);
        }
    }
}

struct Reader {
    retained: Retained,
    joined: bool,
    tell: mpsc::Sender<Option<Retained>>,
}

impl Desk for Reader {
    fn take(&mut self, _: Now, input: Input<'_>, _: &mut Outbox) {
        match input {
            Input::Bus(joined) => self.joined |= joined,
            Input::Message(envelope) if envelope.message.call.is_none() => self.retained.take(envelope),
            Input::HistoryComplete(complete) => {
                self.retained.complete = complete;
                // The command no longer listens where it has been cut off.
                let _ = self.tell.send(self.joined.then(|| std::mem::take(&mut self.retained)));
            }
            _ => {}
        }
    }
}
