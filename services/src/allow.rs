//! `[allow]`: which entities may call which services with which requests.

use aldis_envelope::{EntityId, ServiceId, aldis};

/// One rule: who may call what. Rules only add to the defaults.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AllowRule {
    /// The callers; none is everybody.
    pub from: Option<Vec<EntityId>>,
    /// The service; none is every service of the node.
    pub service: Option<ServiceId>,
    /// The beginnings of the descriptors allowed; the empty text is every request.
    pub requests: Vec<String>,
}

/// Requests that only read: everybody may send them.
const READING: [&str; 6] = [
    aldis::PING,
    aldis::NODE_QUERY,
    aldis::HEALTH_QUERY,
    aldis::LOG_QUERY,
    aldis::DOMAIN_QUERY,
    aldis::link::LINK_QUERY,
];

/// Requests that change how the node works begin so: only the own entities and the operators may send them.
const ADMINISTRATION: [&str; 3] =
    ["aldis.", "UMAA::SO::ResourceAllocation::ResourceAllocationPriority", "queue"];

/// Decides about requests.
#[derive(Debug, Clone, Default)]
pub struct Allow {
    trusted: Vec<EntityId>,
    rules: Vec<AllowRule>,
}

impl Allow {
    /// Rules of a node that speaks for `entities`.
    pub fn new(entities: &[EntityId], operators: &[EntityId], rules: Vec<AllowRule>) -> Self {
        Self { trusted: [entities, operators].concat(), rules }
    }

    /// Whether an entity may send a request to a service.
    ///
    /// # Errors
    /// Why not, for the caller.
    pub fn check(&self, from: EntityId, service: ServiceId, request: &str) -> Result<(), String> {
        let administers = ADMINISTRATION.iter().any(|prefix| request.starts_with(prefix));
        if READING.contains(&request) || self.trusted.contains(&from) || self.allows(from, service, request) {
            return Ok(());
        }
        let whom =
            if administers { "administers the node" } else { "is not in the list of reading requests" };
        Err(format!(
            "`{request}` {whom}, and entity {from} is neither an own entity nor an operator of this node; \
             an [[allow]] rule for service {service} can permit it"
        ))
    }

    fn allows(&self, from: EntityId, service: ServiceId, request: &str) -> bool {
        self.rules.iter().any(|rule| {
            rule.from.as_ref().is_none_or(|entities| entities.contains(&from))
                && rule.service.is_none_or(|allowed| allowed == service)
                && rule.requests.iter().any(|prefix| request.starts_with(prefix))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everybody_reads_and_only_the_trusted_do_more() {
        let id = |n| EntityId::new(n).unwrap();
        let rule = AllowRule {
            from: Some(vec![id(7)]),
            service: ServiceId::new(100).ok(),
            requests: vec!["plan.".into()],
        };
        let allow = Allow::new(&[id(400)], &[id(9000)], vec![rule]);
        let sid = |n| ServiceId::new(n).unwrap();
        for (from, service, request, allowed) in [
            (5, 100, "aldis.Ping", true),
            (5, 1, "aldis.NodeQuery", true),
            (5, 1, "aldis.Kill", false),
            (400, 1, "aldis.Kill", true),
            (9000, 1, "aldis.Kill", true),
            (7, 100, "plan.Route", true),
            (7, 101, "plan.Route", false),
            (8, 100, "plan.Route", false),
        ] {
            assert_eq!(
                allow.check(id(from), sid(service), request).is_ok(),
                allowed,
                "{from} {service} {request}"
            );
        }
        assert!(allow.check(id(5), sid(1), "aldis.Kill").unwrap_err().contains("administers the node"));
    }
}
