//! Recordings: envelopes one after the other, each with the time when it was received.
//!
//! ```text
//! "ALDISREC" version(1 byte) fleet(length, text)        once
//! length(4 bytes, little-endian) record                  repeated
//! record = received(zigzag) key(text) header(bytes) content(bytes), in postcard's format
//! ```
//!
//! Key, header and content are as on the bus, so that whatever reads those reads these. A record that ends too early, as
//! the last one may after a crash, ends the recording and is told.

use super::native::{self, Decoder};
use crate::change::Change;
use crate::key::{Fleet, Keys, Space};
use crate::message::Envelope;
use crate::time::Wall;
use bytes::Bytes;
use serde::{Deserialize, Serialize};

const MAGIC: &[u8; 8] = b"ALDISREC";
const VERSION: u8 = 1;
/// The longest record: far above any message, so that a length that is none is noticed.
const RECORD_BYTES_MAX: usize = 64 * 1024 * 1024;

/// Why a recording, or a record of it, cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RecordingError {
    /// It does not begin as recordings do.
    #[error("no recording: it does not begin with `ALDISREC`, a version and a fleet")]
    Foreign,
    /// It is of another version.
    #[error("recording version {0} is not {VERSION}")]
    Version(u8),
    /// The last record is not whole.
    #[error("the recording ends inside the record at byte {0}")]
    Torn(usize),
    /// A record is not what it should be; those after it can be read.
    #[error("record at byte {at}: {why}")]
    Record {
        /// Where it begins.
        at: usize,
        /// What is wrong.
        why: String,
    },
}

#[derive(Serialize, Deserialize)]
struct Record<'a> {
    received: i64,
    key: &'a str,
    header: &'a [u8],
    content: &'a [u8],
}

/// Writes recordings.
#[derive(Debug)]
pub struct Writer {
    keys: Keys,
}

impl Writer {
    /// A writer of one fleet's envelopes, with the beginning of its recording.
    pub fn new(fleet: &Fleet) -> (Self, Vec<u8>) {
        let mut head = MAGIC.to_vec();
        head.push(VERSION);
        // A fleet's name has at most 64 bytes.
        head.push(fleet.as_str().len() as u8);
        head.extend_from_slice(fleet.as_str().as_bytes());
        (Self { keys: Keys::new(fleet) }, head)
    }

    /// The record of an envelope.
    pub fn record(&self, received: Wall, envelope: &Envelope) -> Vec<u8> {
        let message = &envelope.message;
        let space = if message.change == Change::Unregister { Space::Writer } else { Space::Data };
        let key = self.keys.envelope(space, &message.label, message.instance.as_deref());
        let mut header = Vec::with_capacity(96);
        native::encode(envelope, &mut header);
        let record = Record { received: received.0, key: &key, header: &header, content: &message.content };
        // Postcard fails on a growing buffer only for types without a length, which this has not.
        let body = postcard::to_extend(&record, vec![0; 4]).unwrap_or_default();
        let length = (body.len().saturating_sub(4) as u32).to_le_bytes();
        let mut framed = body;
        if let Some(place) = framed.first_chunk_mut::<4>() {
            *place = length;
        }
        framed
    }
}

/// Reads a recording, one envelope after the other.
#[derive(Debug)]
pub struct Reader<'a> {
    fleet: Fleet,
    decoder: Decoder,
    whole: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    /// A reader of a whole recording.
    ///
    /// # Errors
    /// [`RecordingError::Foreign`] and [`RecordingError::Version`].
    pub fn new(whole: &'a [u8]) -> Result<Self, RecordingError> {
        let rest = whole.strip_prefix(MAGIC).ok_or(RecordingError::Foreign)?;
        let (&version, rest) = rest.split_first().ok_or(RecordingError::Foreign)?;
        if version != VERSION {
            return Err(RecordingError::Version(version));
        }
        let (&length, rest) = rest.split_first().ok_or(RecordingError::Foreign)?;
        let name = rest.get(..length.into()).ok_or(RecordingError::Foreign)?;
        let name = std::str::from_utf8(name).map_err(|_| RecordingError::Foreign)?;
        let fleet = Fleet::new(name).map_err(|_| RecordingError::Foreign)?;
        let at = MAGIC.len() + 2 + usize::from(length);
        Ok(Self { decoder: Decoder::new(Keys::new(&fleet)), fleet, whole, at })
    }

    /// The fleet that was recorded.
    pub fn fleet(&self) -> &Fleet {
        &self.fleet
    }

    fn record(&mut self) -> Option<Result<(Wall, Envelope), RecordingError>> {
        let at = self.at;
        let rest = self.whole.get(at..).filter(|rest| !rest.is_empty())?;
        // Whatever is wrong with a frame, nothing can be read behind it.
        self.at = self.whole.len();
        let torn = Some(Err(RecordingError::Torn(at)));
        let Some((length, rest)) = rest.split_first_chunk::<4>() else { return torn };
        let length = u32::from_le_bytes(*length) as usize;
        if length > RECORD_BYTES_MAX {
            let why = format!("{length} bytes, at most {RECORD_BYTES_MAX} are read");
            return Some(Err(RecordingError::Record { at, why }));
        }
        let Some(body) = rest.get(..length) else { return torn };
        self.at = at + 4 + length;
        Some(self.envelope(body).map_err(|why| RecordingError::Record { at, why }))
    }

    fn envelope(&mut self, body: &[u8]) -> Result<(Wall, Envelope), String> {
        let (record, rest): (Record<'_>, _) =
            postcard::take_from_bytes(body).map_err(|why| why.to_string())?;
        if !rest.is_empty() {
            return Err(format!("{} bytes follow its end", rest.len()));
        }
        let content = Bytes::copy_from_slice(record.content);
        let put = self.decoder.decode(record.key, false, record.header, content.clone());
        // The change is in the header alone; on the bus a dispose came as a DELETE.
        let read =
            put.or_else(|why| self.decoder.decode(record.key, true, record.header, content).map_err(|_| why));
        read.map(|envelope| (Wall(record.received), envelope)).map_err(|why| why.to_string())
    }
}

impl Iterator for Reader<'_> {
    type Item = Result<(Wall, Envelope), RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.record()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        BootId, ContentType, EntityId, Instance, Label, Message, Name, Priority, ServiceId, Source, Stamp,
    };
    use proptest::prelude::*;
    use std::sync::Arc;

    fn envelope(sequence: u64, change: Change) -> Envelope {
        let entity = EntityId::new(400).unwrap();
        let name = Name::new("UMAA::SO::T").unwrap();
        let label = Label::broadcast(ContentType::Umaa, name, Source::new(entity, ServiceId::HEALTH));
        let message = Message::new(Arc::new(label), Bytes::from_static(b"content"));
        let message = message.of_instance(Instance::of_number(7));
        let stamp = Stamp {
            node: entity,
            boot: BootId(3),
            sequence,
            source_time: Wall(-5),
            lifespan_left_ms: None,
            priority: Priority::Data,
            skipped: 0,
            via: Default::default(),
        };
        Envelope { message: Message { change, ..message }, stamp }
    }

    fn recording() -> (Vec<u8>, usize) {
        let (writer, mut whole) = Writer::new(&Fleet::new("blue").unwrap());
        let head = whole.len();
        for (sequence, change) in [(1, Change::Put), (2, Change::Dispose), (3, Change::Unregister)] {
            whole.extend(writer.record(Wall(10 + sequence as i64), &envelope(sequence, change)));
        }
        (whole, head)
    }

    #[test]
    fn what_was_recorded_is_read_again() {
        let (whole, _) = recording();
        let reader = Reader::new(&whole).unwrap();
        assert_eq!(reader.fleet().as_str(), "blue");
        let read: Vec<_> = reader.map(Result::unwrap).collect();
        assert_eq!(read.len(), 3);
        for (place, change) in [Change::Put, Change::Dispose, Change::Unregister].into_iter().enumerate() {
            let (received, read) = &read[place];
            assert_eq!((received.0, read.message.change), (11 + place as i64, change));
            assert_eq!(read.stamp.sequence, place as u64 + 1);
            assert_eq!(read.message.content, "content");
        }
    }

    #[test]
    fn a_torn_end_is_told_and_all_before_it_read() {
        let (whole, head) = recording();
        for cut in head + 1..whole.len() {
            let read: Vec<_> = Reader::new(&whole[..cut]).unwrap().collect();
            let (last, before) = read.split_last().unwrap();
            assert!(before.iter().all(Result::is_ok));
            assert!(last.is_ok() || matches!(last, Err(RecordingError::Torn(_))), "{last:?}");
        }
        assert!(matches!(Reader::new(b"ALDISREC\x02\x01a"), Err(RecordingError::Version(2))));
        assert!(matches!(Reader::new(b"other"), Err(RecordingError::Foreign)));
    }

    proptest! {
        #[test]
        fn damage_never_panics(place: prop::sample::Index, bits in 1_u8..) {
            let (mut whole, _) = recording();
            let place = place.index(whole.len());
            whole[place] ^= bits;
            if let Ok(reader) = Reader::new(&whole) {
                prop_assert!(reader.count() <= 4);
            }
        }
    }
}
