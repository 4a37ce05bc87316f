//! Bounded texts.

use serde::{Deserialize, Serialize};
use std::fmt;

/// The text is longer than its type allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a text of {bytes} bytes, at most {max} are allowed")]
pub struct TextTooLong {
    /// Its length in bytes.
    pub bytes: usize,
    /// The longest allowed.
    pub max: usize,
}

/// A `StringLongDescription`: at most 4095 bytes without a terminator (umaa-so, Type rules).
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct LongDescription(String);

impl LongDescription {
    /// The longest text, in bytes.
    pub const MAX: usize = 4095;

    /// A text.
    ///
    /// # Errors
    /// [`TextTooLong`] over [`Self::MAX`] bytes.
    pub fn new(text: impl Into<String>) -> Result<Self, TextTooLong> {
        let text = text.into();
        if text.len() > Self::MAX {
            Err(TextTooLong { bytes: text.len(), max: Self::MAX })
        } else {
            Ok(Self(text))
        }
    }

    /// A text, cut at a character's end where it is too long, with `…` as its last character.
    pub fn shortened(text: &str) -> Self {
        if text.len() <= Self::MAX {
            return Self(text.to_owned());
        }
        let end = (0..=Self::MAX - '…'.len_utf8()).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0);
        Self(format!("{}…", &text[..end]))
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl TryFrom<String> for LongDescription {
    type Error = TextTooLong;
    fn try_from(text: String) -> Result<Self, TextTooLong> {
        Self::new(text)
    }
}

impl From<LongDescription> for String {
    fn from(text: LongDescription) -> String {
        text.0
    }
}

impl fmt::Display for LongDescription {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_holds_everywhere() {
        let long = "é".repeat(2048);
        assert_eq!(LongDescription::new(long.clone()), Err(TextTooLong { bytes: 4096, max: 4095 }));
        assert!(serde_json::from_str::<LongDescription>(&format!("\"{long}\"")).is_err());
        let cut = LongDescription::shortened(&long);
        assert!(cut.as_str().len() <= LongDescription::MAX && cut.as_str().ends_with('…'));
    }
}
