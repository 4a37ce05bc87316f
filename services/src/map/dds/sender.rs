//! Where the fleet finds what comes from a bus, and whose it is there.

use aldis_envelope::{ContentType, Group, Label, Name, Source};
use std::sync::Arc;

/// Topics that are not of UMAA stand under this, so that no mailbox has their name.
const OTHER_TOPICS: &str = "dds::";

/// The address of a topic.
pub fn address_of(topic: &str) -> String {
    if topic.starts_with("UMAA::") { topic.to_owned() } else { format!("{OTHER_TOPICS}{topic}") }
}

/// Who sends on what comes from a bus, and for which group: the bus's partition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sender {
    /// The bridge.
    pub source: Source,
    /// The group of its messages.
    pub group: Group,
}

impl From<Source> for Sender {
    /// A bridge of the partition without a name.
    fn from(source: Source) -> Self {
        Self { source, group: Group::default() }
    }
}

impl Sender {
    /// The label of a topic's messages.
    pub(super) fn label(&self, content_type: ContentType, name: &Name) -> Arc<Label> {
        let mut label = Label::broadcast(content_type, name.clone(), self.source);
        label.attributes.source_group = self.group.clone();
        Arc::new(label)
    }
}
