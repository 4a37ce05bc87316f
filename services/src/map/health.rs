//! What services of UxAS say of themselves, as health reports of UMAA (ICD 5.1.1).

use aldis_envelope::lmcp::cmasi::{ServiceStatus, ServiceStatusType};
use aldis_envelope::umaa::{ErrorCode, ErrorCondition, HealthReport, LongDescription};
use aldis_envelope::{Guids, Source, Wall};

/// The health of the service that sent a status, reported by another one.
///
/// An error impairs the service, a warning warns, an information says that all is well; what is told in words is the keys and
/// values of the status, in their order. A status knows no time of its own, so the report has that of its coming.
pub fn health_report(
    status: &ServiceStatus,
    of: Source,
    reporter: Source,
    guids: &Guids,
    came: Wall,
) -> HealthReport {
    let severity = match status.status_type {
        ServiceStatusType::Error => ErrorCondition::Error,
        ServiceStatusType::Warning => ErrorCondition::Warn,
        _ => ErrorCondition::None,
    };
    let code = if severity == ErrorCondition::None { ErrorCode::None } else { ErrorCode::Software };
    HealthReport {
        code,
        log_time: came.into(),
        severity,
        status: LongDescription::shortened(&in_words(status, of)),
        time_stamp: came.into(),
        source: guids.of_service(reporter),
        resource_id: guids.of_service(of),
    }
}

fn in_words(status: &ServiceStatus, of: Source) -> String {
    let told = status.info.iter().filter_map(|info| info.get());
    let told: Vec<_> = told
        .map(|info| match (info.key.as_str(), info.value.as_str()) {
            (key, "") => key.to_owned(),
            ("", value) => value.to_owned(),
            (key, value) => format!("{key}: {value}"),
        })
        .collect();
    match told.as_slice() {
        [] => of.to_string(),
        told => format!("{of}: {}", told.join("; ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aldis_envelope::lmcp::{Ref, cmasi::KeyValuePair};
    use aldis_envelope::{EntityId, Fleet, GuidForm, ServiceId};

    fn source(service: u64) -> Source {
        Source::new(EntityId::new(100).unwrap(), ServiceId::new(service).unwrap())
    }

    fn status(status_type: ServiceStatusType, info: &[(&str, &str)]) -> ServiceStatus {
        let pair =
            |&(key, value): &(&str, &str)| Ref::new(KeyValuePair { key: key.into(), value: value.into() });
        ServiceStatus { status_type, info: info.iter().map(pair).collect(), ..Default::default() }
    }

    #[test]
    fn an_error_is_told_with_who_failed_and_why() {
        let guids = Guids::new(&Fleet::new("blue").unwrap(), GuidForm::Readable);
        let report = |status: &ServiceStatus| {
            health_report(status, source(61), source(2), &guids, Wall(1_500_000_007))
        };
        let error = report(&status(ServiceStatusType::Error, &[("RequestID", "7"), ("no region", "")]));
        assert_eq!((error.severity, error.code), (ErrorCondition::Error, ErrorCode::Software));
        assert_eq!(error.status.as_str(), "eid100sid61: RequestID: 7; no region");
        assert_eq!(
            (error.resource_id, error.source),
            (guids.of_service(source(61)), guids.of_service(source(2)))
        );
        assert_eq!(Wall::from(error.time_stamp), Wall(1_500_000_007));
        let warning = report(&status(ServiceStatusType::Warning, &[]));
        assert_eq!((warning.severity, warning.status.as_str()), (ErrorCondition::Warn, "eid100sid61"));
        let well = report(&status(ServiceStatusType::Information, &[("", "started")]));
        assert_eq!((well.severity, well.code), (ErrorCondition::None, ErrorCode::None));
        let mut long = status(ServiceStatusType::Error, &[]);
        long.info =
            vec![Ref::new(KeyValuePair { key: "é".repeat(5_000).as_str().into(), ..Default::default() })];
        assert!(report(&long).status.as_str().len() <= LongDescription::MAX);
    }
}
