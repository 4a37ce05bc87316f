//! The last of what happened, kept cheaply and printed with a violation; and a hash of all of it.

use super::observe::{Observation, Seen};
use super::world::NodeHandle;
use aldis_envelope::{Change, Label, Monotonic, Stamp};
use std::collections::VecDeque;
use std::fmt::Write;
use std::sync::Arc;

/// How much of the end is kept.
const ENTRIES_MAX: usize = 400;

#[derive(Debug)]
enum Entry {
    Envelope { arrived: bool, label: Arc<Label>, change: Change, boot: u64, sequence: u64, bytes: usize },
    Text(String),
}

/// What happened in a world.
#[derive(Debug)]
pub(super) struct Trace {
    entries: VecDeque<(Monotonic, NodeHandle, Entry)>,
    count: u64,
    hash: u64,
}

impl Default for Trace {
    fn default() -> Self {
        // The offset basis of FNV-1a.
        Self { entries: VecDeque::new(), count: 0, hash: 0xcbf2_9ce4_8422_2325 }
    }
}

impl Trace {
    /// How much happened.
    pub(super) fn count(&self) -> u64 {
        self.count
    }

    /// A hash of everything that happened and of when it did.
    pub(super) fn hash(&self) -> u64 {
        self.hash
    }

    fn mix(&mut self, number: u64) {
        self.hash = (self.hash ^ number).wrapping_mul(0x0100_0000_01b3).rotate_left(23);
    }

    fn envelope(
        &mut self,
        arrived: bool,
        label: &Arc<Label>,
        stamp: &Stamp,
        change: Change,
        content: &[u8],
    ) -> Entry {
        let source = label.source();
        for number in [
            u64::from(arrived),
            source.entity.get(),
            source.service.get().into(),
            stamp.boot.0,
            stamp.sequence,
            u64::from(crc32fast::hash(content)),
        ] {
            self.mix(number);
        }
        let (label, boot, sequence) = (label.clone(), stamp.boot.0, stamp.sequence);
        Entry::Envelope { arrived, label, change, boot, sequence, bytes: content.len() }
    }

    pub(super) fn record(&mut self, observation: &Observation<'_>) {
        let entry = match &observation.seen {
            Seen::Published(e) | Seen::Arrived(e) => {
                let arrived = matches!(observation.seen, Seen::Arrived(_));
                self.envelope(arrived, &e.message.label, &e.stamp, e.message.change, &e.message.content)
            }
            Seen::Ended(_) => Entry::Text("its life ends".into()),
            Seen::Said(note) => Entry::Text(format!("says: {}", note.text)),
            other => Entry::Text(format!("{other:?}")),
        };
        self.push(observation.at, observation.node, entry);
    }

    /// Something that happened to a machine.
    pub(super) fn text(&mut self, at: Monotonic, node: NodeHandle, text: String) {
        self.push(at, node, Entry::Text(text));
    }

    fn push(&mut self, at: Monotonic, node: NodeHandle, entry: Entry) {
        self.mix(at.elapsed().as_nanos() as u64);
        self.mix(node.place() as u64);
        if let Entry::Text(text) = &entry {
            self.mix(u64::from(crc32fast::hash(text.as_bytes())));
        }
        self.count += 1;
        if self.entries.len() == ENTRIES_MAX {
            self.entries.pop_front();
        }
        self.entries.push_back((at, node, entry));
    }

    /// The end of it, a line each.
    pub(super) fn print(&self) -> String {
        let mut text = String::new();
        for (at, node, entry) in &self.entries {
            let at = at.elapsed().as_secs_f64();
            // Writing into a string cannot fail.
            let _ = match entry {
                Entry::Text(entry) => writeln!(text, "{at:12.6} {node} {entry}"),
                Entry::Envelope { arrived, label, change, boot, sequence, bytes } => writeln!(
                    text,
                    "{at:12.6} {node} {} {change:?} {} from {} ({}) boot {boot} number {sequence}, {bytes} bytes",
                    if *arrived { "<-" } else { "->" },
                    label.descriptor(),
                    label.source(),
                    label.address,
                ),
            };
        }
        text
    }
}
