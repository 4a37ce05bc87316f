//! Bounded sequences: `sequence<T, MAX>`.

use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, de};
use std::marker::PhantomData;
use std::{fmt, ops, slice, vec};

/// More elements than a sequence may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{length} elements, at most {max} are allowed")]
pub struct SequenceTooLong {
    /// How many there are.
    pub length: usize,
    /// How many are allowed.
    pub max: usize,
}

/// A sequence of at most `MAX` elements.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(transparent)]
pub struct Sequence<T, const MAX: usize>(Vec<T>);

impl<T, const MAX: usize> Sequence<T, MAX> {
    /// The most elements.
    pub const MAX: usize = MAX;

    /// A sequence of these elements.
    ///
    /// # Errors
    /// [`SequenceTooLong`] when there are more than [`Self::MAX`].
    pub fn new(elements: Vec<T>) -> Result<Self, SequenceTooLong> {
        match elements.len() {
            length if length > MAX => Err(SequenceTooLong { length, max: MAX }),
            _ => Ok(Self(elements)),
        }
    }

    /// Appends an element.
    ///
    /// # Errors
    /// [`SequenceTooLong`] when the sequence is full; it stays as it is.
    pub fn push(&mut self, element: T) -> Result<(), SequenceTooLong> {
        if self.0.len() >= MAX {
            return Err(SequenceTooLong { length: MAX + 1, max: MAX });
        }
        self.0.push(element);
        Ok(())
    }

    /// The elements as a plain vector.
    pub fn into_vec(self) -> Vec<T> {
        self.0
    }
}

impl<T, const MAX: usize> Default for Sequence<T, MAX> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T, const MAX: usize> TryFrom<Vec<T>> for Sequence<T, MAX> {
    type Error = SequenceTooLong;
    fn try_from(elements: Vec<T>) -> Result<Self, SequenceTooLong> {
        Self::new(elements)
    }
}

impl<T, const MAX: usize> ops::Deref for Sequence<T, MAX> {
    type Target = [T];
    fn deref(&self) -> &[T] {
        &self.0
    }
}

/// Elements may be changed in place; their number stays.
impl<T, const MAX: usize> ops::DerefMut for Sequence<T, MAX> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.0
    }
}

impl<T, const MAX: usize> IntoIterator for Sequence<T, MAX> {
    type Item = T;
    type IntoIter = vec::IntoIter<T>;
    fn into_iter(self) -> vec::IntoIter<T> {
        self.0.into_iter()
    }
}

impl<'a, T, const MAX: usize> IntoIterator for &'a Sequence<T, MAX> {
    type Item = &'a T;
    type IntoIter = slice::Iter<'a, T>;
    fn into_iter(self) -> slice::Iter<'a, T> {
        self.0.iter()
    }
}

/// Stops at the first element too many, so that no length of a sender makes it allocate more than `MAX` elements.
impl<'de, T: Deserialize<'de>, const MAX: usize> Deserialize<'de> for Sequence<T, MAX> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Elements<T, const MAX: usize>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>, const MAX: usize> Visitor<'de> for Elements<T, MAX> {
            type Value = Sequence<T, MAX>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a sequence of at most {MAX} elements")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut told: A) -> Result<Self::Value, A::Error> {
                let mut elements = Sequence::default();
                while let Some(element) = told.next_element()? {
                    elements.push(element).map_err(de::Error::custom)?;
                }
                Ok(elements)
            }
        }

        deserializer.deserialize_seq(Elements(PhantomData))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Three = Sequence<u8, 3>;

    #[test]
    fn the_bound_holds_everywhere() {
        let too_long = SequenceTooLong { length: 4, max: 3 };
        assert_eq!(Three::new(vec![0; 4]), Err(too_long));
        let mut full = Three::new(vec![1, 2, 3]).unwrap();
        assert_eq!(full.push(4), Err(too_long));
        full[0] = 9;
        assert_eq!(full.into_vec(), [9, 2, 3]);
        let why = serde_json::from_str::<Three>("[1,2,3,4]").unwrap_err().to_string();
        assert!(why.starts_with("4 elements, at most 3 are allowed"), "{why}");
        assert!(postcard::from_bytes::<Three>(&[4, 1, 2, 3, 4]).is_err());
    }

    #[test]
    fn a_length_beyond_the_bytes_is_refused_without_room_for_it() {
        let huge = [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x7f, 1, 2];
        assert!(postcard::from_bytes::<Three>(&huge).is_err());
        assert_eq!(
            postcard::from_bytes::<Three>(&[2, 1, 2]),
            Three::new(vec![1, 2]).map_err(|_| unreachable!())
        );
    }
}
