//! What comes by a link enters the node.

use super::super::{Node, Origin, Passed, Work};
use crate::event::{Effect, LinkId};
use crate::link::{self, Delivery};
use crate::service::Level;
use aldis_envelope::aldis::link as told;
use aldis_envelope::{ContentType, Envelope, Now, Role};

impl Node {
    /// A message came by a link. Its number is given back in the same turn, so that what comes of it is written with that.
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
        if label.attributes.content_type == ContentType::Aldis && label.descriptor() == told::SERVICES {
            self.services_told(now, place, &envelope, effects);
        } else if !attached.spec.export.behind.contains(&source.entity) {
            let text = format!(
                "{}: a message of {source} is refused: {} is not among the entities behind this link",
                attached.spec.name, source.entity
            );
            self.counters.refused_links += 1;
            self.say(now, Level::Warning, "refused at a link", text, effects);
        } else {
            self.counters.imported_by_links += 1;
            self.links.destinations.hear(&envelope.message);
            self.import_by_link(now, place, envelope, effects);
            self.settle(now, effects);
        }
        if let Some(delivery) = id {
            self.links.give(place, link::Event::Done { delivery, with: Vec::new() });
        }
    }

    fn import_by_link(&mut self, now: Now, place: usize, envelope: Envelope, effects: &mut Vec<Effect>) {
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
            source_time: stamp.source_time,
            lifespan_left_ms: stamp.lifespan_left_ms,
            priority: stamp.priority,
            via,
        };
        let work = Work::new(Origin::Link(LinkId(place)), message);
        self.route(now, Work { passed: Some(Box::new(passed)), ..work }, effects);
    }
}
