//! What goes out on the bus: by a publisher where a key is used often, undeclared where it is not.

use super::Node;
use crate::event::{Effect, PublisherId};
use crate::labels::Standing;
use aldis_envelope::{Change, Envelope, KeyHash, Label, Space};
use std::sync::Arc;

/// How many publishers are declared at the most: Zenoh keeps a route for each. Rarer keys are put on undeclared.
pub(super) const PUBLISHERS_MAX: usize = 2_000;
/// An instance gets a publisher after so many uses: those of a command live for a handful, and a key costs more than it brings.
const INSTANCE_USES_MIN: u32 = 8;
/// How many instances of one stream get a publisher: Zenoh looks a key that is not declared up among all that are.
const INSTANCE_PUBLISHERS_MAX: usize = 64;

impl Node {
    pub(super) fn publish(&mut self, place: usize, envelope: Envelope, effects: &mut Vec<Effect>) {
        self.counters.published += 1;
        if envelope.message.instance.is_none()
            && let Some(publisher) = self.labels.entry(place).publisher
        {
            return effects.push(Effect::Publish(publisher, envelope));
        }
        let message = &envelope.message;
        let (label, change) = (message.label.clone(), message.change);
        let instance = message.instance.clone();
        let on_a_writer_key = change == Change::Unregister;
        let hash = instance.as_ref().map(|instance| instance.hash);
        // A limitedcast's instance chunk needs the serialized key, which a publisher does not keep.
        let plain = hash.is_none() || label.is_broadcast();
        let publisher =
            if plain && !on_a_writer_key { self.publisher(place, &label, hash, effects) } else { None };
        if change == Change::Dispose {
            self.labels.entry(place).forget_rare(hash);
        }
        match publisher {
            Some(publisher) => effects.push(Effect::Publish(publisher, envelope)),
            None => {
                let space = if on_a_writer_key { Space::Writer } else { Space::Data };
                let key = self.keys.envelope(space, &label, instance.as_deref());
                effects.push(Effect::PublishOn(key, Box::new(envelope)));
            }
        }
    }

    /// The publisher of a label and instance; none when there are too many, or where an instance was used too rarely:
    /// thousands declared at once, as at a start, would hold the node up.
    fn publisher(
        &mut self,
        place: usize,
        label: &Arc<Label>,
        instance: Option<KeyHash>,
        effects: &mut Vec<Effect>,
    ) -> Option<PublisherId> {
        let own = &mut self.labels.entry(place).publishers;
        match own.get_mut(&instance) {
            Some(Standing::Declared(known)) => return Some(*known),
            Some(Standing::Used(uses)) if *uses < INSTANCE_USES_MIN => {
                *uses += 1;
                return None;
            }
            None if instance.is_some() => {
                if own.len() < INSTANCE_PUBLISHERS_MAX {
                    own.insert(instance, Standing::Used(1));
                }
                return None;
            }
            _ => {}
        }
        let next = PublisherId(self.publishers.len());
        let known = self.publishers.get(&(label.clone(), instance)).copied();
        let publisher = match known {
            Some(publisher) => publisher,
            None if next.0 >= PUBLISHERS_MAX => return None,
            None => {
                self.publishers.insert((label.clone(), instance), next);
                effects.push(self.declare(label, instance, next));
                next
            }
        };
        let entry = self.labels.entry(place);
        if instance.is_none() {
            entry.publisher = Some(publisher);
        }
        entry.publishers.insert(instance, Standing::Declared(publisher));
        Some(publisher)
    }
}
