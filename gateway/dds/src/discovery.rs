//! Who is there: readers and writers of other participants, by the built-in topics.

use crate::entity::Entity;
use crate::error::{DdsError, check};
use crate::listener::{Callbacks, Listener};
use crate::participant::Participant;
use crate::qos::Qos;
use crate::types::Registered;
use cyclors::*;
use std::ffi::CStr;
use std::fmt;
use std::sync::Arc;

/// How many endpoints are taken from Cyclone DDS at once.
const AT_ONCE: usize = 64;

/// The identity of a participant or an endpoint: 16 bytes as they are on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Guid(pub [u8; 16]);

impl fmt::Display for Guid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, word) in self.0.chunks(4).enumerate() {
            let word = word.iter().fold(0u32, |all, byte| all << 8 | u32::from(*byte));
            write!(f, "{}{word:x}", if place > 0 { ":" } else { "" })?;
        }
        Ok(())
    }
}

/// A GUID as the four numbers that Cyclone DDS works with.
pub(crate) fn guid_from_words(words: [u32; 4]) -> Guid {
    let mut bytes = [0; 16];
    for (place, word) in words.iter().enumerate() {
        bytes[place * 4..place * 4 + 4].copy_from_slice(&word.to_be_bytes());
    }
    Guid(bytes)
}

pub(crate) fn guid_of(entity: &Entity) -> Result<Guid, DdsError> {
    let mut guid = dds_guid_t { v: [0; 16] };
    // SAFETY: the GUID is written to a place on this stack.
    check("dds_get_guid", || "an entity".into(), unsafe { dds_get_guid(entity.0, &mut guid) })?;
    Ok(Guid(guid.v))
}

/// What an endpoint told of its type.
#[derive(Clone)]
pub struct TypeInformation(pub(crate) Arc<Registered>);

impl fmt::Debug for TypeInformation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("TypeInformation")
    }
}

/// Which side of a topic an endpoint is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Side {
    /// It reads.
    Reader,
    /// It writes.
    Writer,
}

/// A reader or a writer of another participant.
#[derive(Debug, Clone)]
pub struct Endpoint {
    /// Its identity.
    pub guid: Guid,
    /// Whose it is.
    pub participant: Guid,
    /// Whether it reads or writes.
    pub side: Side,
    /// Its topic.
    pub topic: String,
    /// The name of its type.
    pub type_name: String,
    /// Its quality of service.
    pub qos: Qos,
    /// What it told of its type, if anything.
    pub type_information: Option<TypeInformation>,
}

/// A change of who is there.
#[derive(Debug, Clone)]
pub enum Change {
    /// An endpoint has come, or its quality of service is different now.
    Endpoint(Box<Endpoint>),
    /// An endpoint is gone.
    EndpointGone(Guid),
    /// A participant has come, with its USER_DATA.
    Participant(Guid, Vec<u8>),
    /// A participant is gone.
    ParticipantGone(Guid),
}

/// Follows who is there, the own participant left out.
pub struct Discovery {
    // Fields are dropped in their order: the readers before what they call back.
    participants: Entity,
    writers: Entity,
    readers: Entity,
    _callbacks: Box<Callbacks>,
    own: Guid,
    _participant: Participant,
}

impl Discovery {
    /// Follows who is there in a participant's domain. The callback says that [`Self::changes`] has something; it must not block.
    ///
    /// # Errors
    /// What Cyclone DDS says.
    pub fn new(participant: &Participant, on_change: Box<dyn Fn() + Send + Sync>) -> Result<Self, DdsError> {
        let callbacks = Callbacks::on_data(on_change);
        // SAFETY: the callbacks are in a box that is dropped after the readers.
        let listener = unsafe { Listener::new(&callbacks)? };
        let reader = |topic: dds_entity_t, what: &str| {
            // SAFETY: the topic is one of Cyclone's constants; the listener is alive for the call, which copies it.
            let handle =
                unsafe { dds_create_reader(participant.entity().0, topic, std::ptr::null(), listener.0) };
            check("dds_create_reader", || what.to_owned(), handle).map(Entity)
        };
        Ok(Self {
            participants: reader(DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, "DCPSParticipant")?,
            writers: reader(DDS_BUILTIN_TOPIC_DCPSPUBLICATION, "DCPSPublication")?,
            readers: reader(DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, "DCPSSubscription")?,
            _callbacks: callbacks,
            own: participant.guid(),
            _participant: participant.clone(),
        })
    }

    /// What has changed since the last call, participants first.
    ///
    /// # Errors
    /// What Cyclone DDS says.
    pub fn changes(&self) -> Result<Vec<Change>, DdsError> {
        let mut changes = Vec::new();
        take(&self.participants, |sample, is_alive| {
            // SAFETY: samples of this topic are of this type, and alive for the call.
            let told = unsafe { &*sample.cast::<dds_builtintopic_participant_t>() };
            let guid = Guid(told.key.v);
            if guid != self.own {
                // SAFETY: as above.
                let come = || Change::Participant(guid, unsafe { user_data(told.qos) });
                changes.push(if is_alive { come() } else { Change::ParticipantGone(guid) });
            }
        })?;
        for (entity, side) in [(&self.writers, Side::Writer), (&self.readers, Side::Reader)] {
            take(entity, |sample, is_alive| {
                let sample = sample.cast::<dds_builtintopic_endpoint_t>();
                // SAFETY: samples of these topics are of this type, and alive for the call.
                let guid = Guid(unsafe { (*sample).key.v });
                if !is_alive {
                    changes.push(Change::EndpointGone(guid));
                    return;
                }
                // SAFETY: as above; where it is alive, its texts are there.
                let endpoint = unsafe { endpoint(sample, side) };
                if endpoint.participant != self.own {
                    changes.push(Change::Endpoint(Box::new(endpoint)));
                }
            })?;
        }
        Ok(changes)
    }
}

/// Takes the samples of a built-in topic; whether each is alive is said with it.
fn take(reader: &Entity, mut each: impl FnMut(*mut std::os::raw::c_void, bool)) -> Result<(), DdsError> {
    loop {
        let mut samples = [std::ptr::null_mut(); AT_ONCE];
        // SAFETY: the infos are numbers, for which zero is valid.
        let mut infos: [dds_sample_info_t; AT_ONCE] = unsafe { std::mem::zeroed() };
        // SAFETY: both arrays have the length that is said; the first is null, so that samples are lent.
        let count =
            unsafe { dds_take(reader.0, samples.as_mut_ptr(), infos.as_mut_ptr(), AT_ONCE, AT_ONCE as u32) };
        let count = check("dds_take", || "a built-in topic".into(), count)? as usize;
        for (sample, info) in samples.iter().zip(&infos).take(count) {
            let is_alive = info.valid_data && info.instance_state == dds_instance_state_DDS_IST_ALIVE;
            each(*sample, is_alive);
        }
        if count == 0 {
            return Ok(());
        }
        // SAFETY: so many samples were lent by this reader, and nothing points into them any more.
        unsafe { dds_return_loan(reader.0, samples.as_mut_ptr(), count as i32) };
    }
}

/// # Safety
/// The sample is alive and has its texts.
unsafe fn endpoint(sample: *mut dds_builtintopic_endpoint_t, side: Side) -> Endpoint {
    // SAFETY: the caller vouches for the sample; what is read of it is copied. The type information that is lent belongs to the
    // sample, its copy to this call.
    unsafe {
        let told = &*sample;
        let mut lent = std::ptr::null();
        let has_type = dds_builtintopic_get_endpoint_type_info(sample, &mut lent) == 0 && !lent.is_null();
        let own = |lent| TypeInformation(Arc::new(Registered(ddsi_typeinfo_dup(lent))));
        Endpoint {
            guid: Guid(told.key.v),
            participant: Guid(told.participant_key.v),
            side,
            topic: CStr::from_ptr(told.topic_name).to_string_lossy().into_owned(),
            type_name: CStr::from_ptr(told.type_name).to_string_lossy().into_owned(),
            qos: Qos::read(told.qos),
            type_information: has_type.then(|| own(lent)),
        }
    }
}

/// # Safety
/// The pointer is null, or points at a quality of service that is alive.
unsafe fn user_data(qos: *const dds_qos_t) -> Vec<u8> {
    let (mut data, mut length) = (std::ptr::null_mut(), 0);
    // SAFETY: the caller vouches for `qos`. The getter allocates a copy of `length` bytes, which is freed here.
    unsafe {
        if qos.is_null() || !dds_qget_userdata(qos, &mut data, &mut length) || data.is_null() {
            return Vec::new();
        }
        let copied = std::slice::from_raw_parts(data.cast::<u8>(), length).to_vec();
        dds_free(data);
        copied
    }
}
