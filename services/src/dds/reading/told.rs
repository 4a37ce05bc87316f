//! Samples that a writer's node tells again, as they were.

use super::super::Participant;
use aldis_envelope::aldis::dds::Retained;
use aldis_envelope::{Envelope, Instance, Label, Message, Priority, Stamp};
use bytes::Bytes;
use std::sync::Arc;

/// A sample of a stream with this label.
pub(super) fn envelope(from: Participant, label: &Arc<Label>, sample: Retained) -> Envelope {
    let Retained { sequence, source_time, change, hash, key, content } = sample;
    let instance = hash.map(|hash| Arc::new(Instance { hash, key: key.map(Bytes::from) }));
    let stamp = Stamp {
        node: from.node,
        boot: from.boot,
        sequence,
        source_time,
        lifespan_left_ms: None,
        priority: Priority::Data,
        skipped: 0,
        via: Default::default(),
    };
    let message = Message { change, instance, ..Message::new(label.clone(), content.into()) };
    Envelope { message, stamp }
}
