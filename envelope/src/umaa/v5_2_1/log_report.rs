//! `UMAA::SO::LogReport::LogReport` (ICD 5.1.2, table 11).

use super::report;
use crate::guid::Guid;
use crate::time::DateTime;
use crate::umaa::structure::structure;
use crate::umaa::{LogLevel, LongDescription};

structure! {
    /// An entry for the fleet's log.
    #[derive(Eq)]
    LogReport = "UMAA::SO::LogReport::LogReportType" {
        /// In words, for people.
        entry: LongDescription = "entry",
        /// Its level.
        level: LogLevel = "level",
        /// When it was made.
        time_stamp: DateTime = "timeStamp",
        /// Who reports (key).
        source: Guid = "source" [key],
    }
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
