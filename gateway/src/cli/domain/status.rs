//! The routes of a bridge, as it tells them.

use crate::cli::exit::Failure;
use crate::cli::link::ask_service;
use crate::cli::member::Join;
use crate::cli::print_line;
use aldis_envelope::aldis::DOMAIN_QUERY;
use aldis_envelope::{EntityId, ServiceId, Source};
use aldis_services::domain::{DomainStatus, RouteStatus};
use serde_json::json;

/// Show the routes of a bridge, with both sides' quality of service.
#[derive(clap::Args)]
pub(super) struct Ls {
    /// The node.
    #[arg(long, default_value = "1")]
    node: EntityId,
    /// The service id of the bridge.
    #[arg(long, default_value = "30")]
    service: ServiceId,
    /// One JSON object.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    join: Join,
}

impl Ls {
    pub(super) fn run(self) -> Result<(), Failure> {
        let to = Source::new(self.node, self.service);
        let status: DomainStatus = ask_service(&self.join, to, DOMAIN_QUERY, Vec::new())?;
        if self.json {
            let routes = status.routes.iter().map(|route| {
                json!({ "topic": route.topic, "type": route.type_name, "way": way(route), "own": route.own,
                        "others": route.others, "state": route.state, "troubles": route.troubles,
                        "crossed": route.crossed })
            });
            let counters: serde_json::Map<_, _> =
                status.counters.iter().map(|(name, value)| (name.clone(), (*value).into())).collect();
            let whole = json!({ "partition": status.partition, "stands_by_for": status.stands_by_for,
                                "routes": routes.collect::<Vec<_>>(), "left_out": status.left_out, "counters": counters });
            print_line(whole);
            return Ok(());
        }
        if let Some(entity) = status.stands_by_for {
            print_line(format_args!("stands by: entity {entity} bridges this domain"));
        }
        for route in &status.routes {
            print_line(format_args!(
                "{} {}: {}, {} crossed",
                way(route),
                route.topic,
                route.state,
                route.crossed
            ));
            print_line(format_args!("  bridge  {}", route.own));
            route.others.iter().for_each(|other| print_line(format_args!("  domain  {other}")));
            route.troubles.iter().for_each(|trouble| print_line(format_args!("  ! {trouble}")));
        }
        status
            .left_out
            .iter()
            .for_each(|(topic, why)| print_line(format_args!("not bridged: {topic}: {why}")));
        let counted = status.counters.iter().filter(|(_, value)| *value > 0);
        let counted: Vec<_> = counted.map(|(name, value)| format!("{name} {value}")).collect();
        print_line(format_args!("counted: {}", counted.join(", ")));
        Ok(())
    }
}

fn way(route: &RouteStatus) -> &'static str {
    if route.inward { "in" } else { "out" }
}
