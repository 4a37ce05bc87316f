//! What a bridge to a domain says of itself.

use super::Domain;
use super::routes::Way;
use crate::map::dds::in_words;
use crate::service::Outbox;
use aldis_envelope::{ContentType, Envelope, Name, aldis};
use serde::{Deserialize, Serialize};

/// What a bridge to a domain says of itself.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DomainStatus {
    /// Its partition.
    pub partition: String,
    /// The entity of the gateway that bridges in its place.
    pub stands_by_for: Option<u64>,
    /// Its routes.
    pub routes: Vec<RouteStatus>,
    /// Endpoints that are not bridged: topic, and why.
    pub left_out: Vec<(String, String)>,
    /// What it counts.
    pub counters: Vec<(String, u64)>,
}

/// One route.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RouteStatus {
    /// Its topic.
    pub topic: String,
    /// Its type.
    pub type_name: String,
    /// Whether it goes from the domain to the fleet.
    pub inward: bool,
    /// What the bridge requests or offers.
    pub own: String,
    /// What the endpoints of the domain offer or request.
    pub others: Vec<String>,
    /// How it is: `open`, `opening`, or why it is not.
    pub state: String,
    /// Troubles that were seen.
    pub troubles: Vec<String>,
    /// How many changes crossed.
    pub crossed: u64,
}

impl Domain {
    pub(super) fn report(&self, request: &Envelope, out: &mut Outbox) {
        let Ok(name) = Name::new(aldis::DOMAIN_STATUS) else { return };
        out.reply(request, ContentType::Aldis, name, aldis::encode(&self.status()).into(), true);
    }

    /// What the bridge says of itself.
    pub fn status(&self) -> DomainStatus {
        let routes = self.routes.all().map(|route| {
            let inward = route.way == Way::In;
            let other = |endpoint: &&crate::service::domain::Endpoint| {
                route.faces(endpoint) && self.is_bridged(endpoint)
            };
            RouteStatus {
                topic: route.topic.clone(),
                type_name: route.type_name.clone(),
                inward,
                own: in_words(&route.quality),
                others: self.endpoints.values().filter(other).map(|e| in_words(&e.quality)).collect(),
                state: match &route.state {
                    None => "opening".to_owned(),
                    Some(Ok(())) => "open".to_owned(),
                    Some(Err(why)) => why.clone(),
                },
                troubles: route.told.clone(),
                crossed: route.crossed,
            }
        });
        let left_out = self.endpoints.values().filter_map(|endpoint| {
            self.why_not(endpoint).map(|why| (endpoint.topic.clone(), why.to_owned()))
        });
        let mut left_out: Vec<_> = left_out.collect();
        left_out.sort();
        left_out.dedup();
        let counters = self.counters.list().into_iter().map(|(name, value)| (name.to_owned(), value));
        DomainStatus {
            partition: self.config.partition.clone(),
            stands_by_for: self.presence.stands_by_for(),
            routes: routes.collect(),
            left_out,
            counters: counters.collect(),
        }
    }
}
