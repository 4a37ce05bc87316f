//! Keys of the journal's records.

use super::event::Record;
use aldis_envelope::EntityId;
use bytes::Bytes;

/// What a record of a link holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub(super) enum Kind {
    /// When this journal was born.
    Born = b'b',
    /// Command numbers below this one may have been used.
    Reserved = b'n',
    /// A command on its way out.
    Outgoing = b'c',
    /// A name that this end gave.
    OwnName = b'd',
    /// The peer's last life and when its journal was born.
    Peer = b'p',
    /// The numbers of the peer's commands that were taken.
    Taken = b'r',
    /// A command that came and is not done.
    Incoming = b'i',
    /// A name that the peer gave.
    PeerName = b'e',
    /// The beginning of a large message that is still coming.
    Partial = b'q',
}

const KINDS: [Kind; 9] = [
    Kind::Born,
    Kind::Reserved,
    Kind::Outgoing,
    Kind::OwnName,
    Kind::Peer,
    Kind::Taken,
    Kind::Incoming,
    Kind::PeerName,
    Kind::Partial,
];

/// The keys of one link's records.
#[derive(Debug, Clone)]
pub(super) struct RecordKeys {
    prefix: Vec<u8>,
}

/// What every key of the records of the link to a peer begins with.
pub fn record_prefix(peer: EntityId) -> Vec<u8> {
    [&b"L"[..], &peer.get().to_be_bytes()].concat()
}

impl RecordKeys {
    pub(super) fn new(peer: EntityId) -> Self {
        Self { prefix: record_prefix(peer) }
    }

    pub(super) fn key(&self, kind: Kind, number: u64) -> Bytes {
        [&self.prefix[..], &[kind as u8], &number.to_be_bytes()].concat().into()
    }

    pub(super) fn parse(&self, key: &[u8]) -> Option<(Kind, u64)> {
        let (&kind, number) = key.strip_prefix(&self.prefix[..])?.split_first()?;
        let kind = *KINDS.iter().find(|known| **known as u8 == kind)?;
        Some((kind, u64::from_be_bytes(number.try_into().ok()?)))
    }

    pub(super) fn put(&self, kind: Kind, number: u64, value: Vec<u8>) -> Record {
        Record::Put { key: self.key(kind, number), value: value.into() }
    }

    pub(super) fn forget(&self, kind: Kind, number: u64) -> Record {
        Record::Forget { key: self.key(kind, number) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_come_back_and_foreign_ones_do_not() {
        let keys = RecordKeys::new(EntityId::new(400).unwrap());
        for kind in KINDS {
            assert_eq!(keys.parse(&keys.key(kind, 9)), Some((kind, 9)));
        }
        let other = RecordKeys::new(EntityId::new(401).unwrap());
        assert_eq!(other.parse(&keys.key(Kind::Born, 0)), None);
        assert_eq!(keys.parse(b"L"), None);
    }
}
