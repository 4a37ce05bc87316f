//! Short texts of a configuration. Only valid ones exist, also through serde.

use super::cure::cured;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The longest name: it stands in log lines, and as common name of a certificate, which allows 64.
const NAME_BYTES_MAX: usize = 64;
/// The longest request prefix, as for all names of messages.
const REQUEST_BYTES_MAX: usize = aldis_envelope::name::TEXT_BYTES_MAX;

/// The name of a node, a bridge or a user: 1 to 64 letters, digits, `-`, `_` or `.`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(extend("pattern" = "^[A-Za-z0-9._-]{1,64}$"))]
pub(crate) struct PlainName(String);

impl PlainName {
    /// A name from its text.
    ///
    /// # Errors
    /// What is wrong and the cure, in two lines.
    pub(crate) fn new(text: &str) -> Result<Self, String> {
        let plain = |b: u8| b.is_ascii_alphanumeric() || matches!(b, b'-' | b'_' | b'.');
        if (1..=NAME_BYTES_MAX).contains(&text.len()) && text.bytes().all(plain) {
            return Ok(Self(text.to_owned()));
        }
        let shown: String = text.chars().take(NAME_BYTES_MAX).collect();
        Err(cured(
            format_args!("`{shown}` is not a name"),
            "names have 1 to 64 letters, digits, `-`, `_` or `.`, such as \"vehicle-400\"",
        ))
    }

    /// The text.
    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }
}

/// The beginning of descriptors of requests; the empty text is every request.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(extend("pattern" = "^[^$|]{0,512}$"))]
pub(crate) struct RequestPrefix(String);

impl RequestPrefix {
    /// A prefix from its text.
    ///
    /// # Errors
    /// What is wrong and the cure, in two lines.
    pub(crate) fn new(text: &str) -> Result<Self, String> {
        if text.len() > REQUEST_BYTES_MAX {
            let message = format!("the prefix has {} bytes", text.len());
            return Err(cured(message, "descriptors have at most 512 bytes"));
        }
        if text.contains(['$', '|']) {
            let message = format!("`{text}` cannot begin a descriptor");
            return Err(cured(message, "leave `$` and `|` out: they separate the fields of a message"));
        }
        Ok(Self(text.to_owned()))
    }

    /// The prefix of every request.
    pub(crate) fn all() -> Self {
        Self(String::new())
    }

    /// The text.
    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }
}

macro_rules! text_conversions {
    ($($text:ident),*) => {$(
        impl TryFrom<String> for $text {
            type Error = String;
            fn try_from(text: String) -> Result<Self, String> {
                Self::new(&text)
            }
        }
        impl From<$text> for String {
            fn from(text: $text) -> String {
                text.0
            }
        }
        impl fmt::Display for $text {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&self.0)
            }
        }
    )*};
}
text_conversions!(PlainName, RequestPrefix);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_can_stand_in_a_user_list_and_in_a_certificate() {
        assert!(PlainName::new("vehicle-400.lan").is_ok());
        for text in ["", "a b", "a:b", "ä", &"x".repeat(65)] {
            assert!(PlainName::new(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_request_prefix_may_be_empty_but_delimits_nothing() {
        assert_eq!(RequestPrefix::new("").unwrap(), RequestPrefix::all());
        assert!(RequestPrefix::new("aldis.node.").is_ok());
        assert!(RequestPrefix::new("a$b").is_err());
        assert!(RequestPrefix::new("a|b").is_err());
    }
}
