//! Writers: changes as CDR bytes, with the time that their source wrote them.

use crate::cache::{DISPOSE, UNREGISTER};
use crate::discovery::{Guid, guid_of};
use crate::entity::Entity;
use crate::error::{DdsError, check};
use crate::listener::{Callbacks, Listener, Mismatch};
use crate::qos::{Qos, nanoseconds};
use crate::topic::Topic;
use cyclors::*;
use std::time::Duration;

/// What is written of an instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sending {
    /// A whole sample.
    Sample,
    /// The key of an instance that is disposed of.
    Dispose,
    /// The key of an instance that is unregistered.
    Unregister,
    /// The key of an instance that is disposed of and unregistered, so that nobody need remember it.
    DisposeAndUnregister,
}

/// A writer. Dropping it ends it; what it kept for readers that come later is gone with it.
pub struct Writer {
    // Fields are dropped in their order: the entity before what it calls back, and its topic.
    entity: Entity,
    _callbacks: Box<Callbacks>,
    topic: Topic,
    guid: Guid,
    /// The type of its samples, which is alive as long as the entity.
    sertype: *const ddsi_sertype,
}

// SAFETY: the entity is a number that Cyclone DDS looks up under its own locks; the type behind the pointer is counted and, by this
// crate, only passed to functions that read it.
unsafe impl Send for Writer {}
// SAFETY: as above.
unsafe impl Sync for Writer {}

impl Writer {
    /// A writer of a topic that never blocks. Readers of its own participant do not hear it.
    ///
    /// # Errors
    /// A quality of service that cannot be.
    pub fn new(
        topic: &Topic,
        qos: &Qos,
        on_mismatch: Box<dyn Fn(Mismatch) + Send + Sync>,
    ) -> Result<Self, DdsError> {
        const CALL: &str = "dds_create_writer";
        let native = qos.native()?;
        let callbacks = Callbacks::on_mismatch(on_mismatch);
        // SAFETY: the callbacks are in a box that the writer owns and drops after its entity.
        let listener = unsafe { Listener::new(&callbacks)? };
        let what = || topic.name().to_owned();
        // SAFETY: topic, quality of service and listener are alive for the call, which copies what it needs of them.
        let handle = unsafe {
            dds_create_writer(topic.participant().entity().0, topic.entity().0, native.0, listener.0)
        };
        let entity = Entity(check(CALL, what, handle)?);
        let guid = guid_of(&entity)?;
        let mut sertype = std::ptr::null();
        // SAFETY: the pointer is written to a place on this stack. The writer counts as a user of the type that it points at.
        let code = unsafe { dds_get_entity_sertype(entity.0, &mut sertype) };
        check("dds_get_entity_sertype", what, code)?;
        Ok(Self { entity, _callbacks: callbacks, topic: topic.clone(), guid, sertype })
    }

    /// What it writes.
    pub fn topic(&self) -> &Topic {
        &self.topic
    }

    /// What others know it by.
    pub fn guid(&self) -> Guid {
        self.guid
    }

    /// Writes a change: the bytes of a sample, or of a key, with the representation's head of four bytes. `false` where readers
    /// have not confirmed enough for more; nothing is written then, and [`Self::wait_for_acknowledgments`] helps.
    ///
    /// # Errors
    /// Bytes that are no sample or no key of the topic's type, or what Cyclone DDS says.
    pub fn write(&self, sending: Sending, cdr: &[u8], source_timestamp: i64) -> Result<bool, DdsError> {
        const CALL: &str = "ddsi_serdata_from_ser_iov";
        let what = || self.topic.name().to_owned();
        let (kind, status) = match sending {
            Sending::Sample => (ddsi_serdata_kind_SDK_DATA, 0),
            Sending::Dispose => (ddsi_serdata_kind_SDK_KEY, DISPOSE),
            Sending::Unregister => (ddsi_serdata_kind_SDK_KEY, UNREGISTER),
            Sending::DisposeAndUnregister => (ddsi_serdata_kind_SDK_KEY, DISPOSE | UNREGISTER),
        };
        if cdr.len() < 4 {
            return Err(DdsError::new(CALL, what(), "fewer than the four bytes of a representation's head"));
        }
        let piece = iovec { iov_base: cdr.as_ptr().cast_mut().cast(), iov_len: cdr.len() };
        // SAFETY: the type is alive, since the entity is. The bytes are checked against it and copied. The data that comes of it is
        // this call's alone until it is given to `dds_forwardcdr`, which takes over the one reference in every case.
        let code = unsafe {
            let data = ddsi_serdata_from_ser_iov(self.sertype, kind, 1, &piece, cdr.len());
            if data.is_null() {
                let cause = format!("{} bytes are no {sending:?} of {}", cdr.len(), self.topic.type_name());
                return Err(DdsError::new(CALL, what(), cause));
            }
            (*data).timestamp.v = source_timestamp;
            (*data).statusinfo = status;
            dds_forwardcdr(self.entity.0, data)
        };
        if code == DDS_RETCODE_TIMEOUT {
            return Ok(false);
        }
        check("dds_forwardcdr", what, code).map(|_| true)
    }

    /// Sends what batching holds back.
    pub fn flush(&self) {
        // SAFETY: the handle is looked up.
        unsafe { dds_write_flush(self.entity.0) };
    }

    /// Waits until all matched reliable readers have confirmed all that was written. `false` where they have not in time.
    ///
    /// # Errors
    /// What Cyclone DDS says.
    pub fn wait_for_acknowledgments(&self, within: Duration) -> Result<bool, DdsError> {
        // SAFETY: the handle is looked up.
        let code = unsafe { dds_wait_for_acks(self.entity.0, nanoseconds(within)) };
        if code == DDS_RETCODE_TIMEOUT {
            return Ok(false);
        }
        check("dds_wait_for_acks", || self.topic.name().to_owned(), code).map(|_| true)
    }

    /// How many readers hear it.
    pub fn matched(&self) -> usize {
        // SAFETY: with no room for handles the call counts alone.
        let count = unsafe { dds_get_matched_subscriptions(self.entity.0, std::ptr::null_mut(), 0) };
        usize::try_from(count).unwrap_or(0)
    }
}
