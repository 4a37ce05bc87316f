//! The envelope itself.

use crate::address::Address;
use crate::call::Call;
use crate::change::{Change, Instance};
use crate::id::Source;
use crate::name::{ContentType, Descriptor, Group, Name};
use crate::stamp::Stamp;
use bytes::Bytes;
use std::sync::Arc;

/// The attributes of a message as UxAS knows them (uxas-wire, Envelope).
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Attributes {
    /// What the content is written in.
    pub content_type: ContentType,
    /// What the content is: for `lmcp` the full type name.
    pub descriptor: Descriptor,
    /// Free text, often empty.
    pub source_group: Group,
    /// Who sent it.
    pub source: Source,
}

/// Address and attributes: what all messages of one stream have in common. Shared, because a stream repeats it.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Label {
    /// Where the message goes.
    pub address: Address,
    /// What it is and whence it comes.
    pub attributes: Attributes,
}

impl Label {
    /// The label of a broadcast: the address is the descriptor.
    pub fn broadcast(content_type: ContentType, name: Name, source: Source) -> Self {
        Self::limitedcast(name.clone().into(), content_type, name.into(), source)
    }

    /// The label of a limitedcast: a message with this descriptor to one address.
    pub fn limitedcast(
        address: Address,
        content_type: ContentType,
        descriptor: Descriptor,
        source: Source,
    ) -> Self {
        let attributes = Attributes { content_type, descriptor, source_group: Group::default(), source };
        Self { address, attributes }
    }

    /// Whether the address is the descriptor (broadcast) or not (limitedcast).
    pub fn is_broadcast(&self) -> bool {
        matches!(&self.address, Address::Name(name) if name.as_str() == self.attributes.descriptor.as_str())
    }

    /// Who sent it.
    pub fn source(&self) -> Source {
        self.attributes.source
    }

    /// What it is.
    pub fn descriptor(&self) -> &str {
        self.attributes.descriptor.as_str()
    }
}

/// What a sender says: a message before a node has stamped it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// Address and attributes.
    pub label: Arc<Label>,
    /// What it does to its instance.
    pub change: Change,
    /// The instance of a keyed topic; none for keyless messages.
    pub instance: Option<Arc<Instance>>,
    /// The part in a call, if any.
    pub call: Option<Box<Call>>,
    /// The content, never read on the way.
    pub content: Bytes,
}

impl Message {
    /// A keyless message that is not part of a call.
    pub fn new(label: Arc<Label>, content: Bytes) -> Self {
        Self { label, change: Change::Put, instance: None, call: None, content }
    }

    /// The same message as a sample of an instance.
    pub fn of_instance(mut self, instance: Instance) -> Self {
        self.instance = Some(Arc::new(instance));
        self
    }
}

/// A message as it travels: what the sender says and what the node that sent it out adds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Envelope {
    /// What the sender says.
    pub message: Message,
    /// What the node adds.
    pub stamp: Stamp,
}
