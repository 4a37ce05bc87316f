//! An entity of Cyclone DDS that is deleted with its owner.

use cyclors::{dds_delete, dds_entity_t};

/// A handle. Handles are numbers that Cyclone DDS looks up, so that a stale one is refused and never followed.
#[derive(Debug)]
pub(crate) struct Entity(pub(crate) dds_entity_t);

impl Drop for Entity {
    fn drop(&mut self) {
        // SAFETY: the handle is a number that is looked up; one whose parent was deleted before is refused, which is well. The call
        // waits until no callback of the entity runs, and owners never drop entities within a callback.
        unsafe { dds_delete(self.0) };
    }
}
