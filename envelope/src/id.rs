//! Identifiers of entities, services, sources and starts. Only valid values exist, also through serde.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::num::{NonZeroU32, NonZeroU64};
use std::str::FromStr;

/// Why a number or a text is not an identifier.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum IdError {
    /// The number is outside the range of an entity id.
    #[error("entity id {0} is outside 1 to {max}", max = EntityId::MAX)]
    Entity(u64),
    /// The number is outside the range of a service id.
    #[error("service id {0} is outside 1 to {max}", max = ServiceId::MAX)]
    Service(u64),
    /// The text is not a decimal number without sign and leading zeros.
    #[error("`{0}` is not a decimal number without sign and leading zeros")]
    NotANumber(String),
}

/// An entity of the fleet: a vehicle, a station, an operator. 1 to 2^48-1 (uxas-wire, Envelope).
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "u64", into = "u64")]
pub struct EntityId(NonZeroU64);

impl EntityId {
    /// The largest entity id: 48 bits, so that it fits a readable GUID.
    pub const MAX: u64 = (1 << 48) - 1;

    /// An entity id from its number.
    ///
    /// # Errors
    /// [`IdError::Entity`] outside 1 to [`EntityId::MAX`].
    pub const fn new(number: u64) -> Result<Self, IdError> {
        match NonZeroU64::new(number) {
            Some(n) if number <= Self::MAX => Ok(Self(n)),
            _ => Err(IdError::Entity(number)),
        }
    }

    /// The number.
    pub const fn get(self) -> u64 {
        self.0.get()
    }
}

/// A service of an entity, 1 to 2^32-1, unique on its entity.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "u64", into = "u64")]
pub struct ServiceId(NonZeroU32);

impl ServiceId {
    /// The largest service id.
    pub const MAX: u64 = u32::MAX as u64;
    /// The node itself: administration, counters, ping.
    pub const NODE: Self = Self(NonZeroU32::MIN);
    /// The health service of every node.
    pub const HEALTH: Self = Self(NonZeroU32::MIN.saturating_add(1));
    /// The log service of every node.
    pub const LOG: Self = Self(NonZeroU32::MIN.saturating_add(2));
    /// The arbiter of an entity's resources (UMAA ResourceAllocation), where it has one.
    pub const ALLOCATION: Self = Self(NonZeroU32::MIN.saturating_add(9));

    /// A service id from its number.
    ///
    /// # Errors
    /// [`IdError::Service`] outside 1 to [`ServiceId::MAX`].
    pub const fn new(number: u64) -> Result<Self, IdError> {
        if number > Self::MAX {
            return Err(IdError::Service(number));
        }
        match NonZeroU32::new(number as u32) {
            Some(n) => Ok(Self(n)),
            None => Err(IdError::Service(number)),
        }
    }

    /// The number.
    pub const fn get(self) -> u32 {
        self.0.get()
    }
}

/// Reads a decimal number as it stands in addresses and keys: no sign, no leading zeros.
pub(crate) fn decimal(text: &str) -> Result<u64, IdError> {
    let canonical = !text.is_empty()
        && text.bytes().all(|b| b.is_ascii_digit())
        && (text.len() == 1 || !text.starts_with('0'));
    let number = if canonical { text.parse().ok() } else { None };
    number.ok_or_else(|| IdError::NotANumber(text.chars().take(40).collect()))
}

macro_rules! id_conversions {
    ($id:ident) => {
        impl TryFrom<u64> for $id {
            type Error = IdError;
            fn try_from(number: u64) -> Result<Self, IdError> {
                Self::new(number)
            }
        }
        impl From<$id> for u64 {
            fn from(id: $id) -> u64 {
                u64::from(id.0.get())
            }
        }
        impl FromStr for $id {
            type Err = IdError;
            fn from_str(text: &str) -> Result<Self, IdError> {
                Self::new(decimal(text)?)
            }
        }
        impl fmt::Display for $id {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }
        impl fmt::Debug for $id {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }
    };
}
id_conversions!(EntityId);
id_conversions!(ServiceId);

/// Who sent a message: a service of an entity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Source {
    /// The entity that the service belongs to.
    pub entity: EntityId,
    /// The service on that entity.
    pub service: ServiceId,
}

impl Source {
    /// A source from its two ids.
    pub const fn new(entity: EntityId, service: ServiceId) -> Self {
        Self { entity, service }
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "eid{}sid{}", self.entity, self.service)
    }
}

/// One life of a node; larger means later. The number of starts where a journal keeps it, otherwise the
/// wall clock in nanoseconds at the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
pub struct BootId(pub u64);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_hold_their_ranges() {
        assert_eq!(EntityId::new(0), Err(IdError::Entity(0)));
        assert!(EntityId::new(EntityId::MAX).is_ok());
        assert_eq!(EntityId::new(1 << 48), Err(IdError::Entity(1 << 48)));
        assert!(ServiceId::new(u64::from(u32::MAX)).is_ok());
        assert_eq!(ServiceId::new(1 << 32), Err(IdError::Service(1 << 32)));
        assert_eq!((ServiceId::LOG.get(), ServiceId::ALLOCATION.get()), (3, 10));
    }

    #[test]
    fn serde_takes_the_same_road() {
        assert_eq!(serde_json::from_str::<EntityId>("400").unwrap().get(), 400);
        assert!(serde_json::from_str::<EntityId>("0").unwrap_err().to_string().contains("outside 1 to"));
        assert!(serde_json::from_str::<ServiceId>("4294967296").is_err());
    }

    #[test]
    fn only_canonical_decimals_are_ids() {
        for text in ["", "007", "+7", "-1", "7a", "99999999999999999999"] {
            assert!(text.parse::<EntityId>().is_err(), "{text}");
        }
        assert_eq!("7".parse::<EntityId>().unwrap().to_string(), "7");
    }
}
