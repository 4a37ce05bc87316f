//! A retained sample as the journal holds it.
//!
//! ```text
//! version u8 | length of the head u32, little-endian | head, in postcard's format | content
//! ```

use aldis_envelope::{
    Change, ContentType, Group, Instance, KeyHash, Label, Message, Name, Source, Wall, aldis,
};
use bytes::Bytes;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

const VERSION: u8 = 1;
/// Version and length.
const FIXED: usize = 5;

/// Why a record is no sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RecordError {
    /// It was written by a newer program.
    #[error("it has version {0}, this program knows {VERSION}")]
    Newer(u8),
    /// It is not what it should be.
    #[error("it is no sample")]
    NoSample,
}

#[derive(Serialize, Deserialize)]
struct Head {
    source: Source,
    topic: Name,
    content_type: ContentType,
    group: Group,
    source_time: Wall,
    change: Change,
    hash: Option<KeyHash>,
    key: Option<Vec<u8>>,
}

/// A sample without what one life of a node adds to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Record {
    /// What its source says.
    pub message: Message,
    /// When it did, by its own clock.
    pub source_time: Wall,
}

impl Record {
    /// The bytes of a sample of a topic; none where the message is no broadcast.
    pub fn encode(message: &Message, source_time: Wall) -> Option<Bytes> {
        let label = &message.label;
        let instance = message.instance.as_deref();
        let head = Head {
            source: label.source(),
            topic: Name::new(label.descriptor()).ok().filter(|_| label.is_broadcast())?,
            content_type: label.attributes.content_type.clone(),
            group: label.attributes.source_group.clone(),
            source_time,
            change: message.change,
            hash: instance.map(|instance| instance.hash),
            key: instance.and_then(|instance| instance.key.as_ref()).map(|key| key.to_vec()),
        };
        let head = aldis::encode(&head);
        let mut bytes = Vec::with_capacity(FIXED + head.len() + message.content.len());
        bytes.push(VERSION);
        bytes.extend((head.len() as u32).to_le_bytes());
        bytes.extend_from_slice(&head);
        bytes.extend_from_slice(&message.content);
        Some(bytes.into())
    }

    /// The sample of some bytes.
    ///
    /// # Errors
    /// [`RecordError`] where they are none that this program knows.
    pub fn decode(bytes: &Bytes) -> Result<Self, RecordError> {
        let &version = bytes.first().ok_or(RecordError::NoSample)?;
        if version > VERSION {
            return Err(RecordError::Newer(version));
        }
        let length = bytes.get(1..FIXED).and_then(|length| length.try_into().ok());
        let length = u32::from_le_bytes(length.ok_or(RecordError::NoSample)?) as usize;
        let end = FIXED.checked_add(length).ok_or(RecordError::NoSample)?;
        let head = bytes.get(FIXED..end).and_then(aldis::decode::<Head>).filter(|_| version == VERSION);
        let head = head.ok_or(RecordError::NoSample)?;
        let mut label = Label::broadcast(head.content_type, head.topic, head.source);
        label.attributes.source_group = head.group;
        let instance = head.hash.map(|hash| Arc::new(Instance { hash, key: head.key.map(Bytes::from) }));
        let message = Message::new(Arc::new(label), bytes.slice(end..));
        let message = Message { change: head.change, instance, ..message };
        Ok(Self { message, source_time: head.source_time })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aldis_envelope::{EntityId, ServiceId};
    use proptest::prelude::*;

    fn message(change: Change, key: Option<i64>, content: Vec<u8>) -> Message {
        let source = Source::new(EntityId::new(400).unwrap(), ServiceId::HEALTH);
        let mut label = Label::broadcast(ContentType::Umaa, Name::new("UMAA::SO::T").unwrap(), source);
        label.attributes.source_group = Group::new("fleet").unwrap();
        let instance = key.map(|key| Arc::new(Instance::of_number(key)));
        Message { change, instance, ..Message::new(Arc::new(label), content.into()) }
    }

    proptest! {
        #[test]
        fn what_is_encoded_is_read_again(
            change in prop_oneof![Just(Change::Put), Just(Change::Dispose), Just(Change::Unregister)],
            key: Option<i64>,
            content: Vec<u8>,
            at: i64,
        ) {
            let message = message(change, key, content);
            let read = Record::decode(&Record::encode(&message, Wall(at)).unwrap());
            prop_assert_eq!(read, Ok(Record { message, source_time: Wall(at) }));
        }

        #[test]
        fn damage_never_panics(place: prop::sample::Index, bits in 1_u8.., cut: prop::sample::Index) {
            let whole = Record::encode(&message(Change::Put, Some(7), vec![1; 9]), Wall(5)).unwrap();
            let mut bytes = whole.to_vec();
            let place = place.index(bytes.len());
            bytes[place] ^= bits;
            let _ = Record::decode(&bytes.clone().into());
            bytes.truncate(cut.index(bytes.len()));
            let _ = Record::decode(&bytes.into());
        }
    }

    #[test]
    fn what_is_newer_and_what_is_no_topic_is_told() {
        assert_eq!(Record::decode(&Bytes::from_static(&[2, 0])), Err(RecordError::Newer(2)));
        assert_eq!(Record::decode(&Bytes::new()), Err(RecordError::NoSample));
        let to = aldis_envelope::Address::new("eid4sid1").unwrap();
        let of = message(Change::Put, None, Vec::new()).label.source();
        let label = Label::limitedcast(to, ContentType::Umaa, Name::new("x").unwrap().into(), of);
        assert_eq!(Record::encode(&Message::new(Arc::new(label), Bytes::new()), Wall(0)), None);
    }
}
