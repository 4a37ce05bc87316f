//! What a message does to a keyed instance, and how an instance is named (DDS 1.4, 2.2.2.5.1.3; RTPS 2.5, 9.6.4.8).

use bytes::Bytes;
use md5::{Digest, Md5};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// What a message does to its instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Change {
    /// A new sample.
    #[default]
    Put,
    /// The instance is gone: a cancel, a clean-up.
    Dispose,
    /// The writer no longer speaks for the instance; it says nothing about the instance itself.
    Unregister,
}

/// The 16-byte DDS key hash of an instance.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct KeyHash(pub [u8; 16]);

/// The text is not a key hash.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("an instance is 32 lower-case hexadecimal digits, or `-` for none")]
pub struct KeyHashError;

impl KeyHash {
    /// The MD5 of some bytes.
    pub fn md5(parts: &[&[u8]]) -> Self {
        let mut digest = Md5::new();
        for part in parts {
            digest.update(part);
        }
        Self(digest.finalize().into())
    }

    fn padded(key: &[u8]) -> Option<Self> {
        let mut hash = [0; 16];
        hash.get_mut(..key.len())?.copy_from_slice(key);
        Some(Self(hash))
    }
}

impl fmt::Display for KeyHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for KeyHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl FromStr for KeyHash {
    type Err = KeyHashError;
    fn from_str(text: &str) -> Result<Self, KeyHashError> {
        let digits: &[u8; 32] = text.as_bytes().try_into().map_err(|_| KeyHashError)?;
        let mut hash = [0; 16];
        for (byte, pair) in hash.iter_mut().zip(digits.chunks_exact(2)) {
            *byte = nibble(pair[0])? << 4 | nibble(pair[1])?;
        }
        Ok(Self(hash))
    }
}

fn nibble(digit: u8) -> Result<u8, KeyHashError> {
    match digit {
        b'0'..=b'9' => Ok(digit - b'0'),
        b'a'..=b'f' => Ok(digit - b'a' + 10),
        _ => Err(KeyHashError),
    }
}

/// Whether the key of a type always fits the 16 bytes of a key hash. A property of the type, not of one key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyWidth {
    /// Every key of the type fits: the hash is the key, padded with zeros.
    Fits16,
    /// Some key of the type may be longer: the hash is the MD5 of the key.
    Wider,
}

/// One instance of a keyed topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Instance {
    /// The key hash.
    pub hash: KeyHash,
    /// The serialized key (big-endian CDR), where it is known. A put carries it in its content.
    pub key: Option<Bytes>,
}

impl Instance {
    /// An instance from its serialized key. A key over 16 bytes is always hashed.
    pub fn of_key(key: Bytes, width: KeyWidth) -> Self {
        let padded = match width {
            KeyWidth::Fits16 => KeyHash::padded(&key),
            KeyWidth::Wider => None,
        };
        let hash = padded.unwrap_or_else(|| KeyHash::md5(&[&key]));
        Self { hash, key: Some(key) }
    }

    /// The instance of an LMCP message by its natural key, an `int64`.
    pub fn of_number(id: i64) -> Self {
        Self::of_key(Bytes::copy_from_slice(&id.to_be_bytes()), KeyWidth::Fits16)
    }

    /// Whether a hash may belong to this serialized key, whatever the width of its type.
    pub(crate) fn hash_fits(hash: KeyHash, key: &[u8]) -> bool {
        KeyHash::padded(key) == Some(hash) || KeyHash::md5(&[key]) == hash
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_key_is_its_own_hash_and_a_long_one_is_digested() {
        assert_eq!(Instance::of_number(400).hash.to_string(), "00000000000001900000000000000000");
        // MD5 of 32 zero bytes, as any md5 tool prints it.
        let wide = Instance::of_key(Bytes::from_static(&[0; 32]), KeyWidth::Wider);
        assert_eq!(wide.hash.to_string(), "70bc8f4b72a86921468bf8e8441dce51");
    }

    #[test]
    fn only_lower_case_hexadecimal_is_read() {
        let hash = KeyHash::md5(&[b"abc"]);
        assert_eq!(hash.to_string().parse(), Ok(hash));
        assert!(hash.to_string().to_uppercase().parse::<KeyHash>().is_err());
        assert!("-".parse::<KeyHash>().is_err());
    }
}
