//! Endpoints that do not come together with a route, and why.

use super::Domain;
use super::routes::Way;
use crate::map::dds::{in_words, mismatches};
use crate::service::Outbox;
use crate::service::domain::{Endpoint, RouteId};
use aldis_envelope::Now;
use std::time::Duration;

/// How long a policy that keeps an endpoint away may stay unexplained: Cyclone DDS may tell of it before it tells of the endpoint.
const EXPLAIN_WITHIN: Duration = Duration::from_secs(2);

impl Domain {
    /// An endpoint does not come together with a route.
    pub(super) fn mismatch(&mut self, now: Now, id: RouteId, policy: String, out: &mut Outbox) {
        if !self.tell_differences(id, out) {
            self.unexplained.entry(id).or_insert((now.monotonic + EXPLAIN_WITHIN, policy));
        }
    }

    /// Tells what has stayed unexplained for long enough. An endpoint that another route is there for is no trouble.
    pub(super) fn explain(&mut self, now: Now, out: &mut Outbox) {
        let due = self.unexplained.iter().filter(|(_, (until, _))| *until <= now.monotonic);
        let due: Vec<RouteId> = due.map(|(id, _)| *id).collect();
        for id in due {
            let Some((_, policy)) = self.unexplained.remove(&id) else { continue };
            if self.tell_differences(id, out) {
                continue;
            }
            let Some(route) = self.routes.get(id) else { continue };
            if self.facing(id).any(|endpoint| !route.serves(endpoint)) {
                continue;
            }
            let verb = if route.way == Way::In { "requests" } else { "offers" };
            let theirs =
                self.facing(id).map(|endpoint| in_words(&endpoint.quality)).collect::<Vec<_>>().join("; ");
            let own = in_words(&route.quality);
            self.counters.mismatches += 1;
            self.trouble(
                id,
                &format!("{policy} does not agree: the bridge {verb} {own}, the other side {theirs}"),
                out,
            );
        }
    }

    /// The bridged endpoints on the other side of a route's topic.
    fn facing(&self, id: RouteId) -> impl Iterator<Item = &Endpoint> {
        let route = self.routes.get(id);
        let faces = move |endpoint: &&Endpoint| route.is_some_and(|route| route.faces(endpoint));
        self.endpoints.values().filter(faces).filter(|endpoint| self.is_bridged(endpoint))
    }

    /// Tells in which policies endpoints that a route is there for differ from it; whether any do.
    fn tell_differences(&mut self, id: RouteId, out: &mut Outbox) -> bool {
        let Some(route) = self.routes.get(id) else { return true };
        let differ = |endpoint: &Endpoint| match route.way {
            Way::In => mismatches(&endpoint.quality, &route.quality),
            Way::Out => mismatches(&route.quality, &endpoint.quality),
        };
        let served = self.facing(id).filter(|endpoint| route.serves(endpoint));
        let mut found: Vec<String> = served.flat_map(differ).map(|mismatch| mismatch.to_string()).collect();
        found.sort();
        found.dedup();
        if !found.is_empty() {
            self.counters.mismatches += 1;
            self.trouble(id, &found.join("; "), out);
        }
        !found.is_empty()
    }
}
