//! What services of UxAS say of themselves, as the health of a part of the node that a bridge leads to (ICD 5.1.1).

use crate::service::{Component, ComponentHealth, Condition};
use aldis_envelope::lmcp::cmasi::{ServiceStatus, ServiceStatusType};
use aldis_envelope::{ContentType, Message, Source, lmcp};

/// The type that is heard, and under which it is broadcast.
const STATUS: &str = "afrl.cmasi.ServiceStatus";

/// The health that a message tells; none where it is no status of a service, or one that cannot be read.
pub fn told(message: &Message) -> Option<ComponentHealth> {
    let label = &message.label;
    if label.descriptor() != STATUS || label.attributes.content_type != ContentType::Lmcp {
        return None;
    }
    lmcp::decode_as::<ServiceStatus>(&message.content).ok().map(|status| health(&status, label.source()))
}

/// The health of the service that sent a status.
///
/// With an error it has failed at something, with a warning it is degraded, an information says that all is well; what is told in words
/// is the keys and values of the status, in their order.
pub fn health(status: &ServiceStatus, of: Source) -> ComponentHealth {
    let condition = match status.status_type {
        ServiceStatusType::Error => Condition::Failed,
        ServiceStatusType::Warning => Condition::Degraded,
        _ => Condition::Well,
    };
    ComponentHealth { component: Component::Service(of), condition, status: in_words(status) }
}

fn in_words(status: &ServiceStatus) -> String {
    let told = status.info.iter().filter_map(|info| info.get());
    let told: Vec<_> = told
        .map(|info| match (info.key.as_str(), info.value.as_str()) {
            (key, "") => key.to_owned(),
            ("", value) => value.to_owned(),
            (key, value) => format!("{key}: {value}"),
        })
        .collect();
    if told.is_empty() { "says no more".into() } else { told.join("; ") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aldis_envelope::lmcp::{Ref, cmasi::KeyValuePair};
    use aldis_envelope::{EntityId, Label, Name, ServiceId};
    use std::sync::Arc;

    fn source() -> Source {
        Source::new(EntityId::new(100).unwrap(), ServiceId::new(61).unwrap())
    }

    fn status(status_type: ServiceStatusType, info: &[(&str, &str)]) -> ServiceStatus {
        let pair =
            |&(key, value): &(&str, &str)| Ref::new(KeyValuePair { key: key.into(), value: value.into() });
        ServiceStatus { status_type, info: info.iter().map(pair).collect(), ..Default::default() }
    }

    #[test]
    fn an_error_is_told_with_who_failed_and_why() {
        let error = status(ServiceStatusType::Error, &[("RequestID", "7"), ("no region", "")]);
        let health = health(&error, source());
        assert_eq!((health.component, health.condition), (Component::Service(source()), Condition::Failed));
        assert_eq!(health.status, "RequestID: 7; no region");
    }

    #[test]
    fn warnings_degrade_and_informations_say_that_all_is_well() {
        let warning = health(&status(ServiceStatusType::Warning, &[]), source());
        assert_eq!((warning.condition, warning.status.as_str()), (Condition::Degraded, "says no more"));
        let well = health(&status(ServiceStatusType::Information, &[("", "started")]), source());
        assert_eq!((well.condition, well.status.as_str()), (Condition::Well, "started"));
    }

    #[test]
    fn a_message_tells_it_where_it_is_a_status() {
        let message = |name: &str, content: Vec<u8>| {
            let label = Label::broadcast(ContentType::Lmcp, Name::new(name).unwrap(), source());
            told(&Message::new(Arc::new(label), content.into()))
        };
        let status = lmcp::encode(&status(ServiceStatusType::Error, &[])).unwrap();
        assert_eq!(message(STATUS, status.clone()).map(|health| health.condition), Some(Condition::Failed));
        assert_eq!(message("afrl.cmasi.KeyValuePair", status.clone()), None);
        assert_eq!(message(STATUS, status[..20].to_vec()), None);
    }
}
