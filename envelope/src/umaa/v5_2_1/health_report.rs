//! `UMAA::SO::HealthReport::HealthReport` (ICD 5.1.1, table 9).

use super::sourced;
use crate::guid::Guid;
use crate::time::DateTime;
use crate::umaa::structure::structure;
use crate::umaa::{ErrorCode, ErrorCondition, HealthKey, LongDescription, Topic};

structure! {
    /// The most recent health of one resource.
    #[derive(Eq)]
    HealthReport = "UMAA::SO::HealthReport::HealthReportType" {
        /// The kind of system.
        code: ErrorCode = "code",
        /// When the error occurred.
        log_time: DateTime = "logTime",
        /// How bad it is.
        severity: ErrorCondition = "severity",
        /// In words, for people.
        status: LongDescription = "status",
        /// When the report was made.
        time_stamp: DateTime = "timeStamp",
        /// Who reports (key).
        source: Guid = "source" [key],
        /// Whose health it is (key).
        resource_id: Guid = "resourceID" [key],
    }
}

impl Topic for HealthReport {
    const NAME: &'static str = "UMAA::SO::HealthReport::HealthReport";
    const TYPE_NAME: &'static str = "UMAA::SO::HealthReport::HealthReportType";
    type Key = HealthKey;

    fn key(&self) -> HealthKey {
        HealthKey { source: self.source, resource_id: self.resource_id }
    }
}

sourced!(HealthReport);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::umaa::{ContentError, decode, encode, label};
    use crate::{EntityId, ServiceId, Source};

    fn report() -> HealthReport {
        HealthReport {
            code: ErrorCode::Software,
            log_time: DateTime::new(1, 2).unwrap(),
            severity: ErrorCondition::Warn,
            status: LongDescription::new("ok").unwrap(),
            time_stamp: DateTime::new(3, 4).unwrap(),
            source: Guid([1; 16]),
            resource_id: Guid([2; 16]),
        }
    }

    #[test]
    fn the_content_is_the_members_in_the_order_of_the_wire() {
        let content = encode(&report());
        assert_eq!(content[..9], [8, 2, 4, 4, 2, b'o', b'k', 6, 8]);
        assert_eq!(content[9..], [[1; 16], [2; 16]].concat());
        assert_eq!(decode::<HealthReport>(&content), Ok(report()));
        assert!(label::<HealthReport>(Source::new(EntityId::new(1).unwrap(), ServiceId::HEALTH)).is_ok());
    }

    #[test]
    fn the_key_hash_is_the_digest_of_source_and_resource() {
        let instance = report().instance();
        assert_eq!(instance.hash, crate::KeyHash::md5(&[&[1; 16], &[2; 16]]));
    }

    #[test]
    fn what_is_not_exactly_a_report_is_refused() {
        let content = encode(&report());
        for cut in 0..content.len() {
            assert!(decode::<HealthReport>(&content[..cut]).is_err());
        }
        let longer = [&content[..], &[0]].concat();
        assert!(matches!(decode::<HealthReport>(&longer), Err(ContentError::Trailing { left: 1, .. })));
        let mut late = content.to_vec();
        late[0] = 9;
        assert!(matches!(decode::<HealthReport>(&late), Err(ContentError::Unreadable { .. })));
    }
}
