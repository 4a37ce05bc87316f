//! Short texts of an envelope: names of addresses and descriptors, and the source group.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::sync::Arc;

/// The longest name, content type or group, in bytes: far above any type name of UMAA or UxAS, and small enough
/// that a hostile header costs nothing.
pub const TEXT_BYTES_MAX: usize = 512;

/// Why a text cannot stand in an envelope.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NameError {
    /// The text is empty where something must stand.
    #[error("the {0} is empty")]
    Empty(&'static str),
    /// The text holds a character that delimits fields.
    #[error("the {what} `{text}` holds `{delimiter}`, which delimits fields of an envelope")]
    Delimiter {
        /// Which text it is.
        what: &'static str,
        /// The text, shortened.
        text: String,
        /// The character found.
        delimiter: char,
    },
    /// The text is longer than [`TEXT_BYTES_MAX`].
    #[error("the {what} has {bytes} bytes, at most {TEXT_BYTES_MAX} are allowed")]
    TooLong {
        /// Which text it is.
        what: &'static str,
        /// Its length in bytes.
        bytes: usize,
    },
    /// The text begins like an entity id, but is none.
    #[error(
        "`{0}` begins like an entity id but is not `eidN`, `eidNsidM` or `eidNsidall` (dot before `sid` allowed)"
    )]
    NotAnId(String),
}

pub(crate) fn shortened(text: &str) -> String {
    text.chars().take(60).collect()
}

fn check(what: &'static str, text: &str, delimiters: &[char]) -> Result<(), NameError> {
    if text.len() > TEXT_BYTES_MAX {
        return Err(NameError::TooLong { what, bytes: text.len() });
    }
    match text.chars().find(|c| delimiters.contains(c)) {
        Some(delimiter) => Err(NameError::Delimiter { what, text: shortened(text), delimiter }),
        None => Ok(()),
    }
}

/// Whether a text starts as only ids may: `eid` and a digit.
pub(crate) fn looks_like_an_id(text: &str) -> bool {
    text.strip_prefix("eid").and_then(|rest| rest.bytes().next()).is_some_and(|b| b.is_ascii_digit())
}

/// The name of a message type or of a mailbox: not empty, without `$` and `|`, not beginning like an id.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Name(Arc<str>);

impl Name {
    /// A name from its text.
    ///
    /// # Errors
    /// [`NameError`] when the text is empty, too long, holds a delimiter or begins like an id.
    pub fn new(text: &str) -> Result<Self, NameError> {
        if text.is_empty() {
            return Err(NameError::Empty("name"));
        }
        check("name", text, &['$', '|'])?;
        if looks_like_an_id(text) {
            return Err(NameError::NotAnId(shortened(text)));
        }
        Ok(Self(text.into()))
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// The descriptor of a message: what it is, as text. For `lmcp` the full type name. It may have any text without
/// delimiters, an id's too, because nothing is routed by it.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Descriptor(Arc<str>);

impl Descriptor {
    /// A descriptor from its text.
    ///
    /// # Errors
    /// [`NameError`] when the text is empty, too long or holds a delimiter.
    pub fn new(text: &str) -> Result<Self, NameError> {
        if text.is_empty() {
            return Err(NameError::Empty("descriptor"));
        }
        check("descriptor", text, &['$', '|'])?;
        Ok(Self(text.into()))
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl From<Name> for Descriptor {
    fn from(name: Name) -> Self {
        Self(name.0)
    }
}

/// The source group: free text without delimiters, often empty.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Group(Option<Arc<str>>);

impl Group {
    /// A group from its text.
    ///
    /// # Errors
    /// [`NameError`] when the text is too long or holds a delimiter.
    pub fn new(text: &str) -> Result<Self, NameError> {
        check("source group", text, &['$', '|'])?;
        Ok(Self((!text.is_empty()).then(|| text.into())))
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        self.0.as_deref().unwrap_or_default()
    }
}

/// What the content of an envelope is written in.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum ContentType {
    /// LMCP bytes as they came.
    Lmcp,
    /// A UMAA Support Operations type whose description is exactly ours, in postcard.
    Umaa,
    /// Any other UMAA or DDS sample: its CDR bytes as they came, with their representation id.
    Cdr,
    /// A request or answer of Aldis's own services, in postcard.
    Aldis,
    /// Something that we carry and do not read.
    Other(Name),
}

impl ContentType {
    /// A content type from its text.
    ///
    /// # Errors
    /// [`NameError`] when the text is not a name.
    pub fn new(text: &str) -> Result<Self, NameError> {
        Ok(match text {
            "lmcp" => Self::Lmcp,
            "umaa" => Self::Umaa,
            "cdr" => Self::Cdr,
            "aldis" => Self::Aldis,
            "" => return Err(NameError::Empty("content type")),
            other => Self::Other(Name::new(other)?),
        })
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        match self {
            Self::Lmcp => "lmcp",
            Self::Umaa => "umaa",
            Self::Cdr => "cdr",
            Self::Aldis => "aldis",
            Self::Other(name) => name.as_str(),
        }
    }
}

macro_rules! text_conversions {
    ($($t:ident),*) => {$(
        impl TryFrom<String> for $t {
            type Error = NameError;
            fn try_from(text: String) -> Result<Self, NameError> {
                Self::new(&text)
            }
        }
        impl From<$t> for String {
            fn from(text: $t) -> String {
                text.as_str().to_owned()
            }
        }
        impl fmt::Display for $t {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(self.as_str())
            }
        }
        impl fmt::Debug for $t {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "{:?}", self.as_str())
            }
        }
    )*};
}
text_conversions!(Name, Descriptor, Group, ContentType);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_refuses_what_delimits_and_what_looks_like_an_id() {
        assert!(Name::new("afrl.cmasi.AirVehicleState").is_ok());
        assert!(Name::new("eidolon").is_ok());
        assert!(matches!(Name::new("a$b"), Err(NameError::Delimiter { delimiter: '$', .. })));
        assert!(matches!(Name::new("a|b"), Err(NameError::Delimiter { delimiter: '|', .. })));
        assert!(matches!(Name::new("eid4x"), Err(NameError::NotAnId(_))));
        assert!(matches!(Name::new(""), Err(NameError::Empty(_))));
        assert!(matches!(Name::new(&"x".repeat(513)), Err(NameError::TooLong { bytes: 513, .. })));
    }

    #[test]
    fn serde_refuses_the_same() {
        assert!(serde_json::from_str::<Name>("\"a$b\"").is_err());
        assert!(serde_json::from_str::<Group>("\"a|b\"").is_err());
        assert_eq!(serde_json::from_str::<ContentType>("\"lmcp\"").unwrap(), ContentType::Lmcp);
    }
}
