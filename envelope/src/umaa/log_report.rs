//! `UMAA::SO::LogReport::LogReport` (ICD 5.1.2, table 11).

use super::{LongDescription, Topic};
use crate::change::KeyWidth;
use crate::guid::Guid;
use crate::time::DateTime;
use bytes::Bytes;
use serde::{Deserialize, Serialize};

/// The level of an entry (`LogLevelEnumType`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum LogLevel {
    /// Something failed.
    Error,
    /// Worth knowing.
    Information,
    /// Worth a look.
    Warning,
}

/// An entry for the fleet's log.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LogReport {
    /// In words, for people.
    pub entry: LongDescription,
    /// Its level.
    pub level: LogLevel,
    /// When it was made.
    pub time_stamp: DateTime,
    /// Who reports (key).
    pub source: Guid,
}

impl Topic for LogReport {
    const NAME: &'static str = "UMAA::SO::LogReport::LogReport";
    /// One GUID, 16 bytes.
    const KEY_WIDTH: KeyWidth = KeyWidth::Fits16;

    fn key(&self) -> Bytes {
        Bytes::copy_from_slice(&self.source.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::umaa::{decode, encode, label};
    use crate::{EntityId, ServiceId, Source};

    #[test]
    fn the_instance_is_the_source() {
        let report = LogReport {
            entry: LongDescription::new("é").unwrap(),
            level: LogLevel::Warning,
            time_stamp: DateTime::new(-1, 0).unwrap(),
            source: Guid([7; 16]),
        };
        assert_eq!(report.instance().hash.0, [7; 16]);
        assert_eq!(decode::<LogReport>(&encode(&report)), Ok(report));
        assert!(label::<LogReport>(Source::new(EntityId::new(1).unwrap(), ServiceId::LOG)).is_ok());
    }
}
