//! Keys of links, in files of their own.

use aldis_services::link::LinkKey;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// One `[[link.key]]`: a key that both ends have.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct KeyFile {
    /// Its number: a key with a larger one replaces it. Of two in use at once one is odd and one even.
    #[schemars(range(min = 1))]
    pub(crate) number: u32,
    /// A file with 64 hexadecimal digits and nothing else: `openssl rand -hex 32`.
    pub(crate) file: PathBuf,
}

/// Why a key cannot be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum KeyError {
    /// The file cannot be read.
    #[error("the key file {0} cannot be read: {1}")]
    Unreadable(String, std::io::Error),
    /// It is no key.
    #[error(
        "the key file {0} does not hold 64 hexadecimal digits and nothing else; `openssl rand -hex 32` makes them"
    )]
    NoKey(String),
}

impl KeyFile {
    /// Reads the key.
    ///
    /// # Errors
    /// [`KeyError`] where the file cannot be read or holds no key.
    pub(crate) fn read(&self) -> Result<LinkKey, KeyError> {
        let name = self.file.display().to_string();
        let text =
            std::fs::read_to_string(&self.file).map_err(|why| KeyError::Unreadable(name.clone(), why))?;
        let secret = digits(text.trim()).ok_or(KeyError::NoKey(name))?;
        Ok(LinkKey { number: self.number, secret })
    }
}

fn digits(text: &str) -> Option<[u8; 32]> {
    let digits: Vec<u8> = text.chars().map(|c| c.to_digit(16).map(|d| d as u8)).collect::<Option<_>>()?;
    let bytes: Vec<u8> = digits.chunks(2).map(|two| two.iter().fold(0, |byte, d| byte << 4 | d)).collect();
    if digits.len() == 64 { bytes.try_into().ok() } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_64_digits_and_nothing_else() {
        assert_eq!(digits(&"0f".repeat(32)), Some([15; 32]));
        for text in ["", "0f", &"0g".repeat(32), &"0f".repeat(33), &"0".repeat(63)] {
            assert_eq!(digits(text), None, "{text}");
        }
    }
}
