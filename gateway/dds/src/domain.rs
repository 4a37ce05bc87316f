//! Domains that this process has opened with a configuration of its own.

use crate::entity::Entity;
use crate::error::{DdsError, check, text};
use cyclors::dds_create_domain;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError, Weak};

static OPEN: Mutex<BTreeMap<u32, Weak<Domain>>> = Mutex::new(BTreeMap::new());

/// A domain with its configuration, shared by the participants in it. It is closed with the last of them.
#[derive(Debug)]
pub(crate) struct Domain {
    config: String,
    _entity: Entity,
}

impl Domain {
    /// Opens a domain, or joins those that have opened it with the same configuration.
    pub(crate) fn open(id: u32, config: &str) -> Result<Arc<Self>, DdsError> {
        const CALL: &str = "dds_create_domain";
        let what = || format!("domain {id}");
        let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = open.get(&id).and_then(Weak::upgrade) {
            return if known.config == config {
                Ok(known)
            } else {
                Err(DdsError::new(CALL, what(), "this process has it open with another configuration"))
            };
        }
        let c_config = text(CALL, config)?;
        // SAFETY: the text has a terminator and is copied by the call.
        let handle = check(CALL, what, unsafe { dds_create_domain(id, c_config.as_ptr()) })?;
        let domain = Arc::new(Self { config: config.to_owned(), _entity: Entity(handle) });
        open.insert(id, Arc::downgrade(&domain));
        Ok(domain)
    }
}
