//! Nodes of a benchmark: peers that know each other by address alone, each with one service.

use crate::cli::exit::Failure;
use crate::cli::member::Member;
use crate::config::Config;
use crate::runtime;
use aldis_envelope::{ContentType, EntityId, Label, Name, ServiceId, Source};
use aldis_services::{Service, ServiceSpec};
use std::sync::Arc;

/// A node's `[bus]` table as text.
pub(super) fn configuration(entity: u64, bus: &str) -> Result<Config, Failure> {
    let text = format!("name = \"bench-{entity}\"\nfleet = \"bench\"\nentities = [{entity}]\n[bus]\n{bus}\n");
    Config::parse("bench", &text).map_err(Failure::from)
}

/// The service of a node.
pub(super) fn source(entity: u64) -> Result<Source, Failure> {
    let ids = EntityId::new(entity).and_then(|e| ServiceId::new(100).map(|s| Source::new(e, s)));
    ids.map_err(|why| Failure::Failed(why.to_string()))
}

/// The label of what the service broadcasts.
pub(super) fn label(name: &str, from: Source) -> Result<Arc<Label>, Failure> {
    let name = Name::new(name).map_err(|why| Failure::Failed(why.to_string()))?;
    Ok(Arc::new(Label::broadcast(ContentType::Cdr, name, from)))
}

/// A node whose service is made once: it is not expected to crash.
pub(super) fn member(
    entity: u64,
    bus: &str,
    make: impl Fn() -> Box<dyn Service> + Send + Sync + 'static,
) -> Result<Member, Failure> {
    let config = configuration(entity, bus)?;
    let outside = runtime::outside(&config).map_err(|why| Failure::Failed(why.to_string()))?;
    let mut node = runtime::node_config(&config);
    node.services.push(ServiceSpec {
        source: source(entity)?,
        name: "bench".into(),
        factory: Arc::new(make),
    });
    Member::start(node, outside)
}
