//! Participants: who takes part in a domain.

use crate::discovery::{Guid, guid_of};
use crate::domain::Domain;
use crate::entity::Entity;
use crate::error::{DdsError, check};
use cyclors::{dds_create_participant, dds_create_qos, dds_delete_qos, dds_qset_userdata};
use std::sync::Arc;

/// How a domain is joined.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ParticipantConfig {
    /// The domain's number, at most 230.
    pub domain: u32,
    /// The configuration of Cyclone DDS as XML; none is what `CYCLONEDDS_URI` says.
    pub xml: Option<String>,
    /// What others see of this participant: its USER_DATA.
    pub user_data: Vec<u8>,
}

impl ParticipantConfig {
    /// A domain as the environment configures it.
    pub fn new(domain: u32) -> Self {
        Self { domain, ..Self::default() }
    }

    /// A domain on this machine alone, over its loopback interface and without multicast, as tests use it.
    pub fn loopback(domain: u32) -> Self {
        let xml = "<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast><Interfaces>\
                   <NetworkInterface address=\"127.0.0.1\"/></Interfaces></General><Discovery>\
                   <ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>60</MaxAutoParticipantIndex>\
                   <Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery></Domain></CycloneDDS>";
        Self { xml: Some(xml.into()), ..Self::new(domain) }
    }
}

/// A participant. Its readers and writers keep it alive.
#[derive(Debug, Clone)]
pub struct Participant(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    // Fields are dropped in their order: the participant before its domain.
    entity: Entity,
    _domain: Option<Arc<Domain>>,
    domain: u32,
    guid: Guid,
}

impl Participant {
    /// Joins a domain. What is configured counts for the first participant of this process in it; later ones must have the same.
    ///
    /// # Errors
    /// What Cyclone DDS says: a configuration that it cannot read, no network, a domain that is open otherwise.
    pub fn open(config: &ParticipantConfig) -> Result<Self, DdsError> {
        const CALL: &str = "dds_create_participant";
        let what = || format!("domain {}", config.domain);
        let domain = config.xml.as_deref().map(|xml| Domain::open(config.domain, xml)).transpose()?;
        // SAFETY: the quality of service is made, used and deleted here; the user data is copied by the call, whose length is
        // that of the slice; no listener is given.
        let handle = unsafe {
            let qos = dds_create_qos();
            dds_qset_userdata(qos, config.user_data.as_ptr().cast(), config.user_data.len());
            let handle = dds_create_participant(config.domain, qos, std::ptr::null());
            dds_delete_qos(qos);
            handle
        };
        let entity = Entity(check(CALL, what, handle)?);
        let guid = guid_of(&entity)?;
        Ok(Self(Arc::new(Inner { entity, _domain: domain, domain: config.domain, guid })))
    }

    /// The domain's number.
    pub fn domain(&self) -> u32 {
        self.0.domain
    }

    /// What others know it by.
    pub fn guid(&self) -> Guid {
        self.0.guid
    }

    pub(crate) fn entity(&self) -> &Entity {
        &self.0.entity
    }
}
