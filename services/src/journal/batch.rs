//! Batches: what stands together or not at all, as the owner says it and as the disk holds it.
//!
//! ```text
//! put     1 | space u8 | key length u8 | value length u32 | key | value
//! forget  2 | space u8 | key length u8 | key
//! ```
//!
//! Integers are little-endian.

use bytes::Bytes;

/// The most bytes of a key.
pub const KEY_BYTES_MAX: usize = 255;
/// The most bytes of a record, its key and seven bytes of its head included. What is larger is divided by its owner.
pub const RECORD_BYTES_MAX: usize = (1 << 20) - 1;
/// The most bytes of a batch: it is one piece in memory and one piece on disk.
pub const BATCH_BYTES_MAX: usize = 4 << 20;

const PUT: u8 = 1;
const FORGET: u8 = 2;

/// One change.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Operation {
    /// Keep a record, in place of the one with this key.
    Put {
        /// Keeps the keys of different owners apart.
        space: u8,
        /// Its key, up to [`KEY_BYTES_MAX`].
        key: Bytes,
        /// Its value.
        value: Bytes,
    },
    /// Keep the record with this key no longer. It need not be there.
    Forget {
        /// Its space.
        space: u8,
        /// Its key.
        key: Bytes,
    },
}

impl Operation {
    /// Its size on disk.
    pub(super) fn encoded_bytes(&self) -> usize {
        match self {
            Self::Put { key, value, .. } => 7 + key.len() + value.len(),
            Self::Forget { key, .. } => 3 + key.len(),
        }
    }

    pub(super) fn view(&self) -> View<'_> {
        match self {
            Self::Put { space, key, value } => View { space: *space, key, value: Some(value) },
            Self::Forget { space, key } => View { space: *space, key, value: None },
        }
    }
}

/// Why a batch cannot be kept by any journal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum BatchError {
    /// A key is too long.
    #[error("a key of {0} bytes: {KEY_BYTES_MAX} are allowed")]
    Key(usize),
    /// A record is too large.
    #[error("a record of {0} bytes with its key: {RECORD_BYTES_MAX} are allowed, divide it")]
    Record(usize),
    /// All together is too large.
    #[error("a batch of {0} bytes: {BATCH_BYTES_MAX} are allowed, divide it")]
    Batch(usize),
}

/// Changes that stand together or not at all.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Batch {
    operations: Vec<Operation>,
    bytes: usize,
}

impl Batch {
    /// An empty batch.
    pub fn new() -> Self {
        Self::default()
    }

    /// Keeps a record, in place of the one with this key.
    pub fn put(&mut self, space: u8, key: impl Into<Bytes>, value: impl Into<Bytes>) -> &mut Self {
        self.push(Operation::Put { space, key: key.into(), value: value.into() })
    }

    /// Keeps a record no longer.
    pub fn forget(&mut self, space: u8, key: impl Into<Bytes>) -> &mut Self {
        self.push(Operation::Forget { space, key: key.into() })
    }

    /// Adds a change.
    pub fn push(&mut self, operation: Operation) -> &mut Self {
        self.bytes += operation.encoded_bytes();
        self.operations.push(operation);
        self
    }

    /// The changes in their order: of two to one key the later holds.
    pub fn operations(&self) -> &[Operation] {
        &self.operations
    }

    /// Its size on disk, without the frame around it.
    pub fn encoded_bytes(&self) -> usize {
        self.bytes
    }

    pub(super) fn check(&self) -> Result<(), BatchError> {
        for operation in &self.operations {
            let key = operation.view().key.len();
            if key > KEY_BYTES_MAX {
                return Err(BatchError::Key(key));
            }
            if operation.encoded_bytes() > RECORD_BYTES_MAX {
                return Err(BatchError::Record(operation.encoded_bytes()));
            }
        }
        if self.bytes > BATCH_BYTES_MAX {
            return Err(BatchError::Batch(self.bytes));
        }
        Ok(())
    }
}

/// An operation as it stands in a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct View<'a> {
    pub(super) space: u8,
    pub(super) key: &'a [u8],
    /// None for a forget.
    pub(super) value: Option<&'a [u8]>,
}

impl View<'_> {
    /// Its size on disk.
    pub(super) fn encoded_bytes(&self) -> usize {
        self.value.map_or(3, |value| 7 + value.len()) + self.key.len()
    }

    /// Appends it to a buffer. The lengths were checked when it was taken.
    pub(super) fn encode(&self, buffer: &mut Vec<u8>) {
        let kind = if self.value.is_some() { PUT } else { FORGET };
        buffer.extend([kind, self.space, self.key.len() as u8]);
        if let Some(value) = self.value {
            buffer.extend((value.len() as u32).to_le_bytes());
        }
        buffer.extend_from_slice(self.key);
        buffer.extend_from_slice(self.value.unwrap_or_default());
    }
}

/// Reads the operations of a body one by one.
#[derive(Debug, Clone)]
pub(super) struct Views<'a> {
    body: &'a [u8],
    at: usize,
}

impl<'a> Views<'a> {
    pub(super) fn new(body: &'a [u8]) -> Self {
        Self { body, at: 0 }
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let taken = self.body.get(self.at..self.at.checked_add(count)?)?;
        self.at += count;
        Some(taken)
    }

    fn view(&mut self) -> Option<View<'a>> {
        let &[kind, space, key_length] = self.take(3)? else { return None };
        let value_length = match kind {
            PUT => Some(u32::from_le_bytes(self.take(4)?.try_into().ok()?) as usize),
            FORGET => None,
            _ => return None,
        };
        let key = self.take(usize::from(key_length))?;
        let value = match value_length {
            Some(length) => Some(self.take(length)?),
            None => None,
        };
        Some(View { space, key, value })
    }
}

impl<'a> Iterator for Views<'a> {
    /// Where in the body it begins, and the operation.
    type Item = (usize, View<'a>);

    /// Ends at the first thing that is no operation: a body whose checksum holds has none.
    fn next(&mut self) -> Option<Self::Item> {
        if self.at == self.body.len() {
            return None;
        }
        let begin = self.at;
        let view = self.view();
        if view.is_none() {
            self.at = self.body.len();
        }
        view.map(|view| (begin, view))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn operation() -> impl Strategy<Value = Operation> {
        let bytes = |max| proptest::collection::vec(any::<u8>(), 0..max).prop_map(Bytes::from);
        prop_oneof![
            (any::<u8>(), bytes(256), bytes(300)).prop_map(|(space, key, value)| Operation::Put {
                space,
                key,
                value
            }),
            (any::<u8>(), bytes(256)).prop_map(|(space, key)| Operation::Forget { space, key }),
        ]
    }

    proptest! {
        #[test]
        fn what_is_encoded_is_read_again(operations in proptest::collection::vec(operation(), 0..6)) {
            let mut body = Vec::new();
            let mut places = Vec::new();
            for operation in &operations {
                places.push(body.len());
                operation.view().encode(&mut body);
                prop_assert_eq!(body.len() - places.last().unwrap(), operation.encoded_bytes());
                prop_assert_eq!(operation.view().encoded_bytes(), operation.encoded_bytes());
            }
            let read: Vec<_> = Views::new(&body).collect();
            let expected: Vec<_> = places.into_iter().zip(operations.iter().map(Operation::view)).collect();
            prop_assert_eq!(read, expected);
        }

        #[test]
        fn no_body_is_read_beyond_its_end(body in proptest::collection::vec(any::<u8>(), 0..64)) {
            let read: usize = Views::new(&body).map(|(_, view)| view.encoded_bytes()).sum();
            prop_assert!(read <= body.len());
        }
    }

    #[test]
    fn what_is_too_large_is_named() {
        let mut batch = Batch::new();
        batch.put(0, vec![0; 256], Bytes::new());
        assert_eq!(batch.check(), Err(BatchError::Key(256)));
        let mut batch = Batch::new();
        batch.put(0, Bytes::new(), vec![0; RECORD_BYTES_MAX - 7]);
        assert_eq!(batch.check(), Ok(()));
        (0..4).for_each(|_| {
            batch.put(0, Bytes::new(), vec![0; RECORD_BYTES_MAX - 7]);
        });
        assert_eq!(batch.check(), Err(BatchError::Batch(5 * RECORD_BYTES_MAX)));
        let mut batch = Batch::new();
        batch.put(0, Bytes::new(), vec![0; RECORD_BYTES_MAX - 6]);
        assert_eq!(batch.check(), Err(BatchError::Record(RECORD_BYTES_MAX + 1)));
    }
}
