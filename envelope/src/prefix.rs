//! Subscriptions: which addresses a prefix receives (uxas-wire, Envelope).

use crate::address::{Address, Dialect};
use crate::name::{NameError, TEXT_BYTES_MAX, looks_like_an_id};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::sync::Arc;

/// A subscription. Names match left to right as text; an id is matched whole, so that `eid200` never receives what is
/// addressed to `eid2000`.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Prefix {
    /// Every address whose text begins with this one; the empty text is every address.
    Text(Arc<str>),
    /// An id, matched whole: `eid200` receives all that is addressed to the entity and to its services,
    /// `eid200sid5` what is addressed to that service.
    Id(Address),
}

impl Prefix {
    /// A prefix from its text.
    ///
    /// # Errors
    /// [`NameError`] when the text holds a delimiter, is too long, or begins like an id and is none.
    pub fn new(text: &str) -> Result<Self, NameError> {
        if looks_like_an_id(text) {
            return Ok(Self::Id(Address::new(text)?));
        }
        if text.len() > TEXT_BYTES_MAX {
            return Err(NameError::TooLong { what: "prefix", bytes: text.len() });
        }
        if let Some(delimiter) = text.chars().find(|c| matches!(c, '$' | '|')) {
            let text = crate::name::shortened(text);
            return Err(NameError::Delimiter { what: "prefix", text, delimiter });
        }
        Ok(Self::Text(text.into()))
    }

    /// The prefix that receives everything.
    pub fn all() -> Self {
        Self::Text("".into())
    }

    /// Whether a message with this address is received.
    pub fn matches(&self, address: &Address) -> bool {
        match (self, address) {
            (Self::Text(prefix), Address::Name(name)) => name.as_str().starts_with(&**prefix),
            (Self::Text(prefix), id) => id_text(id).starts_with(&**prefix),
            (Self::Id(Address::Entity(entity)), address) => address.entity() == Some(*entity),
            (Self::Id(id), address) => id == address,
        }
    }
}

/// Ids in the spelling that OpenUxAS compares as text.
fn id_text(id: &Address) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = id.write(Dialect::OpenUxas, &mut text);
    text
}

impl TryFrom<String> for Prefix {
    type Error = NameError;
    fn try_from(text: String) -> Result<Self, NameError> {
        Self::new(&text)
    }
}

impl From<Prefix> for String {
    fn from(prefix: Prefix) -> String {
        prefix.to_string()
    }
}

impl fmt::Display for Prefix {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Id(id) => id.fmt(f),
        }
    }
}

impl fmt::Debug for Prefix {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every prefix of the table in the wire specification, with what it must and must not receive.
    const TABLE: [(&str, &[&str], &[&str]); 9] = [
        ("afrl.cmasi", &["afrl.cmasi", "afrl.cmasi.Circle", "afrl.cmasix"], &["afrl.cmas", "eid1"]),
        ("afrl.cmasi.", &["afrl.cmasi.Circle"], &["afrl.cmasi", "afrl.cmasix"]),
        (
            "afrl.cmasi.AirVehicle",
            &["afrl.cmasi.AirVehicleState", "afrl.cmasi.AirVehicleConfiguration"],
            &["afrl.cmasi.Air", "afrl::cmasi::AirVehicleState"],
        ),
        ("UMAA::", &["UMAA::SO::HealthReport::HealthReport"], &["UMAA", "UMAA.SO", "UMAA:"]),
        ("UMAA::SO::Health", &["UMAA::SO::HealthReport::HealthReport"], &["UMAA::SO::LogReport::LogReport"]),
        (
            "eid200",
            &["eid200", "eid200.sid5", "eid200sid50", "eid200.sidall"],
            &["eid2000", "eid2000.sid5", "eid20"],
        ),
        ("eid200.sid5", &["eid200sid5"], &["eid200.sid50", "eid200.sidall", "eid200", "eid2000.sid5"]),
        ("Aircraft", &["AircraftPathPlanner", "Aircraft"], &["GroundPathPlanner", "aircraft"]),
        ("", &["afrl.cmasi.Circle", "eid1", "eid1.sid2", "AircraftPathPlanner"], &[]),
    ];

    #[test]
    fn the_table_of_the_wire_specification() {
        for (prefix, received, not_received) in TABLE {
            let prefix = Prefix::new(prefix).unwrap();
            for address in received {
                assert!(prefix.matches(&Address::new(address).unwrap()), "{prefix:?} receives {address}");
            }
            for address in not_received {
                assert!(
                    !prefix.matches(&Address::new(address).unwrap()),
                    "{prefix:?} must not get {address}"
                );
            }
        }
    }

    #[test]
    fn a_prefix_that_is_half_an_id_is_refused() {
        for text in ["eid200.", "eid200.sid", "eid2x"] {
            assert!(matches!(Prefix::new(text), Err(NameError::NotAnId(_))), "{text}");
        }
    }
}
