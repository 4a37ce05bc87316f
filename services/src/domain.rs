//! A DDS domain beside the fleet: what its writers say goes out on the bus, what the fleet says its readers get.
//!
//! The bridge is a service. So the node repairs, orders and retains for it as for any other (`dds`), and who comes late on one side
//! gets what the other side has. **Routes** are its own readers and writers in the domain, opened by what discovery finds: a reader
//! for a topic that somebody writes, a writer for one that somebody reads.

mod agreement;
mod config;
mod incoming;
mod outgoing;
mod presence;
mod report;
mod routes;
#[cfg(test)]
mod tests;
mod topics;

pub use config::DomainConfig;
pub use presence::mark;
pub use report::{DomainStatus, RouteStatus};

use crate::counters::counters;
use crate::map::dds::Lost;
use crate::service::domain::{Arrival, DomainCommand, DomainEvent, DomainGuid, Endpoint, RouteId};
use crate::service::{Input, Level, Outbox, Service};
use aldis_envelope::{Monotonic, Now, Prefix, Refusal, aldis};
use incoming::Registered;
use outgoing::Written;
use presence::Presence;
use routes::Routes;
use std::collections::{BTreeMap, BTreeSet};
use topics::Topics;

/// How many changes wait for what discovery says of their writer, for each writer: news of it is on its way already.
const EARLY_MAX: usize = 1_024;
/// How many writers may have changes waiting so.
const EARLY_WRITERS_MAX: usize = 256;

counters! {
    /// What the bridge to a domain counts.
    DomainCounters {
    /// Changes that went from the domain to the fleet.
    imported,
    /// Changes that went from the fleet to the domain.
    exported,
    /// Changes that were no sample of their type.
    refused_malformed,
    /// Disposes and unregisters that named an instance by its hash alone, of which nothing is known.
    refused_unknown_key,
    /// Changes for the domain that Cyclone DDS refused.
    refused_write,
    /// Changes for the domain that were dropped because its readers confirmed nothing for too long.
    shed_stalled,
    /// Changes from a writer that discovery never told of.
    shed_unannounced,
    /// Changes that another gateway had written.
    echoes_stopped,
    /// Kinds of what the other version of UMAA cannot say.
    untranslatable,
    /// Instances that were left by the last who wrote them.
    instances_left,
    /// Endpoints that did not come together with a route.
    mismatches,
    }
}

/// The bridge of one domain and partition.
pub struct Domain {
    config: DomainConfig,
    topics: Topics,
    endpoints: BTreeMap<DomainGuid, Endpoint>,
    presence: Presence,
    routes: Routes,
    /// By route: who has which instance registered.
    registered: BTreeMap<RouteId, Registered>,
    /// By route: what was written for whom.
    written: BTreeMap<RouteId, Written>,
    /// Changes of writers that discovery has not told of yet.
    early: BTreeMap<DomainGuid, Vec<(RouteId, Arrival)>>,
    /// Writers that have just been opened beside others of their address: what is retained comes again, for them.
    fresh: BTreeSet<RouteId>,
    /// By route: a policy that keeps some endpoint away, of which discovery may still tell, and until when.
    unexplained: BTreeMap<RouteId, (Monotonic, String)>,
    counters: DomainCounters,
    /// The addresses of which messages are received.
    subscribed: BTreeSet<String>,
    congested: bool,
}

impl Domain {
    /// The bridge, before anything is known of its domain.
    pub fn new(config: DomainConfig) -> Self {
        Self {
            topics: Topics::new(&config),
            presence: Presence::new(&config),
            config,
            endpoints: BTreeMap::new(),
            routes: Routes::default(),
            registered: BTreeMap::new(),
            written: BTreeMap::new(),
            early: BTreeMap::new(),
            fresh: BTreeSet::new(),
            unexplained: BTreeMap::new(),
            counters: DomainCounters::default(),
            subscribed: BTreeSet::new(),
            congested: false,
        }
    }

    fn domain(&mut self, now: Now, event: DomainEvent, out: &mut Outbox) {
        match event {
            DomainEvent::Joined => {}
            DomainEvent::Endpoint(endpoint) => self.endpoint(*endpoint, out),
            DomainEvent::EndpointGone(guid) => {
                self.early.remove(&guid);
                if self.endpoints.remove(&guid).is_some() {
                    self.route_anew(out);
                }
            }
            DomainEvent::Participant(guid, data) => {
                if self.presence.came(guid, &data) {
                    self.route_anew(out);
                }
            }
            DomainEvent::ParticipantGone(guid) => {
                if self.presence.went(guid) {
                    self.route_anew(out);
                }
            }
            DomainEvent::Opened(route, result) => {
                if let Some(trouble) = self.routes.opened(route, result) {
                    out.note(Level::Warning, trouble);
                }
            }
            DomainEvent::Arrived(route, arrival) => self.arrived(route, arrival, out),
            DomainEvent::WriterGone(route, writer, autodispose) => {
                self.early.remove(&writer);
                self.writer_gone(route, writer, autodispose, out);
            }
            DomainEvent::Mismatch(route, policy) => self.mismatch(now, route, policy, out),
            DomainEvent::Refused(route, why) => {
                self.counters.refused_write += 1;
                if let Some(text) = self.routes.first_trouble(route, &why) {
                    out.note(Level::Warning, text);
                }
            }
            DomainEvent::Waiting(count) => {
                let congested = count > self.config.queue_max / 2;
                if congested != self.congested {
                    self.congested = congested;
                    out.congested(congested);
                }
            }
            DomainEvent::Shed(route, count) => {
                self.counters.shed_stalled += count;
                if let Some(route) = self.routes.get(route) {
                    let topic = &route.topic;
                    out.note(
                        Level::Warning,
                        format!("{count} changes of {topic} dropped: its readers confirm nothing"),
                    );
                }
            }
        }
    }

    fn endpoint(&mut self, endpoint: Endpoint, out: &mut Outbox) {
        let guid = endpoint.guid;
        self.endpoints.insert(guid, endpoint);
        self.route_anew(out);
        for (route, arrival) in self.early.remove(&guid).unwrap_or_default() {
            self.arrived(route, arrival, out);
        }
    }

    /// Opens and closes routes for those that are there.
    fn route_anew(&mut self, out: &mut Outbox) {
        let wanted = self.wanted();
        let (opened, closed) = self.routes.change(wanted, &mut self.topics);
        for route in closed {
            self.close(route, out);
        }
        self.topics.keep(&self.routes.topics());
        let mut again = BTreeSet::new();
        for opening in opened {
            if let Some(route) = self.routes.get(opening.route).filter(|_| opening.writes) {
                if self.subscribed.contains(&route.address) {
                    self.fresh.insert(opening.route);
                    again.insert(route.address.clone());
                }
                if route.translated {
                    self.topics.say_all_again();
                }
            }
            out.domain(DomainCommand::Open(Box::new(opening)));
        }
        let addresses: BTreeSet<String> = self.routes.addresses().map(str::to_owned).collect();
        if addresses != self.subscribed {
            out.subscribe(addresses.iter().filter_map(|address| Prefix::new(address).ok()).collect());
            self.subscribed = addresses;
        }
        if !again.is_empty() {
            out.tell_again(again.iter().filter_map(|address| Prefix::new(address).ok()).collect());
        }
    }

    /// Says what the other version of UMAA cannot, which comes once for each kind.
    fn lost(&mut self, lost: &[Lost], out: &mut Outbox) {
        for lost in lost {
            self.counters.untranslatable += 1;
            out.note(Level::Warning, lost.to_string());
        }
    }
}

impl Service for Domain {
    fn follows_bus(&self) -> bool {
        true
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.unexplained.values().map(|(until, _)| *until).min()
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        if let Input::Again(envelope) = input {
            self.leaves(envelope, true, out);
            return;
        }
        self.fresh.clear();
        match input {
            Input::Domain(event) => self.domain(now, event, out),
            Input::Deadline => self.explain(now, out),
            Input::Message(envelope) if envelope.message.call.is_some() => {
                if envelope.message.label.descriptor() == aldis::DOMAIN_QUERY {
                    self.report(envelope, out);
                } else {
                    let what = envelope.message.label.descriptor().to_owned();
                    out.refuse(envelope, Refusal::NotUnderstood(what));
                }
            }
            Input::Message(envelope) => self.leaves(envelope, false, out),
            Input::Token(source, false) => self.source_gone(source, out),
            _ => {}
        }
    }
}
