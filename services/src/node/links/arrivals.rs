//! What comes by a link enters the node.

use super::super::{Node, Origin, Passed, Work};
use crate::event::{Effect, LinkId};
use crate::link::{self, Delivery, DeliveryId};
use crate::service::Level;
use aldis_envelope::aldis::link as told;
use aldis_envelope::{ContentType, Envelope, Now, Role};

impl Node {
    /// A message came by a link. Its number is given back when it is handed on, so that what comes of it is written with that.
    pub(super) fn arrived_by_link(
        &mut self,
        now: Now,
        place: usize,
        delivery: Delivery,
        effects: &mut Vec<Effect>,
    ) {
        let Delivery { id, envelope, .. } = delivery;
        let label = &envelope.message.label;
        let source = label.source();
        let attached = &self.links.all[place];
        let origin = Origin::Link(LinkId(place));
        if label.attributes.content_type == ContentType::Aldis && label.descriptor() == told::SERVICES {
            self.services_told(now, place, &envelope, effects);
            self.done_for_link(origin, id);
        } else if label.attributes.content_type == ContentType::Aldis
            && matches!(label.descriptor(), told::CONFIRM_ASK | told::CONFIRMED)
        {
            self.told_of_confirmation(now, place, &envelope, effects);
            self.done_for_link(origin, id);
        } else if !attached.spec.export.behind.contains(&source.entity) {
            let text = format!(
                "{}: a message of {source} is refused: {} is not among the entities behind this link",
                attached.spec.name, source.entity
            );
            self.counters.refused_links += 1;
            self.say(now, Level::Warning, "refused at a link", text, effects);
            self.done_for_link(origin, id);
        } else {
            self.counters.imported_by_links += 1;
            self.links.destinations.hear(&envelope.message);
            self.import_by_link(now, place, id, envelope, effects);
            self.settle(now, effects);
        }
    }

    /// A message that came by a link is handed on, or safe here.
    pub(in crate::node) fn done_for_link(&mut self, origin: Origin, delivery: Option<DeliveryId>) {
        if let (Origin::Link(LinkId(place)), Some(delivery)) = (origin, delivery) {
            self.links.give(place, link::Event::Done { delivery, with: Vec::new() });
        }
    }

    fn import_by_link(
        &mut self,
        now: Now,
        place: usize,
        delivery: Option<DeliveryId>,
        envelope: Envelope,
        effects: &mut Vec<Effect>,
    ) {
        let Envelope { mut message, stamp } = envelope;
        if let Some(call) = &mut message.call
            && let Role::Request { time_left_ms } = &mut call.role
            && let Some(left) = stamp.lifespan_left_ms
        {
            *time_left_ms = left.min(*time_left_ms);
        }
        let mut via = stamp.via;
        via.push(stamp.node);
        let passed = Passed {
            delivery,
            before: Some((stamp.boot, stamp.sequence)),
            source_time: stamp.source_time,
            lifespan_left_ms: stamp.lifespan_left_ms,
            priority: stamp.priority,
            via,
        };
        let work = Work::new(Origin::Link(LinkId(place)), message);
        self.route(now, Work { passed: Some(Box::new(passed)), ..work }, effects);
    }
}
