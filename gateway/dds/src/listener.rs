//! What Cyclone DDS tells of an endpoint by itself: mismatches of quality of service.

use crate::error::DdsError;
use crate::qos::Policy;
use cyclors::*;
use std::os::raw::c_void;

/// A reader and a writer that do not come together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mismatch {
    /// How many there were so far.
    pub count: u32,
    /// The policy that the last of them disagreed about.
    pub policy: Policy,
}

type OnMismatch = Box<dyn Fn(Mismatch) + Send + Sync>;
type OnData = Box<dyn Fn() + Send + Sync>;

/// What an endpoint calls back. It must outlive the endpoint.
pub(crate) struct Callbacks {
    on_mismatch: Option<OnMismatch>,
    on_data: Option<OnData>,
}

impl Callbacks {
    pub(crate) fn on_mismatch(on_mismatch: OnMismatch) -> Box<Self> {
        Box::new(Self { on_mismatch: Some(on_mismatch), on_data: None })
    }

    pub(crate) fn on_data(on_data: OnData) -> Box<Self> {
        Box::new(Self { on_mismatch: None, on_data: Some(on_data) })
    }
}

/// A listener for the creation of one endpoint.
pub(crate) struct Listener(pub(crate) *mut dds_listener_t);

impl Drop for Listener {
    fn drop(&mut self) {
        // SAFETY: the pointer came from `dds_create_listener`; entities copy what is in it.
        unsafe { dds_delete_listener(self.0) };
    }
}

impl Listener {
    /// A listener that calls these.
    ///
    /// # Safety
    /// The callbacks stay where they are until the entity that is created with this listener is deleted: deletion waits for
    /// callbacks that run, and none begins afterwards.
    pub(crate) unsafe fn new(callbacks: &Callbacks) -> Result<Self, DdsError> {
        let argument = std::ptr::from_ref(callbacks).cast_mut().cast::<c_void>();
        // SAFETY: the argument is handed to the functions below alone, which read it as what it is.
        unsafe {
            let listener = dds_create_listener(argument);
            if listener.is_null() {
                return Err(DdsError::new("dds_create_listener", "an endpoint", "no memory"));
            }
            if callbacks.on_mismatch.is_some() {
                dds_lset_offered_incompatible_qos(listener, Some(offered));
                dds_lset_requested_incompatible_qos(listener, Some(requested));
            }
            if callbacks.on_data.is_some() {
                dds_lset_data_available(listener, Some(available));
            }
            Ok(Self(listener))
        }
    }
}

/// # Safety
/// The argument is a living [`Callbacks`].
unsafe extern "C" fn offered(
    _: dds_entity_t,
    status: dds_offered_incompatible_qos_status_t,
    argument: *mut c_void,
) {
    // SAFETY: as above.
    unsafe { mismatch(argument, status.total_count, status.last_policy_id) };
}

/// # Safety
/// The argument is a living [`Callbacks`].
unsafe extern "C" fn requested(
    _: dds_entity_t,
    status: dds_requested_incompatible_qos_status_t,
    argument: *mut c_void,
) {
    // SAFETY: as above.
    unsafe { mismatch(argument, status.total_count, status.last_policy_id) };
}

/// # Safety
/// The argument is a living [`Callbacks`].
unsafe fn mismatch(argument: *mut c_void, count: u32, policy: u32) {
    // SAFETY: the caller vouches for it, and nobody changes it.
    let callbacks = unsafe { &*argument.cast::<Callbacks>() };
    if let Some(tell) = &callbacks.on_mismatch {
        tell(Mismatch { count, policy: Policy(policy) });
    }
}

/// # Safety
/// The argument is a living [`Callbacks`].
unsafe extern "C" fn available(_: dds_entity_t, argument: *mut c_void) {
    // SAFETY: the caller vouches for it, and nobody changes it.
    let callbacks = unsafe { &*argument.cast::<Callbacks>() };
    if let Some(tell) = &callbacks.on_data {
        tell();
    }
}
