//! What service 1 says of its node.

use super::{Node, Origin, Work};
use aldis_envelope::aldis::{NodeStatus, ServiceStatus};
use aldis_envelope::{Address, Call, ContentType, Envelope, Label, Message, Name, Now, Role};
use bytes::Bytes;
use std::sync::Arc;

impl Node {
    pub(super) fn status(&self, now: Now) -> NodeStatus {
        let uptime = self.started.map(|started| now.monotonic - started).unwrap_or_default();
        let is_bridge = |source| self.bridges.iter().any(|bridge| bridge.spec.source == source);
        let here = |hosted: &&crate::host::Hosted| !hosted.is_removed() && !is_bridge(hosted.spec.source);
        let services = self.services.iter().filter(here);
        let services = services.map(|hosted| ServiceStatus {
            source: hosted.spec.source,
            name: hosted.spec.name.clone(),
            state: hosted.state().to_owned(),
        });
        let bridges = self.bridges.iter().map(|bridge| ServiceStatus {
            source: bridge.spec.source,
            name: bridge.spec.name.clone(),
            state: bridge.status(),
        });
        NodeStatus {
            node: self.entity(),
            entities: self.config.entities.clone(),
            boot: self.config.boot,
            uptime_ms: u64::try_from(uptime.as_millis()).unwrap_or(u64::MAX),
            services: services.chain(bridges).collect(),
            counters: self.all_counters(),
        }
    }

    /// Every counter of the node, of its bridges and links, those of a bridge or link with its name before.
    pub fn all_counters(&self) -> Vec<(String, u64)> {
        let own = self.counters.list().into_iter().map(|(name, value)| (name.to_owned(), value));
        let bridges = self.bridges.iter().flat_map(|bridge| {
            let prefix = &bridge.spec.name;
            bridge.counters.list().into_iter().map(move |(name, value)| (format!("{prefix}.{name}"), value))
        });
        own.chain(bridges).chain(self.links.counters()).collect()
    }

    /// Answers a request in the name of a service.
    pub(super) fn reply_as_host(
        &mut self,
        service: usize,
        request: &Envelope,
        descriptor: &str,
        content: Bytes,
    ) {
        let (Some(call), Ok(name)) = (&request.message.call, Name::new(descriptor)) else { return };
        let to = Address::Service(request.message.label.source());
        let from = self.services[service].spec.source;
        let content_type = if descriptor == aldis_envelope::aldis::PONG {
            request.message.label.attributes.content_type.clone()
        } else {
            ContentType::Aldis
        };
        let label = Arc::new(Label::limitedcast(to, content_type, name.into(), from));
        let call = Some(Box::new(Call { id: call.id, role: Role::Reply { last: true } }));
        let reply = Message { call, ..Message::new(label, content) };
        self.work.push_back(Work::new(Origin::Service(service), reply));
    }
}
