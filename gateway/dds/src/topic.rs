//! Topics: a name and the type of its samples.

use crate::discovery::TypeInformation;
use crate::entity::Entity;
use crate::error::{DdsError, check, text};
use crate::participant::Participant;
use crate::qos::nanoseconds;
use crate::types::Builder;
use aldis_envelope::description::{Extensibility, Library};
use cyclors::*;
use std::sync::Arc;
use std::time::Duration;

/// How long a peer may take to tell the parts of a type that it has announced.
const TYPE_WITHIN: Duration = Duration::from_secs(2);

/// Where a topic's type comes from.
#[derive(Debug, Clone, Copy)]
pub enum TypeSource<'a> {
    /// A description.
    Described {
        /// What it is described in.
        library: &'a Library,
        /// Its fully scoped name there.
        type_name: &'a str,
        /// Overrides what the description says of it and of all that it needs.
        extensibility: Option<Extensibility>,
        /// Whether peers are told of the type, so that they compare it with theirs. Where they are not, the name alone is compared.
        told: bool,
    },
    /// What an endpoint told of its type. The type is asked of the peer where this process does not know it.
    Discovered(&'a TypeInformation),
}

/// A topic of a participant.
#[derive(Debug, Clone)]
pub struct Topic(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    entity: Entity,
    participant: Participant,
    name: String,
    extensibility: Extensibility,
    type_name: String,
}

/// A descriptor that Cyclone DDS made.
struct Descriptor(*mut dds_topic_descriptor_t);

impl Drop for Descriptor {
    fn drop(&mut self) {
        // SAFETY: the pointer was made by `dds_create_topic_descriptor` and is deleted once, here.
        unsafe { dds_delete_topic_descriptor(self.0) };
    }
}

impl Topic {
    /// A topic of a participant.
    ///
    /// # Errors
    /// A type that cannot be, a peer that does not tell its type within two seconds, or a topic of this name with another type.
    pub fn new(participant: &Participant, name: &str, source: TypeSource<'_>) -> Result<Self, DdsError> {
        const CALL: &str = "dds_create_topic";
        let c_name = text(CALL, name)?;
        let whole;
        let (descriptor, told) = match source {
            TypeSource::Described { library, type_name, extensibility, told } => {
                whole = Builder::new(participant, library, extensibility).register(type_name)?;
                let scope = dds_find_scope_DDS_FIND_SCOPE_LOCAL_DOMAIN;
                (describe(participant, name, whole.information.0, scope, Duration::ZERO)?, told)
            }
            TypeSource::Discovered(information) => {
                let scope = dds_find_scope_DDS_FIND_SCOPE_GLOBAL;
                (describe(participant, name, information.0.0, scope, TYPE_WITHIN)?, true)
            }
        };
        // SAFETY: the descriptor is alive until the end of this function. What is passed is a copy of it whose pointers all point
        // into it, and the call copies what it needs. The first operation is there in every type.
        let (handle, first, type_name) = unsafe {
            let mut given = *descriptor.0;
            if !told {
                given.m_flagset &= !DDS_TOPIC_XTYPES_METADATA;
            }
            let handle = dds_create_topic(
                participant.entity().0,
                &given,
                c_name.as_ptr(),
                std::ptr::null(),
                std::ptr::null(),
            );
            let type_name = std::ffi::CStr::from_ptr(given.m_typename).to_string_lossy().into_owned();
            (handle, if given.m_nops > 0 { *given.m_ops } else { 0 }, type_name)
        };
        let entity = Entity(check(CALL, || name.to_owned(), handle)?);
        let extensibility = extensibility_of(first);
        let (participant, name) = (participant.clone(), name.to_owned());
        Ok(Self(Arc::new(Inner { entity, participant, name, extensibility, type_name })))
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// The name of its type.
    pub fn type_name(&self) -> &str {
        &self.0.type_name
    }

    /// How its type may grow.
    pub fn extensibility(&self) -> Extensibility {
        self.0.extensibility
    }

    /// Whose it is.
    pub fn participant(&self) -> &Participant {
        &self.0.participant
    }

    pub(crate) fn entity(&self) -> &Entity {
        &self.0.entity
    }
}

/// What the first operation of a type says: whether its samples have their length before them, or their members' ids.
fn extensibility_of(operation: u32) -> Extensibility {
    match operation & 0xff00_0000 {
        dds_stream_opcode_DDS_OP_DLC => Extensibility::Appendable,
        dds_stream_opcode_DDS_OP_PLC => Extensibility::Mutable,
        _ => Extensibility::Final,
    }
}

impl TypeInformation {
    /// How the type may grow. The type is asked of the peer where this process does not know it.
    ///
    /// # Errors
    /// A peer that does not tell its type within two seconds, or a type that cannot be.
    pub fn extensibility(&self, participant: &Participant) -> Result<Extensibility, DdsError> {
        let scope = dds_find_scope_DDS_FIND_SCOPE_GLOBAL;
        let descriptor = describe(participant, "an endpoint's type", self.0.0, scope, TYPE_WITHIN)?;
        // SAFETY: the descriptor is alive, and has as many operations as it says.
        let first = unsafe { if (*descriptor.0).m_nops > 0 { *(*descriptor.0).m_ops } else { 0 } };
        Ok(extensibility_of(first))
    }
}

fn describe(
    participant: &Participant,
    name: &str,
    information: *const dds_typeinfo_t,
    scope: dds_find_scope_t,
    within: Duration,
) -> Result<Descriptor, DdsError> {
    let mut descriptor = std::ptr::null_mut();
    // SAFETY: the information is alive for the call, as its owner is borrowed by the caller; the descriptor is written to a place
    // on this stack, and only where the call succeeds.
    let code = unsafe {
        let entity = participant.entity().0;
        dds_create_topic_descriptor(scope, entity, information, nanoseconds(within), &mut descriptor)
    };
    check("dds_create_topic_descriptor", || name.to_owned(), code)?;
    Ok(Descriptor(descriptor))
}
