//! Readers: every change of a topic as its writers sent it.

use crate::cache::{Cache, Receive};
use crate::discovery::{Guid, guid_of};
use crate::entity::Entity;
use crate::error::{DdsError, check};
use crate::listener::{Callbacks, Listener, Mismatch};
use crate::qos::Qos;
use crate::topic::Topic;
use cyclors::*;

/// A reader. Dropping it ends it; no call to its receiver is under way afterwards.
pub struct Reader {
    // Fields are dropped in their order: the entity before what it calls back, and its topic.
    entity: Entity,
    _callbacks: Box<Callbacks>,
    topic: Topic,
    guid: Guid,
}

impl Reader {
    /// A reader of a topic. Writers of its own participant are not heard. The mismatches of writers are told as they are found.
    ///
    /// # Errors
    /// A quality of service that cannot be.
    pub fn new(
        topic: &Topic,
        qos: &Qos,
        receiver: Box<dyn Receive>,
        on_mismatch: Box<dyn Fn(Mismatch) + Send + Sync>,
    ) -> Result<Self, DdsError> {
        const CALL: &str = "dds_create_reader_rhc";
        let native = qos.native()?;
        let callbacks = Callbacks::on_mismatch(on_mismatch);
        // SAFETY: the callbacks are in a box that the reader owns and drops after its entity.
        let listener = unsafe { Listener::new(&callbacks)? };
        let cache = Cache::for_reader(receiver);
        // SAFETY: topic, quality of service and listener are alive for the call; the cache has the layout of `struct dds_rhc` and is
        // the reader's from here on: it is freed by it after its last use.
        let handle = unsafe {
            let participant = topic.participant().entity().0;
            dds_create_reader_rhc(participant, topic.entity().0, native.0, listener.0, cache.cast())
        };
        if handle < 0 {
            // SAFETY: no reader was created that could have it.
            unsafe { Cache::take_back(cache) };
        }
        let entity = Entity(check(CALL, || topic.name().to_owned(), handle)?);
        let guid = guid_of(&entity)?;
        Ok(Self { entity, _callbacks: callbacks, topic: topic.clone(), guid })
    }

    /// What it reads.
    pub fn topic(&self) -> &Topic {
        &self.topic
    }

    /// What others know it by.
    pub fn guid(&self) -> Guid {
        self.guid
    }

    /// How many writers it hears.
    pub fn matched(&self) -> usize {
        // SAFETY: with no room for handles the call counts alone.
        let count = unsafe { dds_get_matched_publications(self.entity.0, std::ptr::null_mut(), 0) };
        usize::try_from(count).unwrap_or(0)
    }
}
