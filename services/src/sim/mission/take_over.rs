//! Who takes control of a vehicle at a time and commands nothing: what was under way there has to stop.

use crate::service::{Input, Level, Outbox, Service, ServiceSpec};
use crate::umaa::command::{Consumer, ConsumerSettings, Told};
use aldis_envelope::umaa::ResourceAllocationCommand;
use aldis_envelope::{DateTime, EntityId, Guid, Guids, Monotonic, Now, Prefix, ServiceId, Source};
use std::sync::Arc;
use std::time::Duration;

/// Control that is taken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TakeOver {
    /// When, from the start.
    pub at: Duration,
    /// Of which vehicle.
    pub vehicle: EntityId,
    /// Of which of its resources.
    pub resource: String,
}

struct Operator {
    guids: Guids,
    consumer: Consumer<ResourceAllocationCommand>,
    /// What is to be taken yet, by its time.
    left: Vec<TakeOver>,
}

/// The service that takes over.
pub(super) fn operator(own: Source, guids: &Guids, mut left: Vec<TakeOver>) -> ServiceSpec {
    left.sort_by_key(|one| one.at);
    let guids = guids.clone();
    let factory = Arc::new(move || -> Box<dyn Service> {
        let consumer = Consumer::new(own, guids.clone(), ConsumerSettings::default());
        Box::new(Operator { guids: guids.clone(), consumer, left: left.clone() })
    });
    ServiceSpec { source: own, name: "operator".to_owned(), factory }
}

impl Operator {
    fn take(&mut self, now: Now, one: &TakeOver, out: &mut Outbox) {
        let arbiter = self.guids.of_service(Source::new(one.vehicle, ServiceId::ALLOCATION));
        let wish = ResourceAllocationCommand {
            duration: None,
            resource_id: self.guids.of_resource(one.vehicle, &one.resource),
            time_stamp: DateTime::default(),
            source: Guid::NIL,
            session_id: Guid::NIL,
            destination: arbiter,
        };
        if let Err(why) = self.consumer.start(now, arbiter, wish, out) {
            out.note(Level::Error, format!("vehicle {}: {why}", one.vehicle));
        }
    }
}

impl Service for Operator {
    fn subscriptions(&self) -> Vec<Prefix> {
        self.consumer.subscriptions()
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        for news in self.consumer.handle(now, &input, out) {
            if let Told::Ended { outcome, .. } = news {
                out.note(Level::Warning, format!("control of a vehicle ended: {outcome:?}"));
            }
        }
        while let Some(one) = self.left.first().cloned()
            && Monotonic::since_start(one.at) <= now.monotonic
        {
            self.left.remove(0);
            self.take(now, &one, out);
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        let next = self.left.first().map(|one| Monotonic::since_start(one.at));
        [next, self.consumer.next_deadline()].into_iter().flatten().min()
    }
}
