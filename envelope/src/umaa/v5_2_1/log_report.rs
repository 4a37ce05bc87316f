//! `UMAA::SO::LogReport::LogReport` (ICD 5.1.2, table 11).

use super::report;
use crate::guid::Guid;
use crate::time::DateTime;
use crate::umaa::{LogLevel, LongDescription};
use serde::{Deserialize, Serialize};

/// An entry for the fleet's log.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
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

report!(LogReport, "UMAA::SO::LogReport::LogReport");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::umaa::{Topic, decode, encode, label};
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
