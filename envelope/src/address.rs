//! Addresses: where a message goes, in the spellings of OpenUxAS and of the UxAS slides.

use crate::id::{EntityId, IdError, ServiceId, Source, decimal};
use crate::name::{Name, NameError, looks_like_an_id, shortened};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// How a bridge writes ids: `eid400.sid37` or `eid400sid37`. Both are always read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Dialect {
    /// Dotted addresses (`eid400.sid37`) and bare decimal source ids (`400`, `37`): what OpenUxAS sends.
    #[default]
    OpenUxas,
    /// Addresses without a dot (`eid400sid37`) and source ids with their prefix (`eid400`, `sid37`).
    Slides,
}

/// Where a message goes.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Address {
    /// A message type (broadcast) or a mailbox (limitedcast).
    Name(Name),
    /// One service of one entity, `eid400sid37`.
    Service(Source),
    /// All services of an entity, `eid400sidall`.
    EntityServices(EntityId),
    /// The entity itself, `eid400`.
    Entity(EntityId),
}

impl Address {
    /// An address from its text in either spelling.
    ///
    /// # Errors
    /// [`NameError`] when the text is no valid name, or begins like an id and is none.
    pub fn new(text: &str) -> Result<Self, NameError> {
        if !looks_like_an_id(text) {
            return Ok(Self::Name(Name::new(text)?));
        }
        parse_id(text).map_err(|_| NameError::NotAnId(shortened(text)))
    }

    /// Writes the address in a dialect's spelling.
    pub fn write(&self, dialect: Dialect, out: &mut impl fmt::Write) -> fmt::Result {
        let dot = match dialect {
            Dialect::OpenUxas => ".",
            Dialect::Slides => "",
        };
        match self {
            Self::Name(name) => out.write_str(name.as_str()),
            Self::Service(to) => write!(out, "eid{}{dot}sid{}", to.entity, to.service),
            Self::EntityServices(entity) => write!(out, "eid{entity}{dot}sidall"),
            Self::Entity(entity) => write!(out, "eid{entity}"),
        }
    }

    /// The entity that an id address names; none for a name.
    pub fn entity(&self) -> Option<EntityId> {
        match self {
            Self::Name(_) => None,
            Self::Service(to) => Some(to.entity),
            Self::EntityServices(entity) | Self::Entity(entity) => Some(*entity),
        }
    }
}

fn parse_id(text: &str) -> Result<Address, IdError> {
    let rest = text.strip_prefix("eid").unwrap_or(text);
    let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
    let entity = EntityId::new(decimal(&rest[..digits])?)?;
    let tail = &rest[digits..];
    if tail.is_empty() {
        return Ok(Address::Entity(entity));
    }
    let sid = tail.strip_prefix('.').unwrap_or(tail).strip_prefix("sid");
    match sid {
        Some("all") => Ok(Address::EntityServices(entity)),
        Some(number) => Ok(Address::Service(Source::new(entity, ServiceId::new(decimal(number)?)?))),
        None => Err(IdError::NotANumber(shortened(text))),
    }
}

impl FromStr for Address {
    type Err = NameError;
    fn from_str(text: &str) -> Result<Self, NameError> {
        Self::new(text)
    }
}

impl TryFrom<String> for Address {
    type Error = NameError;
    fn try_from(text: String) -> Result<Self, NameError> {
        Self::new(&text)
    }
}

impl From<Address> for String {
    fn from(address: Address) -> String {
        address.to_string()
    }
}

impl From<Name> for Address {
    fn from(name: Name) -> Self {
        Self::Name(name)
    }
}

impl From<Source> for Address {
    fn from(source: Source) -> Self {
        Self::Service(source)
    }
}

/// The spelling of the slides: `eid400sid37`.
impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write(Dialect::Slides, f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_spellings_are_one_address() {
        for (dotted, plain) in
            [("eid400.sid37", "eid400sid37"), ("eid400.sidall", "eid400sidall"), ("eid400", "eid400")]
        {
            let address = Address::new(dotted).unwrap();
            assert_eq!(address, Address::new(plain).unwrap());
            let mut text = String::new();
            address.write(Dialect::OpenUxas, &mut text).unwrap();
            assert_eq!(text, dotted);
            assert_eq!(address.to_string(), plain);
        }
    }

    #[test]
    fn what_begins_like_an_id_is_one_or_is_refused() {
        for text in [
            "eid400.",
            "eid400.sid",
            "eid400sid0",
            "eid0",
            "eid400.sidfoo",
            "eid0400",
            "eid281474976710656",
            "eid4..sid1",
            "eid4.sid4294967296",
        ] {
            assert!(matches!(Address::new(text), Err(NameError::NotAnId(_))), "{text}");
        }
        assert!(matches!(Address::new("eidetic"), Ok(Address::Name(_))));
    }
}
